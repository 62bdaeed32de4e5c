//! Wrong input gives one line that names the file, the line or the material, and never a panic.

use std::fs;
use std::path::Path;

use mesolux::scene::{BuiltinOptions, load};

const MTL: &str = "newmtl lamp\nKd 0.1 0.2 0.3\nKe 1 2 3\n";
const OBJ: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl lamp\nf 1/1 2/2 3/3\n";
const TOML: &str = "name = 'x'\n[[mesh]]\nfile = 'a.obj'\nscale = 2\n[[point_light]]\nname = 'p'\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n[[camera]]\nname = 'c'\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 40\n";

fn try_files(dir: &Path, first: &str, files: [(&str, &[u8]); 3]) -> Result<(), String> {
    for (name, bytes) in files {
        let path = dir.join(name);
        // Most stand there already from the round before.
        if fs::read(&path).ok().as_deref() != Some(bytes) {
            fs::write(path, bytes).unwrap();
        }
    }
    load(
        dir.join(first).to_str().unwrap(),
        &BuiltinOptions::default(),
    )
    .map(|_| ())
    .map_err(|error| error.to_string())
}

/// Replaces `from` by `to` in one of the three files, loads `first`, and looks for each fragment in the message.
fn refused(first: &str, file: &str, from: &str, to: &str, fragments: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let mut files = [
        ("a.mtl", MTL.to_owned()),
        ("a.obj", OBJ.to_owned()),
        ("a.toml", TOML.to_owned()),
    ];
    let text = &mut files.iter_mut().find(|(name, _)| *name == file).unwrap().1;
    assert!(text.contains(from), "{from} is in {file}");
    *text = text.replacen(from, to, 1);
    let files = files
        .each_ref()
        .map(|(name, text)| (*name, text.as_bytes()));
    let error =
        try_files(dir.path(), first, files).expect_err(&format!("{file}: {from:?} → {to:?}"));
    assert!(!error.contains('\n'), "one line: {error:?}");
    for fragment in fragments {
        assert!(error.contains(fragment), "{fragment:?} is not in {error:?}");
    }
}

#[test]
fn the_untouched_files_are_good() {
    let dir = tempfile::tempdir().unwrap();
    let files = [
        ("a.mtl", MTL.as_bytes()),
        ("a.obj", OBJ.as_bytes()),
        ("a.toml", TOML.as_bytes()),
    ];
    try_files(dir.path(), "a.obj", files).unwrap();
    try_files(dir.path(), "a.toml", files).unwrap();
}

