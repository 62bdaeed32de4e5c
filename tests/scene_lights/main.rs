//! Lights of scene files: what they mean, what is refused, and that they read back as written.

mod bad;
mod ies;
mod tables;
mod written;

use std::fs;
use std::path::Path;

use mesolux::scene::{LoadOptions, Scene, load};
use tempfile::TempDir;

/// A black square of 8 × 8 that faces up.
const FLOOR: &str = "v -4 0 -4\nv -4 0 4\nv 4 0 4\nv 4 0 -4\nf 1 2 3 4\n";

/// The square with these tables.
fn read_in(dir: &Path, tables: &str) -> mesolux::error::Result<Scene> {
    fs::write(dir.join("floor.obj"), FLOOR).unwrap();
    let text = format!("[[mesh]]\nfile = 'floor.obj'\nsides = 'as given'\n{tables}");
    let path = dir.join("a.toml");
    fs::write(&path, text).unwrap();
    load(path.to_str().unwrap(), &LoadOptions::default())
}

fn good(tables: &str) -> Scene {
    read_in(TempDir::new().unwrap().path(), tables).unwrap_or_else(|e| panic!("{tables}: {e}"))
}

/// Files beside the scene, then the tables.
fn good_with(files: &[(&str, &str)], tables: &str) -> Scene {
    let dir = TempDir::new().unwrap();
    for (name, text) in files {
        fs::write(dir.path().join(name), text).unwrap();
    }
    read_in(dir.path(), tables).unwrap_or_else(|e| panic!("{tables}: {e}"))
}

fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

fn wide(rgb: [f32; 3]) -> [f64; 3] {
    rgb.map(f64::from)
}

/// Whether two numbers agree to a part of the second.
#[track_caller]
fn near(found: f64, exact: f64, part: f64) {
    assert!(
        (found - exact).abs() <= part * exact.abs(),
        "{found} is not {exact}"
    );
}
