//! The program as a person meets it: good runs, and every kind of bad input with one clear line and
//! exit code 2.

use std::path::Path;
use std::process::{Command, Output};

fn mesolux(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(args)
        .current_dir(folder)
        .env(
            "XDG_CACHE_HOME",
            concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"),
        )
        .output()
        .expect("the program runs")
}

const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
    usemtl floor\nf 1 4 3 2\nusemtl light\nf 5 6 7 8\n";
const MATERIALS: &str = "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl light\nKd 0 0 0\nKe 1 1 1\n";

#[test]
fn bad_input_is_one_line_and_exit_code_2() {
    let room = |change: (&str, &str)| ROOM.replace(change.0, change.1);
    let mtl = |change: (&str, &str)| MATERIALS.replace(change.0, change.1);
    // What is wrong, the OBJ, the MTL, more arguments, and what the one line must say.
    type Case<'a> = (&'a str, String, String, &'a [&'a str], &'a [&'a str]);
    let cases: [Case; 16] = [
        (
            "lamp that faces away",
            room(("f 5 6 7 8", "f 8 7 6 5")),
            MATERIALS.into(),
            &[],
            &["room.obj", "no light arrives", "sides"],
        ),
        (
            "nan",
            room(("v 1 0 0", "v nan 0 0")),
            MATERIALS.into(),
            &[],
            &["room.obj:3"],
        ),
        (
            "infinite",
            room(("v 1 0 0", "v 1e999 0 0")),
            MATERIALS.into(),
            &[],
            &["room.obj:3"],
        ),
        (
            "index out of range",
            room(("f 5 6 7 8", "f 5 6 7 99")),
            MATERIALS.into(),
            &[],
            &["room.obj:13", "99"],
        ),
        (
            "face of two",
            room(("f 5 6 7 8", "f 5 6")),
            MATERIALS.into(),
            &[],
            &["room.obj:13"],
        ),
        (
            "unknown material",
            room(("usemtl light", "usemtl lamp")),
            MATERIALS.into(),
            &[],
            &["lamp"],
        ),
        (
            "reflectance above 1",
            ROOM.into(),
            mtl(("Kd 0.5 0.5 0.5", "Kd 0.5 1.5 0.5")),
            &[],
            &["floor"],
        ),
        (
            "reflectance below 0",
            ROOM.into(),
            mtl(("Kd 0.5 0.5 0.5", "Kd 0.5 -1 0.5")),
            &[],
            &["floor"],
        ),
        (
            "no light",
            ROOM.into(),
            mtl(("Ke 1 1 1", "Ke 0 0 0")),
            &[],
            &["light"],
        ),
        ("empty", String::new(), MATERIALS.into(), &[], &["room.obj"]),
        (
            "device",
            ROOM.into(),
            MATERIALS.into(),
            &["--device", "nosuch"],
            &["nosuch"],
        ),
        (
            "hemicube",
            ROOM.into(),
            MATERIALS.into(),
            &["--hemicube", "7"],
            &["--hemicube 7"],
        ),
        (
            "residual",
            ROOM.into(),
            MATERIALS.into(),
            &["--residual", "nan"],
            &["--residual"],
        ),
        (
            "budget",
            ROOM.into(),
            MATERIALS.into(),
            &["--budget=-1"],
            &["--budget"],
        ),
        (
            "threads",
            ROOM.into(),
            MATERIALS.into(),
            &["--threads", "0"],
            &["--threads 0"],
        ),
        (
            "patches of a file",
            ROOM.into(),
            MATERIALS.into(),
            &["--patches", "9"],
            &["patches"],
        ),
    ];
    for (what, obj, materials, more, said) in cases {
        let folder = tempfile::tempdir().expect("a folder for the test");
        std::fs::write(folder.path().join("room.obj"), obj).expect("written");
        std::fs::write(folder.path().join("room.mtl"), materials).expect("written");
        let mut args = vec!["bake", "room.obj", "-o", "out.safetensors"];
        args.extend(more);
        let run = mesolux(&args, folder.path());
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{what}: {text}");
        let lines: Vec<_> = text
            .lines()
            .filter(|l| l.starts_with("mesolux: "))
            .collect();
        assert_eq!(lines.len(), 1, "{what}: {text}");
        assert!(
            said.iter().all(|s| lines[0].contains(s)),
            "{what}: {}",
            lines[0]
        );
        assert!(!text.contains("panicked"), "{what}: {text}");
        let left: Vec<_> = std::fs::read_dir(folder.path()).expect("listed").collect();
        assert_eq!(left.len(), 2, "{what}: nothing is written");
    }
}

