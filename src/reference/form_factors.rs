//! Twin of the receiver estimator: form factors and visibility of one source for every element, in
//! f64.

use glam::DVec3;

use crate::constants::{KIND_POINT, NONE};
use crate::math::form_factor::to_polygon;
use crate::math::hemicube::{direction_of, pixel_of};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// Rounding of a plane's height at a point, as in the shader.
const HEIGHT_EPSILON: f64 = 1e-6;
/// Largest distance between two points of one surface, in footprints of a pixel, as in the shader.
const REACH: f64 = 1.5;

/// Mean over an element of form factor times visibility: irradiance from a unit of the source's
/// radiosity. `seen` says whether the source sees a place.
pub fn gather(
    elements: &Elements,
    source: &Source,
    element: usize,
    seen: impl Fn(DVec3) -> bool,
) -> f64 {
    let triangle = elements.triangle(element);
    let centroid = elements.centroid[element];
    let size = elements.radius(element);
    let gap = centroid.distance(source.centroid) - source.radius;
    if gap > 4.0 * size && lies_in_plane(centroid, elements.normal[element], source) {
        return 0.0;
    }
    let points: &[[f64; 3]] = if gap > 4.0 * size {
        &POINTS[..1]
    } else if gap > size {
        &POINTS[1..4]
    } else {
        &POINTS[4..]
    };
    points
        .iter()
        .map(|&[u, v, weight]| {
            let p = triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0]);
            let p = before_plane(p, elements.normal[element], source);
            let f = form_factor(elements, source, p, element);
            if f > 0.0 && seen(p) { weight * f } else { 0.0 }
        })
        .sum()
}

/// Cosine of the largest angle between surfaces that count as parallel, as in the shader.
const LEVEL: f64 = 0.99;

/// As in the shader: whether a place lies in the plane of a plane source and its surface is
/// parallel to it.
fn lies_in_plane(p: DVec3, normal: DVec3, source: &Source) -> bool {
    let level = normal.dot(source.normal).abs() >= LEVEL;
    let plane = source.kind != KIND_POINT && source.cone == 0.0;
    plane && level && (p - source.centroid).dot(source.normal) <= HEIGHT_EPSILON
}

/// As in the shader: moves a place that lies in the plane of a source, on a surface not parallel to
/// it, slightly in front of the plane.
fn before_plane(p: DVec3, normal: DVec3, source: &Source) -> DVec3 {
    let height = (p - source.centroid).dot(source.normal);
    let plane = source.kind != KIND_POINT && source.cone == 0.0;
    if plane && height.abs() <= HEIGHT_EPSILON && normal.dot(source.normal).abs() < LEVEL {
        p + (2.0 * HEIGHT_EPSILON - height) * source.normal
    } else {
        p
    }
}

/// Form factor from a point of an element to the source, without occlusion.
fn form_factor(elements: &Elements, source: &Source, p: DVec3, element: usize) -> f64 {
    let normal = elements.normal[element];
    if source.kind == KIND_POINT {
        let d = source.eye - p;
        let side = d.dot(source.normal);
        let mine = if source.cone == 0.0 {
            side <= 0.0
        } else {
            side < 0.0
        };
        return if mine {
            d.dot(normal).max(0.0) / d.length().powi(3)
        } else {
            0.0
        };
    }
    if source.cone == 0.0 {
        if (p - source.centroid).dot(source.normal) <= HEIGHT_EPSILON * source.radius {
            return 0.0;
        }
        return source
            .contour
            .iter()
            .map(|c| to_polygon(p, normal, c))
            .sum::<f64>()
            .max(0.0);
    }
    // A curved source: the sum over the members whose fronts face the point.
    (source.first_element..source.first_element + source.element_count)
        .map(|m| m as usize)
        .filter(|&m| m != element && (p - elements.centroid[m]).dot(elements.normal[m]) > 0.0)
        .map(|m| to_polygon(p, normal, &elements.triangle(m)).max(0.0))
        .sum()
}

/// Whether the source sees a place `p` on an element, by its item buffer `items`, `[row][column]`
/// of a hemicube of `n` pixels a side.
pub fn visible(
    elements: &Elements,
    source: &Source,
    items: &[u32],
    n: u32,
    p: DVec3,
    element: usize,
) -> bool {
    let d = p - source.eye;
    let local = DVec3::new(
        d.dot(source.tangent),
        d.dot(source.bitangent),
        d.dot(source.normal),
    );
    let pixel = pixel_of(local, n);
    let item = items[(pixel.row * n + pixel.column) as usize];
    if item == NONE || item as usize == element {
        return true;
    }
    let plane = elements.normal[item as usize];
    let on_plane = elements.centroid[item as usize];
    let eye_height = (source.eye - on_plane).dot(plane);
    let height = (p - on_plane).dot(plane);
    let depth = if eye_height >= 0.0 { -height } else { height };
    if depth <= HEIGHT_EPSILON {
        return true;
    }
    let ray = direction_of(pixel, n);
    let ray = source.tangent * ray.x + source.bitangent * ray.y + source.normal * ray.z;
    let seen = source.eye + ray * (-eye_height / plane.dot(ray));
    let apart = p.distance(seen);
    let normal = elements.normal[element];
    let grazing = normal.dot(d).abs().min(plane.dot(d).abs()) / d.length();
    let footprint = d.length() * 2.0 / f64::from(n) / grazing.max(0.05);
    if (seen - source.eye).dot(d) > d.length() * (d.length() + REACH * footprint) {
        return true;
    }
    apart <= REACH * footprint && depth <= apart * normal.cross(plane).length() + HEIGHT_EPSILON
}

/// Sample points of a triangle (two barycentric coordinates, weight): the centroid; degree 2;
/// Radon's degree 5.
const POINTS: [[f64; 3]; 11] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0],
    [1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 3.0],
    [1.0 / 3.0, 1.0 / 3.0, 0.225],
    [0.470142064, 0.470142064, 0.132394153],
    [0.059715872, 0.470142064, 0.132394153],
    [0.470142064, 0.059715872, 0.132394153],
    [0.101286507, 0.101286507, 0.125939181],
    [0.797426985, 0.101286507, 0.125939181],
    [0.101286507, 0.797426985, 0.125939181],
];
