//! The walk through the tree of shadow casters against its twin, which tries every triangle.

use bytemuck::Zeroable;
use glam::Vec3;
use mesolux::mesh::shadow_tree::ShadowTree;
use mesolux::passes::shadow_rays::ShadowRays;
use mesolux::passes::types::{ShadowRay, ShadowTriangle};
use mesolux::reference;

use crate::common::random::Random;
use crate::common::{assert_silent, device};

/// Shares by which a crossing in f32 may lie on another side than in f64: coordinates of up to 4
/// round by 2⁻²², a volume of three such by some 2⁻²⁰ against triangles of 10⁻² and ways of 1: 10⁻⁴
/// of a share.
const UNSURE: f64 = 1e-3;

#[test]
fn the_tree_finds_what_trying_every_triangle_does() {
    let mut random = Random(1);
    let mut place = |size: f64| {
        let mut side = || random.range(-size, size) as f32;
        Vec3::new(side(), side(), side())
    };
    // From large ones to small ones, some square to an axis.
    let triangles: Vec<ShadowTriangle> = (0..400)
        .map(|i| {
            let middle = place(2.0);
            let size = [1.0, 0.3, 0.1, 0.03][i % 4];
            let mut corners = [0; 3].map(|_| middle + place(size));
            if i % 3 == 0 {
                corners.iter_mut().for_each(|c| c[i / 3 % 3] = middle[0]);
            }
            let [a, b, c] = corners;
            ShadowTriangle {
                a,
                b,
                c,
                // Whole branches of the tree have a relief, others in part.
                relief: (middle.x > 0.7 || i % 5 == 0).into(),
                ..ShadowTriangle::zeroed()
            }
        })
        .collect();
    let rays: Vec<ShadowRay> = (0..20_000)
        .map(|i| {
            let from = place(2.0);
            // A third along an axis: their ways never meet the sides of boxes that lie along them.
            let mut to = from + place(1.5);
            if i % 3 == 0 {
                to = from.with_x(to.x);
            }
            ShadowRay {
                from,
                clear: if i % 2 == 0 { 0.0 } else { 0.5 },
                to,
            }
        })
        .collect();
    let tree = ShadowTree::new(triangles.clone());
    assert_eq!(tree.triangles.len(), triangles.len());
    let pass = ShadowRays::new(&device()).expect("the device walks");
    let found = pass.run(&tree, &rays).expect("the device walks");
    let (mut sure, mut blocked) = (0, 0);
    for (ray, found) in rays.iter().zip(&found) {
        let depth = reference::shadow_rays::blocked(&triangles, ray);
        if depth.abs() > UNSURE {
            sure += 1;
            blocked += usize::from(depth > 0.0);
            assert_eq!(*found, depth > 0.0, "{ray:?}: {depth}");
        }
    }
    println!(
        "{blocked} of {sure} sure ways of {} are blocked",
        rays.len()
    );
    assert!(sure > 15_000 && blocked > 2000 && sure - blocked > 2000);
    let none = pass
        .run(&ShadowTree::new(Vec::new()), &rays[..100])
        .expect("the device walks");
    assert!(none.iter().all(|hit| !hit));
    assert_silent();
}
