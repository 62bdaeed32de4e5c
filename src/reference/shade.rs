//! Twin of the shade pass: a ray through every sample against every triangle.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::mesh::corners::{Joined, corner_irradiance};
use crate::picture::{SAMPLES, View};
use crate::scene::Scene;

/// Distance, in pixels, that a rasteriser with 8 subpixel bits and the rounding of positions to f32
/// may move an edge, with a wide margin.
const EDGE: f64 = 1.0 / 16.0;

/// Mean radiance of each pixel, `[row][column]` from the top left, W·m⁻²·sr⁻¹; none where a sample
/// lies within 1/16 of a pixel of an edge, where the rasteriser may see another element.
pub fn shade(scene: &Scene, irradiance: &[Vec3], view: &View<'_>) -> Vec<Option<DVec3>> {
    let corners = corner_irradiance(scene, irradiance, Joined::Smooth);
    let camera = view.camera;
    let back = (camera.position - camera.look_at).normalize();
    let right = camera.up.cross(back).normalize();
    let up = back.cross(right);
    let pixel = 2.0 * (0.5 * camera.fov_y.to_radians()).tan() / f64::from(view.height);
    // A place in the picture in pixels, from its left top corner.
    let ray = |x: f64, y: f64| {
        let (from_middle, above) = (
            x - 0.5 * f64::from(view.width),
            0.5 * f64::from(view.height) - y,
        );
        right * (from_middle * pixel) + up * (above * pixel) - back
    };
    let mut picture = Vec::with_capacity((view.width * view.height) as usize);
    for row in 0..view.height {
        for column in 0..view.width {
            let mut sum = DVec3::ZERO;
            let mut sure = true;
            for i in 0..SAMPLES * SAMPLES {
                let place = |first: u32, sub: u32| {
                    f64::from(first) + (f64::from(sub) + 0.5) / f64::from(SAMPLES)
                };
                let (x, y) = (place(column, i % SAMPLES), place(row, i / SAMPLES));
                let seen = |dx, dy| first_seen(scene, camera.position, ray(x + dx, y + dy));
                let hit = seen(0.0, 0.0);
                let element = hit.map(|h| h.0);
                sure &= [(EDGE, 0.0), (-EDGE, 0.0), (0.0, EDGE), (0.0, -EDGE)]
                    .into_iter()
                    .all(|(dx, dy)| seen(dx, dy).map(|h| h.0) == element);
                if let Some((e, weights)) = hit {
                    sum += radiance(scene, &corners[e], e, weights, camera.position);
                }
            }
            picture.push(sure.then_some(sum / f64::from(SAMPLES * SAMPLES)));
        }
    }
    picture
}

/// The nearest element along a ray and the barycentric weights of its corners there.
fn first_seen(scene: &Scene, eye: DVec3, ray: DVec3) -> Option<(usize, [f64; 3])> {
    let mut nearest: Option<(f64, usize, [f64; 3])> = None;
    for (e, triangle) in scene.triangles.iter().enumerate() {
        // Signed volumes of the tetrahedra over the three edges.
        let [a, b, c] = scene.corners(triangle).map(|p| p - eye);
        let volumes = [b.cross(c), c.cross(a), a.cross(b)].map(|n| n.dot(ray));
        let total: f64 = volumes.iter().sum();
        let weights = volumes.map(|v| v / total);
        let along = a.dot(b.cross(c)) / total;
        let hit = total != 0.0 && along > 0.0 && weights.iter().all(|w| *w >= 0.0);
        if hit && nearest.is_none_or(|n| along < n.0) {
            nearest = Some((along, e, weights));
        }
    }
    nearest.map(|(_, e, weights)| (e, weights))
}

/// L = ρ · E / π + Le on the front of an element, nothing on its back.
fn radiance(
    scene: &Scene,
    irradiance: &[Vec3; 3],
    e: usize,
    weights: [f64; 3],
    eye: DVec3,
) -> DVec3 {
    let triangle = &scene.triangles[e];
    let material = &scene.materials[triangle.material as usize];
    let [a, b, c] = scene.corners(triangle);
    if (b - a).cross(c - a).dot(eye - a) <= 0.0 {
        return DVec3::ZERO;
    }
    let mixed = |values: [f64; 3]| (0..3).map(|k| weights[k] * values[k]).sum::<f64>();
    let at = |uv: [[f32; 2]; 3]| [0, 1].map(|i| mixed(uv.map(|uv| f64::from(uv[i]))));
    let uv = at(triangle.uv).map(|x| x as f32);
    let texture = material
        .map_kd
        .as_ref()
        .map_or([1.0; 3], |map| map.sample_bilinear(uv[0], uv[1]));
    let [u, v] = at(triangle.uv_of_emission());
    let emitted = material.emitted_at(u, v);
    DVec3::from_array(std::array::from_fn(|channel| {
        let incident = mixed(irradiance.map(|corner| f64::from(corner[channel])));
        let rho = f64::from(material.kd[channel]) * f64::from(texture[channel]);
        rho * incident / PI + f64::from(emitted[channel])
    }))
}
