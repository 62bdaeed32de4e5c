//! One function for each kind of file that Mesolux reads: reads bytes as such a file. It may refuse
//! them; it must not panic, hang or take memory beyond measure.
//!
//! `scripts/fuzz` runs them under libFuzzer, tests/fuzz_corpus.rs on what is kept in `corpus`.

use std::fs;
use std::path::Path;

use mesolux::bake::solution::{About, Bake};
use mesolux::export::{probes, sensors};
use mesolux::mesh::elements::Elements;
use mesolux::picture::Picture;
use mesolux::scene::ies::Luminaire;
use mesolux::scene::{self, HeightMap, LoadOptions, NormalMap, Texture};
use mesolux::solver::{Checkpoints, Visibility};
use tempfile::TempDir;

const OBJ: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n\
    usemtl lamp\nf 1/1 2/2 3/3\nusemtl wall\nf 1/1 3/3 4/2\n";
const MTL: &[u8] = b"newmtl lamp\nKd 0.1 0.2 0.3\nKe 1 2 3\nnewmtl wall\nKd 0.5 0.5 0.5\n";
/// An 8 × 8 grey ramp.
const MAP: &[u8] = include_bytes!("../corpus/image/ramp.png");
const LAMP: &[u8] = include_bytes!("../corpus/ies/ring.ies");

/// What lies beside the file that is read, by name.
const FILES: [(&str, &[u8]); 4] = [
    ("a.obj", OBJ),
    ("a.mtl", MTL),
    ("a.png", MAP),
    ("a.ies", LAMP),
];

/// A folder with [`FILES`], kept for the process: a run writes one of them again.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        FILES
            .iter()
            .for_each(|(name, bytes)| folder.write(name, bytes));
        folder
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.0.path().join(name), bytes).expect("written");
    }
}

thread_local! {
    static FOLDER: Folder = Folder::new();
}

/// Writes the bytes under a name, gives the path to `read`, and puts back what was there.
fn with(name: &str, bytes: &[u8], read: impl Fn(&Path)) {
    FOLDER.with(|folder| {
        folder.write(name, bytes);
        read(&folder.0.path().join(name));
        if let Some((_, before)) = FILES.iter().find(|(of, _)| *of == name) {
            folder.write(name, before);
        }
    });
}

/// Reads a scene and makes its elements.
fn load(path: &Path) {
    let path = path.to_str().expect("a path in UTF-8");
    if let Ok(scene) = scene::load(path, &LoadOptions::default()) {
        let _ = scene.hash();
        Elements::new(&scene);
    }
}

/// A mesh beside a material library.
pub fn obj(bytes: &[u8]) {
    with("a.obj", bytes, load);
}

/// A material library beside its mesh and a map.
pub fn mtl(bytes: &[u8]) {
    with("a.mtl", bytes, |path| load(&path.with_extension("obj")));
}

/// A scene beside a mesh, a map and a lamp.
pub fn scene_toml(bytes: &[u8]) {
    with("a.toml", bytes, load);
}

/// glTF as text or binary.
pub fn gltf(bytes: &[u8]) {
    let name = match bytes.starts_with(b"glTF") {
        true => "a.glb",
        false => "a.gltf",
    };
    with(name, bytes, load);
}

/// An image, as each kind of map and as a picture.
pub fn image(bytes: &[u8]) {
    let name = match bytes {
        [0x76, ..] => "a.exr",
        [b'#', ..] => "a.hdr",
        [0xff, ..] => "a.jpg",
        _ => "a.png",
    };
    with(name, bytes, |path| {
        let _ = Texture::load(path);
        let _ = HeightMap::load(path);
        let _ = NormalMap::load(path);
        let _ = Picture::read(path);
    });
}

/// A luminaire.
pub fn ies(bytes: &[u8]) {
    with("a.ies", bytes, |path| {
        if let Ok(lamp) = Luminaire::read(path) {
            lamp.lumens();
        }
    });
}

/// Points of sensors and probes.
pub fn points(bytes: &[u8]) {
    with("a.pts", bytes, |path| {
        let _ = sensors::read_points(path);
        let _ = probes::read_positions(path);
    });
}

/// A bake.
pub fn bake(bytes: &[u8]) {
    with("a.safetensors", bytes, |path| {
        let _ = Bake::load(path);
        let _ = About::load(path);
    });
}

/// Kept form factors.
pub fn visibility(bytes: &[u8]) {
    with("a.visibility", bytes, |path| {
        let _ = Visibility::load(path);
    });
}

/// A part of a checkpoint.
pub fn checkpoint(bytes: &[u8]) {
    with("0000.rows", bytes, |path| {
        let _ = Checkpoints::read_part(path, [1 << 10, 1 << 10]);
    });
}