#[test]
fn bad_names_and_outputs() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for (args, said) in [
        (&["bake", "nosuch", "-o", "o.safetensors"][..], "nosuch"),
        (
            &["bake", "missing.obj", "-o", "o.safetensors"],
            "missing.obj",
        ),
        (
            &["bake", "missing.toml", "-o", "o.safetensors"],
            "missing.toml",
        ),
        (
            &["bake", "cornell", "-o", "no/such/folder/o.safetensors"],
            "no/such/folder",
        ),
        (
            &["bake", "cornell", "--patches", "3", "-o", "o.safetensors"],
            "patches",
        ),
        (
            &[
                "bake",
                "cornell",
                "--statue",
                "none.obj",
                "-o",
                "o.safetensors",
            ],
            "none.obj",
        ),
        (&["render", "cornell", "-o", "picture.bmp"], "picture.bmp"),
        (&["bake", "cornell", "-o", "a.exr"], "a.exr"),
        (
            &[
                "render",
                "b.safetensors",
                "--quality",
                "draft",
                "-o",
                "p.png",
            ],
            "b.safetensors is a bake already, which --quality has no effect on",
        ),
        (
            &[
                "render",
                "b.safetensors",
                "-o",
                "p.png",
                "--patches",
                "9000",
            ],
            "--patches",
        ),
        (
            &["render", "missing.safetensors", "-o", "p.png"],
            "missing.safetensors",
        ),
        (
            &["render", "cornell", "--camera", "nosuch", "-o", "p.png"],
            "nosuch",
        ),
        (&["scene", "nosuch", "-o", "folder"], "nosuch"),
        (
            &[
                "render",
                "cornell",
                "--reference",
                "--paths",
                "1",
                "-o",
                "p.png",
            ],
            "paths 1",
        ),
        (
            &[
                "render",
                "cornell",
                "--reference",
                "--budget=-1",
                "-o",
                "p.png",
            ],
            "--budget -1",
        ),
        (
            &[
                "render",
                "cornell",
                "--reference",
                "--size",
                "0x8",
                "-o",
                "p.png",
            ],
            "width 0",
        ),
        (
            &["render", "b.safetensors", "--reference", "-o", "p.png"],
            "b.safetensors",
        ),
        (
            &[
                "render",
                "cornell",
                "--reference",
                "--white",
                "lamps",
                "-o",
                "p.png",
            ],
            "--white R,G,B",
        ),
    ] {
        let run = mesolux(args, folder.path());
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{args:?}: {text}");
        let lines: Vec<_> = text
            .lines()
            .filter(|l| l.starts_with("mesolux: "))
            .collect();
        assert!(
            lines.len() == 1 && lines[0].contains(said),
            "{args:?}: {text}"
        );
        let left: Vec<_> = std::fs::read_dir(folder.path()).expect("listed").collect();
        assert!(
            left.is_empty(),
            "{args:?}: nothing is written, but {left:?} is"
        );
    }
    // No Vulkan driver at all.
    let run = Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(["bake", "cornell", "-o", "o.safetensors"])
        .env("VK_DRIVER_FILES", "/nonexistent.json")
        .env("VK_ICD_FILENAMES", "/nonexistent.json")
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("Vulkan"));
}

