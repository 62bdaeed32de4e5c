//! Views of relief for those who look for faults: slots, overdraw.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::bake::bake;
use mesolux::bake::solution::Solution;
use mesolux::math::directions::Directions;
use mesolux::meso::Options;
use mesolux::render::{Lighting, Renderer, SAMPLES, Show, View, render, slot_colour};
use mesolux::scene::{Camera, Scene, Sun};
use mesolux::solver::Settings;

/// Scene units from the lowest to the highest of the plates.
const HEIGHT: f64 = 1e-3;

/// Two plates with a hardly visible relief, one above the other, and a lamp aside.
fn plates() -> Scene {
    let mut build = Build::new();
    let lamp = build.material(0.0, 10.0);
    let plate = build.material(0.5, 0.0);
    build.relief(plate, 16, |x, y| {
        HEIGHT * (x * (1.0 - x) * y * (1.0 - y) * 16.0)
    });
    let (u, v) = (DVec3::Z, DVec3::X);
    for y in [0.0, -0.25] {
        let cells = build.quad(DVec3::new(-1.0, y, -1.0), 2.0 * u, 2.0 * v, (4, 4), plate);
        build.uv(cells, u, v);
    }
    build.quad(DVec3::new(1.5, 0.2, -0.5), u, DVec3::Y, (1, 1), lamp);
    build.0.scene
}

/// Straight above the middle of the plates, which fill its frame.
fn above() -> Camera {
    Camera {
        name: "above".into(),
        position: DVec3::new(0.03, 1.0, 0.07),
        look_at: DVec3::new(0.03, 0.0, 0.07),
        up: DVec3::X,
        fov_y: 40.0,
    }
}

fn baked(scene: &Scene) -> Solution {
    let settings = Settings {
        hemicube: 32,
        shots: Some(4),
        relief: Options {
            directions: Directions::new(16).expect("a number of the paper"),
            ..Options::default()
        },
        ..Settings::default()
    };
    bake(&device(), scene, &settings, |_| true).expect("the device solves the scene")
}

fn view(camera: &Camera) -> View<'_> {
    View {
        camera,
        width: 40,
        height: 40,
    }
}

/// A ray leaves one prism of each plate, or two where it passes from one to the next: through seams
/// of 7 units' length for a unit of area (lines every half unit along both sides, and diagonals),
/// into whose breadth the prism's height is foreshortened by half the field of view's diagonal at
/// most.
#[test]
fn overdraw_counts_all_layers() {
    let most_twice = 2.0 * 7.0 * 1.1 * HEIGHT * (20.0_f64.to_radians().tan() * 2.0_f64.sqrt());
    let scene = plates();
    let solution = baked(&scene);
    let camera = above();
    let lighting = Lighting {
        show: Show::Overdraw,
        ..Lighting::from(&solution)
    };
    let renderer =
        Renderer::new(&device(), &scene, lighting, &view(&camera), SAMPLES).expect("a renderer");
    let counts = renderer.overdraw().expect("counts");
    let least = counts.fragments.iter().copied().fold(f32::MAX, f32::min);
    let mean = counts.fragments.iter().map(|&f| f64::from(f)).sum::<f64>() / 1600.0;
    println!("{least} fragments at least, {mean} in the mean, {most_twice} may be seen twice");
    assert!(least >= 2.0);
    assert!(mean <= 2.0 + most_twice);
    for (steps, fragments) in counts.steps.iter().zip(&counts.fragments) {
        assert!(steps >= fragments, "{steps} steps of {fragments} fragments");
    }
    assert_eq!(counts.top(), counts.top().log2().round().exp2());
    let picture = renderer.picture().expect("a picture");
    assert_eq!((picture.width, picture.height), (40, 40));
    assert_silent();
}

#[test]
fn slots_have_one_colour_a_triangle() {
    // f32 in the mean of 16 samples.
    const ROUNDING: f32 = 1e-5;
    // Pixels that a seam crosses: lines every half unit, and diagonals, over 0.73 units in 40
    // pixels.
    const MIXED: usize = 1600 / 5;
    let scene = plates();
    let solution = baked(&scene);
    let light = solution.relief.as_ref().expect("the plates have a relief");
    let directions = Directions::new(16).expect("a number of the paper");
    let colours: Vec<Vec3> = light
        .incident_moment
        .chunks(16)
        .map(|moments| slot_colour(&directions, moments))
        .collect();
    assert!(colours.iter().any(|c| c.max_element() > 0.0));
    let lighting = Lighting {
        show: Show::Slots,
        ..Lighting::from(&solution)
    };
    let camera = above();
    let picture = render(&device(), &scene, lighting, &view(&camera)).expect("a picture");
    let unknown = picture
        .radiance
        .iter()
        .filter(|p| {
            let near = |c: &&Vec3| c.distance(Vec3::from(**p)) < ROUNDING;
            colours.iter().find(near).is_none()
        })
        .count();
    println!("{unknown} of 1600 pixels lie on seams");
    assert!(unknown <= MIXED);
    assert_silent();
}

