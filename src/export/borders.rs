//! Texels along the borders of charts, so that interpolation there gives the light of the surface.
//!
//! Across a seam a surface continues in another chart. Both sides interpolate between texels some of
//! which lie outside of their charts; these are chosen so that along the border the interpolated
//! light is what the surface has there, in the least squares.

use glam::{DVec2, Vec3};

use super::light_map::Looking;
use super::surface::Surface;
use super::texels::{TexelMap, borders, on_edge};
use crate::error::Result;
use crate::solver::{LightAt, Place};

/// Points along a border a texel, at which direct light is found.
const POINTS: f64 = 2.0;

/// Texels along a border from one point at which indirect light is found to the next.
const SPACING: f64 = 4.0;

/// Weight of a texel's own light against that along the border.
const OWN: f64 = 0.02;

/// Sweeps over the texels.
const SWEEPS: usize = 60;

/// A texel becomes this many times as bright as it was at most.
const BRIGHTER: f64 = 2.0;

/// Direct and indirect light.
type Value = [f64; 6];

/// Interpolation at a point of a border, and the light there.
struct Sample {
    texels: [(usize, f64); 4],
    light: Value,
}

fn value(direct: Vec3, indirect: Vec3) -> Value {
    let ([a, b, c], [d, e, f]) = (direct.to_array(), indirect.to_array());
    [a, b, c, d, e, f].map(f64::from)
}

/// Changes the texels outside of their charts.
pub(super) fn fit(
    surface: &Surface,
    map: &TexelMap,
    looking: &mut Looking<'_>,
    light: &mut [LightAt],
) -> Result<()> {
    let samples = samples(surface, map, looking)?;
    let own: Vec<Value> = light.iter().map(|l| value(l.direct, l.indirect)).collect();
    let mut values = own.clone();
    // Samples that read each texel that may change.
    let is_free = |t: usize| map.texels[t].distance > 0.0;
    let mut read_by: Vec<Vec<(usize, f64)>> = vec![Vec::new(); light.len()];
    for (s, sample) in samples.iter().enumerate() {
        for &(t, weight) in &sample.texels {
            if is_free(t) && weight > 0.0 {
                read_by[t].push((s, weight));
            }
        }
    }
    let free: Vec<usize> = (0..light.len())
        .filter(|&t| !read_by[t].is_empty())
        .collect();
    let mut residual: Vec<Value> = samples.iter().map(|s| s.off(&values)).collect();
    for _ in 0..SWEEPS {
        for &t in &free {
            let square: f64 = read_by[t].iter().map(|(_, w)| w * w).sum();
            for c in 0..6 {
                let pull: f64 = read_by[t].iter().map(|&(s, w)| w * residual[s][c]).sum();
                let back = OWN * (own[t][c] - values[t][c]);
                let wanted = values[t][c] + (pull + back) / (square + OWN);
                let now = wanted.clamp(0.0, BRIGHTER * own[t][c]);
                let change = now - values[t][c];
                values[t][c] = now;
                for &(s, w) in &read_by[t] {
                    residual[s][c] -= w * change;
                }
            }
        }
    }
    for &t in &free {
        let [a, b, c, d, e, f] = values[t].map(|v| v as f32);
        light[t] = LightAt {
            direct: Vec3::new(a, b, c),
            indirect: Vec3::new(d, e, f),
        };
    }
    Ok(())
}

impl Sample {
    /// What the light there is more than the interpolated one.
    fn off(&self, values: &[Value]) -> Value {
        std::array::from_fn(|c| {
            let found: f64 = self.texels.iter().map(|&(t, w)| w * values[t][c]).sum();
            self.light[c] - found
        })
    }
}

/// A point of a border.
struct Point {
    texels: [(usize, f64); 4],
    place: Place,
    /// The two of those at which indirect light is found that it lies between, and how far.
    knots: [usize; 2],
    along: f64,
}

/// Points along the borders with their light; none of what was stopped before.
fn samples(surface: &Surface, map: &TexelMap, looking: &mut Looking<'_>) -> Result<Vec<Sample>> {
    let (mut points, mut knots) = (Vec::new(), Vec::new());
    for (t, k) in borders(surface) {
        let Some(page) = surface.page[t] else {
            continue;
        };
        let ends = [k, (k + 1) % 3].map(|k| surface.texel(t, k));
        let length = ends[0].distance(ends[1]);
        let pieces = (length / SPACING).ceil().max(1.0) as usize;
        let first = knots.len();
        let beside = |along: f64| surface.place(t, on_edge(surface, t, k, along)[1]);
        knots.extend((0..=pieces).map(|i| beside(i as f64 / pieces as f64)));
        let count = (POINTS * length).ceil().max(1.0) as usize;
        for i in 0..count {
            let along = (i as f64 + 0.5) / count as f64;
            let at: DVec2 = ends[0] + along * (ends[1] - ends[0]);
            let between = map.between(page, at);
            let known = between.map(|(t, w)| t.map(|t| (t, w)));
            let [Some(a), Some(b), Some(c), Some(d)] = known else {
                continue;
            };
            let piece = ((along * pieces as f64) as usize).min(pieces - 1);
            points.push(Point {
                texels: [a, b, c, d],
                place: beside(along),
                knots: [first + piece, first + piece + 1],
                along: along * pieces as f64 - piece as f64,
            });
        }
    }
    let indirect = looking.at(&knots)?;
    let places: Vec<Place> = points.iter().map(|point| point.place).collect();
    let direct = looking.direct(&places)?;
    let sample = |(point, &direct): (&Point, &Vec3)| {
        let [near, far] = point.knots.map(|k| indirect.get(k).map(|l| l.indirect));
        Some(Sample {
            texels: point.texels,
            light: value(direct, near?.lerp(far?, point.along as f32)),
        })
    };
    Ok(points.iter().zip(&direct).filter_map(sample).collect())
}
