//! Alpha masks of files: what is cut out, and the light that comes through.

mod common;

use std::fmt::Write;
use std::path::Path;

use common::{Build, assert_silent};
use glam::DVec3;
use image::{GrayImage, Luma, Rgba, RgbaImage};
use mesolux::error::Result;
use mesolux::scene::{ImportOptions, LoadOptions, Scene, load};
use mesolux::solver::Settings;
use tempfile::TempDir;

/// A parallelogram as OBJ, of n cells a side, with coordinates 0..1.
fn quad(text: &mut String, first: &mut u32, corner: DVec3, u: DVec3, v: DVec3, n: u32) {
    for j in 0..=n {
        for i in 0..=n {
            let [s, t] = [i, j].map(|k| f64::from(k) / f64::from(n));
            let p = corner + u * s + v * t;
            writeln!(text, "v {} {} {}\nvt {s} {t}", p.x, p.y, p.z).unwrap();
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = *first + j * (n + 1) + i;
            let [a, b, c, d] = [a, a + 1, a + n + 2, a + n + 1].map(|v| format!("{v}/{v}"));
            writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").unwrap();
        }
    }
    *first += (n + 1) * (n + 1);
}

/// A floor, a lamp above it, and plates of a material in between.
fn scene(dir: &Path, plates: &[[f64; 2]], mtl: &str) -> Result<Scene> {
    let (mut text, mut first) = (String::from("mtllib a.mtl\n"), 1);
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    text += "usemtl floor\n";
    quad(&mut text, &mut first, -x - z, 2.0 * z, 2.0 * x, 24);
    text += "usemtl lamp\n";
    quad(
        &mut text,
        &mut first,
        y - 0.2 * (x + z),
        0.4 * x,
        0.4 * z,
        2,
    );
    text += "usemtl plate\n";
    for &[from, to] in plates {
        let corner = 0.4 * y + (2.0 * from - 1.0) * 0.4 * x - 0.4 * z;
        let across = 0.8 * (to - from) * x;
        quad(&mut text, &mut first, corner, 0.8 * z, across, 1);
    }
    std::fs::write(dir.join("a.obj"), text).unwrap();
    let materials = format!(
        "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 4 4 4\nnewmtl plate\nKd 0 0 0\n{mtl}"
    );
    std::fs::write(dir.join("a.mtl"), materials).unwrap();
    let options = LoadOptions {
        import: ImportOptions {
            sides_as_given: true,
            ..ImportOptions::default()
        },
        ..LoadOptions::default()
    };
    load(dir.join("a.obj").to_str().unwrap(), &options)
}

const STRIPES: [[f64; 2]; 2] = [[0.125, 0.375], [0.5, 0.875]];

/// Whether stripes hold a place; they lie along v, since u runs along z.
fn is_plate(v: u32, side: u32) -> bool {
    let at = (f64::from(v) + 0.5) / f64::from(side);
    STRIPES.iter().any(|[from, to]| (from..to).contains(&&at))
}

fn folder() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    // The image's rows run down.
    let mask = GrayImage::from_fn(64, 64, |_, y| Luma([255 * u8::from(is_plate(63 - y, 64))]));
    mask.save(dir.path().join("mask.png")).unwrap();
    let leaf = RgbaImage::from_fn(64, 64, |_, y| {
        Rgba([255, 255, 255, 255 * u8::from(is_plate(63 - y, 64))])
    });
    leaf.save(dir.path().join("leaf.png")).unwrap();
    dir
}

fn area(scene: &Scene, material: &str) -> f64 {
    let of = |t: &&mesolux::scene::Triangle| scene.materials[t.material as usize].name == material;
    let areas = scene.triangles.iter().filter(of).map(|t| {
        let [a, b, c] = scene.corners(t);
        0.5 * (b - a).cross(c - a).length()
    });
    areas.sum()
}

/// Of the irradiance of the floor: rms, and of its mean. Measured: 0, to the bit.
const SAME_LIGHT: [f64; 2] = [1e-4, 1e-4];