#[test]
fn wrong_obj_lines_are_named() {
    for (from, to, fragments) in [
        ("v 1 0 0", "v 1 0", ["a.obj:3:", "3 coordinates, found 2"]),
        ("v 1 0 0", "v 1 0 0 0 0", ["a.obj:3:", "found 5"]),
        ("v 1 0 0", "v", ["a.obj:3:", "found 0"]),
        (
            "v 1 0 0",
            "v 1 nan 0",
            ["a.obj:3:", "\"nan\" is not a finite number"],
        ),
        (
            "v 1 0 0",
            "v 1 -inf 0",
            ["a.obj:3:", "\"-inf\" is not a finite"],
        ),
        (
            "v 1 0 0",
            "v 1 1e999 0",
            ["a.obj:3:", "\"1e999\" is not a finite"],
        ),
        ("v 1 0 0", "v 1 o 0", ["a.obj:3:", "\"o\" is not a number"]),
        ("v 1 0 0", "v 1 0 0 0", ["a.obj:3:", "weight"]),
        ("vt 1 0", "vt 1", ["a.obj:6:", "2 coordinates, found 1"]),
        ("vt 1 0", "vt 1 NaN", ["a.obj:6:", "NaN"]),
        ("vt 1 0", "vt 1 1e300", ["a.obj:6:", "too large"]),
        ("2/2 3/3", "2/2", ["a.obj:9:", "3 corners, found 2"]),
        ("1/1 2/2 3/3", "", ["a.obj:9:", "3 corners, found 0"]),
        ("3/3", "0/3", ["a.obj:9:", "vertex index 0"]),
        (
            "3/3",
            "4/3",
            ["a.obj:9:", "vertex index 4 is out of range: 3 so far"],
        ),
        (
            "3/3",
            "-4/3",
            ["a.obj:9:", "vertex index -4 is out of range"],
        ),
        (
            "3/3",
            "3/4",
            ["a.obj:9:", "texture vertex index 4 is out of range"],
        ),
        (
            "3/3",
            "3/3/1",
            ["a.obj:9:", "normal index 1 is out of range"],
        ),
        ("3/3", "3/3/1/1", ["a.obj:9:", "normal index"]),
        ("3/3", "3", ["a.obj:9:", "2 of 3 corners"]),
        ("3/3", "x/3", ["a.obj:9:", "\"x\" is not a vertex index"]),
        (
            "3/3",
            "99999999999999999999",
            ["a.obj:9:", "is not a vertex index"],
        ),
        (
            "3/3",
            "-9223372036854775808/3",
            ["a.obj:9:", "out of range"],
        ),
        ("usemtl lamp", "usemtl lamb", ["a.obj:8:", "\"lamb\""]),
        ("usemtl lamp", "usemtl", ["a.obj:8:", "no material"]),
        ("mtllib a.mtl", "mtllib b.mtl", ["a.obj:1:", "\"b.mtl\""]),
        ("mtllib a.mtl", "mtllib", ["a.obj:1:", "no file"]),
        ("f 1/1 2/2 3/3", "", ["a.obj", "no face"]),
        (
            "v 1 1 0",
            "v 0.5 0 0",
            ["a.obj", "no triangle in it with an area (1"],
        ),
        (
            "v 1 0 0\nv 1 1 0",
            "v 1e16 0 0\nv 0 1e16 0",
            ["a.obj", "units across"],
        ),
        (
            "v 1 0 0\nv 1 1 0",
            "v 1e308 -1e308 0\nv 0 1e308 0",
            ["a.obj", "units across"],
        ),
        ("usemtl lamp", "", ["a.obj", "no light"]),
    ] {
        refused("a.obj", "a.obj", from, to, &fragments);
    }
}

