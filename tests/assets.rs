//! The scenes in `assets/` are what their commands write, and light arrives in them.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use common::{assert_silent, device};
use mesolux::bake::bake;
use mesolux::bake::quality::Quality;
use mesolux::scene::{LoadOptions, load, write_scene};
use mesolux::solver::StopReason;

/// Names, and the elements of those that are made in any number.
const ASSETS: [(&str, Option<usize>); 7] = [
    ("cornell-box", None),
    ("brick-wall", None),
    ("woven-cloth", None),
    ("embossed-plate", None),
    ("fruit-platter", Some(6_000)),
    ("bowl-and-bunny", Some(6_000)),
    ("cornell-relief", Some(8_000)),
];

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("assets")
        .join(name)
}

/// Files of a folder with their content, without scripts of the window.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_none_or(|ending| ending != "txt"))
        .map(|path| {
            let name = path.file_name().expect("a file has a name");
            let content = fs::read(&path).expect("the file can be read");
            (name.to_string_lossy().into_owned(), content)
        })
        .collect()
}

#[test]
fn assets_are_what_their_commands_write() {
    for (name, patches) in ASSETS {
        let options = LoadOptions {
            patches,
            ..LoadOptions::default()
        };
        let scene = load(name, &options).expect("it is built in");
        let written = tempfile::tempdir().expect("a folder for the test");
        write_scene(&scene, written.path()).expect("it is written");
        let (kept, now) = (files(&folder(name)), files(written.path()));
        let names = |of: &BTreeMap<String, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&kept), names(&now), "{name}");
        for (file, content) in &kept {
            assert!(*content == now[file], "assets/{name}/{file} is another one");
        }
    }
}

#[test]
fn light_arrives_in_the_assets() {
    for (name, _) in ASSETS {
        let path = folder(name).join("scene.toml");
        let path = path.to_str().expect("the path is a text");
        let scene = load(path, &LoadOptions::default()).expect("it is read");
        assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
        assert_eq!(scene.cameras.len(), 1, "{name}");
        let settings = Quality::Preview.settings();
        let baked = bake(&device(), &scene, &settings, |_| true).expect("it is baked");
        assert_eq!(baked.report.stop, StopReason::Residual, "{name}");
        let area: f64 = baked.area.iter().sum();
        let lit = baked.area.iter().zip(&baked.irradiance);
        let mean = lit
            .map(|(area, light)| area * f64::from(light.element_sum()) / 3.0)
            .sum::<f64>()
            / area;
        println!(
            "{name}: {} triangles, mean irradiance {mean:.3}",
            scene.triangles.len()
        );
        assert!(
            baked.irradiance.iter().all(|light| light.is_finite()),
            "{name}"
        );
        assert!((0.1..20.0).contains(&mean), "{name}: {mean}");
        let relief = name != "cornell-box";
        assert_eq!(baked.relief.is_some(), relief, "{name}");
    }
    assert_silent();
}