/// A sun above a flat plate whose material has a hardly visible relief of 16 texels: what the plate
/// sends is known. From near, its texels are shaded each; from afar, by what all of them send; in
/// between, the near part of one picture is shaded the one way and the far part the other.
#[test]
fn relief_sends_as_much_from_afar() {
    // Diameter of the disc that a sample of a picture looks at, at a distance of one, and texels
    // that it may be wide.
    let angle = 2.0 * 20.0_f64.to_radians().tan() / f64::from(40 * SAMPLES);
    let widest = 2.0;
    // A sample is as wide at a distance of 1.6, within the picture from a height of one.
    let texel = angle * 1.6 / widest;
    let mut build = Build::new();
    let plate = build.material(0.5, 0.0);
    build.relief(plate, 16, |x, y| HEIGHT * (x * (1.0 - x) * y * (1.0 - y)));
    let cells = build.quad(
        DVec3::new(-10.0, 0.0, -10.0),
        20.0 * DVec3::Z,
        20.0 * DVec3::X,
        (20, 20),
        plate,
    );
    build.uv(cells, 16.0 * texel * DVec3::Z, 16.0 * texel * DVec3::X);
    build.scene.lights.suns.push(Sun {
        name: "sun".into(),
        towards: DVec3::Y,
        irradiance: [1.0; 3],
        angle: 0.0,
    });
    let scene = build.0.scene;
    let solution = baked(&scene);
    let expected = 0.5 / std::f32::consts::PI;
    for height in [0.3, 1.0, 4.0] {
        let camera = Camera {
            position: DVec3::new(0.0, height, 0.0),
            look_at: DVec3::new(height, 0.0, 0.0),
            up: DVec3::Y,
            ..above()
        };
        let lighting = Lighting::from(&solution);
        let picture = render(&device(), &scene, lighting, &view(&camera)).expect("a picture");
        let error = |p: &[f32; 3]| (Vec3::from(*p) / expected - 1.0).abs().max_element();
        let largest = picture.radiance.iter().map(error).fold(0.0, f32::max);
        println!("from {height}: {largest:.1e}");
        assert!(largest < 5e-4, "from {height}: {largest}");
    }
    assert_silent();
}

/// A plain quad shows its reflectance, its normal and grey, whatever light falls on it, and a lamp
/// its reflectance too.
#[test]
fn plain_surfaces_show_what_they_are() {
    let mut build = Build::new();
    let lamp = build.material(0.2, 10.0);
    let plain = build.material(0.5, 0.0);
    build.scene.materials[plain as usize].kd = [0.1, 0.5, 0.8];
    let (u, v) = (2.0 * DVec3::Z, DVec3::X);
    build.quad(DVec3::new(-1.0, 0.0, -1.0), u, v, (2, 2), plain);
    build.quad(DVec3::new(0.0, 0.0, -1.0), u, v, (2, 2), lamp);
    build.quad(DVec3::new(-1.0, 0.5, -2.0), DVec3::Y, u, (1, 1), lamp);
    let (scene, camera) = (build.0.scene, above());
    let solution = baked(&scene);
    let up = [0.5, 1.0, 0.5];
    for (show, of_plain, of_lamp) in [
        (Show::Albedo, [0.1, 0.5, 0.8], [0.2; 3]),
        (Show::Normal, up, up),
        (Show::Height, [0.5; 3], [0.5; 3]),
    ] {
        let lighting = Lighting {
            show,
            ..Lighting::from(&solution)
        };
        let picture = render(&device(), &scene, lighting, &view(&camera)).expect("a picture");
        assert_eq!(picture.automatic_exposure, 0.0);
        let near = |p: &[f32; 3], of: [f32; 3]| {
            let apart = Vec3::from_array(*p) - Vec3::from_array(of);
            apart.abs().max_element() < 1e-5
        };
        let [plain, lamp] =
            [of_plain, of_lamp].map(|of| picture.radiance.iter().filter(|p| near(p, of)).count());
        println!("{show:?}: {plain} pixels of the plain quad, {lamp} of the lamp");
        // The camera is not quite above the edge between them, which is mixed.
        let edge = 40;
        match of_plain == of_lamp {
            true => assert_eq!(plain, 1600),
            false => {
                assert!(plain > 600 && lamp > 600 && plain + lamp >= 1600 - edge);
            }
        }
    }
    assert_silent();
}
