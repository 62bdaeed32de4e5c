//! The members of a source, as its near receivers see them.

use glam::DVec3;

use super::parts::PartTree;
use crate::math::form_factor::vector_to_triangle;
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// A member further off than this many of its radii, and as high above the receiver's horizon,
/// counts as a disc seen along its axis: off by less than 1 %.
const AS_DISC: f64 = 5.0;

/// Height above a member's plane from which on a place sees its front, internal units.
const ABOVE: f64 = 1e-7;

/// A source as its near receivers see it.
pub(super) struct Seen {
    /// Of the ball that holds the source.
    pub middle: DVec3,
    pub radius: f64,
    pub tree: PartTree,
    /// In the tree's order.
    pub members: Vec<Member>,
}

pub(super) struct Member {
    pub triangle: [DVec3; 3],
    pub centroid: DVec3,
    normal: DVec3,
    area: f64,
    pub radius: f64,
}

impl Seen {
    pub fn new(elements: &Elements, source: &Source) -> Self {
        let tree = PartTree::of(elements, source);
        // An element that is cut into several sources.
        let cut = source.element_count == 1;
        let member = |&e: &u32| {
            let own = elements.triangle(e as usize);
            let triangle = match source.contour.first().map(Vec::as_slice) {
                Some(&[a, b, c]) if cut => [a, b, c],
                _ => own,
            };
            Member::new(triangle, elements.normal[e as usize])
        };
        Self {
            middle: source.centroid,
            radius: source.radius,
            members: tree.members.iter().map(member).collect(),
            tree,
        }
    }
}

impl Member {
    fn new(triangle: [DVec3; 3], normal: DVec3) -> Self {
        let [a, b, c] = triangle;
        let centroid = (a + b + c) / 3.0;
        Self {
            triangle,
            centroid,
            normal,
            area: 0.5 * (b - a).cross(c - a).length(),
            radius: triangle
                .map(|v| v.distance(centroid))
                .into_iter()
                .fold(0.0, f64::max),
        }
    }

    /// Form factor from a place, as if nothing stood between.
    pub fn form_factor(&self, p: DVec3, n: DVec3) -> f64 {
        self.form_factor_vector(p, n).dot(n).max(0.0)
    }

    /// See [`vector_to_triangle`].
    pub fn form_factor_vector(&self, p: DVec3, n: DVec3) -> DVec3 {
        let way = self.centroid - p;
        let facing = -way.dot(self.normal);
        let height = way.dot(n);
        if facing <= ABOVE || height <= -self.radius {
            return DVec3::ZERO;
        }
        let square = way.length_squared();
        if height >= self.radius && square > AS_DISC * AS_DISC * self.radius * self.radius {
            let disc = std::f64::consts::PI * square + self.area;
            return way * (facing * self.area / (square * disc));
        }
        vector_to_triangle(p, n, &self.triangle)
    }
}
