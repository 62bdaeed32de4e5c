//! Twin of the item-buffer pass: a ray through every pixel's centre against every triangle.

use glam::DVec3;

use crate::constants::NONE;
use crate::elements::Elements;
use crate::hemicube::{Pixel, direction_of, pixel_of};
use crate::sources::Source;

/// Where a ray meets the plane of a triangle.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Distance along the ray, in its own lengths.
    pub along: f64,
    /// Least barycentric coordinate: below 0 outside the triangle, 0 on an edge.
    pub inside: f64,
}

/// The plane of a triangle met by the ray from `origin`; none where they are parallel or it lies behind.
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
    (along > 0.0).then_some(Hit {
        along,
        inside: x.min(y).min(1.0 - x - y),
    })
}

/// World direction through a pixel's centre.
pub fn ray(source: &Source, pixel: Pixel, n: u32) -> DVec3 {
    let d = direction_of(pixel, n);
    source.tangent * d.x + source.bitangent * d.y + source.normal * d.z
}

/// The element that each pixel sees, `[row][column]` of the hemicube's column, or [`NONE`].
pub fn item_buffer(elements: &Elements, source: &Source, n: u32) -> Vec<u32> {
    let mut items = Vec::with_capacity(3 * (n * n) as usize);
    for row in 0..3 * n {
        for column in 0..n {
            let ray = ray(source, Pixel { column, row }, n);
            let nearest = (0..elements.len())
                .filter(|&e| above(elements, source, e))
                .filter_map(|e| {
                    let hit = intersect(source.eye, ray, elements.triangle(e))?;
                    (hit.inside >= 0.0).then_some((hit.along, e))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            items.push(nearest.map_or(NONE, |(_, e)| e as u32));
        }
    }
    items
}

/// Whether an element rises above the source's own plane.
fn above(elements: &Elements, source: &Source, e: usize) -> bool {
    elements
        .triangle(e)
        .iter()
        .any(|v| (*v - source.eye).dot(source.normal) > 1e-9)
}

/// How far outside a triangle, in pixels, a pixel's centre may lie and still be drawn: a rasteriser with 4 subpixel bits
/// moves a corner by at most 1/32 of a pixel.
const SNAP: f64 = 1.0 / 16.0;

/// Whether an item buffer is right: each pixel has the element that its ray meets first, or one that passes within a
/// rasteriser's rounding of it and no farther off than that.
pub fn agrees(elements: &Elements, source: &Source, n: u32, drawn: &[u32]) -> bool {
    let expected = item_buffer(elements, source, n);
    expected
        .iter()
        .zip(drawn)
        .enumerate()
        .all(|(i, (&want, &got))| {
            want == got || {
                let pixel = Pixel {
                    column: i as u32 % n,
                    row: i as u32 / n,
                };
                explained(elements, source, n, pixel, want, got)
            }
        })
}

/// Whether rounding explains that a pixel shows `got` where its centre's ray meets `want`: some ray within [`SNAP`] of the
/// centre meets `got` first.
fn explained(
    elements: &Elements,
    source: &Source,
    n: u32,
    pixel: Pixel,
    want: u32,
    got: u32,
) -> bool {
    let centre = direction_of(pixel, n);
    let step = 2.0 / f64::from(n) * SNAP;
    let first = |ray: DVec3| {
        (0..elements.len())
            .filter(|&e| above(elements, source, e))
            .filter_map(|e| {
                let hit = intersect(source.eye, ray, elements.triangle(e))?;
                (hit.inside >= 0.0).then_some((hit.along, e))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(NONE, |(_, e)| e as u32)
    };
    debug_assert_eq!(
        pixel_of(centre, n),
        pixel,
        "a pixel's direction falls in it"
    );
    let _ = want;
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
        first(ray) == got
    })
}
