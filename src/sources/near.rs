//! Which elements have another surface close before them: light there changes over short ways, and falls on it unevenly.

use std::collections::HashMap;

use glam::{DVec3, IVec3};

use crate::elements::Elements;

/// Heights above an element's plane below which a place lies in the plane, in internal units.
const FLAT: f64 = 1e-6;

/// Per element: whether anything of another chart lies before it within `reach` of its centroid.
pub(super) fn near_others(elements: &Elements, charts: &[Vec<u32>], reach: f64) -> Vec<bool> {
    let cell = |p: DVec3| (p / reach).floor().as_ivec3();
    // Places on the triangles, no more than `reach` apart, by chart.
    let mut places: HashMap<IVec3, Vec<(u32, Vec<DVec3>)>> = HashMap::new();
    for (c, chart) in (0_u32..).zip(charts) {
        for &e in chart {
            for place in spread(elements.triangle(e as usize), reach) {
                let here = places.entry(cell(place)).or_default();
                match here.last_mut() {
                    Some((last, places)) if *last == c => places.push(place),
                    _ => here.push((c, vec![place])),
                }
            }
        }
    }
    let mut near = vec![false; elements.len()];
    let square = reach * reach;
    for (c, chart) in (0_u32..).zip(charts) {
        for &e in chart {
            let (middle, normal) = (elements.centroid[e as usize], elements.normal[e as usize]);
            let before = |place: &DVec3| {
                let way = *place - middle;
                way.length_squared() <= square && way.dot(normal) > FLAT
            };
            let home = cell(middle);
            near[e as usize] = (0..27).any(|i| {
                let beside = IVec3::new(i % 3, i / 3 % 3, i / 9) - 1;
                let others = places.get(&(home + beside)).into_iter().flatten();
                others
                    .filter(|(of, _)| *of != c)
                    .any(|(_, places)| places.iter().any(before))
            });
        }
    }
    near
}

/// Middles of equal parts of a triangle, no part longer than `most`.
fn spread([a, b, c]: [DVec3; 3], most: f64) -> impl Iterator<Item = DVec3> {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let parts = (longest / most).ceil().max(1.0);
    let [ab, ac] = [(b - a) / parts, (c - a) / parts];
    (0..parts as u32).flat_map(move |i| {
        (0..parts as u32 - i).flat_map(move |j| {
            // The upright part, and the one upside down beside it.
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
    use crate::charts::{Connections, charts, morton_order};
    use crate::scene::{BuiltinOptions, load};

    /// The grid finds what a look at all pairs finds.
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
        let mut chart_of = vec![0; elements.len()];
        for (c, chart) in charts.iter().enumerate() {
            chart.iter().for_each(|&e| chart_of[e as usize] = c);
        }
        // Longer than any element, each of which is thus one place.
        let reach = 0.15;
        let near = near_others(&elements, &charts, reach);
        for (e, &near) in near.iter().enumerate() {
            let sees = |other: usize| {
                let way = elements.centroid[other] - elements.centroid[e];
                chart_of[other] != chart_of[e]
                    && way.length() <= reach
                    && way.dot(elements.normal[e]) > FLAT
            };
            assert_eq!(near, (0..elements.len()).any(sees), "element {e}");
        }
        assert!(near.contains(&true) && near.contains(&false));
    }
}
