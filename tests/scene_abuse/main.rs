//! Wrong input gives one line that names the file, the line or the material, and never a panic.

mod mangled;
mod obj;
mod scene_file;

use std::fs;
use std::path::Path;

use mesolux::scene::{LoadOptions, load};

const MTL: &str = "newmtl lamp\nKd 0.1 0.2 0.3\nKe 1 2 3\n";
const OBJ: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl lamp\nf 1/1 2/2 3/3\n";
const TOML: &str = "name = 'x'\n[[mesh]]\nfile = 'a.obj'\nscale = 2\n[[point_light]]\nname = 'p'\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n[[camera]]\nname = 'c'\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 40\n";

/// The three files as they are read without complaint.
const GOOD: [(&str, &str); 3] = [("a.mtl", MTL), ("a.obj", OBJ), ("a.toml", TOML)];

fn try_files(dir: &Path, first: &str, files: [(&str, impl AsRef<[u8]>); 3]) -> Result<(), String> {
    for (name, bytes) in files {
        let path = dir.join(name);
        // Most stand there already from the round before.
        if fs::read(&path).ok().as_deref() != Some(bytes.as_ref()) {
            fs::write(path, bytes).unwrap();
        }
    }
    load(dir.join(first).to_str().unwrap(), &LoadOptions::default())
        .map(|_| ())
        .map_err(|error| error.to_string())
}

/// Replaces `from` by `to` in one of the three files, loads `first`, and looks for each fragment in
/// the message.
fn refused(first: &str, file: &str, from: &str, to: &str, fragments: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let mut files = GOOD.map(|(name, text)| (name, text.to_owned()));
    let text = &mut files.iter_mut().find(|(name, _)| *name == file).unwrap().1;
    assert!(text.contains(from), "{from} is in {file}");
    *text = text.replacen(from, to, 1);
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
    try_files(dir.path(), "a.obj", GOOD).unwrap();
    try_files(dir.path(), "a.toml", GOOD).unwrap();
}

#[test]
fn unknown_scenes_and_options_are_named() {
    let none = LoadOptions::default();
    let error = load("cornel", &none).unwrap_err().to_string();
    assert!(
        error.contains("\"cornel\"") && error.contains("cornell"),
        "{error}"
    );
    let error = load("nowhere.obj", &none).unwrap_err().to_string();
    assert!(error.contains("nowhere.obj: cannot be read"), "{error}");
    let patches = LoadOptions {
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
        let error = load(path.to_str().unwrap(), &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(fragments.iter().all(|f| error.contains(f)), "{error}");
    }
    fs::create_dir(dir.path().join("folder.obj")).unwrap();
    let folder = dir.path().join("folder.obj");
    load(folder.to_str().unwrap(), &LoadOptions::default()).unwrap_err();
}
