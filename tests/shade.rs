//! The shaded picture against its CPU twin, and what a person would notice first: left and right, up and down.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use mesolux::reference;
use mesolux::render::{MOST_PIXELS, Picture, View, corner_irradiance, render};
use mesolux::scene::{Camera, Material, Scene, Texture, Triangle};
use mesolux::vk::Device;

/// Relative to the brightest radiance of a picture without textures: positions, weights and products in f32 round by some
/// 10 · 2⁻²⁴, more where weights are steep: samples of the smallest triangle here span 1/160 of it.
const PLAIN: f64 = 1e-4;
/// With textures: filters weigh texels in steps of no more than 2⁻⁸ along each side.
const TEXTURED: f64 = 2.0 / 256.0;

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
        material,
    });
}

/// A square of half side `half` about `centre`, towards +z or away from it; texture upright seen from its front.
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

/// Red left, green right, blue above, nothing below; a lamp in front of the green; a back in front of the red.
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

fn texture(width: u32, height: u32, texels: Vec<[f32; 3]>) -> Arc<Texture> {
    Arc::new(Texture {
        path: PathBuf::from("test.png"),
        width,
        height,
        texels,
    })
}

fn textured(map: Arc<Texture>, half: f64) -> Scene {
    let mut scene = Scene {
        materials: vec![Material {
            map_kd: Some(map),
            ..material([0.9; 3])
        }],
        ..Scene::default()
    };
    add_square(&mut scene, [0.0; 3], half, true, 0);
    scene
}

#[test]
fn an_asymmetric_scene_agrees_with_the_twin() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = View {
        camera: &camera,
        width: 61,
        height: 47,
    };
    agree(&scene, &view, PLAIN);
    no_messages();
}

#[test]
fn a_picture_of_several_tiles_agrees_with_the_twin() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = View {
        camera: &camera,
        width: 530,
        height: 515,
    };
    agree(&scene, &view, PLAIN);
    no_messages();
}

#[test]
fn red_is_left_green_right_blue_above_nothing_below() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = View {
        camera: &camera,
        width: 90,
        height: 90,
    };
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
fn a_texture_stands_upright() {
    let white = [1.0; 3];
    let scene = textured(texture(2, 2, vec![RED, GREEN, BLUE, white]), 1.0);
    let camera = camera(DVec3::ZERO);
    let view = View {
        camera: &camera,
        width: 64,
        height: 64,
    };
    agree(&scene, &view, TEXTURED);
    let picture = draw(&scene, &view);
    let at = |column: usize, row: usize| picture.radiance[row * 64 + column];
    let [left_top, right_top, left_bottom] = [at(22, 22), at(42, 22), at(22, 42)];
    assert!(left_top[0] > left_top[1] && left_top[0] > left_top[2]);
    assert!(right_top[1] > right_top[0] && right_top[1] > right_top[2]);
    assert!(left_bottom[2] > left_bottom[0] && left_bottom[2] > left_bottom[1]);
    no_messages();
}

#[test]
fn a_repeated_texture_of_odd_size_agrees_with_the_twin() {
    let texels = (0..15)
        .map(|i| [i as f32 / 15.0, 0.5, 1.0 - i as f32 / 15.0])
        .collect();
    let mut scene = textured(texture(5, 3, texels), 1.3);
    for triangle in &mut scene.triangles {
        triangle.uv = triangle.uv.map(|[u, v]| [2.0 * u - 40.7, 1.5 * v + 12.3]);
    }
    let camera = camera(DVec3::new(0.3, 0.0, 0.0));
    let view = View {
        camera: &camera,
        width: 50,
        height: 60,
    };
    agree(&scene, &view, TEXTURED);
    no_messages();
}

#[test]
fn a_fine_texture_far_away_is_its_mean() {
    // An odd size: no level of detail halves it evenly.
    let side = 511;
    let texels = (0..side * side)
        .map(|i| [((i % side + i / side) % 2) as f32; 3])
        .collect();
    let mut scene = textured(texture(side, side, texels), 1.0);
    let camera = camera(DVec3::ZERO);
    let view = View {
        camera: &camera,
        width: 16,
        height: 16,
    };
    let picture = render(&device(), &scene, &[Vec3::ONE; 2], &view).expect("a picture");
    let mean = picture.radiance[8 * 16 + 8][0];
    scene.materials[0].map_kd = None;
    let white = render(&device(), &scene, &[Vec3::ONE; 2], &view)
        .expect("a picture")
        .radiance[8 * 16 + 8][0];
    assert!(
        (mean / white - 0.5).abs() < 0.01,
        "{} of white",
        mean / white
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
    agree(
        &far,
        &View {
            camera: &there,
            width: 61,
            height: 47,
        },
        PLAIN,
    );
    let [a, b] = [(&near, &here), (&far, &there)].map(|(scene, camera)| {
        draw(
            scene,
            &View {
                camera,
                width: 61,
                height: 47,
            },
        )
    });
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
                    material: 0,
                })
                .to_vec(),
            materials: vec![material(RED)],
            ..Scene::default()
        };
        let corners = corner_irradiance(&scene, &[Vec3::ONE, Vec3::splat(3.0)]);
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

