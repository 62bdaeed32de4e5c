//! Lights that are written read back with the same bits, and count in the hash.

use std::sync::Arc;

use glam::DVec3;
use image::{ImageBuffer, Rgb};
use mesolux::scene::sky::{Dome, Panorama, Sky};
use mesolux::scene::{Lights, LoadOptions, Scene, Web, load, write_scene};
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::{good, read_in};

fn again(scene: &Scene) -> Scene {
    let dir = TempDir::new().unwrap();
    let path = write_scene(scene, dir.path()).unwrap();
    load(path.to_str().unwrap(), &LoadOptions::default()).unwrap()
}

#[test]
fn every_light_reads_back_the_same() {
    let dir = TempDir::new().unwrap();
    let of = |v: f64, h: f64| (10.0 - v / 30.0) * (1.0 + 0.1 * (h / 77.0).sin());
    let angles: Vec<f64> = (0..=9).map(|i| 10.0 * f64::from(i)).collect();
    let text = super::ies::file(1, &angles, &[0.0, 90.0, 180.0], of);
    std::fs::write(dir.path().join("a.ies"), text).unwrap();
    let texel = |x: u32, y: u32| Rgb([x as f32 / 7.0, y as f32 / 3.0, 0.1]);
    ImageBuffer::from_fn(14, 7, texel)
        .save(dir.path().join("p.exr"))
        .unwrap();
    let points = "[[point_light]]\nposition = [0, 2, 0]\nkelvin = 3000\nlumens = 100\n\
                  [[point_light]]\nname = 'a'\nposition = [1, 2, 0]\nies = 'a.ies'\n\
                  axis = [0.3, -1, 0.7]\nrotation = 33\n\
                  [[point_light]]\nposition = [1, 2, 0]\nwatts = 3\ntowards = [0.2, 0, 0.9]\n\
                  spot = { inner = 12.3, outer = 14.5 }\n\
                  [[sun]]\nelevation = 33\nazimuth = 44\nirradiance = 700\nkelvin = 5500\n";
    for sky in [
        "",
        "[sky]\nmodel = 'uniform'\nradiance = [1, 2, 3]\n",
        "[sky]\nmodel = 16\nlux = 100\nup = [1, 2, 3]\n",
        "[sky]\nmodel = 'cie clear'\nlux = 1e4\nsun = { elevation = 33, azimuth = 44, lux = 1 }\n",
        "[sky]\nmodel = 'perez'\ndirect = 300\ndiffuse = 120\n\
         sun = { elevation = 13, azimuth = 284 }\n",
        "[sky]\npicture = 'p.exr'\nazimuth = 12\nscale = [1, 2, 0.1]\n",
    ] {
        let scene = read_in(dir.path(), &format!("{points}{sky}")).unwrap();
        let read = again(&scene);
        assert_eq!(scene.lights, read.lights, "{sky}");
        assert_eq!(scene.hash(), read.hash());
        assert_eq!(again(&read).lights, read.lights);
    }
}

#[test]
fn webs_and_pictures_of_code_read_back_the_same() {
    let mut scene = good(
        "[[point_light]]\nposition = [0, 2, 0]\ncandela = 9\nspot = { outer = 40 }\n\
         [sky]\nmodel = 'uniform'\nradiance = 1\n",
    );
    for (rows, columns) in [(2, 1), (3, 2), (7, 5), (4, 1)] {
        let shares = (0..rows * columns).map(|i| 0.1 + i as f32 / 3.0).collect();
        let beam = scene.lights.points[0].beam.as_mut().unwrap();
        beam.web = Arc::new(Web {
            rows,
            columns,
            shares,
        });
        let sky: &mut Sky = scene.lights.sky.as_mut().unwrap();
        sky.dome = Dome::Picture(Arc::new(Panorama {
            width: rows,
            height: columns,
            texels: vec![[0.1, 0.2, rows as f32]; (rows * columns) as usize],
        }));
        assert_eq!(again(&scene).lights, scene.lights, "{rows} × {columns}");
    }
}

#[test]
fn every_light_counts_in_the_hash() {
    let tables = [
        "[[point_light]]\nposition = [0, 2, 0]\ncandela = 9\n",
        "[[point_light]]\nposition = [0, 2, 0]\ncandela = 9\nspot = { outer = 40 }\n",
        "[[point_light]]\nposition = [0, 2, 0]\ncandela = 9\nspot = { outer = 41 }\n",
        "[[point_light]]\nposition = [0, 2, 0]\ncandela = 9\nspot = { outer = 40 }\naxis = [1, 0, 0]",
        "[[sun]]\ntowards = [0, 1, 0]\nlux = 9\n",
        "[[sun]]\ntowards = [0, 1, 0]\nlux = 9\nangle = 2\n",
        "[[sun]]\ntowards = [0, 1, 1]\nlux = 9\n",
        "[sky]\nmodel = 'uniform'\nlux = 9\n",
        "[sky]\nmodel = 'uniform'\nlux = 10\n",
        "[sky]\nmodel = 'uniform'\nlux = 9\nup = [1, 0, 0]\n",
        "[sky]\nmodel = 1\nlux = 9\n",
        "[sky]\nmodel = 3\nlux = 9\n",
        "[sky]\nmodel = 12\nluminance = 9\nsun = { elevation = 20, azimuth = 0 }\n",
        "[sky]\nmodel = 12\nluminance = 9\nsun = { elevation = 21, azimuth = 0 }\n",
    ];
    let mut hashes: Vec<String> = tables.iter().map(|table| good(table).hash()).collect();
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), tables.len());
}

#[test]
fn scenes_without_new_lights_keep_their_hash() {
    let scene = good("[[point_light]]\nposition = [0, 2, 0]\nintensity = [1, 2, 3]\n");
    // The bytes as they were before there were suns and skies.
    let mut bytes = Vec::new();
    let length = |n: usize| (n as u64).to_le_bytes();
    let vector = |v: DVec3| v.to_array().map(f64::to_le_bytes).concat();
    bytes.extend(length(scene.vertices.len()));
    scene.vertices.iter().for_each(|&v| bytes.extend(vector(v)));
    bytes.extend(length(scene.triangles.len()));
    for t in &scene.triangles {
        bytes.extend(t.vertices.map(u32::to_le_bytes).concat());
        bytes.extend(t.uv.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
        bytes.extend(t.material.to_le_bytes());
    }
    bytes.extend(length(scene.materials.len()));
    for material in &scene.materials {
        let colours = material.kd.iter().chain(&material.ke);
        bytes.extend(colours.flat_map(|c| c.to_le_bytes()));
        bytes.extend(length(0));
    }
    bytes.extend(length(1));
    let Lights { points, .. } = &scene.lights;
    bytes.extend(vector(points[0].position));
    bytes.extend(points[0].intensity.iter().flat_map(|c| c.to_le_bytes()));
    let digest: String = Sha256::digest(&bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    assert_eq!(scene.hash(), digest);
}
