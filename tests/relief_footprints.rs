//! Elements smaller than the repeat of their texture: each sends by the texels that it shows.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec2, DVec3, Vec3};
use mesolux::constants::NONE;
use mesolux::math::directions::Directions;
use mesolux::mesh::relief::MOST_FOOTPRINTS;
use mesolux::mesh::tiles::tiles;
use mesolux::meso::{Footprints, HeightField, Options, Response, Scattering, Transport};
use mesolux::passes::relief_visibility::ReliefVisibility;
use mesolux::solver::Settings;

const TEXELS: u32 = 24;

/// Bumps and grooves, steep enough to shadow each other.
fn bumps(x: f64, y: f64) -> f64 {
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    0.06 * wave(x) * wave(2.0 * y) + 0.03 * wave(3.0 * x + y)
}

/// A plate of `cells`² squares with one repeat of a relief over `repeat` units of its one.
fn plate(cells: u32, repeat: f64, height: impl Fn(f64, f64) -> f64) -> Build {
    let mut build = Build::new();
    let of = build.material(0.7, 0.0);
    build.scene.materials[of as usize].kd = [0.9, 0.6, 0.2];
    build.relief(of, TEXELS, height);
    let all = build.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (cells, cells), of);
    build.uv(all, DVec3::X * repeat, DVec3::Y * repeat);
    build
}

/// The parts of a plate: field, texture coordinates, response of the tile and of each footprint.
struct Parts {
    field: HeightField,
    uv: Vec<[DVec2; 3]>,
    footprints: Footprints,
    whole: Response,
    parts: Vec<Response>,
}

fn parts(build: &Build, directions: &Directions, most: usize) -> Parts {
    let elements = mesolux::mesh::elements::Elements::new(&build.scene);
    let (mut tiles, _) = tiles(&build.scene, &elements).expect("the relief is sound");
    let tile = tiles.pop().expect("the plate has one");
    let visibility = ReliefVisibility::new(&device())
        .and_then(|pass| pass.run(&tile.field))
        .expect("the device marches");
    let uv: Vec<[DVec2; 3]> = tile
        .members
        .iter()
        .map(|&e| build.scene.triangles[elements.input_index[e] as usize].uv)
        .map(|uv| uv.map(|p| DVec2::from_array(p.map(f64::from))))
        .collect();
    let footprints = Footprints::new(&tile.field, &uv, most);
    let (normals, reflectance) = (&tile.shading.normals, &tile.shading.reflectance);
    let scattering = Scattering::new(directions, &tile.field, &visibility, normals, reflectance);
    let whole = scattering.whole();
    let parts = scattering.of_footprints(&footprints, &whole);
    Parts {
        field: tile.field,
        uv,
        footprints,
        whole,
        parts,
    }
}

/// Light that a response sends for light from some directions, `[in][out]`.
fn sent(response: &Response) -> Vec<Vec3> {
    let from = Directions::new(64).expect("a number of the paper");
    (0..from.count())
        .flat_map(|slot| response.sent_from(from.centre(slot)))
        .collect()
}

/// Largest difference of two responses as a share of the largest entry.
fn difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    let largest = a.iter().map(|v| v.abs().max_element()).fold(0.0, f32::max);
    let apart = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element());
    apart.fold(0.0, f32::max) / largest
}

/// Sum of what the footprints send by the area of their elements in the texture.
fn by_area(of: &Parts) -> Vec<Vec3> {
    let parts: Vec<Vec<Vec3>> = of.parts.iter().map(sent).collect();
    let mut sum = vec![Vec3::ZERO; parts[0].len()];
    for (uv, &footprint) in of.uv.iter().zip(&of.footprints.of) {
        let area = 0.5 * (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]).abs() as f32;
        for (sum, of) in sum.iter_mut().zip(&parts[footprint as usize]) {
            *sum += area * *of;
        }
    }
    sum
}

/// An element that shows a tile or more has the response of the tile, to the bit.
#[test]
fn elements_of_a_tile_or_more_have_its_response() {
    // Squares of 2 × 2 repeats: triangles of two tiles.
    let build = plate(2, 0.25, bumps);
    let directions = Directions::new(32).expect("a number of the paper");
    let settings = Settings {
        relief: Options {
            directions,
            ..Options::default()
        },
        ..Settings::default()
    };
    let elements =
        mesolux::bake::elements(&device(), &build.scene, &settings).expect("the device marches");
    let relief = elements.relief.as_ref().expect("the plate has one");
    let of = parts(&build, &directions, MOST_FOOTPRINTS);
    assert_eq!(of.footprints.count(), 0);
    assert_eq!(relief.responses.len(), 1);
    assert_eq!(relief.responses[0].matrix, of.whole.matrix);
    // The tile's mean is a sum of 1,152 numbers in f32.
    assert!(relief.scale.iter().all(|s| s.distance(Vec3::ONE) < 1e-4));
    assert_silent();
}

