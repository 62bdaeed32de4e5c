//! What lights bring to triangles, by rays.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::lights::{Change, Light, Spot};
use crate::bake::solution::DirectionalLight;
use crate::mesh::corners::{Corners, Joined};
use crate::mesh::merged::merged;
use crate::scene::geometry::{ABOVE, Geometry};
use crate::scene::{Scene, Triangle};
use crate::view::corner_light::{CornerLight, Slant, Slanted, at_corners, slant};
use crate::view::snapshot::Snapshot;

/// What a light that sends 1 brings to the middle of each triangle, W·m⁻², as vectors towards it
/// whose part along a normal is the irradiance there; zero in its shadow.
type Brought = Arc<[Vec3]>;

/// Bytes of what is remembered of lights where they were.
const REMEMBERED: usize = 64 << 20;

/// What rays lead between.
pub(super) struct Rays {
    /// What stands in their way: whole planes, which rays pass sooner than what they were cut into.
    geometry: Geometry,
    /// Middles, internal units, and areas, square ones, `[triangle]`.
    places: Vec<(DVec3, f64)>,
    /// Materials whose triangles they do not see: emitters that move.
    pub without: Vec<usize>,
    /// Of the last lights that were asked for.
    known: VecDeque<(Light, Brought)>,
}

impl Rays {
    pub fn new(scene: &Scene, without: Vec<usize>) -> Self {
        let stands = |i: usize| !without.contains(&(scene.triangles[i].material as usize));
        let joined = merged(scene, |i| stands(i).then_some(()));
        let corners = joined
            .iter()
            .map(|t| t.vertices.map(|v| scene.vertices[v as usize]));
        let geometry = Geometry::standing_for(scene, corners);
        let place = |t: &Triangle| {
            let [a, b, c] = scene.corners(t).map(|p| geometry.inside(p));
            ((a + b + c) / 3.0, 0.5 * (b - a).cross(c - a).length())
        };
        Self {
            places: scene.triangles.par_iter().map(place).collect(),
            geometry,
            without,
            known: VecDeque::new(),
        }
    }

    /// Finds what the next sketch will take away.
    pub fn prepare(&mut self, base: &Snapshot) {
        for light in &base.scene.lights.points {
            self.brought(&base.about.corners, &Light::Point(light.clone()));
        }
    }

    pub fn sketch(&mut self, base: &Snapshot, changes: &[Change]) -> CornerLight {
        let about = &base.about.corners;
        let terms: Vec<(Brought, Vec3)> = (changes.iter())
            .flat_map(|[before, now]| [(before, -1.0), (now, 1.0)])
            .map(|((light, sent), sign)| (self.brought(about, light), *sent * sign))
            .collect();
        let direct: Vec<Vec3> = (base.direct.par_iter().zip(&about.normals).enumerate())
            .map(|(e, (before, normal))| {
                let normal = normal.as_vec3();
                let lit =
                    |(brought, intensity): &(Brought, Vec3)| normal.dot(brought[e]) * *intensity;
                // What rounding leaves below none is none.
                (*before + terms.iter().map(lit).sum::<Vec3>()).max(Vec3::ZERO)
            })
            .collect();
        let before = &base.at_corners;
        let direct = about.irradiance(&direct, Joined::Smooth);
        let all = (before.all.par_iter())
            .zip(before.direct.par_iter().zip(&direct))
            .map(|(all, (before, now))| {
                std::array::from_fn(|k| (all[k] + now[k] - before[k]).max(Vec3::ZERO))
            });
        let by_direction = before.slanted.as_ref().zip(base.relief.as_ref());
        CornerLight {
            all: all.collect(),
            slanted: by_direction.map(|(before, of)| slanted(about, before, of, &terms)),
            direct,
        }
    }

    fn brought(&mut self, about: &Corners, light: &Light) -> Brought {
        let same = |known: &Light| match (known, light) {
            (Light::Point(known), Light::Point(light)) => {
                known.position == light.position && known.beam == light.beam
            }
            (known, light) => known == light,
        };
        if let Some((_, brought)) = self.known.iter().find(|(known, _)| same(known)) {
            return Arc::clone(brought);
        }
        let brought: Brought = self.find(about, light).into();
        let room = (REMEMBERED / size_of_val(&*brought).max(1)).max(2);
        self.known.truncate(room - 1);
        self.known.push_front((light.clone(), Arc::clone(&brought)));
        brought
    }

    /// As [`Brought`]. A triangle is taken for a disc, so that a light that touches it brings as
    /// much as it sends to that side.
    fn find(&self, about: &Corners, light: &Light) -> Vec<Vec3> {
        let geometry = &self.geometry;
        let square = geometry.unit * geometry.unit;
        // From a place that sends so much in a direction, internal units.
        let from = |e: usize, normal: DVec3, at: DVec3, own: f64, sent: &dyn Fn(DVec3) -> f64| {
            let (middle, area) = self.places[e];
            let way = at - middle;
            if normal.dot(way) <= 0.0 {
                return DVec3::ZERO;
            }
            let share = sent(-way);
            if share <= 0.0 || !geometry.sees(middle + ABOVE * normal, at) {
                return DVec3::ZERO;
            }
            let area = (area + own / square) / std::f64::consts::TAU;
            let spread = (way.length_squared() + area) * square;
            way.normalize() * (share / spread)
        };
        let to_triangle = |(e, &normal): (usize, &DVec3)| match light {
            Light::Point(light) => {
                let at = geometry.inside(light.position);
                from(e, normal, at, 0.0, &|way| light.share(way)).as_vec3()
            }
            Light::Emitter(spots) => {
                let of = |spot: &Spot| {
                    let sent = |way: DVec3| spot.area * spot.normal.dot(way.normalize_or_zero());
                    from(e, normal, geometry.inside(spot.at), spot.area, &sent)
                };
                spots.iter().map(of).sum::<DVec3>().as_vec3()
            }
        };
        about
            .normals
            .par_iter()
            .enumerate()
            .map(to_triangle)
            .collect()
    }
}

/// How light depends on the slopes of `relief` after these lights were added, those before with
/// the sign −.
fn slanted(
    about: &Corners,
    before: &Slanted,
    relief: &DirectionalLight,
    terms: &[(Brought, Vec3)],
) -> Slanted {
    let added = (relief.elements.par_iter().zip(&relief.frames)).map(|(&e, frame)| {
        let mut sum: Slant = [Vec3::ZERO; 4];
        for (brought, intensity) in terms {
            let brought = brought[e as usize];
            let inward = Vec3::from_array(frame.map(|axis| axis.dot(brought)));
            let of_light = slant(&[intensity.abs().to_array().map(|i| inward * i)], frame);
            let sign = intensity.min_element().signum();
            for (sum, of_light) in sum.iter_mut().zip(of_light) {
                *sum += of_light * sign;
            }
        }
        sum
    });
    let added = at_corners(about, &relief.elements, added.collect());
    let with = |before: &[[Slant; 3]]| {
        let both = before.par_iter().zip(&added);
        let sum = |(before, added): (&[Slant; 3], &[Slant; 3])| {
            std::array::from_fn(|k| std::array::from_fn(|i| before[k][i] + added[k][i]))
        };
        both.map(sum).collect()
    };
    Slanted {
        all: with(&before.all),
        direct: with(&before.direct),
    }
}
