//! A bent sheet, and light on its elements.

use glam::{DVec3, Vec3};
use mesolux::bake::solution::DirectionalLight;
use mesolux::math::directions::Directions;
use mesolux::scene::Scene;

use super::Build;

/// A sheet of n × n cells over 0..1 × 0..1, bent to z = −bend · (x² + y²) about its middle, with
/// its texture along x and y.
pub fn sheet(n: u32, bend: f64) -> Scene {
    let mut build = Build::new();
    let relief = build.material(0.7, 0.0);
    let cells = build.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (n, n), relief);
    build.uv(cells, DVec3::X, DVec3::Y);
    for v in &mut build.scene.vertices {
        let (x, y) = (v.x - 0.5, v.y - 0.5);
        v.z = -bend * (x * x + y * y);
    }
    build.0.scene
}

/// Elements under a light that `moments` tells by the element's frame, `[slot][colour]`.
pub fn light_on(
    scene: &Scene,
    directions: &Directions,
    moments: impl Fn([DVec3; 3]) -> Vec<[Vec3; 3]>,
) -> DirectionalLight {
    let frames: Vec<[DVec3; 3]> = scene
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = scene.corners(t);
            let normal = (b - a).cross(c - a).normalize();
            let tangent = (DVec3::X - normal * normal.x).normalize();
            [tangent, normal.cross(tangent), normal]
        })
        .collect();
    DirectionalLight {
        elements: (0..frames.len() as u32).collect(),
        directions: (0..directions.count())
            .map(|k| directions.centre(k))
            .collect(),
        incident_moment: frames.iter().flat_map(|&f| moments(f)).collect(),
        incident_moment_direct: Vec::new(),
        exitant: Vec::new(),
        frames: frames.iter().map(|f| f.map(|v| v.as_vec3())).collect(),
    }
}

/// Moments of parallel light for [`light_on`].
pub fn parallel(
    directions: &Directions,
    frame: [DVec3; 3],
    towards: DVec3,
    strength: Vec3,
) -> Vec<[Vec3; 3]> {
    let local = DVec3::from(frame.map(|axis| axis.dot(towards)));
    let mut moments = vec![[Vec3::ZERO; 3]; directions.count()];
    moments[directions.slot_of(local)] = strength.to_array().map(|s| s * local.as_vec3());
    moments
}
