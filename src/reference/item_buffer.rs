//! Twin of the item-buffer pass: a ray through every pixel's centre against every triangle.

use glam::DVec3;

use crate::constants::{KIND_SURFACE, NONE};
use crate::math::hemicube::{Pixel, direction_of};
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;
use crate::mesh::sources::Source;

/// Distance of the near plane, as in the pass; a ray's largest component in the source's frame is
/// 1.
const NEAR: f64 = 1e-6;

/// Intersection of a ray with the plane of a triangle.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Distance along the ray, in lengths of the ray vector.
    pub along: f64,
    /// Least barycentric coordinate: below 0 outside the triangle, 0 on an edge.
    pub inside: f64,
}

/// Intersection of the ray from `origin` with the plane of a triangle; None where they are parallel
/// or the plane is behind.
pub fn intersect(origin: DVec3, ray: DVec3, [a, b, c]: [DVec3; 3]) -> Option<Hit> {
    let (u, v) = (b - a, c - a);
    let p = ray.cross(v);
    let determinant = u.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let t = origin - a;
    let q = t.cross(u);
    let (x, y) = (t.dot(p) / determinant, ray.dot(q) / determinant);
    let along = v.dot(q) / determinant;
    (along > NEAR).then_some(Hit {
        along,
        inside: x.min(y).min(1.0 - x - y),
    })
}

/// World direction through a pixel's centre.
pub fn ray(source: &Source, pixel: Pixel, n: u32) -> DVec3 {
    let d = direction_of(pixel, n);
    source.tangent * d.x + source.bitangent * d.y + source.normal * d.z
}

/// The item that each pixel sees, `[row][column]` of the hemicube's column, or [`NONE`].
pub fn item_buffer(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    n: u32,
) -> Vec<u32> {
    let mut items = Vec::with_capacity(3 * (n * n) as usize);
    for row in 0..3 * n {
        for column in 0..n {
            let ray = ray(source, Pixel { column, row }, n);
            items.push(first(elements, connections, occluders, source, ray));
        }
    }
    items
}

/// The item of the occluder that a ray from the eye meets first, or [`NONE`].
fn first(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    ray: DVec3,
) -> u32 {
    (0..occluders.len())
        .filter(|&i| above(elements, connections, occluders, source, i))
        .filter_map(|i| {
            let hit = intersect(source.eye, ray, occluders.triangle(elements, i))?;
            (hit.inside >= 0.0).then_some((hit.along, i))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(NONE, |(_, i)| occluders.items[i])
}

/// Whether an occluder can be seen at all: it rises above the source's own plane, and not every
/// face leaves it out.
fn above(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    i: usize,
) -> bool {
    let rises = |v: &DVec3| (*v - source.eye).dot(source.normal) > 1e-9;
    !is_left_out(elements, connections, occluders, source, i)
        && occluders.triangle(elements, i).iter().any(rises)
}

/// Whether an occluder is left out of all faces even without culling: it lies in one plane with the
/// eye and belongs to the eye's own connected part, or it is a back of that part and the part is
/// closed.
pub fn is_left_out(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    i: usize,
) -> bool {
    let item = occluders.items[i] as usize;
    let component = connections.component[item];
    let same = source.kind == KIND_SURFACE && component == source.component;
    let own = same && connections.closed[component as usize];
    let height = (source.eye - elements.centroid[item]).dot(elements.normal[item]);
    let edge_on = same && height.abs() <= 1e-6;
    let own_back = own && height <= 0.0;
    edge_on || own_back
}

/// How far outside a triangle, in pixels, a pixel's centre may lie and still be drawn: a rasteriser
/// with 4 subpixel bits moves a corner by at most 1/32 of a pixel.
const SNAP: f64 = 1.0 / 16.0;

/// Pixels of an item buffer that are wrong, each with the element that its ray meets first and the
/// one drawn. A pixel is right also with the element that some ray within a rasteriser's rounding
/// of its centre meets first.
pub fn disagreements(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    n: u32,
    drawn: &[u32],
) -> Vec<(Pixel, u32, u32)> {
    let expected = item_buffer(elements, connections, occluders, source, n);
    (0..)
        .zip(expected.iter().zip(drawn))
        .map(|(i, (&want, &got))| {
            let pixel = Pixel {
                column: i % n,
                row: i / n,
            };
            (pixel, want, got)
        })
        .filter(|&(pixel, want, got)| {
            want != got && !explained(elements, connections, occluders, source, n, pixel, got)
        })
        .collect()
}

/// Whether rounding explains that a pixel shows `got` where its centre's ray meets `want`: some ray
/// within [`SNAP`] of the centre meets `got` first.
fn explained(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    source: &Source,
    n: u32,
    pixel: Pixel,
    got: u32,
) -> bool {
    let centre = direction_of(pixel, n);
    let step = 2.0 / f64::from(n) * SNAP;
    (0..16).any(|i| {
        let angle = f64::from(i) * std::f64::consts::TAU / 16.0;
        let (du, dv) = (step * angle.cos(), step * angle.sin());
        // Shift within the face: the component that is ±1 stays.
        let d = if centre.z == 1.0 && pixel.row < n {
            DVec3::new(centre.x + du, centre.y + dv, 1.0)
        } else if centre.x.abs() == 1.0 {
            DVec3::new(centre.x, centre.y + du, centre.z + dv)
        } else {
            DVec3::new(centre.x + du, centre.y, centre.z + dv)
        };
        let ray = source.tangent * d.x + source.bitangent * d.y + source.normal * d.z;
        first(elements, connections, occluders, source, ray) == got
    })
}