#[test]
fn wrong_materials_are_named() {
    for (from, to, fragments) in [
        (
            "0.1 0.2 0.3",
            "0.1 1.2 0.3",
            [
                "material \"lamp\": reflectance Kd (0.1, 1.2, 0.3) must be in 0..=1",
                "a.mtl",
            ],
        ),
        (
            "0.1 0.2 0.3",
            "-0.1 0.2 0.3",
            ["material \"lamp\": reflectance Kd", "a.mtl"],
        ),
        (
            "0.1 0.2 0.3",
            "nan 0.2 0.3",
            ["a.mtl:2: material \"lamp\": Kd", "nan"],
        ),
        (
            "0.1 0.2 0.3",
            "0.1 0.2",
            ["a.mtl:2: material \"lamp\": Kd", "found 2"],
        ),
        (
            "Kd 0.1 0.2 0.3",
            "Kd",
            ["a.mtl:2: material \"lamp\": Kd", "found 0"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 -2 3",
            ["material \"lamp\": emitted radiance Ke (1, -2, 3)", "a.mtl"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 inf 3",
            ["a.mtl:3: material \"lamp\": Ke", "inf"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 1e39 3",
            ["a.mtl:3: material \"lamp\": Ke", "too large"],
        ),
        ("Ke 1 2 3", "Ke 0 0 0", ["no light", "a.obj"]),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd gone.png",
            ["material \"lamp\": map_Kd", "gone.png"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd a.obj",
            ["material \"lamp\": map_Kd", "cannot be decoded"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd",
            ["a.mtl:4:", "names no file"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd -s 2 2 1 x.png",
            ["a.mtl:4:", "options"],
        ),
        ("newmtl lamp", "newmtl", ["a.mtl:1:", "no name"]),
        ("newmtl lamp", "", ["a.mtl:2:", "before the first newmtl"]),
        ("Ke 1 2 3", "newmtl lamp", ["a.mtl:3:", "twice"]),
    ] {
        refused("a.obj", "a.mtl", from, to, &fragments);
    }
}

#[test]
fn a_texture_brighter_than_white_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let picture = image::ImageBuffer::from_pixel(2, 2, image::Rgb([0.5_f32, 20.0, 0.5]));
    image::DynamicImage::from(picture)
        .save(dir.path().join("x.exr"))
        .unwrap();
    let mtl = format!("{MTL}map_Kd x.exr\n");
    let files = [
        ("a.mtl", mtl.as_bytes()),
        ("a.obj", OBJ.as_bytes()),
        ("a.toml", TOML.as_bytes()),
    ];
    let error = try_files(dir.path(), "a.obj", files).unwrap_err();
    assert!(
        error.contains("material \"lamp\"") && error.contains("x.exr"),
        "{error}"
    );
}

#[test]
fn wrong_scene_files_are_named() {
    for (from, to, fragments) in [
        ("name = 'x'", "nam = 'x'", ["a.toml:1:", "nam"]),
        ("name = 'x'", "name = 'x", ["a.toml:1:", ""]),
        ("scale = 2", "size = 2", ["a.toml:4:", "size"]),
        (
            "scale = 2",
            "scale = 0",
            ["a.toml:2:", "scale must not be 0"],
        ),
        (
            "scale = 2",
            "scale = [1, 0, 1]",
            ["a.toml:2:", "scale must not be 0"],
        ),
        (
            "scale = 2",
            "scale = nan",
            ["a.toml:2:", "scale must be finite"],
        ),
        (
            "scale = 2",
            "scale = 'big'",
            ["a.toml:4:", "a number or [x, y, z]"],
        ),
        (
            "scale = 2",
            "scale = 1e308\ntranslate = [1e308, 0, 0]",
            ["a.toml:2:", "beyond every number"],
        ),
        (
            "scale = 2",
            "rotate = [0, inf, 0]",
            ["a.toml:2:", "rotate must be finite"],
        ),
        ("scale = 2", "translate = [0, 0]", ["a.toml:4:", ""]),
        (
            "scale = 2",
            "material = 'tin'",
            ["a.toml:2:", "material \"tin\""],
        ),
        (
            "file = 'a.obj'",
            "file = 'b.obj'",
            ["b.obj", "cannot be read"],
        ),
        ("file = 'a.obj'", "", ["a.toml:2:", "file"]),
        (
            "[[camera]]",
            "[material.tin]\nkd = [1,1,1]\n[[camera]]",
            ["a.toml:9:", "material \"tin\""],
        ),
        (
            "[[camera]]",
            "[material.lamp]\nkd = [1,2,1]\n[[camera]]",
            ["a.toml:9:", "reflectance Kd (1, 2, 1)"],
        ),
        (
            "[[camera]]",
            "[material.lamp]\nke = [1,nan,1]\n[[camera]]",
            ["a.toml:9:", "Ke"],
        ),
        (
            "[[camera]]",
            "[material.lamp]\nmap_kd = 'no.png'\n[[camera]]",
            ["\"lamp\"", "no.png"],
        ),
        (
            "[[camera]]",
            "[material.lamp]\ngloss = 1\n[[camera]]",
            ["a.toml:10:", "gloss"],
        ),
        (
            "[0, 1, 0]\nint",
            "[0, inf, 0]\nint",
            ["a.toml:5:", "point light \"p\": position"],
        ),
        (
            "intensity = [1, 1, 1]",
            "intensity = [1, -1, 1]",
            ["a.toml:5:", "point light \"p\": intensity"],
        ),
        (
            "intensity = [1, 1, 1]",
            "intensity = [1, 1e39, 1]",
            ["a.toml:5:", "point light \"p\": intensity"],
        ),
        ("intensity = [1, 1, 1]", "", ["a.toml:5:", "intensity"]),
        (
            "fov = 40",
            "fov = 180",
            ["a.toml:9:", "camera \"c\": fov 180"],
        ),
        (
            "fov = 40",
            "fov = nan",
            ["a.toml:9:", "camera \"c\": fov NaN"],
        ),
        ("fov = 40", "", ["a.toml:9:", "fov"]),
        (
            "look_at = [0, 0, 0]",
            "look_at = [0, 0, 5]",
            ["a.toml:9:", "same point"],
        ),
        (
            "look_at = [0, 0, 0]",
            "look_at = [0, 0, nan]",
            ["a.toml:9:", "finite"],
        ),
        (
            "up = [0, 1, 0]",
            "up = [0, 0, -2]",
            ["a.toml:9:", "parallel"],
        ),
        ("up = [0, 1, 0]", "up = [0, 0, 0]", ["a.toml:9:", "zero"]),
        (
            "[[camera]]",
            "[[camera]]\nname='c'\nposition=[1,0,0]\nlook_at=[0,0,0]\nfov=9\n[[camera]]",
            ["a.toml:14:", "earlier"],
        ),
    ] {
        refused("a.toml", "a.toml", from, to, &fragments);
    }
}

#[test]
fn unknown_scenes_and_options_are_named() {
    let none = BuiltinOptions::default();
    let error = load("cornel", &none).unwrap_err().to_string();
    assert!(
        error.contains("\"cornel\"") && error.contains("cornell"),
        "{error}"
    );
    let error = load("nowhere.obj", &none).unwrap_err().to_string();
    assert!(error.contains("nowhere.obj: cannot be read"), "{error}");
    let patches = BuiltinOptions {
        patches: Some(9),
        ..none
    };
    assert!(
        load("nowhere.obj", &patches)
            .unwrap_err()
            .to_string()
            .contains("patches")
    );
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes, fragments) in [
        ("empty.obj", &b""[..], ["empty.obj", "no face"]),
        ("empty.toml", b"", ["empty.toml", "no triangle"]),
        (
            "binary.obj",
            b"v 0 0 0\n\x00\xff\xfe\x80",
            ["binary.obj:2:", "UTF-8"],
        ),
        ("zeros.obj", &[0; 999], ["zeros.obj", "no face"]),
    ] {
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = load(path.to_str().unwrap(), &BuiltinOptions::default())
            .unwrap_err()
            .to_string();
        assert!(fragments.iter().all(|f| error.contains(f)), "{error}");
    }
    fs::create_dir(dir.path().join("folder.obj")).unwrap();
    let folder = dir.path().join("folder.obj");
    load(folder.to_str().unwrap(), &BuiltinOptions::default()).unwrap_err();
}

/// A small generator with a known sequence (xorshift64*), so that a failure can be seen again.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n
    }
}

/// One or two changes: a byte put in, taken out, replaced, a piece doubled or cut off.
fn mangle(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    const BYTES: &[u8] = b"0123456789.-+eE/ \n\r\t\\#\"'[]={},naninfvtfKdmap_\0\xff\xc3\xa9";
    let mut bytes = bytes.to_vec();
    for _ in 0..=dice.below(2) {
        let at = dice.below(bytes.len().max(1));
        let byte = BYTES[dice.below(BYTES.len())];
        match dice.below(6) {
            _ if bytes.is_empty() => bytes.push(byte),
            0 => bytes.insert(at, byte),
            1 => drop(bytes.remove(at)),
            2 | 3 => bytes[at] = byte,
            4 => {
                let end = (at + 1 + dice.below(20)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                let to = dice.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

#[test]
fn mangled_files_never_panic() {
    let dir = tempfile::tempdir().unwrap();
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    let good = [
        ("a.mtl", MTL.as_bytes()),
        ("a.obj", OBJ.as_bytes()),
        ("a.toml", TOML.as_bytes()),
    ];
    let (mut read, mut refused) = (0, 0);
    for round in 0..3_000 {
        let mut files = good;
        let mangled = mangle(good[round % 3].1, &mut dice);
        files[round % 3].1 = &mangled;
        match try_files(dir.path(), "a.toml", files) {
            Ok(()) => read += 1,
            Err(error) => {
                refused += 1;
                assert!(!error.is_empty() && !error.contains('\n'), "{error:?}");
            }
        }
    }
    // Both ways are taken often, or the mangling is too weak or too strong to tell anything.
    assert!(
        read > 300 && refused > 300,
        "{read} read, {refused} refused"
    );
}