#[test]
fn written_files_hold_the_picture() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = View {
        camera: &camera,
        width: 61,
        height: 47,
    };
    let picture = draw(&scene, &view);
    let dir = tempfile::tempdir().expect("a folder");
    let exr = dir.path().join("picture.EXR");
    picture.write(&exr, Some(3.0)).expect("written");
    let read = image::open(&exr).expect("an EXR").into_rgb32f();
    assert_eq!(read.dimensions(), (61, 47));
    assert!(
        read.pixels().zip(&picture.radiance).all(|(a, b)| a.0 == *b),
        "linear and whole"
    );

    let png = dir.path().join("picture.png");
    picture.write(&png, None).expect("written");
    let bytes = std::fs::read(&png).expect("a PNG");
    let automatic = image::open(&png).expect("a PNG").into_rgb8();
    assert_eq!(automatic.dimensions(), (61, 47));
    picture
        .write(&png, Some(picture.automatic_exposure))
        .expect("written");
    assert_eq!(
        std::fs::read(&png).expect("a PNG"),
        bytes,
        "the same picture is the same file"
    );
    picture
        .write(&png, Some(picture.automatic_exposure - 2.0))
        .expect("written");
    let darker = image::open(&png).expect("a PNG").into_rgb8();
    let sum = |p: &image::RgbImage| p.pixels().map(|p| u64::from(p.0[0])).sum::<u64>();
    assert!(sum(&darker) < sum(&automatic));
    assert_eq!(darker.get_pixel(30, 46).0, [0; 3], "nothing is black");
    no_messages();
}

/// A grey card of radiance 0.5: by the curve 0.5 − 0.04, of which the sRGB code lies between two.
#[test]
fn a_grey_card_has_the_code_of_the_formulas() {
    let mut scene = Scene {
        materials: vec![material([1.0; 3])],
        ..Scene::default()
    };
    add_square(&mut scene, [0.0; 3], 4.0, true, 0);
    let camera = camera(DVec3::ZERO);
    let view = View {
        camera: &camera,
        width: 32,
        height: 32,
    };
    let e = Vec3::splat(0.5 * std::f32::consts::PI);
    let picture = render(&device(), &scene, &[e; 2], &view).expect("a picture");
    assert!((picture.automatic_exposure - (0.6_f32 / 0.5).log2()).abs() < 1e-5);
    let dir = tempfile::tempdir().expect("a folder");
    let png = dir.path().join("card.png");
    picture.write(&png, Some(0.0)).expect("written");
    let read = image::open(&png).expect("a PNG").into_rgb8();
    let mean = read.pixels().map(|p| f64::from(p.0[1])).sum::<f64>() / 1024.0;
    let exact = 255.0 * (1.055 * 0.46_f64.powf(1.0 / 2.4) - 0.055);
    // Over whole 8 × 8 blocks the mean of a dithered code is the exact one to the dither's step.
    assert!(
        (mean - exact).abs() < 1.0 / 64.0 + 1e-3,
        "{mean} instead of {exact}"
    );
    no_messages();
}

#[test]
fn sizes_names_and_places_that_cannot_be_are_refused() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    for (width, height) in [(0, 5), (5, 0), (MOST_PIXELS + 1, 5), (5, u32::MAX)] {
        let view = View {
            camera: &camera,
            width,
            height,
        };
        let error =
            render(&device(), &scene, &irradiance(&scene), &view).expect_err("no such size");
        assert!(
            matches!(&error, mesolux::error::Error::Usage(m) if m.contains("16384")),
            "{error}"
        );
    }
    let picture = draw(
        &scene,
        &View {
            camera: &camera,
            width: 3,
            height: 1,
        },
    );
    let dir = tempfile::tempdir().expect("a folder");
    for name in ["picture.jpg", "picture", ".png"] {
        let error = picture
            .write(&dir.path().join(name), None)
            .expect_err("no such kind");
        assert!(
            matches!(&error, mesolux::error::Error::Usage(m) if m.contains(".png") && m.contains(".exr"))
        );
    }
    for name in ["missing/picture.png", "missing/picture.exr"] {
        let error = picture
            .write(&dir.path().join(name), None)
            .expect_err("no such folder");
        assert!(matches!(error, mesolux::error::Error::Write { .. }));
    }
    no_messages();
}
