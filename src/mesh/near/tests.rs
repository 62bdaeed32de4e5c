//! Form factors by parts against those by all members.

use glam::{DQuat, DVec3, EulerRot};

use super::parts::Part;
use super::seen::{Before, ROUGH, Seen};
use super::{NearPairs, Nearness, pairs_of};
use crate::math::form_factor::to_triangle;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::{self, Grouping, Sources};
use crate::scene::Lights;
use crate::scene::shapes::Shapes;

/// Irrational steps, for places and normals that spread evenly.
const STEPS: [f64; 5] = [0.8567, 0.7339, 0.6287, 0.5386, 0.4614];

/// An oblique grid and a sphere.
fn shapes() -> (Elements, Sources, Connections) {
    let mut shapes = Shapes::new();
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.3, 0.5, 0.7);
    let (x, y) = (turn * DVec3::X, turn * DVec3::Y);
    shapes.quad(DVec3::ZERO, x, y, (40, 40), 0);
    shapes.sphere(DVec3::new(0.6, 0.5, 0.9), 0.3, 4, true, 0);
    shapes.weld();
    let mut elements = Elements::new(&shapes.scene);
    let (sources, connections) =
        sources::build(&mut elements, &Lights::NONE, &Grouping::default(), 0);
    (elements, sources, connections)
}

/// With places about both with any normal, in internal units.
fn scene() -> (Elements, Vec<Seen>, Vec<[DVec3; 2]>) {
    let (elements, sources, _) = shapes();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for c in &elements.centroid {
        (low, high) = (low.min(*c), high.max(*c));
    }
    let place = |k: usize| {
        let [u, v, w, s, t] = STEPS.map(|step| (0.5 + step * k as f64).fract());
        let (sin, cos) = (std::f64::consts::TAU * s).sin_cos();
        let up = 2.0 * t - 1.0;
        let across = (1.0 - up * up).sqrt();
        [
            low + (high - low) * DVec3::new(u, v, w),
            DVec3::new(across * cos, across * sin, up),
        ]
    };
    let seen = |source| Seen::new(&elements, source);
    let seen = sources.list.iter().map(seen).collect();
    let places = (0..400).map(place).collect();
    (elements, seen, places)
}

fn by_members(elements: &Elements, seen: &Seen, part: Part, p: DVec3, n: DVec3) -> f64 {
    let members = part.first..part.first + part.count;
    let factor = |m: usize| {
        let triangle = &seen.triangles[m];
        let front = (p - seen.centroid(m)).dot(elements.normal[seen.tree.members[m] as usize]);
        match front > 0.0 {
            true => to_triangle(p, n, triangle).max(0.0),
            false => 0.0,
        }
    };
    members.map(factor).sum()
}

/// Nor is any looked for.
#[test]
fn none_is_near_where_none_is_asked_for() {
    let (elements, sources, connections) = shapes();
    let tree = ShadowTree::new(Occluders::elements(&elements).casters(&elements, &connections));
    let near = |nearness: &Nearness| {
        let found = pairs_of(&elements, &sources.list, &tree, nearness);
        NearPairs::new(&elements, &sources.list, found)
    };
    let some = Nearness {
        source: 1e-4,
        part: 1e-4,
    };
    assert!(near(&some).pair_count() > 100);
    let none = near(&Nearness::NONE);
    assert_eq!((none.pair_count(), none.rays), (0, 0));
    assert_eq!(none.weights, elements.area);
}

#[test]
fn near_factors_by_parts_are_those_by_members() {
    let (elements, seen, places) = scene();
    let (mut whole, mut parts) = (Apart::default(), Apart::default());
    let mut fewer = 0;
    for seen in &seen {
        let mut factors = vec![0.0; seen.tree.part_count()];
        for &[p, n] in &places {
            let before = Before {
                element: usize::MAX,
                normal: n,
                samples: &[(p, 1.0)],
                clear: false,
            };
            let all = seen.note(seen.tree.whole(), &before, &mut factors);
            assert!(
                seen.roughly(p, n) >= ROUGH * all,
                "a rough form factor is too small"
            );
            let mut stack = vec![seen.tree.whole()];
            while let Some(part) = stack.pop() {
                let factor = factors[part.index];
                if factor.is_nan() {
                    fewer += part.count;
                    continue;
                }
                let apart = match part.index {
                    0 => &mut whole,
                    _ => &mut parts,
                };
                apart.add(factor, by_members(&elements, seen, part, p, n));
                if part.count > 1 {
                    stack.extend(part.halves());
                }
            }
        }
    }
    println!("whole: {whole:?}; parts: {parts:?}; {fewer} members within parts");
    assert!(whole.count > 1000 && parts.count > 1000 && fewer > 1000);
    assert!(whole.relative() <= 2.0 * WHOLE && whole.most <= 2.0 * MOST);
    assert!(parts.relative() <= 2.0 * PARTS);
}

/// Measured: rms over the rms of the form factors, and the largest difference.
const WHOLE: f64 = 7.5e-4;
const MOST: f64 = 3.3e-4;
const PARTS: f64 = 5.8e-4;

/// How far form factors are from the true ones.
#[derive(Debug, Default)]
struct Apart {
    count: u32,
    squares: f64,
    off: f64,
    most: f64,
}

impl Apart {
    fn add(&mut self, factor: f64, truth: f64) {
        self.count += 1;
        self.squares += truth * truth;
        self.off += (factor - truth).powi(2);
        self.most = self.most.max((factor - truth).abs());
    }

    fn relative(&self) -> f64 {
        (self.off / self.squares).sqrt()
    }
}

/// Samples of a close receiver count by their weights, and a part without a form factor of its own
/// finds one.
#[test]
fn near_samples_are_weighted() {
    let (_, seen, places) = scene();
    for seen in &seen {
        let mut factors = vec![0.0; seen.tree.part_count()];
        for of in places.windows(3) {
            let samples = [(of[0][0], 0.5), (of[1][0], 0.3), (of[2][0], 0.2)];
            let before = Before {
                element: usize::MAX,
                normal: of[0][1],
                samples: &samples,
                clear: false,
            };
            let factor = seen.note(seen.tree.whole(), &before, &mut factors);
            let each = samples
                .map(|(p, weight)| weight * seen.factor(seen.tree.whole(), p, before.normal));
            assert!((factor - each.iter().sum::<f64>()).abs() <= MOST);
            assert!(
                seen.member_at(0.5, seen.tree.whole(), &before, &mut factors)
                    < seen.triangles.len()
            );
        }
    }
}
