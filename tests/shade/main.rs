//! The shaded picture against its CPU twin, and what a person would notice first: left and right,
//! up and down.

mod files;
mod textures;

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use mesolux::reference;
use mesolux::render::{Joined, Picture, View, corner_irradiance, render};
use mesolux::scene::{Camera, Material, Scene, Triangle};
use mesolux::vk::Device;

/// Relative to the brightest radiance of a picture without textures: positions, weights and
/// products in f32 round by some 10 · 2⁻²⁴, more where weights are steep: samples of the smallest
/// triangle here span 1/160 of it.
const PLAIN: f64 = 1e-4;

const RED: [f32; 3] = [0.8, 0.1, 0.05];
const GREEN: [f32; 3] = [0.1, 0.7, 0.05];
const BLUE: [f32; 3] = [0.05, 0.1, 0.9];

fn device() -> Arc<Device> {
    static DEVICE: OnceLock<Arc<Device>> = OnceLock::new();
    DEVICE
        .get_or_init(|| {
            // Validation messages reach the test's output.
            let _ = tracing_subscriber::fmt().with_test_writer().try_init();
            mesolux::solver::open_device(None, true).expect("a Vulkan device")
        })
        .clone()
}

fn no_messages() {
    assert_eq!(mesolux::vk::validation_messages(), 0);
}

/// At the origin's +z side, looking towards −z: +x is right, +y is up.
fn camera(offset: DVec3) -> Camera {
    Camera {
        name: "test".into(),
        position: offset + DVec3::new(0.0, 0.0, 4.0),
        look_at: offset,
        up: DVec3::Y,
        fov_y: 40.0,
    }
}

fn view(camera: &Camera, width: u32, height: u32) -> View<'_> {
    View {
        camera,
        width,
        height,
    }
}

fn material(kd: [f32; 3]) -> Material {
    Material {
        kd,
        ..Material::default()
    }
}

/// Adds a triangle that shares no vertices with any other.
fn add(scene: &mut Scene, corners: [[f64; 3]; 3], uv: [[f32; 2]; 3], material: u32) {
    let first = scene.vertices.len() as u32;
    scene.vertices.extend(corners.map(DVec3::from_array));
    scene.triangles.push(Triangle {
        vertices: [first, first + 1, first + 2],
        uv,
        emission_uv: None,
        light_uv: None,
        material,
    });
}

/// A square of half side `half` about `centre`, towards +z or away from it; texture upright seen
/// from its front.
fn add_square(scene: &mut Scene, [x, y, z]: [f64; 3], half: f64, towards: bool, material: u32) {
    let side = if towards { half } else { -half };
    let corner = |i: f64, j: f64| [x + side * i, y + half * j, z];
    let [a, b, c, d] = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    add(
        scene,
        [a, b, c],
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
        material,
    );
    add(
        scene,
        [a, c, d],
        [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        material,
    );
}

/// Red left, green right, blue above, nothing below; a lamp in front of the green; a back in front
/// of the red.
fn asymmetric() -> Scene {
    let lamp = Material {
        ke: [7.0, 6.0, 5.0],
        ..material([0.5; 3])
    };
    let [red, green, blue] = [RED, GREEN, BLUE].map(material);
    let mut scene = Scene {
        materials: vec![red, green, blue, lamp],
        ..Scene::default()
    };
    add(
        &mut scene,
        [[-1.2, -0.8, 0.0], [-0.2, -0.7, 0.3], [-0.9, 0.5, -0.2]],
        [[0.0; 2]; 3],
        0,
    );
    add(
        &mut scene,
        [[0.1, -0.9, -0.4], [1.2, -0.6, 0.2], [0.8, 0.6, 0.0]],
        [[0.0; 2]; 3],
        1,
    );
    add(
        &mut scene,
        [[-0.5, 0.7, 0.0], [0.6, 0.8, 0.0], [-0.4, 1.2, 0.1]],
        [[0.0; 2]; 3],
        2,
    );
    add_square(&mut scene, [0.7, -0.2, 0.6], 0.15, true, 3);
    add_square(&mut scene, [-0.65, -0.3, 0.6], 0.12, false, 3);
    scene
}

fn irradiance(scene: &Scene) -> Vec<Vec3> {
    (0..scene.triangles.len())
        .map(|e| Vec3::new(3.0 + e as f32, 4.0, 5.0 - 0.5 * e as f32))
        .collect()
}

fn draw(scene: &Scene, view: &View<'_>) -> Picture {
    render(&device(), scene, &irradiance(scene), view).expect("a picture")
}

fn agree(scene: &Scene, view: &View<'_>, tolerance: f64) {
    let picture = draw(scene, view);
    let twin = reference::shade::shade(scene, &irradiance(scene), view);
    let brightest = twin
        .iter()
        .flatten()
        .map(|p| p.max_element())
        .fold(0.0, f64::max);
    let sure = twin.iter().flatten().count();
    assert!(
        2 * sure > twin.len(),
        "only {sure} of {} pixels are compared",
        twin.len()
    );
    for (place, (got, want)) in picture.radiance.iter().zip(&twin).enumerate() {
        let Some(want) = want else { continue };
        let got = Vec3::from_array(*got).as_dvec3();
        let (column, row) = (place as u32 % view.width, place as u32 / view.width);
        assert!(
            (got - *want).abs().max_element() <= tolerance * brightest,
            "pixel ({column}, {row}): {got} instead of {want}"
        );
    }
}

#[test]
fn an_asymmetric_scene_agrees_with_the_twin() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = view(&camera, 61, 47);
    agree(&scene, &view, PLAIN);
    no_messages();
}

