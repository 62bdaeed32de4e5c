//! Sources of a single element, of a piece of one, and of point lights.

use glam::DVec3;

use super::{Source, triangle_area};
use crate::constants::{KIND_POINT, KIND_SURFACE, NONE};
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::scene::PointLight;

/// An element, or a piece of one.
pub(super) fn part(
    elements: &Elements,
    connections: &Connections,
    e: usize,
    triangle: [DVec3; 3],
) -> Source {
    let eye = triangle.into_iter().sum::<DVec3>() / 3.0;
    Source {
        kind: KIND_SURFACE,
        eye,
        centroid: eye,
        normal: elements.normal[e],
        tangent: DVec3::ZERO,
        bitangent: DVec3::ZERO,
        area: triangle_area(triangle),
        facing: triangle_area(triangle),
        parts: Vec::new(),
        radius: triangle
            .into_iter()
            .map(|v| v.distance(eye))
            .fold(0.0, f64::max),
        cone: 0.0,
        emitted: elements.emitted[e],
        web: None,
        first_element: e as u32,
        element_count: 1,
        places: Vec::new(),
        contour: vec![triangle.to_vec()],
        component: connections.component[e],
    }
}

/// The two halves of a triangle, cut at the middle of its longest edge.
pub(super) fn halves(triangle: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let length = |i: usize| triangle[i].distance_squared(triangle[(i + 1) % 3]);
    let longest = (0..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
    let [a, b, c] = [0, 1, 2].map(|i| triangle[(longest + i) % 3]);
    let middle = 0.5 * (a + b);
    [[a, middle, c], [middle, b, c]]
}

pub(super) fn point(light: &PointLight, elements: &Elements) -> [Source; 2] {
    let eye = (light.position - elements.origin) / elements.unit;
    let half = |normal: DVec3, cone: f64| Source {
        kind: KIND_POINT,
        eye,
        centroid: eye,
        normal,
        tangent: DVec3::ZERO,
        bitangent: DVec3::ZERO,
        area: 0.0,
        facing: 0.0,
        parts: Vec::new(),
        radius: 0.0,
        // The shader assigns the plane between the halves to the one whose cone is 0.
        cone,
        emitted: (DVec3::from_array(light.intensity.map(f64::from))
            / (elements.unit * elements.unit))
            .as_vec3(),
        web: None,
        first_element: 0,
        element_count: 0,
        places: Vec::new(),
        contour: Vec::new(),
        component: NONE,
    };
    [half(DVec3::Y, 0.0), half(DVec3::NEG_Y, 1.0)]
}