/// The lamp of the Cornell box is yellow: by its white the back wall is nearly grey, and with 16
/// bits as with 8.
#[test]
fn a_white_wall_is_shown_white() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let wall = |options: &[&str]| -> [f64; 3] {
        let mut args = vec!["render", "cornell-box", "-o", "p.png", "--size", "64x64"];
        args.extend(["--quality", "preview"]);
        args.extend(options);
        let run = mesolux(&args, folder.path());
        assert!(
            run.status.success(),
            "{}",
            String::from_utf8_lossy(&run.stderr)
        );
        let picture = image::open(folder.path().join("p.png"))
            .expect("a PNG")
            .into_rgb16();
        // The upper part of the back wall.
        let pixels = (20..44).flat_map(|x| (16..22).map(move |y| (x, y)));
        let sum = pixels.fold([0.0; 3], |sum: [f64; 3], (x, y)| {
            let pixel = picture.get_pixel(x, y).0;
            [0, 1, 2].map(|c| sum[c] + f64::from(pixel[c]) / 65535.0)
        });
        sum.map(|c| c / 144.0)
    };
    let [plain, white, deep] = [
        &[][..],
        &["--white", "lamps"],
        &["--white", "lamps", "--png", "srgb16"],
    ]
    .map(wall);
    println!("{plain:.3?}, by its white {white:.3?}");
    assert!(plain[0] / plain[2] > 1.5);
    assert!((white[0] / white[2] - 1.0).abs() < WHITE);
    assert!((0..3).all(|c| (white[c] - deep[c]).abs() < 0.5 / 255.0));
}

/// Red over blue of the wall's codes, less 1: what red and green walls add. Measured: 0.12.
const WHITE: f64 = 0.2;

/// What goes to a file has no colours, unless they are asked for; --quiet leaves warnings.
#[test]
fn stderr_is_as_the_options_say() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    std::fs::write(folder.path().join("room.obj"), ROOM).expect("written");
    let materials = MATERIALS.replace("newmtl light", "d 0.5\nnewmtl light");
    std::fs::write(folder.path().join("room.mtl"), materials).expect("written");
    let stderr = |options: &[&str]| {
        let args = [&["bake", "room.obj", "-o", "o.safetensors"], options].concat();
        let run = mesolux(&args, folder.path());
        assert!(run.status.success());
        String::from_utf8(run.stderr).expect("UTF-8")
    };
    let plain = stderr(&[]);
    assert!(
        !plain.contains('\x1b') && plain.contains("INFO") && plain.contains("opaque"),
        "{plain}"
    );
    assert!(stderr(&["--color", "always"]).contains("\x1b["));
    let quiet = stderr(&["--quiet"]);
    assert!(
        !quiet.contains("INFO") && quiet.contains("room.mtl:3"),
        "{quiet}"
    );
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for shell in ["bash", "zsh", "fish"] {
        let run = mesolux(&["completions", shell], folder.path());
        let text = String::from_utf8(run.stdout).expect("UTF-8");
        assert!(
            run.status.success() && text.contains("sides-as-given"),
            "{shell}"
        );
    }
    let run = mesolux(&["man", "-o", "pages"], folder.path());
    assert!(run.status.success());
    for command in [
        "", "-bake", "-render", "-view", "-compare", "-scene", "-info", "-bench",
    ] {
        let path = folder.path().join(format!("pages/mesolux{command}.1"));
        let page = std::fs::read_to_string(&path).expect("a page");
        assert!(page.contains(".SH NAME"), "{}", path.display());
    }
}

