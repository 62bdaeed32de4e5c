//! Groups of elements as sources, and where groups are cut.

use glam::DVec3;

use super::{PART_MEMBERS, Part, Source};
use crate::constants::KIND_SURFACE;
use crate::mesh::charts::Connections;
use crate::mesh::contour::contour;
use crate::mesh::elements::Elements;

/// Largest distance from the mean plane, as a share of the extent, at which a group still counts as
/// plane.
const FLAT: f64 = 1e-6;

/// A group of elements as a whole.
pub(super) struct Shape {
    area: f64,
    centroid: DVec3,
    /// Mean normal.
    normal: DVec3,
    /// Projected area seen from far away along `normal`.
    facing: f64,
    /// Whether all lie in one plane and face the same way.
    pub flat: bool,
}

impl Shape {
    pub fn new(elements: &Elements, members: impl Iterator<Item = usize> + Clone) -> Self {
        let area: f64 = members.clone().map(|e| elements.area[e]).sum();
        let weigh = |values: &[DVec3]| -> DVec3 {
            let weighed = members.clone().map(|e| values[e] * elements.area[e]);
            weighed.sum::<DVec3>() / area
        };
        let centroid = weigh(&elements.centroid);
        let mean = weigh(&elements.normal);
        let first = members
            .clone()
            .next()
            .map_or(DVec3::Z, |e| elements.normal[e]);
        let normal = mean.normalize_or(first);
        let corners = || members.clone().flat_map(|e| elements.triangle(e));
        let extent = corners().map(|v| v.distance(centroid)).fold(0.0, f64::max);
        let flat = corners().all(|v| (v - centroid).dot(normal).abs() <= FLAT * extent)
            && members
                .clone()
                .all(|e| elements.normal[e].dot(normal) > 0.5);
        Self {
            area,
            centroid,
            normal,
            facing: area * mean.length(),
            flat,
        }
    }
}

/// Sorts the members along their longest extent and returns the index of the cut: at the widest gap
/// between neighbours in the middle third, which on a grid is a line of the grid.
pub(super) fn bisect(elements: &Elements, members: &mut [u32]) -> usize {
    let centroid = |e: u32| elements.centroid[e as usize];
    let axis = elements.longest_axis(members);
    members.sort_by(|&a, &b| centroid(a)[axis].total_cmp(&centroid(b)[axis]));
    let count = members.len();
    let middle = (count / 3).max(1)..=(count - count / 3).min(count - 1);
    let gap = |i: usize| centroid(members[i])[axis] - centroid(members[i - 1])[axis];
    // Gaps of a grid are equal only up to rounding: among the widest, the one nearest to the
    // middle.
    let widest = middle.clone().map(gap).fold(0.0, f64::max) * (1.0 - 1e-6);
    middle
        .filter(|&i| gap(i) >= widest)
        .min_by_key(|&i| i.abs_diff(count / 2))
        .unwrap_or(count / 2)
}

pub(super) fn group(
    elements: &Elements,
    connections: &Connections,
    range: std::ops::Range<usize>,
) -> Source {
    let shape = Shape::new(elements, range.clone());
    let (centroid, flat) = (shape.centroid, shape.flat);
    let corners = || range.clone().flat_map(|e| elements.triangle(e));
    let inside = flat
        && range
            .clone()
            .any(|e| holds(elements.triangle(e), centroid, shape.normal));
    let eye = if inside {
        centroid
    } else {
        let nearest = range
            .clone()
            .min_by(|&a, &b| {
                let to = |e: usize| elements.centroid[e].distance_squared(centroid);
                to(a).total_cmp(&to(b))
            })
            .unwrap_or(range.start);
        elements.centroid[nearest]
    };
    let cone = if flat {
        0.0
    } else {
        let cosine = range
            .clone()
            .map(|e| elements.normal[e].dot(shape.normal))
            .fold(1.0, f64::min);
        cosine.clamp(-1.0, 1.0).acos().max(1e-6)
    };
    let emitted = range
        .clone()
        .map(|e| elements.emitted[e].as_dvec3() * elements.area[e])
        .sum::<DVec3>()
        / shape.area;
    Source {
        kind: KIND_SURFACE,
        eye,
        centroid,
        normal: shape.normal,
        tangent: DVec3::ZERO,
        bitangent: DVec3::ZERO,
        area: shape.area,
        facing: shape.facing,
        parts: if flat {
            Vec::new()
        } else {
            parts(elements, range.clone())
        },
        radius: corners().map(|v| v.distance(centroid)).fold(0.0, f64::max),
        cone,
        emitted: emitted.as_vec3(),
        web: None,
        first_element: range.start as u32,
        element_count: range.len() as u32,
        places: Vec::new(),
        contour: contour(elements, range.clone()),
        component: connections.component[range.start],
    }
}

fn parts(elements: &Elements, range: std::ops::Range<usize>) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut stack = vec![range.map(|e| e as u32).collect::<Vec<_>>()];
    while let Some(mut members) = stack.pop() {
        if members.len() > PART_MEMBERS {
            let at = bisect(elements, &mut members);
            stack.push(members.split_off(at));
            stack.push(members);
            continue;
        }
        let of = |e: &u32| *e as usize;
        let area: f64 = members.iter().map(|e| elements.area[of(e)]).sum();
        let weigh = |values: &[DVec3]| -> DVec3 {
            let sum = members.iter().map(|e| values[of(e)] * elements.area[of(e)]);
            sum.sum()
        };
        let centroid = weigh(&elements.centroid) / area;
        let corners = members.iter().flat_map(|e| elements.triangle(of(e)));
        parts.push(Part {
            centroid,
            vector_area: weigh(&elements.normal),
            radius: corners.map(|v| v.distance(centroid)).fold(0.0, f64::max),
            members,
        });
    }
    parts
}

/// Whether a point of the plane with normal `n` lies in a triangle, its edges included.
pub(super) fn holds(triangle: [DVec3; 3], p: DVec3, n: DVec3) -> bool {
    (0..3).all(|i| {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        (b - a).cross(p - a).dot(n) >= -1e-9 * (b - a).length_squared()
    })
}
