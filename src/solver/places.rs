//! Light at places other than the elements.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Estimator, Light, Problem, ReliefLight, Solver};
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::mesh::near::Outlook;

/// A place on a surface, or in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Scene units.
    pub position: DVec3,
    /// Unit.
    pub normal: DVec3,
}

/// Irradiance at a place, W·m⁻², RGB.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LightAt {
    /// Straight from emitters, point lights and suns.
    pub direct: Vec3,
    /// From the sky, and after one reflection and more.
    pub indirect: Vec3,
}

/// Radiosity of the parts of a source, `[part]`.
struct Sent {
    emitted: Vec<DVec3>,
    reflected: Vec<DVec3>,
}

impl Solver {
    /// Irradiance at `places` of what has been solved: form factors to the parts of all sources, in
    /// f64, with a ray to each part of 1/192 of the view or less, and the light that each part
    /// sends. Costs some milliseconds a place on one core, and more where there are more elements.
    ///
    /// # Errors
    /// A place that is not finite, a normal that is not of unit length; the `pixel` estimator; a
    /// device that fails.
    pub fn light_at(&self, places: &[Place]) -> Result<Vec<LightAt>> {
        let on = &self.problem;
        if on.settings.estimator != Estimator::Receiver {
            let what = "light at places needs the `receiver` estimator";
            return Err(Error::Usage(what.into()));
        }
        let is_good = |place: &Place| {
            place.position.is_finite() && (place.normal.length() - 1.0).abs() < 1e-6
        };
        if let Some(i) = places.iter().position(|place| !is_good(place)) {
            return Err(Error::Usage(format!(
                "place {i}: its position must be finite and its normal of unit length"
            )));
        }
        let light = self.light()?;
        let outlook = Outlook::new(&on.elements, &on.sources.list, &on.occluder_tree);
        let sent: Vec<Sent> = (0..on.sources.list.len())
            .into_par_iter()
            .map(|s| sent(on, &outlook, s, &light))
            .collect();
        let at = |looking: &mut _, place: &Place| {
            let elements = &on.elements;
            let p = (place.position - elements.origin) / elements.unit;
            let (mut direct, mut indirect) = (DVec3::ZERO, DVec3::ZERO);
            outlook.parts(p, place.normal, looking, |s, part, factor| {
                direct += factor * sent[s].emitted[part.index];
                indirect += match (&light.relief, outlook.tree(s)) {
                    (Some(relief), Some(tree)) if on.sources.relief.contains(&s) => {
                        let members = &tree.members[part.first..part.first + part.count];
                        let towards = by_direction(elements, relief, members, p);
                        factor * (towards - sent[s].emitted[part.index])
                    }
                    _ => factor * sent[s].reflected[part.index],
                };
            });
            outlook.points(p, place.normal, |s, share| {
                direct += share * on.sources.list[s].emitted.as_dvec3();
            });
            outlook.far(p, place.normal, |s, share| {
                direct += share * on.sources.list[s].emitted.as_dvec3();
            });
            if let Some(sky) = &on.sky {
                indirect += outlook.sky(sky, p, place.normal);
            }
            LightAt {
                direct: direct.as_vec3(),
                indirect: indirect.max(DVec3::ZERO).as_vec3(),
            }
        };
        Ok((places.par_iter())
            .map_init(|| outlook.looking(), at)
            .collect())
    }
}

fn sent(on: &Problem, outlook: &Outlook, source: usize, light: &Light) -> Sent {
    let Some(tree) = outlook.tree(source) else {
        return Sent {
            emitted: Vec::new(),
            reflected: Vec::new(),
        };
    };
    let elements = &on.elements;
    let areas = tree.sums(|e| elements.area[e as usize]);
    let mean = |of: &dyn Fn(usize) -> Vec3| -> Vec<DVec3> {
        let power = tree.sums(|e| elements.area[e as usize] * of(e as usize).as_dvec3());
        power
            .iter()
            .zip(&areas)
            .map(|(power, area)| power / area)
            .collect()
    };
    Sent {
        emitted: mean(&|e| elements.emitted[e]),
        reflected: mean(&|e| light.radiosity[e] - elements.emitted[e]),
    }
}

/// Mean radiosity that elements with a relief send towards a place, emission included.
fn by_direction(elements: &Elements, light: &ReliefLight, members: &[u32], p: DVec3) -> DVec3 {
    let Some(relief) = &elements.relief else {
        return DVec3::ZERO;
    };
    let k = relief.directions.count();
    let (mut power, mut area) = (DVec3::ZERO, 0.0);
    for &e in members {
        let e = e as usize;
        let way = (p - elements.centroid[e]).normalize_or_zero();
        let along = |axis: Vec3| axis.as_dvec3().dot(way);
        let (x, y) = (along(relief.tangent[e]), along(relief.bitangent[e]));
        let local = DVec3::new(x, y, elements.normal[e].dot(way));
        let first = (e - light.elements[0] as usize) * k;
        let sent: DVec3 = (relief.directions.bilinear(local).into_iter())
            .map(|(slot, weight)| weight * light.exitant[first + slot].as_dvec3())
            .sum();
        power += elements.area[e] * sent;
        area += elements.area[e];
    }
    power / area
}
