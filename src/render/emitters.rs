//! Emitters where their light is drawn sharply: in closed form, and as points where shadows are
//! looked for.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::lights::{sun_disc, sun_distance};
use crate::constants::{LIGHT_POINTS, LIGHT_SETS};
use crate::mesh::merged::merged;
use crate::mesh::sources::triangle_area;
use crate::passes::types::LightPolygon;
use crate::picture::Projection;
use crate::scene::{Beam, Scene};

/// A light point in scene units.
pub struct Shining {
    pub position: DVec3,
    /// Normal of an emitter; None for a point light.
    pub normal: Option<DVec3>,
    pub area: f64,
    pub strength: DVec3,
    pub beam: Option<Beam>,
}

/// A triangle that emits, of as few as possible.
#[derive(Clone, Copy)]
struct Emitter {
    corners: [DVec3; 3],
    radiance: [f32; 3],
}

/// Emitters of a scene, without its suns. Those that are cut finely are joined: the closed form
/// takes time by the polygon, and few points on each of many triangles would not be spread evenly.
fn emitters(scene: &Scene) -> Vec<Emitter> {
    let radiance = |i: usize| {
        let t = &scene.triangles[i];
        let material = &scene.materials[t.material as usize];
        let radiance = material.emitted_over(&t.uv_of_emission());
        radiance.iter().any(|&c| c > 0.0).then_some(radiance)
    };
    let joined = merged(scene, radiance);
    joined
        .iter()
        .map(|t| Emitter {
            corners: t.vertices.map(|v| scene.vertices[v as usize]),
            radiance: t.kind,
        })
        .collect()
}

/// What emits in a scene.
pub struct Emitters {
    /// All; None where they are many.
    polygons: Option<Vec<Polygon>>,
    /// LIGHT_SETS sets of LIGHT_POINTS points on the emitters, distributed by power, if there are
    /// emitters; then the point lights.
    pub points: Vec<Shining>,
}

impl Emitters {
    pub fn new(scene: &Scene) -> Self {
        let emitters = emitters(scene);
        Self {
            polygons: polygons(&emitters),
            points: points(scene, &emitters),
        }
    }

    /// Whether places that nothing shadows are lit by points: by point lights, or by emitters that
    /// are not in closed form.
    pub fn light_by_points(&self, scene: &Scene) -> bool {
        self.polygons.is_none() || !scene.lights.points.is_empty()
    }

    /// Emitters and suns, if their light is found in closed form: all, or none where the emitters
    /// are many.
    pub fn seen_from(&self, scene: &Scene, projection: &Projection) -> Vec<LightPolygon> {
        let Some(polygons) = &self.polygons else {
            return Vec::new();
        };
        let emitters = polygons.iter().map(|polygon| {
            let seen = |p: DVec3| ((p - projection.eye) / projection.unit).as_vec3();
            let [a, b, c, d] = polygon.corners.map(seen);
            let strength = std::f32::consts::PI * Vec3::from(polygon.radiance);
            LightPolygon {
                a,
                b,
                c,
                d,
                strength,
                far: 0,
            }
        });
        let suns = scene.lights.suns.iter().map(|sun| {
            let towards = sun.towards.as_vec3();
            LightPolygon {
                a: towards,
                b: towards,
                c: towards,
                d: towards,
                strength: sun.irradiance.into(),
                far: 1,
            }
        });
        emitters.chain(suns).collect()
    }
}

/// Most polygons whose light is found in closed form: each costs about as much as a light point.
const MOST_POLYGONS: usize = 16;

/// An emitter in closed form, its last corner twice if it is a triangle.
struct Polygon {
    corners: [DVec3; 4],
    radiance: [f32; 3],
}

impl Polygon {
    /// The same with a triangle that continues it across an edge to a convex quadrangle in one
    /// plane, of the same radiance.
    fn joined(&self, corners: [DVec3; 3], radiance: [f32; 3]) -> Option<Self> {
        let [a, b, c, d] = self.corners;
        if radiance != self.radiance || c != d {
            return None;
        }
        let own = [a, b, c];
        // The edge runs the other way in the other triangle.
        let (k, l) = (0..3)
            .flat_map(|k| (0..3).map(move |l| (k, l)))
            .find(|&(k, l)| own[k] == corners[(l + 1) % 3] && own[(k + 1) % 3] == corners[l])?;
        let new = corners[(l + 2) % 3];
        let quad = [own[k], new, own[(k + 1) % 3], own[(k + 2) % 3]];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let turns = |i: usize| {
            let [p, q, r] = [0, 1, 2].map(|j| quad[(i + j) % 4]);
            let turn = (q - p).cross(r - q);
            turn.normalize_or_zero().dot(normal) > 1.0 - 1e-9
        };
        (0..4).all(turns).then_some(Self {
            corners: quad,
            ..*self
        })
    }
}

/// All emitters in closed form; None where they are many.
fn polygons(emitters: &[Emitter]) -> Option<Vec<Polygon>> {
    let mut found: Vec<Polygon> = Vec::new();
    for &Emitter { corners, radiance } in emitters {
        let joins = |(i, polygon): (usize, &Polygon)| Some((i, polygon.joined(corners, radiance)?));
        match found.iter().enumerate().find_map(joins) {
            Some((i, joined)) => found[i] = joined,
            None => {
                let [a, b, c] = corners;
                found.push(Polygon {
                    corners: [a, b, c, c],
                    radiance,
                });
            }
        }
        if found.len() > MOST_POLYGONS {
            return None;
        }
    }
    Some(found)
}