#[test]
fn light_comes_through_as_past_plain_plates() {
    let dir = folder();
    let [masked, plain, none] = [
        scene(dir.path(), &[[0.0, 1.0]], "map_d mask.png\n").unwrap(),
        scene(dir.path(), &STRIPES, "").unwrap(),
        scene(dir.path(), &[], "").unwrap(),
    ];
    let triangles = masked.triangles.len();
    assert!(
        triangles < plain.triangles.len() + 16,
        "{triangles} triangles"
    );
    let light = [masked, plain, none].map(|scene| {
        let floor = 0..2 * 24 * 24;
        let solved = Build::of(scene).solve(&Settings::default());
        let values: Vec<f64> = floor.map(|e| f64::from(solved.irradiance[e].x)).collect();
        values
    });
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let [masked, plain, none] = &light;
    let squares: Vec<f64> = masked
        .iter()
        .zip(plain)
        .map(|(a, b)| (a - b).powi(2))
        .collect();
    let rms = mean(&squares).sqrt() / mean(plain);
    let off = (mean(masked) / mean(plain) - 1.0).abs();
    println!(
        "rms {rms:.1e}, mean {off:.1e}, of {:.3}",
        mean(plain) / mean(none)
    );
    assert!(rms <= SAME_LIGHT[0] && off <= SAME_LIGHT[1]);
    assert!(mean(plain) < 0.8 * mean(none), "the plates cast shadows");
    assert_silent();
}

#[test]
fn mtl_and_scene_files_name_masks() {
    let dir = folder();
    let exact = 0.8 * 0.8 * 0.625;
    let whole = [[0.0, 1.0]];
    for mtl in [
        "map_d mask.png\n",
        "map_d -imfchan r mask.png\n",
        "map_d leaf.png\n",
        // As Blender writes it.
        "map_Kd leaf.png\nmap_d leaf.png\n",
        "map_d -s 1 0.5 mask.png\n",
    ] {
        let found = scene(dir.path(), &whole, mtl).unwrap();
        let exact = if mtl.contains("-s") {
            // The lower half of the picture.
            0.8 * 0.8 * 2.0 * 0.25
        } else {
            exact
        };
        let off = (area(&found, "plate") / exact - 1.0).abs();
        assert!(off < 1e-6, "{mtl}: {off}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        assert!(
            found
                .notes
                .iter()
                .any(|n| n.contains("\"plate\": its alpha mask"))
        );
        assert!(found.materials.iter().all(|m| m.alpha_mask.is_none()));
    }
    // An opaque alpha channel of the base colour's own texture is no luminance.
    let black = RgbaImage::from_pixel(4, 4, Rgba([0, 0, 0, 255]));
    black.save(dir.path().join("black.png")).unwrap();
    let found = scene(dir.path(), &whole, "map_Kd black.png\nmap_d black.png\n").unwrap();
    assert!((area(&found, "plate") / 0.64 - 1.0).abs() < 1e-12);

    scene(dir.path(), &whole, "").unwrap();
    let read = |material: &str| {
        let text = format!("[[mesh]]\nfile = \"a.obj\"\n[material.plate]\n{material}\n");
        let path = dir.path().join("scene.toml");
        std::fs::write(&path, text).unwrap();
        load(path.to_str().unwrap(), &LoadOptions::default())
    };
    let found = read("alpha_mask = \"mask.png\"").unwrap();
    assert!((area(&found, "plate") / exact - 1.0).abs() < 1e-6);
    for (material, words) in [
        ("alpha_cutoff = 0.5", "alpha_cutoff needs an alpha_mask"),
        (
            "alpha_mask = \"mask.png\"\nalpha_cutoff = nan",
            "alpha cutoff NaN must be in 0..=1",
        ),
        ("alpha_mask = \"none.png\"", "none.png"),
    ] {
        let refused = read(material).expect_err(material).to_string();
        let is_good = refused.contains(words) && refused.lines().count() == 1;
        assert!(is_good, "{refused}");
    }
}
