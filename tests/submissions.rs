//! Submissions come in parts, since drivers end what takes them more than 2 s. How long the longest
//! of each kind takes is printed; that they are many enough is asserted.

mod common;

use common::{assert_silent, device, own_device};
use mesolux::bake::{solution, solve};
use mesolux::render::{Cuts, Lighting, Renderer, SAMPLES, Show, View};
use mesolux::scene::{LoadOptions, Scene, load};
use mesolux::solver::Settings;

/// Elements times sources of a part that makes rows, at most.
const PAIRS: u64 = 1 << 17;

/// Samples along a side of a tile of a picture, at most.
const TILE: u32 = 256;

fn loaded(name: &str, patches: Option<usize>) -> Scene {
    let options = LoadOptions {
        patches,
        ..LoadOptions::default()
    };
    load(name, &options).expect("it is built in")
}

/// Light, and parts that make rows.
fn solved(name: &str, patches: Option<usize>, part_pairs: Option<u64>) -> (Vec<u32>, usize) {
    let device = own_device();
    device.time_parts();
    let scene = loaded(name, patches);
    let settings = Settings {
        shots: Some(40),
        ..Settings::default()
    };
    let settings = Settings {
        part_pairs: part_pairs.unwrap_or(settings.part_pairs),
        ..settings
    };
    let solver = solve(&device, &scene, &settings, None, |_| true).expect("it is solved");
    let light = solver.light().expect("it comes back");
    let mut all = light.irradiance;
    all.extend(light.irradiance_direct);
    all.extend(light.radiosity);
    if let Some(relief) = light.relief {
        all.extend(relief.moments.iter().flatten());
        all.extend(relief.exitant);
    }
    let words = all.iter().flat_map(|v| v.to_array()).map(f32::to_bits);
    let parts = device.timed_parts();
    let of_rows = parts.0.get("make rows").map_or(0, |part| part.0);
    (words.collect(), of_rows as usize)
}

/// A row whose elements are more than a part finds is cut, in a scene with emitters that are looked
/// at by rays, and in one with relief, a sun and a sky.
#[test]
fn the_size_of_parts_changes_no_light() {
    for (name, patches) in [("cornell", Some(6000)), ("brick-wall", None)] {
        let (whole, few) = solved(name, patches, None);
        let (cut, many) = solved(name, patches, Some(500));
        println!("{name}: {few} and {many} parts");
        assert!(many > 10 * few, "{name}: {few} and {many} parts");
        let other = whole.iter().zip(&cut).filter(|(a, b)| a != b).count();
        assert_eq!(other, 0, "of {} numbers of {name}", whole.len());
    }
    assert_silent();
}

/// A tile draws only what reaches into it, and is cut where that is much: the picture stays, of
/// plain triangles, of relief and of what counts its fragments.
#[test]
fn the_cuts_of_draws_change_no_picture() {
    let scene = loaded("cornell-relief", Some(8000));
    let device = own_device();
    device.time_parts();
    let solver = solve(&device, &scene, &Settings::default(), None, |_| true).expect("solved");
    let solution = solution(&scene, &solver).expect("it comes back");
    let view = View {
        camera: &scene.cameras[0],
        width: 320,
        height: 200,
    };
    for show in [Show::Shaded, Show::Overdraw] {
        let lighting = Lighting {
            show,
            ..Lighting::from(&solution)
        };
        let mut renderer =
            Renderer::new(&device, &scene, lighting, &view, SAMPLES).expect("a view");
        let mut picture = |cuts| {
            renderer.cuts = cuts;
            device.time_parts();
            let picture = renderer.picture().expect("it is drawn");
            let bits: Vec<[u32; 3]> = picture
                .radiance
                .iter()
                .map(|rgb| rgb.map(f32::to_bits))
                .collect();
            (bits, device.timed_parts().0["shade"].0, renderer.drawn())
        };
        let cuts = Cuts::default();
        let (whole, few, [_, all]) = picture(Cuts {
            by_tile: false,
            ..cuts
        });
        let (by_tile, same, [drawn, _]) = picture(cuts);
        let (cut, many, _) = picture(Cuts {
            part_triangles: 300,
            ..cuts
        });
        println!("{drawn} of {all} triangles, {few} and {many} parts");
        assert!(drawn < all / 4, "{drawn} of {all}");
        // The first time something is uploaded too.
        assert!(same <= few && many > 2 * few, "{few}, {same}, {many}");
        assert!(whole == by_tile, "another picture by tile");
        assert!(whole == cut, "another picture in parts");
    }
    assert_silent();
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn what_is_submitted_comes_in_parts() {
    for (name, patches, shots) in [
        ("cornell", 100_000, None),
        ("cornell-relief", 40_000, None),
        // Emitters, which take longest, and some others.
        ("cornell", 1_000_000, Some(50)),
    ] {
        let device = device();
        let scene = loaded(name, Some(patches));
        device.time_parts();
        let settings = Settings {
            residual: 0.05,
            shots,
            ..Settings::default()
        };
        let solver = solve(&device, &scene, &settings, None, |_| true).expect("it is solved");
        let solution = solution(&scene, &solver).expect("it comes back");
        let view = View {
            camera: &scene.cameras[0],
            width: 640,
            height: 480,
        };
        let lighting = Lighting::from(&solution);
        let renderer = Renderer::new(&device, &scene, lighting, &view, SAMPLES).expect("a view");
        renderer.picture().expect("it is drawn");
        let [drawn, of] = renderer.drawn();
        let mut parts: Vec<_> = device.timed_parts().0.into_iter().collect();
        parts.sort_by_key(|(_, (_, longest))| std::cmp::Reverse(*longest));
        println!(
            "{name}, {patches} elements, {} sources; tiles draw {drawn} of {of} triangles",
            solver.report().sources
        );
        for (name, (count, longest)) in parts.iter().take(12) {
            println!("  {name}: {count}, {:.3} s at most", longest.as_secs_f64());
        }
        let count = |name: &str| {
            parts
                .iter()
                .find(|part| part.0 == name)
                .map_or(0, |p| p.1.0)
        };
        let least = solver.report().kept_sources * patches as u64 / PAIRS;
        assert!(count("make rows") >= least, "{least}");
        let [across, down] = [view.width, view.height].map(|side| (side * SAMPLES).div_ceil(TILE));
        let tiles = u64::from(across * down);
        assert!(count("shade") >= tiles, "{tiles} tiles");
    }
    assert_silent();
}
