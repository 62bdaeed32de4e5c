//! What stands where a file should be: a folder, a pipe, a device, an image without bound, a tensor
//! of another type. Each is refused at once with exit code 2 and one line that names it.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nusemtl lamp\nf 1/1 2/1 3/1\n";
const MTL: &str = "newmtl lamp\nKd 0.1 0.2 0.3\nKe 1 2 3\n";
const GLTF: &str = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "buffers": [{"uri": "a.bin", "byteLength": 36}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0]}]}"#;

/// How long a program may take that has nothing to do; one that waits at a pipe never ends.
const PATIENCE: Duration = Duration::from_secs(60);

/// Exit code and stderr of the program, which is stopped if it does not end.
fn run(folder: &Path, args: &[&str]) -> (Option<i32>, String) {
    let child = Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(args)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let id = child.id().to_string();
    let (done, wait) = std::sync::mpsc::channel();
    std::thread::spawn(move || done.send(child.wait_with_output()));
    let output = wait.recv_timeout(PATIENCE).unwrap_or_else(|_| {
        let _ = Command::new("kill").args(["-KILL", &id]).status();
        panic!("{args:?} does not end");
    });
    let output = output.expect("the program ran");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), text)
}

fn pipe(folder: &Path, name: &str) {
    let made = Command::new("mkfifo").arg(folder.join(name)).status();
    assert!(made.expect("mkfifo runs").success());
}

#[test]
fn what_is_no_file_is_refused() {
    const PIPE: &str = "a pipe or a device, where a regular file is wanted";
    type Case = (&'static str, fn(&Path), &'static str, [&'static str; 2]);
    let map = |folder: &Path, file: &str| {
        fs::write(folder.join("a.mtl"), format!("{MTL}map_Kd {file}\n")).expect("written");
    };
    let cases: [Case; 8] = [
        ("scene", |f| pipe(f, "b.obj"), "b.obj", ["b.obj", PIPE]),
        (
            "library",
            |f| {
                fs::remove_file(f.join("a.mtl")).expect("removed");
                pipe(f, "a.mtl");
            },
            "a.obj",
            ["a.mtl", PIPE],
        ),
        (
            "library that is a folder",
            |f| {
                fs::remove_file(f.join("a.mtl")).expect("removed");
                fs::create_dir(f.join("a.mtl")).expect("made");
            },
            "a.obj",
            ["a.mtl", "is a directory"],
        ),
        (
            "scene.toml of a device",
            |f| fs::write(f.join("b.toml"), "[[mesh]]\nfile = '/dev/zero'\n").expect("written"),
            "b.toml",
            ["/dev/zero", ""],
        ),
        ("texture", |f| pipe(f, "a.png"), "a.obj", ["a.png", PIPE]),
        (
            "buffer",
            |f| {
                fs::write(f.join("b.gltf"), GLTF).expect("written");
                pipe(f, "a.bin");
            },
            "b.gltf",
            ["a.bin", PIPE],
        ),
        (
            "bake",
            |f| pipe(f, "b.safetensors"),
            "b.safetensors",
            ["b.safetensors", PIPE],
        ),
        (
            "large texture",
            |f| {
                let file = fs::File::create(f.join("a.png")).expect("made");
                let mut png = png::Encoder::new(file, 8193, 16_384);
                png.set_depth(png::BitDepth::One);
                let mut rows = png.write_header().expect("written");
                rows.write_image_data(&vec![0; 1025 * 16_384])
                    .expect("written");
            },
            "a.obj",
            ["a.png", "8193 × 16384 texels are more than 134217728"],
        ),
    ];
    for (what, make, scene, words) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("a.obj"), OBJ).expect("written");
        fs::write(folder.path().join("a.mtl"), MTL).expect("written");
        make(folder.path());
        if folder.path().join("a.png").exists() {
            map(folder.path(), "a.png");
        }
        let (code, said) = run(folder.path(), &["info", scene]);
        assert_eq!(code, Some(2), "{what}: {said}");
        let line = said.lines().last().unwrap_or_default();
        assert!(
            words.iter().all(|word| line.contains(word)),
            "{what}: {said}"
        );
    }
}

/// 100,000 materials, each used, are found by their names; comparing each with each is 10¹⁰ times.
#[test]
fn many_materials_are_read() {
    const COUNT: usize = 100_000;
    let folder = tempfile::tempdir().expect("a folder");
    let materials: String = (0..COUNT)
        .map(|i| format!("newmtl paint{i}\nKd 0.5 0.5 0.{i:06}\n"))
        .collect();
    let faces: String = (0..COUNT)
        .map(|i| format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nusemtl paint{i}\nf -3 -2 -1\n"))
        .collect();
    let lamp = "v 0 2 0\nv 1 2 0\nv 0 2 1\nusemtl lamp\nf -3 -2 -1\n";
    fs::write(folder.path().join("a.mtl"), format!("{MTL}{materials}")).expect("written");
    fs::write(
        folder.path().join("a.obj"),
        format!("mtllib a.mtl\n{faces}{lamp}"),
    )
    .expect("written");
    let scene = mesolux::scene::load(
        folder.path().join("a.obj").to_str().expect("UTF-8"),
        &mesolux::scene::LoadOptions::default(),
    )
    .expect("a scene");
    assert_eq!(scene.triangles.len(), COUNT + 1);
    assert_eq!(scene.materials.len(), COUNT + 1);
}

/// A bake whose `material` is of another type is no bake.
#[test]
fn every_tensor_of_a_bake_has_its_type() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bake = vec![
        "bake",
        "cornell-box",
        "--no-cache",
        "--quality",
        "preview",
        "-o",
        "a.safetensors",
    ];
    let device = std::env::var("MESOLUX_TEST_DEVICE");
    if let Ok(device) = &device {
        bake.extend(["--device", device]);
    }
    let (code, said) = run(folder.path(), &bake);
    assert_eq!(code, Some(0), "{said}");
    let path = folder.path().join("a.safetensors");
    let mut bytes = fs::read(&path).expect("a bake");
    let header = br#""material":{"dtype":"U32""#;
    let at = bytes
        .windows(header.len())
        .position(|window| window == header);
    let at = at.expect("the tensor's header") + header.len() - 4;
    bytes[at] = b'F';
    fs::write(&path, bytes).expect("written");
    let (code, said) = run(folder.path(), &["render", "a.safetensors", "-o", "a.png"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("a.safetensors: material: not U32"), "{said}");
}