#[test]
fn bakes_and_renders_files_of_every_kind() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    std::fs::write(folder.path().join("room.obj"), ROOM).expect("written");
    std::fs::write(folder.path().join("room.mtl"), MATERIALS).expect("written");
    let bake = mesolux(
        &[
            "bake",
            "room.obj",
            "-o",
            "o.safetensors",
            "--json",
            "--validate",
        ],
        folder.path(),
    );
    assert!(
        bake.status.success(),
        "{}",
        String::from_utf8_lossy(&bake.stderr)
    );
    let report: serde_json::Value =
        serde_json::from_slice(&bake.stdout).expect("one JSON object on stdout");
    assert!(
        report["elements"].as_u64() > Some(1000),
        "four triangles are cut"
    );
    assert_eq!(report["stop"], "residual");
    for key in [
        "device",
        "sources",
        "hemicubes",
        "unshot_share",
        "error_bound",
        "seconds",
        "skipped",
    ] {
        assert!(!report[key].is_null(), "{key}");
    }
    for picture in ["p.png", "p.exr"] {
        let args = [
            "render",
            "o.safetensors",
            "-o",
            picture,
            "--size",
            "64x48",
            "--validate",
        ];
        let run = mesolux(&args, folder.path());
        assert!(
            run.status.success(),
            "{}",
            String::from_utf8_lossy(&run.stderr)
        );
        let image = image::open(folder.path().join(picture)).expect("a picture");
        assert_eq!((image.width(), image.height()), (64, 48));
    }
    // A scene that has changed is not drawn with an old bake's light.
    std::fs::write(
        folder.path().join("room.obj"),
        ROOM.replace("v 0 1 0", "v 0 2 0"),
    )
    .expect("written");
    let run = mesolux(&["render", "o.safetensors", "-o", "q.png"], folder.path());
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("changed"));
    // A bake cut short is an error, not a panic.
    let bytes = std::fs::read(folder.path().join("o.safetensors")).expect("read");
    std::fs::write(
        folder.path().join("cut.safetensors"),
        &bytes[..bytes.len() / 2],
    )
    .expect("written");
    let run = mesolux(&["render", "cut.safetensors", "-o", "q.png"], folder.path());
    assert_eq!(
        run.status.code(),
        Some(2),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
}

/// Without any Vulkan driver; the interval is told.
#[test]
fn draws_the_reference() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    std::fs::write(folder.path().join("room.obj"), ROOM).expect("written");
    std::fs::write(folder.path().join("room.mtl"), MATERIALS).expect("written");
    for light in ["global", "direct", "indirect"] {
        let run = Command::new(env!("CARGO_BIN_EXE_mesolux"))
            .args(["render", "room.obj", "--reference", "--paths", "8"])
            .args(["--light", light, "--size", "32x24", "--seed", "3"])
            .args(["-o", "p.exr"])
            .env("VK_DRIVER_FILES", "/nonexistent.json")
            .env("VK_ICD_FILENAMES", "/nonexistent.json")
            .current_dir(folder.path())
            .output()
            .expect("the program runs");
        let text = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{text}");
        assert!(text.contains("8 paths a pixel") && text.contains("(95 %)"));
        let image = image::open(folder.path().join("p.exr")).expect("a picture");
        assert_eq!((image.width(), image.height()), (32, 24));
    }
    // What belongs to the one way of drawing is refused with the other.
    let refused = |args: &[&str]| {
        let run = mesolux(
            &[&["render", "room.obj", "-o", "q.png"], args].concat(),
            folder.path(),
        );
        assert_eq!(run.status.code(), Some(2), "{args:?}");
        assert!(
            String::from_utf8_lossy(&run.stderr).contains("--reference"),
            "{args:?}"
        );
    };
    refused(&["--paths", "8"]);
    refused(&["--reference", "--hemicube", "64"]);
    refused(&["--reference", "--shading", "normal"]);
    refused(&["--reference", "--direct", "slots"]);
    assert!(!folder.path().join("q.png").exists());
}

