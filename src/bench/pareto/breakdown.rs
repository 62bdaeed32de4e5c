//! Distribution of a bake's error: by material and facing direction, in direct and indirect light,
//! and the worst elements.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::bakes::Done;
use crate::bench::measure::net_squares;
use crate::bench::places::place_of;
use crate::bench::truth::{PARTS, Parts, Truth, average, mean};
use crate::scene::Scene;

/// Number of worst elements reported.
const WORST: usize = 10;

/// Error at the centroids of a part of the scene, over the mean irradiance of all places.
#[derive(Debug, Clone, Serialize)]
pub struct Part {
    pub name: String,
    pub places: usize,
    /// Mean of the reference here over that of all places.
    pub light: f64,
    pub bias: f64,
    pub rms: f64,
    /// Of direct and of indirect light.
    pub rms_direct: f64,
    pub rms_indirect: f64,
    /// Share of the sum of squares over all places.
    pub share: f64,
}

/// An element whose irradiance is far from the reference.
#[derive(Debug, Clone, Serialize)]
pub struct Worst {
    /// In the order of the input.
    pub triangle: usize,
    pub material: String,
    /// Centroid, scene units.
    pub place: [f64; 3],
    pub normal: [f64; 3],
    /// Means over the colours, over the mean of all places.
    pub truth: f64,
    pub ours: f64,
    /// The part of the difference that is direct light.
    pub direct: f64,
}

/// The error of one bake in parts.
#[derive(Debug, Clone, Serialize)]
pub struct Breakdown {
    pub parts: Vec<Part>,
    pub worst: Vec<Worst>,
}

/// Values at the places with their truth: all light, the direct or the indirect part.
struct Light {
    ours: Vec<Vec3>,
    truth: Vec<Parts>,
}

impl Light {
    /// The parts of two truths are independent, and so are those of their difference.
    fn without(&self, other: &Self) -> Self {
        let ours = self.ours.iter().zip(&other.ours);
        let truth = self.truth.iter().zip(&other.truth);
        Self {
            ours: ours.map(|(a, b)| a - b).collect(),
            truth: truth
                .map(|(a, b)| std::array::from_fn::<Vec3, PARTS, _>(|k| a[k] - b[k]))
                .collect(),
        }
    }

    fn true_grey(&self, place: usize) -> f64 {
        average(&self.truth[place]).element_sum() / 3.0
    }
}

impl Breakdown {
    pub(super) fn new(scene: &Scene, done: &Done, truth: &Truth) -> Self {
        let global = Light {
            ours: truth.at_places(&done.irradiance),
            truth: truth.centroids.clone(),
        };
        let direct = Light {
            ours: truth.at_places(&done.direct),
            truth: truth.direct.clone(),
        };
        let indirect = global.without(&direct);
        let lights = [&global, &direct, &indirect];
        let squares = lights.map(|light| net_squares(&light.ours, &light.truth));
        let whole = mean(&truth.places, &global.truth);
        let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (i, e) in truth.places.iter().map(|place| place.triangle).enumerate() {
            let name = &scene.materials[scene.triangles[e].material as usize].name;
            let faces = facing(place_of(scene, e).1);
            for key in ["all".into(), name.clone(), format!("{name} {faces}")] {
                groups.entry(key).or_default().push(i);
            }
        }
        let weight = |i: usize| truth.places[i].weight;
        let all: f64 = (0..truth.places.len())
            .map(|i| weight(i) * squares[0][i])
            .sum();
        let parts = groups.into_iter().map(|(name, members)| {
            let sum = |value: &dyn Fn(usize) -> f64| -> f64 {
                members.iter().map(|&i| weight(i) * value(i)).sum()
            };
            let count = sum(&|_| 1.0);
            let rms = |values: &[f64]| (sum(&|i| values[i]) / count).max(0.0).sqrt() / whole;
            let light = sum(&|i| global.true_grey(i));
            let apart = sum(&|i| grey(global.ours[i]) - global.true_grey(i));
            Part {
                name,
                places: members.len(),
                light: light / count / whole,
                bias: apart / count / whole,
                rms: rms(&squares[0]),
                rms_direct: rms(&squares[1]),
                rms_indirect: rms(&squares[2]),
                share: sum(&|i| squares[0][i]) / all,
            }
        });
        let mut order: Vec<usize> = (0..truth.places.len()).collect();
        order.sort_by(|&a, &b| squares[0][b].total_cmp(&squares[0][a]));
        order.dedup_by_key(|&mut i| truth.places[i].triangle);
        let worst = order.iter().take(WORST).map(|&i| {
            let triangle = truth.places[i].triangle;
            let (place, normal) = place_of(scene, triangle);
            let material = scene.triangles[triangle].material as usize;
            Worst {
                triangle,
                material: scene.materials[material].name.clone(),
                place: place.to_array(),
                normal: normal.to_array(),
                truth: global.true_grey(i) / whole,
                ours: grey(global.ours[i]) / whole,
                direct: (grey(direct.ours[i]) - direct.true_grey(i)) / whole,
            }
        });
        Self {
            parts: parts.collect(),
            worst: worst.collect(),
        }
    }

    pub(super) fn print(&self) {
        crate::say!(
            "part            places  light  share of error   bias %    rms %  of direct  of indirect"
        );
        for p in &self.parts {
            crate::say!(
                "{:<15} {:>6} {:>6.2} {:>13.1} % {:>+8.2} {:>8.2} {:>10.2} {:>12.2}",
                p.name,
                p.places,
                p.light,
                100.0 * p.share,
                100.0 * p.bias,
                100.0 * p.rms,
                100.0 * p.rms_direct,
                100.0 * p.rms_indirect
            );
        }
        crate::say!(
            "worst elements: triangle, material, place, normal, irradiance over the mean, ours less truth %, of it direct %"
        );
        for w in &self.worst {
            let [x, y, z] = w.place;
            let [nx, ny, nz] = w.normal;
            crate::say!(
                "{:>8} {:<10} ({x:.3}, {y:.3}, {z:.3})  ({nx:+.2}, {ny:+.2}, {nz:+.2}) {:>6.3} {:>+7.1} {:>+7.1}",
                w.triangle,
                w.material,
                w.truth,
                100.0 * (w.ours - w.truth),
                100.0 * w.direct
            );
        }
    }
}

/// Mean over the colours.
fn grey(v: Vec3) -> f64 {
    v.as_dvec3().element_sum() / 3.0
}

/// The axis that a normal is nearest to.
fn facing(normal: DVec3) -> &'static str {
    let size = normal.abs();
    let axis = (0..3).fold(0, |best, i| if size[i] > size[best] { i } else { best });
    [["-x", "+x"], ["-y", "+y"], ["-z", "+z"]][axis][usize::from(normal[axis] > 0.0)]
}
