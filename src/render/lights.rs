//! Points that emitters and point lights are taken for where their light on relief is drawn sharply.

use glam::{DVec3, Vec3};

use super::Projection;
use crate::constants::{KIND_POINT, KIND_SURFACE, LIGHT_POINTS};
use crate::passes::types::LightPoint;
use crate::scene::Scene;
use crate::sources::triangle_area;

/// A light point in scene units.
pub struct Shining {
    position: DVec3,
    /// Of an emitter; none of a point light.
    normal: Option<DVec3>,
    strength: DVec3,
}

/// LIGHT_POINTS points on the emitters, if there are any, by their power, then the point lights.
pub fn shining(scene: &Scene) -> Vec<Shining> {
    let emitters: Vec<(usize, DVec3, f64)> = scene
        .triangles
        .iter()
        .enumerate()
        .filter_map(|(e, t)| {
            let emitted = DVec3::from(scene.materials[t.material as usize].ke.map(f64::from));
            let power = emitted.element_sum() * triangle_area(scene.corners(t));
            (power > 0.0).then_some((e, emitted, power))
        })
        .collect();
    let whole: f64 = emitters.iter().map(|e| e.2).sum();
    let share = whole / f64::from(LIGHT_POINTS);
    let mut points = Vec::new();
    let mut remaining = emitters.iter();
    let mut current = remaining.next();
    let mut passed = 0.0;
    for i in 0..LIGHT_POINTS {
        let at = (f64::from(i) + 0.5) * share;
        while let Some(&(.., power)) = current {
            if at <= passed + power {
                break;
            }
            match remaining.next() {
                Some(next) => {
                    passed += power;
                    current = Some(next);
                }
                None => break,
            }
        }
        let Some(&(e, emitted, _)) = current else {
            break;
        };
        let [a, b, c] = scene.corners(&scene.triangles[e]);
        // The R2 sequence (Roberts 2018), folded into the triangle.
        let along = |step: f64| (0.5 + step * f64::from(i)).fract();
        let (s, t) = (
            along(0.754_877_666_246_692_8),
            along(0.569_840_290_998_053_2),
        );
        let (s, t) = if s + t > 1.0 {
            (1.0 - s, 1.0 - t)
        } else {
            (s, t)
        };
        points.push(Shining {
            position: a + (b - a) * s + (c - a) * t,
            normal: Some((b - a).cross(c - a).normalize_or_zero()),
            strength: emitted * (share / emitted.element_sum()),
        });
    }
    points.extend(scene.point_lights.iter().map(|light| Shining {
        position: light.position,
        normal: None,
        strength: DVec3::from(light.intensity.map(f64::from)),
    }));
    points
}

impl Shining {
    pub fn seen_from(&self, projection: &Projection) -> LightPoint {
        LightPoint {
            position: ((self.position - projection.eye) / projection.unit).as_vec3(),
            kind: if self.normal.is_some() {
                KIND_SURFACE
            } else {
                KIND_POINT
            },
            normal: self.normal.unwrap_or_default().as_vec3(),
            strength: (self.strength / (projection.unit * projection.unit)).as_vec3(),
        }
    }

    /// What would arrive at a place without anything between, as a vector in the frame's coordinates, `[colour]`; none from
    /// below the frame's horizon.
    fn arriving(&self, at: DVec3, frame: [DVec3; 3]) -> [DVec3; 3] {
        let way = self.position - at;
        let square = way.length_squared();
        let towards = way / square.sqrt();
        let sent = self.normal.map_or(1.0, |n| (-n.dot(towards)).max(0.0));
        let local = DVec3::from(frame.map(|axis| axis.dot(towards)));
        if local.z <= 0.0 || sent == 0.0 {
            return [DVec3::ZERO; 3];
        }
        (self.strength * (sent / square))
            .to_array()
            .map(|s| local * s)
    }
}

/// The share of the points' light that arrives at a place, by colour: the direct light there, `[slot][colour]` as vectors,
/// along what would arrive without anything between; none where nothing would.
pub fn share(
    points: &[Shining],
    at: DVec3,
    frame: [DVec3; 3],
    direct: &[[Vec3; 3]],
) -> Option<Vec3> {
    let mut open = [DVec3::ZERO; 3];
    for point in points {
        let arriving = point.arriving(at, frame);
        (0..3).for_each(|c| open[c] += arriving[c]);
    }
    let share = |c: usize| {
        let found: DVec3 = direct.iter().map(|m| m[c].as_dvec3()).sum();
        match open[c].length_squared() {
            0.0 => 0.0,
            square => (found.dot(open[c]) / square).clamp(0.0, 2.0) as f32,
        }
    };
    let any = open.iter().any(|c| *c != DVec3::ZERO);
    any.then(|| Vec3::new(share(0), share(1), share(2)))
}

/// Shares beyond the horizon from those of the neighbours, triangle by triangle: bumps there still rise into the light.
pub fn spread(shares: Vec<Option<Vec3>>, triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut shares = shares;
    for _ in 0..ROUNDS {
        let mut found = vec![(Vec3::ZERO, 0.0_f32); shares.len()];
        for triangle in triangles {
            let known = triangle.iter().filter_map(|&v| shares[v as usize]);
            let (sum, count) = known.fold((Vec3::ZERO, 0.0), |(sum, n), s| (sum + s, n + 1.0));
            for &v in triangle {
                if count > 0.0 && shares[v as usize].is_none() {
                    found[v as usize].0 += sum / count;
                    found[v as usize].1 += 1.0;
                }
            }
        }
        if found.iter().all(|f| f.1 == 0.0) {
            break;
        }
        for (share, (sum, count)) in shares.iter_mut().zip(found) {
            if count > 0.0 {
                *share = Some(sum / count);
            }
        }
    }
    shares.into_iter().map(Option::unwrap_or_default).collect()
}

/// Triangles that a share spreads over beyond the horizon.
const ROUNDS: usize = 8;