/// The three parts of the light stand side by side; a camera may be described; compare tells that a
/// picture is itself.
#[test]
fn draws_parts_of_the_light_and_compares() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    std::fs::write(folder.path().join("room.obj"), ROOM).expect("written");
    std::fs::write(folder.path().join("room.mtl"), MATERIALS).expect("written");
    let run = |args: &[&str]| mesolux(args, folder.path());
    let look = [
        "--look-from",
        "0.5,0.5,-2",
        "--look-at",
        "0.5,0.5,0",
        "--fov",
        "50",
    ];
    let base = [
        "render",
        "room.obj",
        "--size",
        "24x20",
        "--residual",
        "0.05",
        "-o",
        "all.exr",
    ];
    let done = run(&[&base[..], &look, &["--light", "all"]].concat());
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let image = image::open(folder.path().join("all.exr"))
        .expect("a picture")
        .into_rgb32f();
    assert_eq!(image.dimensions(), (72, 20));
    for row in 0..20 {
        for column in 0..24 {
            let at = |part: u32| image.get_pixel(24 * part + column, row).0;
            for c in 0..3 {
                let (sum, whole) = (at(0)[c] + at(1)[c], at(2)[c]);
                assert!(
                    (sum - whole).abs() <= 1e-5 * whole.max(1.0),
                    "{sum} for {whole}"
                );
            }
        }
    }
    let done = run(&["compare", "all.exr", "all.exr", "-o", "beside.png"]);
    let text = String::from_utf8_lossy(&done.stdout);
    assert!(
        done.status.success() && text.starts_with("relMSE 0.000e0"),
        "{text}"
    );
    let beside = image::open(folder.path().join("beside.png")).expect("a picture");
    assert_eq!((beside.width(), beside.height()), (216, 20));
    for wrong in ["--look-at 1,2", "--fov 180", "--look-from nan,0,0"] {
        let wrong: Vec<&str> = wrong.split(' ').collect();
        let done = run(&[&["render", "room.obj", "-o", "q.png"], &wrong[..]].concat());
        assert_eq!(done.status.code(), Some(2), "{wrong:?}");
    }
}

/// The paper's method bakes by one name, refuses what it leaves no choice of, and is drawn by its
/// own shading unless asked otherwise.
#[test]
fn the_papers_preset() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |args: &[&str]| mesolux(args, folder.path());
    let bake = |with: &[&str]| {
        let scene = ["bake", "embossed-plate", "-o", "a.safetensors"];
        run(&[&scene, with].concat())
    };
    for (with, told) in [
        (
            &["--preset", "paper", "--transport", "physical"][..],
            "cannot be used with",
        ),
        (
            &["--preset", "paper", "--quality", "draft"],
            "cannot be used with",
        ),
        (
            &["--preset", "paper", "--directions", "128"],
            "16, 32 or 64",
        ),
        (&["--estimator", "pixel"], "--preset paper"),
    ] {
        let refused = bake(with);
        let error = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{error}");
        assert!(error.contains(told), "{error}");
    }
    let baked = bake(&[
        "--preset",
        "paper",
        "--hemicube",
        "32",
        "--shots",
        "400",
        "--json",
    ]);
    let error = String::from_utf8_lossy(&baked.stderr);
    assert!(baked.status.success(), "{error}");
    let report: serde_json::Value = serde_json::from_slice(&baked.stdout).expect("JSON");
    assert_eq!(report["estimator"], "paper");
    // None is cut, and none shoots for another.
    assert_eq!(report["sources"], report["elements"]);
    let pixels = |with: &[&str]| {
        let draw = ["render", "a.safetensors", "-o", "a.png", "--size", "48x48"];
        let drawn = run(&[&draw, with].concat());
        assert!(
            drawn.status.success(),
            "{}",
            String::from_utf8_lossy(&drawn.stderr)
        );
        image::open(folder.path().join("a.png"))
            .expect("a picture")
            .into_rgb8()
    };
    let own = pixels(&[]);
    assert_eq!(own, pixels(&["--shading", "clusters", "--direct", "slots"]));
    assert_ne!(own, pixels(&["--shading", "factored", "--direct", "sharp"]));
}