#[test]
fn a_picture_of_several_tiles_agrees_with_the_twin() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = view(&camera, 530, 515);
    agree(&scene, &view, PLAIN);
    no_messages();
}

#[test]
fn red_is_left_green_right_blue_above_nothing_below() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = view(&camera, 90, 90);
    let picture = draw(&scene, &view);
    // 4 units away, half the picture is 4 · tan 20° = 1.456 units.
    let at = |x: f64, y: f64| {
        let column = 45.0 + 45.0 * x / 1.456;
        let row = 45.0 - 45.0 * y / 1.456;
        picture.radiance[row as usize * 90 + column as usize]
    };
    let strongest = |[r, g, b]: [f32; 3]| (r > g.max(b), g > r.max(b), b > r.max(g));
    assert_eq!(
        strongest(at(-0.8, 0.0)),
        (true, false, false),
        "red is left"
    );
    assert_eq!(
        strongest(at(0.7, 0.2)),
        (false, true, false),
        "green is right"
    );
    assert_eq!(
        strongest(at(-0.3, 0.9)),
        (false, false, true),
        "blue is above"
    );
    assert_eq!(at(0.0, -1.2), [0.0; 3], "nothing is below");
    // The lamp's plane is nearer, 3.4 units away.
    let lamp = at(0.7 * 4.0 / 3.4, -0.2 * 4.0 / 3.4);
    assert!(lamp[0] > 7.0 && lamp[2] > 5.0, "a lamp shines: {lamp:?}");
    assert_eq!(
        at(-0.65 * 4.0 / 3.4, -0.3 * 4.0 / 3.4),
        [0.0; 3],
        "a back is black and blocks"
    );
    no_messages();
}

#[test]
fn a_scene_far_off_keeps_its_shape() {
    let near = asymmetric();
    let mut far = near.clone();
    let offset = DVec3::new(1e6, -1e6, 1e6);
    far.vertices.iter_mut().for_each(|v| *v += offset);
    let [here, there] = [camera(DVec3::ZERO), camera(offset)];
    agree(&far, &view(&there, 61, 47), PLAIN);
    let [a, b] =
        [(&near, &here), (&far, &there)].map(|(scene, camera)| draw(scene, &view(camera, 61, 47)));
    let differing = a
        .radiance
        .iter()
        .zip(&b.radiance)
        .filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 1e-3));
    // Where an edge meets a sample within rounding.
    assert!(differing.count() < 10);
    no_messages();
}

#[test]
fn irradiance_is_smooth_up_to_a_crease() {
    // Two squares that share an edge, bent by 30° and by 60°.
    for (bend, smooth) in [(30.0_f64, true), (60.0, false)] {
        let (sin, cos) = bend.to_radians().sin_cos();
        let scene = Scene {
            vertices: vec![
                DVec3::new(-1.0, 0.0, 0.0),
                DVec3::new(0.0, 0.0, 0.0),
                DVec3::new(0.0, 1.0, 0.0),
                DVec3::new(cos, 0.0, -sin),
            ],
            triangles: [[0, 1, 2], [1, 3, 2]]
                .map(|vertices| Triangle {
                    vertices,
                    uv: [[0.0; 2]; 3],
                    emission_uv: None,
                    light_uv: None,
                    material: 0,
                })
                .to_vec(),
            materials: vec![material(RED)],
            ..Scene::default()
        };
        let corners = corner_irradiance(&scene, &[Vec3::ONE, Vec3::splat(3.0)], Joined::Smooth);
        assert_eq!(corners[0][0], Vec3::ONE, "a corner of its own");
        // At vertex 1 both have a right angle.
        let shared = if smooth { 2.0 } else { 1.0 };
        assert!(
            (corners[0][1].x - shared).abs() < 1e-6,
            "{bend}°: {}",
            corners[0][1]
        );
    }
}
