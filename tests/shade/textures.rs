//! Textures in the picture.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use mesolux::render::render;
use mesolux::scene::{Material, Scene, Texture};

use super::{
    BLUE, GREEN, RED, add_square, agree, camera, device, draw, material, no_messages, view,
};

/// Relative to the brightest radiance: filters weigh texels in steps of no more than 2⁻⁸ along each
/// side.
const TEXTURED: f64 = 2.0 / 256.0;

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
fn a_texture_stands_upright() {
    let white = [1.0; 3];
    let scene = textured(texture(2, 2, vec![RED, GREEN, BLUE, white]), 1.0);
    let camera = camera(DVec3::ZERO);
    let view = view(&camera, 64, 64);
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
    let view = view(&camera, 50, 60);
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
    let view = view(&camera, 16, 16);
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

/// What a texture emits is added to what the surface reflects, before and behind other surfaces.
#[test]
fn a_texture_of_emission_agrees_with_the_twin() {
    let white = [1.0; 3];
    let mut scene = textured(texture(2, 2, vec![RED, GREEN, BLUE, white]), 1.0);
    let texels = (0..15).map(|i| [i as f32, 7.0, 15.0 - i as f32]).collect();
    scene.materials[0].ke = [0.3, 0.2, 0.4];
    scene.materials[0].map_ke = Some(texture(5, 3, texels));
    scene.materials.push(material([0.5; 3]));
    add_square(&mut scene, [0.3, 0.2, 0.5], 0.4, true, 1);
    add_square(&mut scene, [-0.3, -0.2, -0.5], 1.1, true, 1);
    let camera = camera(DVec3::new(0.3, 0.0, 0.0));
    let view = view(&camera, 50, 60);
    agree(&scene, &view, TEXTURED);
    // In a place of its own, turned and stretched against that of the colours.
    for triangle in &mut scene.triangles[..2] {
        let turned = |[u, v]: [f32; 2]| [1.5 - 2.0 * v, 0.3 + u];
        triangle.emission_uv = Some(triangle.uv.map(turned));
    }
    agree(&scene, &view, TEXTURED);
    no_messages();
}
