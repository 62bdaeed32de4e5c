//! Elements with another surface close in front of them: light between the two varies over short
//! distances.

use std::time::Duration;

use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use crate::mesh::elements::Elements;

/// Heights above an element's plane below which a place lies in the plane, in internal units.
const FLAT: f64 = 1e-6;

/// Margin of boxes: the rounding of coordinates of 1 in f32.
const BOX_MARGIN: f32 = 1.0 / (1 << 22) as f32;

/// A place on a triangle, and the triangle's chart.
struct Place(DVec3, u32);

impl Boundable for Place {
    fn aabb(&self) -> Aabb {
        let mut bounds = Aabb::from_point(self.0.as_vec3a());
        bounds.min -= BOX_MARGIN;
        bounds.max += BOX_MARGIN;
        bounds
    }
}

/// Places on all triangles, no more than `reach` apart, in a tree of boxes.
pub(super) struct Surroundings<'a> {
    elements: &'a Elements,
    reach: f64,
    places: Vec<Place>,
    bvh: Bvh2,
    /// The chart of all places in a node if they have the same, `[node]`.
    charts: Vec<Option<u32>>,
}

impl<'a> Surroundings<'a> {
    pub fn new(elements: &'a Elements, charts: &[Vec<u32>], reach: f64) -> Self {
        let mut places = Vec::new();
        for (c, chart) in (0_u32..).zip(charts) {
            for &e in chart {
                let of_element = spread(elements.triangle(e as usize), reach);
                places.extend(of_element.map(|place| Place(place, c)));
            }
        }
        let params = BvhBuildParams::fast_build();
        let bvh = build_bvh2(&places, params, &mut Duration::default());
        let charts = charts_of_nodes(&bvh, &places);
        Self {
            elements,
            reach,
            places,
            bvh,
            charts,
        }
    }

    /// Whether another chart has a place in front of this element within `reach` of its centroid.
    pub fn any_before(&self, element: u32, chart: u32) -> bool {
        let (middle, normal) = (
            self.elements.centroid[element as usize],
            self.elements.normal[element as usize],
        );
        let square = self.reach * self.reach;
        let before = |&place: &u32| {
            let Place(place, of) = self.places[place as usize];
            let way = place - middle;
            of != chart && way.length_squared() <= square && way.dot(normal) > FLAT
        };
        let mut nodes = vec![0];
        while let Some(n) = nodes.pop() {
            let node = &self.bvh.nodes[n];
            let (low, high) = (
                node.aabb.min.as_dvec3() - middle,
                node.aabb.max.as_dvec3() - middle,
            );
            let nearest = DVec3::ZERO.clamp(low, high);
            let highest = (low * normal).max(high * normal).element_sum();
            if self.charts[n] == Some(chart) || nearest.length_squared() > square || highest <= FLAT
            {
                continue;
            }
            let first = node.first_index as usize;
            if !node.is_leaf() {
                nodes.extend([first, first + 1]);
                continue;
            }
            let own = first..first + node.prim_count as usize;
            if self.bvh.primitive_indices[own].iter().any(before) {
                return true;
            }
        }
        false
    }
}

fn charts_of_nodes(bvh: &Bvh2, places: &[Place]) -> Vec<Option<u32>> {
    // Parents come before their children; an empty tree has no nodes.
    let mut order = Vec::from_iter((!bvh.nodes.is_empty()).then_some(0));
    let mut next = 0;
    while next < order.len() {
        let node = &bvh.nodes[order[next]];
        let first = node.first_index as usize;
        if !node.is_leaf() {
            order.extend([first, first + 1]);
        }
        next += 1;
    }
    let mut charts = vec![None; bvh.nodes.len()];
    for &n in order.iter().rev() {
        let node = &bvh.nodes[n];
        let first = node.first_index as usize;
        charts[n] = if node.is_leaf() {
            let own = &bvh.primitive_indices[first..first + node.prim_count as usize];
            let chart = |place: u32| places[place as usize].1;
            let one = own.iter().all(|&place| chart(place) == chart(own[0]));
            one.then(|| chart(own[0]))
        } else {
            charts[first].filter(|_| charts[first] == charts[first + 1])
        };
    }
    charts
}

/// Centroids of equal parts of a triangle, none longer than `most`.
fn spread([a, b, c]: [DVec3; 3], most: f64) -> impl Iterator<Item = DVec3> {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let parts = (longest / most).ceil().max(1.0);
    let [ab, ac] = [(b - a) / parts, (c - a) / parts];
    (0..parts as u32).flat_map(move |i| {
        (0..parts as u32 - i).flat_map(move |j| {
            // The upright part, and the inverted one beside it.
            let upright = Some(1.0 / 3.0);
            let turned = (f64::from(i + j + 1) < parts).then_some(2.0 / 3.0);
            upright
                .into_iter()
                .chain(turned)
                .map(move |third| a + ab * (f64::from(i) + third) + ac * (f64::from(j) + third))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::charts::{Connections, charts, morton_order};
    use crate::scene::{BuiltinOptions, load};

    /// The tree finds what a look at all pairs finds.
    #[test]
    fn elements_near_others_are_those_of_all_pairs() {
        let options = BuiltinOptions {
            patches: Some(4_000),
            statue: None,
        };
        let scene = load("cornell", &options).expect("a scene of ours");
        let elements = Elements::new(&scene);
        let connections = Connections::new(&elements);
        let charts = charts(&elements, &connections, &morton_order(&elements));
        let mut chart_of = vec![0_u32; elements.len()];
        for (c, chart) in (0_u32..).zip(&charts) {
            chart.iter().for_each(|&e| chart_of[e as usize] = c);
        }
        // Longer than any element, so that each is one place.
        let reach = 0.15;
        let surroundings = Surroundings::new(&elements, &charts, reach);
        let mut found = [0, 0];
        for e in 0..elements.len() {
            let near = surroundings.any_before(e as u32, chart_of[e]);
            found[usize::from(near)] += 1;
            let sees = |other: usize| {
                let way = elements.centroid[other] - elements.centroid[e];
                chart_of[other] != chart_of[e]
                    && way.length() <= reach
                    && way.dot(elements.normal[e]) > FLAT
            };
            assert_eq!(near, (0..elements.len()).any(sees), "element {e}");
        }
        assert!(found[0] > 0 && found[1] > 0, "{found:?}");
    }
}
