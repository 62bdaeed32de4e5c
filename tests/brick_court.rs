//! The built-in court in raking sun: exact counts, no hole and no back in sight, files that read
//! back the same.

use glam::DVec3;
use mesolux::math::random;
use mesolux::scene::{LoadOptions, Scene, load, write_scene};

const NAME: &str = "brick-court";
const LEAST: usize = 6_000;

fn built(patches: Option<usize>) -> Scene {
    let options = LoadOptions {
        patches,
        ..LoadOptions::default()
    };
    load(NAME, &options).unwrap()
}

#[test]
fn the_counts_are_exact() {
    for patches in [LEAST, LEAST + 1, 9_999, 17_778, 60_000] {
        let scene = built(Some(patches));
        assert_eq!(scene.triangles.len(), patches);
        assert_eq!(scene.dropped_degenerate, 0);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
    let scene = built(None);
    assert_eq!(scene.triangles.len(), 60_000);
    assert_eq!(scene.hash(), built(Some(60_000)).hash());
    assert_eq!((scene.lights.points.len(), scene.lights.suns.len()), (0, 1));
    assert!(scene.lights.sky.is_some());
    assert!(scene.materials.iter().all(|m| !m.emits()));
    let options = LoadOptions {
        patches: Some(LEAST - 1),
        ..LoadOptions::default()
    };
    let error = load(NAME, &options).unwrap_err().to_string();
    assert!(error.contains(NAME) && error.contains("6000"), "{error}");
}

#[test]
fn there_is_no_statue_to_replace() {
    let options = LoadOptions {
        statue: Some("bunny.obj".into()),
        ..LoadOptions::default()
    };
    let error = load(NAME, &options).unwrap_err().to_string();
    assert!(error.contains(NAME) && error.contains("statue"), "{error}");
}

/// The distance along a ray to a triangle and whether its front is met (Möller and Trumbore 1997).
fn met(from: DVec3, along: DVec3, [a, b, c]: [DVec3; 3]) -> Option<(f64, bool)> {
    let (u, v) = (b - a, c - a);
    let cross = along.cross(v);
    let det = u.dot(cross);
    let (s, turned) = (from - a, (from - a).cross(u));
    let [p, q, t] = [s.dot(cross), along.dot(turned), v.dot(turned)].map(|x| x / det);
    (p >= 0.0 && q >= 0.0 && p + q <= 1.0 && t > 0.0).then_some((t, det > 0.0))
}

/// Rays from places in the open court meet fronts alone, and those that go down always meet one.
#[test]
fn no_back_and_no_hole_is_in_sight() {
    let scene = built(Some(LEAST));
    let mut state = 0x6272_6963_6b21;
    let mut unit = || random::unit(&mut state);
    let mut fronts = 0;
    for _ in 0..20_000 {
        // In front of the plinth and the steps and above the jars; within the walls.
        let from = DVec3::new(
            -4.4 + 7.3 * unit(),
            0.95 + 1.5 * unit(),
            1.35 + 2.2 * unit(),
        );
        let along = loop {
            let p = DVec3::new(unit(), unit(), unit()) * 2.0 - 1.0;
            if (0.01..1.0).contains(&p.length_squared()) {
                break p.normalize();
            }
        };
        let hits = scene
            .triangles
            .iter()
            .filter_map(|t| met(from, along, scene.corners(t)));
        match hits.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((distance, front)) => {
                let at = from + distance * along;
                assert!(front, "from {from} the back at {at} is seen");
                fronts += 1;
            }
            // Beyond the ends of the pavement.
            None => {
                let ground = from - along * (from.y / along.y);
                let open = ground.x < -8.0 || ground.z > 9.0 || (ground.x > 2.97 && ground.z > 3.6);
                assert!(along.y > 0.0 || open, "nothing is met at {ground}");
            }
        }
    }
    println!("{fronts} of 20,000 rays meet a front");
    assert!(fronts > 8_000, "{fronts}");
}

/// The maps are made by code, and are written as files.
#[test]
fn it_reads_back_the_same() {
    let scene = built(Some(LEAST));
    let dir = tempfile::tempdir().unwrap();
    let path = write_scene(&scene, dir.path()).unwrap();
    let again = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(scene.hash(), again.hash());
    assert!(again.notes.is_empty(), "{:?}", again.notes);
}

/// The relief is as steep as masonry is, and an element is a few texels long.
#[test]
fn the_relief_is_that_of_masonry() {
    let scene = built(None);
    let tiles = [
        ("brick", 1.8, 0.9),
        ("paving", 2.4, 1.2),
        ("door", 1.0, 1.0),
    ];
    for (name, wide, high) in tiles {
        let material = scene.materials.iter().find(|m| m.name == name).unwrap();
        let map = material.map_height.as_deref().unwrap();
        let (width, height) = (map.width, map.height);
        let at = |i: u32, j: u32| f64::from(map.values[(j % height * width + i % width) as usize]);
        let steps = [wide / f64::from(width), high / f64::from(height)];
        let slopes = |i: u32, j: u32| {
            [at(i + 1, j) - at(i, j), at(i, j + 1) - at(i, j)]
                .into_iter()
                .zip(steps)
                .map(|(rise, step)| (f64::from(material.height_scale) * rise / step).powi(2))
                .sum::<f64>()
        };
        let mean = |of: &mut dyn Iterator<Item = f64>| {
            let (sum, n) = of.fold((0.0, 0.0), |(sum, n), x| (sum + x, n + 1.0));
            (sum / n).sqrt()
        };
        let all = mean(
            &mut (0..height)
                .flat_map(|j| (0..width).map(move |i| (i, j)))
                .map(|(i, j)| slopes(i, j)),
        );
        // Where the map meets its own repeat it is no steeper than elsewhere.
        let seams = (0..height)
            .map(|j| (width - 1, j))
            .chain((0..width).map(|i| (i, height - 1)));
        let seam = mean(&mut seams.map(|(i, j)| slopes(i, j)));
        println!(
            "{name}: {:.1} mm, rms slope {all:.3}, {seam:.3} at the seam",
            1e3 * material.height_scale
        );
        assert!((0.1..1.0).contains(&all), "{name}: {all}");
        assert!(seam < 2.5 * all, "{name}: {seam}");
    }
}