/// The parts of a tile, by area, are the tile. Exactly so where no height shifts a facet aside;
/// else up to the rows being made to sum to 1, which allots a footprint a little more or less of
/// the facets at its rim: a facet is taken to lie at its centre, half a texel from its corners at
/// most, in footprints four texels wide.
#[test]
fn footprints_sum_to_their_tile() {
    let directions = Directions::new(16).expect("a number of the paper");
    for (name, height, most_apart) in [("nearly flat", 1e-4, 2e-4), ("bumps", 1.0, 0.05)] {
        let of = parts(
            &plate(6, 1.0, |x, y| height * bumps(x, y)),
            &directions,
            MOST_FOOTPRINTS,
        );
        assert_eq!((of.uv.len(), of.footprints.count()), (72, 72));
        let apart = difference(&sent(&of.whole), &by_area(&of));
        let spread = of
            .parts
            .iter()
            .map(|part| difference(&sent(&of.whole), &sent(part)))
            .fold(0.0, f32::max);
        println!(
            "{name}: the parts' mean differs from the tile by {apart:.1e}, a part by up to {spread:.1e}"
        );
        assert!(apart <= most_apart);
        // The parts of bumps are not alike, or the test would see nothing.
        assert!(height < 1.0 || spread > 0.5);
        // Under a sky of radiosity 1 facets that emit 1 − ρ send 1, and so does every part into
        // every slot.
        for part in of.parts.iter().chain([&of.whole]) {
            for slot in 0..directions.count() {
                let sent = part.send(&[Vec3::ONE])[slot];
                let kept = Vec3::new(0.9, 0.6, 0.2);
                let emitted = (Vec3::ONE - kept) * part.emission[slot];
                let whole = sent + emitted;
                assert!(
                    (whole - Vec3::ONE).abs().max_element() < FURNACE,
                    "{name} {slot}: {whole}"
                );
            }
        }
    }
    assert_silent();
}

/// Rounding of sums over 1,152 facets and 16 slots in f32, and bounces left out below 1e-6.
const FURNACE: f32 = 1e-4;
/// Rims of triangles two texels wide are sampled twice a texel: densities of the cells there are
/// off by some percent, up or down by chance.
const RIMS: f32 = 3e-3;

/// Triangles that show the same texels share a footprint, in whatever repeat they lie; too many are
/// joined by place.
#[test]
fn footprints_are_shared_and_bounded() {
    let directions = Directions::new(16).expect("a number of the paper");
    let repeated = parts(&plate(12, 0.5, bumps), &directions, MOST_FOOTPRINTS);
    assert_eq!(repeated.uv.len(), 288);
    assert_eq!(repeated.footprints.count(), 72);
    let joined = parts(&plate(12, 1.0, bumps), &directions, 50);
    assert!((25..=50).contains(&joined.footprints.count()));
    assert!(joined.footprints.of.iter().all(|&f| f != NONE));
    for f in 0..joined.footprints.count() {
        let shares = joined.footprints.shares(f);
        assert_eq!(shares.len(), joined.field.facet_count());
        let sum: f32 = shares.iter().sum();
        assert!((sum - 1.0).abs() < 1e-5);
    }
    // One alone is the whole plate, and the whole tile.
    let one = parts(&plate(12, 1.0, bumps), &directions, 1);
    assert_eq!(one.footprints.count(), 1);
    let apart = difference(&sent(&one.whole), &sent(&one.parts[0]));
    println!("a footprint of the whole tile differs from the tile by {apart:.1e}");
    assert!(apart < RIMS);
    assert_silent();
}

const CELLS: u32 = 8;

/// A closed room whose floor and one wall show one map each: E = 1 − ρ everywhere, so every element
/// sends 1 into every slot.
#[test]
fn furnace_of_elements_smaller_than_their_tile() {
    let mut build = Build::new();
    let mut material = |rho: f32| build.material(rho, (1.0 - rho) / std::f32::consts::PI);
    let [plain, floor, wall] = [0.5, 0.8, 0.6].map(&mut material);
    // Steep, rms slope 0.6: how a near and wide source's light is spread over the slots matters.
    build.relief(floor, TEXELS, bumps);
    build.relief(wall, TEXELS, |x, y| bumps(y, x));
    let sides = build.room(DVec3::ZERO, DVec3::ONE, CELLS, plain);
    for (side, material, u, v) in [
        (&sides[0], floor, DVec3::Z, DVec3::X),
        (&sides[2], wall, DVec3::Y, DVec3::Z),
    ] {
        for t in &mut build.scene.triangles[side.clone()] {
            t.material = material;
        }
        build.uv(side.clone(), u, v);
    }
    for (transport, k) in [
        (Transport::Physical, 16),
        (Transport::Physical, 64),
        (Transport::Paper, 16),
    ] {
        let solved = build.solve(&Settings {
            residual: 3e-4,
            relief: Options {
                transport,
                directions: Directions::new(k).expect("a number of the paper"),
                cache: None,
            },
            ..Settings::default()
        });
        let relief = solved.relief.as_ref().expect("it has one");
        let worst = |values: &[Vec3]| {
            let apart = values.iter().map(|b| (b.x - 1.0).abs());
            apart.fold(0.0, f32::max)
        };
        let mean = solved.mean(&solved.radiosity, 0..solved.area.len());
        let classes = &solved
            .report
            .relief
            .as_ref()
            .expect("there is relief")
            .classes;
        let footprints: usize = classes.iter().map(|c| c.footprints).sum();
        println!(
            "furnace, {footprints} footprints, {transport:?}, K = {k}: mean radiosity {mean:.4}, largest error {:.2} %, by slot {:.2} %",
            100.0 * worst(&solved.radiosity),
            100.0 * worst(&relief.exitant)
        );
        if transport == Transport::Physical {
            assert!(worst(&solved.radiosity) <= 0.02);
        }
    }
}