/// An emitter or a part of a sun that points are taken on.
struct Lit {
    corners: [DVec3; 3],
    radiance: DVec3,
    /// Its area over its power.
    area_of_power: f64,
    /// Power of it and of all before it.
    whole: f64,
}

fn points(scene: &Scene, emitters: &[Emitter]) -> Vec<Shining> {
    let mut whole = 0.0;
    let mut lit: Vec<Lit> = Vec::new();
    for &Emitter { corners, radiance } in emitters {
        let radiance = DVec3::from(radiance.map(f64::from));
        let power = radiance.element_sum() * triangle_area(corners);
        if power > 0.0 {
            whole += power;
            lit.push(Lit {
                corners,
                radiance,
                area_of_power: 1.0 / radiance.element_sum(),
                whole,
            });
        }
    }
    let areas = scene
        .triangles
        .iter()
        .map(|t| triangle_area(scene.corners(t)));
    let area: f64 = areas.sum();
    for sun in &scene.lights.suns {
        let discs = sun_disc(scene, sun);
        let irradiance = DVec3::from(sun.irradiance.map(f64::from));
        // What arrives, over π as the power of the others: a convex body's shadow is a quarter of
        // its area in the mean.
        let power = irradiance.element_sum() * area / (4.0 * PI * discs.len() as f64);
        let square = discs
            .iter()
            .map(|&corners| triangle_area(corners))
            .sum::<f64>();
        let distance = sun_distance(scene);
        for corners in discs.into_iter().filter(|_| power > 0.0) {
            whole += power;
            lit.push(Lit {
                corners,
                radiance: irradiance * (distance * distance / square),
                area_of_power: triangle_area(corners) / power,
                whole,
            });
        }
    }
    let share = whole / f64::from(LIGHT_POINTS);
    let mut points = Vec::new();
    // Number of points that each emitter has so far: those of the next set fall between them.
    let mut taken = vec![0; lit.len()];
    for i in 0..LIGHT_SETS * LIGHT_POINTS {
        let (set, i_in_set) = (i / LIGHT_POINTS, i % LIGHT_POINTS);
        let in_share = (f64::from(set) + 0.5) / f64::from(LIGHT_SETS);
        let at = (f64::from(i_in_set) + in_share) * share;
        let place = lit.partition_point(|e| e.whole < at);
        let place = place.min(lit.len().saturating_sub(1));
        let Some(emitter) = lit.get(place) else {
            break;
        };
        let corners = emitter.corners;
        let [a, b, c] = corners;
        let of_point = share * emitter.area_of_power;
        let position = spread(corners, place as u32, taken[place]);
        taken[place] += 1;
        points.push(Shining {
            position,
            normal: Some((b - a).cross(c - a).normalize_or_zero()),
            area: of_point,
            strength: emitter.radiance * of_point,
            beam: None,
        });
    }
    points.extend(scene.lights.points.iter().map(|light| Shining {
        position: light.position,
        normal: None,
        area: 0.0,
        strength: DVec3::from(light.intensity.map(f64::from)),
        beam: light.beam.clone(),
    }));
    points
}

/// Place i of a sequence in a triangle, which starts elsewhere in every other one: a quadrangle's two
/// go on as one. If the triangle is cut into 4ⁿ similar ones, each of the
/// first 4ⁿ places lies in another of them: the triangular van der Corput sequence of Basu and Owen
/// 2015, with each digit permuted by those before it. Without the permutation places lie in rows,
/// and many would pass a shadow's edge at once.
fn spread(corners: [DVec3; 3], triangle: u32, i: u32) -> DVec3 {
    let [mut a, mut b, mut c] = corners;
    let mut digits = i;
    let mut turn = (triangle / 2).wrapping_mul(0x9e37_79b9);
    // All digits of any i, and zeros, which shrink the triangle towards its centroid.
    for _ in 0..16 {
        let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
        let child = (digits % 4 + (turn >> 30)) % 4;
        turn = (turn ^ (child + 1)).wrapping_mul(0x9e37_79b9);
        (a, b, c) = match child {
            0 => (bc, ca, ab),
            1 => (a, ab, ca),
            2 => (ab, b, bc),
            _ => (ca, bc, c),
        };
        digits /= 4;
    }
    (a + b + c) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 4³ places in a row, one lies in each of the 64 parts; and their mean is the middle, each
    /// part's being its own.
    #[test]
    fn places_are_spread_evenly() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let mut found = std::collections::HashSet::new();
        let mut mean = DVec3::ZERO;
        for i in 64..128 {
            let place = spread(corners, 0, i);
            mean += place / 64.0;
            let (x, y) = (8.0 * place.x, 8.0 * place.y);
            let upper = x.fract() + y.fract() > 1.0;
            found.insert((x as u32, y as u32, upper));
        }
        assert_eq!(found.len(), 64);
        // Half the size of a part: the most by which the mean place can be shifted.
        const SHIFT: f64 = 1.0 / 16.0;
        assert!((mean - DVec3::new(1.0, 1.0, 0.0) / 3.0).length() < SHIFT);
    }
}
