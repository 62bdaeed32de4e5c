//! Height and normal maps: what is read, what is refused, what is told, and that they are written
//! out the same.

mod images;
mod materials;
mod written;

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use image::{DynamicImage, ImageBuffer, Luma, Rgb};
use mesolux::error::Result;
use mesolux::scene::{LoadOptions, Scene, load};
use tempfile::TempDir;

fn read(path: &Path) -> Result<Scene> {
    load(path.to_str().unwrap(), &LoadOptions::default())
}

fn grey16(width: u32, height: u32, code: impl Fn(u32, u32) -> u16) -> DynamicImage {
    ImageBuffer::from_fn(width, height, |x, y| Luma([code(x, y)])).into()
}

fn rgb8(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> DynamicImage {
    ImageBuffer::from_fn(width, height, |x, y| Rgb(texel(x, y))).into()
}

fn rgb_float(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> DynamicImage {
    ImageBuffer::from_fn(width, height, |x, y| Rgb(texel(x, y))).into()
}

/// A folder with images.
fn folder(images: &[(&str, &DynamicImage)]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, image) in images {
        image.save(dir.path().join(name)).unwrap();
    }
    dir
}

const SQUARE: &str = "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";

/// A square of 2 by 2 units under one tile, with a material of these lines.
fn square(dir: &TempDir, lines: &str) -> Result<Scene> {
    fs::write(dir.path().join("a.obj"), SQUARE).unwrap();
    let mtl = format!("newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n{lines}\n");
    fs::write(dir.path().join("a.mtl"), mtl).unwrap();
    read(&dir.path().join("a.obj"))
}

/// The same with a table of a scene file.
fn square_toml(dir: &TempDir, lines: &str) -> Result<Scene> {
    square(dir, "").unwrap();
    let toml = format!("[[mesh]]\nfile = 'a.obj'\n[material.m]\n{lines}\n");
    fs::write(dir.path().join("a.toml"), toml).unwrap();
    read(&dir.path().join("a.toml"))
}

fn ramp() -> DynamicImage {
    grey16(4, 2, |x, y| (x * 9_000 + y * 500) as u16)
}

/// A product of waves, and its normals for a tile of 2 by 2 units; signs turn the normals over.
fn waves(scale: f64, signs: [f64; 2]) -> (DynamicImage, DynamicImage) {
    let size = 64;
    let place = |x: u32, y: u32| {
        [
            (f64::from(x) + 0.5) / 64.0,
            1.0 - (f64::from(y) + 0.5) / 64.0,
        ]
    };
    let wave = |c: f64| (TAU * c + 0.3).sin();
    let slope = |c: f64| TAU * (TAU * c + 0.3).cos();
    let height = grey16(size, size, |x, y| {
        let [u, v] = place(x, y);
        ((0.5 + 0.25 * (wave(u) + wave(v))) * 65_535.0).round() as u16
    });
    let normal = rgb_float(size, size, |x, y| {
        let [u, v] = place(x, y);
        let n = glam::DVec3::new(
            -signs[0] * slope(u) * 0.25 * scale / 2.0,
            -signs[1] * slope(v) * 0.25 * scale / 2.0,
            1.0,
        )
        .normalize();
        ((n + 1.0) / 2.0).as_vec3().to_array()
    });
    (height, normal)
}
