//! The glTF of `export` through Khronos' validator, and in three.js beside `render`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::browser::{Browser, wait};
use crate::display::Display;
use crate::harness::{picture, told};
use crate::server::{Server, State};
use crate::{apart, exported_box, run};

/// Where this file's neighbours are.
fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/web/loaders")
}

/// The packages of `package-lock.json`, installed once.
fn packages() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("loaders");
    std::fs::create_dir_all(&folder).expect("a folder for packages");
    for name in ["package.json", "package-lock.json"] {
        std::fs::copy(sources().join(name), folder.join(name)).expect("it is there");
    }
    let install = ["ci", "--no-audit", "--no-fund", "--prefer-offline"];
    let output = Command::new("npm")
        .args(install)
        .current_dir(&folder)
        .output();
    let output = output.expect("the test needs npm (Debian: npm)");
    assert!(output.status.success(), "{}", told(&output));
    folder
}

/// The issues that Khronos' validator finds.
fn issues(packages: &Path, file: &Path) -> String {
    let program = sources().join("validate.mjs");
    let output = Command::new("node")
        .arg(program)
        .args([packages, file])
        .output();
    let output = output.expect("the test needs node (Debian: nodejs)");
    assert!(output.status.success(), "{}", told(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn others_load_the_gltf() {
    let packages = packages();
    let folder = exported_box();
    let page = folder.path().join("three");
    std::fs::create_dir(&page).expect("a folder for the page");
    std::os::unix::fs::symlink(packages.join("node_modules/three"), page.join("three"))
        .expect("a link to the library");
    std::fs::copy(sources().join("index.html"), page.join("index.html")).expect("it is there");

    let display = Display::new();
    for (name, exposure, limit) in [
        ("mapped", "2", MAPPED),
        ("unlit", "null", UNLIT),
        ("vertices", "null", VERTICES),
    ] {
        let glb = folder.path().join(format!("{name}.glb"));
        let issues = issues(&packages, &glb);
        println!("{name}: {issues}");
        assert!(
            issues.contains("\"numErrors\":0,\"numWarnings\":0"),
            "{name}: {issues}"
        );

        std::fs::copy(&glb, page.join("scene.glb")).expect("a scene");
        let settings = format!("{{ \"exposure\": {exposure} }}");
        std::fs::write(page.join("settings.json"), settings).expect("settings");
        let server = Server::start(&page);
        let profile = folder.path().join(name);
        let browser = Browser::open(&display, &profile, &server.address);
        // A canvas that nothing has been drawn on is 300 pixels wide.
        let is_done = |state: &State| state.title == "done" && state.picture.width() > 300;
        let state = wait(&server, name, is_done);
        drop(browser);
        let (width, height) = state.picture.dimensions();
        let size = format!("{width}x{height}");
        let file = format!("{name}.png");
        let view = ["-o", &file, "--exposure", "1", "--size", &size];
        run(
            folder.path(),
            &[&["render", "box.safetensors"], &view[..]].concat(),
        );
        let error = apart(&state.picture, &picture(folder.path(), &file));
        println!("{name}: FLIP {error:.4} in three.js beside `render`");
        assert!(error <= limit);
    }
}

/// Mean LDR-FLIP with the light map. Measured: 0.0424.
const MAPPED: f32 = 0.085;

/// With baked colours. Measured: 0.0154.
const UNLIT: f32 = 0.031;

/// With colours of vertices. Measured: 0.0143.
const VERTICES: f32 = 0.029;
