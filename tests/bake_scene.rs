//! A bake and its scene: found again where they are moved to, refused where it is another one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use mesolux::bake::solution::{About, Bake};
use serde_json::Value;
use tempfile::TempDir;

const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
    o ground\nusemtl floor\nf 1 4 3 2\no lamp\nusemtl light\nf 5 6 7 8\n";
const MATERIALS: &str = "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl light\nKd 0 0 0\nKe 1 1 1\n";

fn mesolux(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs a command that must succeed, and gives its output.
fn done(args: &[&str], folder: &Path) -> String {
    let run = mesolux(args, folder);
    assert!(run.status.success(), "{args:?}: {}", text(&run.stderr));
    text(&run.stdout)
}

/// Runs a command that must be refused with one line, and gives it.
fn refused(args: &[&str], folder: &Path) -> String {
    let run = mesolux(args, folder);
    let said = text(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{args:?}: {said}");
    let mut lines = said.lines().filter(|line| line.starts_with("mesolux: "));
    let line = lines.next().expect("a line").to_owned();
    assert_eq!(lines.next(), None, "{said}");
    line
}

/// `scenes/room.obj`, and its bake beside the folder.
fn baked() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let scenes = folder.path().join("home/scenes");
    fs::create_dir_all(&scenes).expect("made");
    fs::write(scenes.join("room.obj"), ROOM).expect("written");
    fs::write(scenes.join("room.mtl"), MATERIALS).expect("written");
    let args = ["bake", "scenes/room.obj", "-o", "o.safetensors"];
    done(&args, &folder.path().join("home"));
    folder
}

#[test]
fn a_bake_finds_its_scene_again() {
    let folder = baked();
    let at = |path: &str| folder.path().join(path);
    fs::rename(at("home"), at("elsewhere")).expect("moved");
    let draw = ["render", "o.safetensors", "-o", "p.png", "--size", "32x32"];
    done(&draw, &at("elsewhere"));

    // The bake alone.
    fs::create_dir(at("alone")).expect("made");
    fs::rename(at("elsewhere/o.safetensors"), at("alone/o.safetensors")).expect("moved");
    let line = refused(&draw, &at("alone"));
    for word in [
        "o.safetensors",
        "scenes/room.obj, nor at ",
        "home/scenes/room.obj",
        "--scene",
    ] {
        assert!(line.contains(word), "{word}: {line}");
    }
    let from = |scene| [&draw[..], &["--scene", scene]].concat();
    done(&from("../elsewhere/scenes/room.obj"), &at("alone"));
    let line = refused(&from("none.obj"), &at("alone"));
    assert!(line.contains("none.obj"), "{line}");

    // Another one, at the place and by name.
    fs::create_dir(at("alone/scenes")).expect("made");
    fs::write(at("alone/scenes/room.mtl"), MATERIALS).expect("written");
    let other = ROOM.replace("v 0 1 0", "v 0 2 0");
    fs::write(at("alone/scenes/room.obj"), other).expect("written");
    for args in [&draw[..], &from("scenes/room.obj")] {
        let line = refused(args, &at("alone"));
        assert!(line.contains("another one; bake it again"), "{line}");
    }
    // Where it was counts if what lies beside is another one.
    fs::rename(at("elsewhere"), at("home")).expect("moved");
    done(&draw, &at("alone"));
    let line = refused(
        &["render", "cornell", "-o", "p.png", "--scene", "x.obj"],
        &at("alone"),
    );
    assert!(line.contains("no bake"), "{line}");
}

#[test]
fn info_shows_what_is_inside() {
    let folder = baked();
    let home = folder.path().join("home");
    let json = |input: &str| -> Value {
        serde_json::from_str(&done(&["info", input, "--json"], &home)).expect("JSON")
    };
    let (bake, scene) = (json("o.safetensors"), json("scenes/room.obj"));
    // The areas of the scene's elements are summed alike.
    assert_eq!(bake["contents"], scene["contents"]);
    assert_eq!(bake["elements"], scene["elements"]);
    assert!(scene["bake"].is_null());
    let contents = &bake["contents"];
    assert_eq!(contents["triangles"], 4);
    assert_eq!(contents["meshes"][1]["name"], "lamp");
    assert_eq!(contents["meshes"][1]["ranges"], serde_json::json!([[2, 2]]));
    assert_eq!(bake["bake"]["origin"]["relative"], "scenes/room.obj");
    assert!(bake["bake"]["report"]["error_bound"].as_f64() < Some(0.001));
    let text = done(&["info", "o.safetensors"], &home);
    for word in [
        "8 vertices, 4 triangles, cut to",
        "bounds (0 0 0) to (1 1 1), area 2",
        "ground",
        "lamp",
        "kd 0 0 0, ke 1 1 1",
        "camera \"default\"",
        "hemicube 128",
        "error bound 0",
        "error of cutting into elements: ",
    ] {
        assert!(text.contains(word), "{word} is not in {text}");
    }
    let text = done(&["info", "scenes/room.obj", "--no-refine"], &home);
    assert!(text.contains("4 triangles\n"), "{text}");
    let line = refused(&["info", "o.safetensors", "--no-refine"], &home);
    assert!(line.contains("--no-refine has no effect"), "{line}");
    let line = refused(&["info", "none.safetensors"], &home);
    assert!(line.contains("none.safetensors"), "{line}");
    let line = refused(&["info", "none.obj"], &home);
    assert!(line.contains("none.obj"), "{line}");
}

/// The same file with other metadata.
fn changed(bake: &Path, change: impl FnOnce(&mut Value)) -> PathBuf {
    let bytes = fs::read(bake).expect("read");
    let (length, rest) = bytes.split_at(8);
    let length = u64::from_le_bytes(length.try_into().expect("8 bytes")) as usize;
    let mut header: Value = serde_json::from_slice(&rest[..length]).expect("JSON");
    change(&mut header["__metadata__"]);
    let mut text = header.to_string();
    text.push_str(&" ".repeat(text.len().next_multiple_of(8) - text.len()));
    let path = bake.with_file_name("changed.safetensors");
    let length = (text.len() as u64).to_le_bytes();
    let parts = [&length[..], text.as_bytes(), &rest[header_end(&bytes)..]];
    fs::write(&path, parts.concat()).expect("written");
    path
}

fn header_end(bytes: &[u8]) -> usize {
    u64::from_le_bytes(bytes[..8].try_into().expect("8 bytes")) as usize
}

#[test]
fn wrong_metadata_is_one_line() {
    let folder = baked();
    let bake = folder.path().join("home/o.safetensors");
    let wrong = [
        "",
        "{",
        "[]",
        "null",
        "7",
        "{\"scene\": 7}",
        "{\"meshes\": [1]}",
    ];
    let mut seen = 0;
    for key in [
        "version", "scene", "contents", "settings", "report", "program", "sha256",
    ] {
        for value in wrong.map(Some).into_iter().chain([None]) {
            let path = changed(&bake, |metadata| match value {
                Some(value) => metadata[key] = value.into(),
                None => drop(metadata.as_object_mut().map(|m| m.remove(key))),
            });
            let errors = [About::load(&path).err(), Bake::load(&path).err()];
            for error in errors.iter().flatten() {
                let error = error.to_string();
                assert!(error.contains("changed.safetensors"), "{key}: {error}");
                assert!(!error.contains('\n'), "{key}: {error}");
                seen += 1;
            }
            let must = ["version", "scene"].contains(&key);
            assert!(
                !must || errors.iter().all(Option::is_some),
                "{key} {value:?}"
            );
        }
    }
    assert!(seen > 40, "{seen} errors");
    // Contents that do not fit the elements.
    for (from, to) in [
        ("\"ranges\":[[0,2]]", "\"ranges\":[[0,1]]"),
        ("\"ranges\":[[0,2]]", "\"ranges\":[]"),
        ("\"ranges\":[[0,2]]", "\"ranges\":[[4294967295,4294967295]]"),
        ("\"ranges\":[[0,2]]", "\"ranges\":[[0,-2]]"),
        ("\"vertices\":8", "\"vertices\":1e99"),
    ] {
        changed(&bake, |metadata| {
            let text = metadata["contents"].as_str().expect("a text").to_owned();
            assert!(text.contains(from), "{text}");
            metadata["contents"] = text.replace(from, to).into();
        });
        let line = refused(
            &["info", "changed.safetensors"],
            bake.parent().expect("home"),
        );
        assert!(line.contains("changed.safetensors: contents"), "{line}");
    }
    // A bake of a program that kept no names.
    changed(&bake, |metadata| {
        metadata.as_object_mut().map(|m| m.remove("contents"));
    });
    let home = bake.parent().expect("home");
    assert!(done(&["info", "changed.safetensors"], home).contains("kept no names"));
    let draw = [
        "render",
        "changed.safetensors",
        "-o",
        "p.png",
        "--size",
        "8x8",
    ];
    done(&draw, home);
}
