//! Light at places other than the elements.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Estimator, Problem, ReliefLight, Solver};
use crate::error::{Error, Result};
use crate::math::directions::Directions;
use crate::mesh::elements::Elements;
use crate::mesh::near::{Looking, Outlook, PART, Part};
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::scene::sky::Sky;
use crate::structs::ShadowOccluder;

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

/// Light that comes to a place along a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arriving {
    /// From the place towards where it comes from, unit.
    pub way: DVec3,
    /// Irradiance of a facet that faces it, W·m⁻², RGB.
    pub light: DVec3,
}

/// What can send and stop light: elements in the order of their sources.
#[derive(Clone, Copy)]
pub struct Senders<'a> {
    pub elements: &'a Elements,
    pub sources: &'a [Source],
    pub occluders: &'a ShadowTree<ShadowOccluder>,
    pub sky: Option<&'a Sky>,
}

/// What elements with a relief send by direction, emission included.
pub struct SentByDirection {
    pub directions: Directions,
    /// Index into the vectors below, `[element]`; none of an element without relief.
    pub meso: Vec<Option<u32>>,
    /// Tangent, bitangent and normal, `[meso element]`.
    pub frames: Vec<[Vec3; 3]>,
    /// Radiosity πL, bilinear between the directions, `[meso element][direction]`, RGB.
    pub exitant: Vec<Vec3>,
}

/// A lit scene, looked at from places.
pub struct Lit<'a> {
    of: Senders<'a>,
    outlook: Outlook<'a>,
    /// `[source]`
    sent: Vec<Sent>,
    /// Of what a part sends to a place, the unevenness that it may have, W·m⁻²: of emitted and of
    /// reflected light.
    allowed: [f64; 2],
    by_direction: Option<&'a SentByDirection>,
}

/// Sine of the lowest light that counts by the way on which it arrives.
const LEAST_HEIGHT: f64 = 1e-4;

/// Of the mean radiosity of a scene, emitted or reflected, the unevenness of what a part sends to a
/// place, at most: where it is more, near members count for more than others.
const UNEVEN: f64 = 2e-4;

/// Radiosity of the parts of a source, `[part]`.
struct Sent {
    emitted: Vec<DVec3>,
    reflected: Vec<DVec3>,
    /// Standard deviations of what the members emit and reflect, W·m⁻².
    unevenness: [Vec<f64>; 2],
    /// Whether a member sends by direction.
    directed: bool,
}

impl Solver {
    /// Irradiance at `places` of what has been solved; see [`Lit::at`].
    ///
    /// # Errors
    /// As [`Lit::at`]; the `pixel` estimator; a device that fails.
    pub fn light_at(&self, places: &[Place]) -> Result<Vec<LightAt>> {
        let on = &self.problem;
        if on.settings.estimator != Estimator::Receiver {
            let what = "light at places needs the `receiver` estimator";
            return Err(Error::Usage(what.into()));
        }
        check(places)?;
        let light = self.light()?;
        let by_direction = light.relief.as_ref().and_then(|sent| directed(on, sent));
        let of = Senders {
            elements: &on.elements,
            sources: &on.sources.list,
            occluders: &on.occluder_tree,
            sky: on.sky.as_ref(),
        };
        Lit::new(of, &light.radiosity, by_direction.as_ref()).at(places)
    }
}

/// # Errors
/// A place that is not finite, a normal that is not of unit length.
fn check(places: &[Place]) -> Result<()> {
    let is_good =
        |place: &Place| place.position.is_finite() && (place.normal.length() - 1.0).abs() < 1e-6;
    match places.iter().position(|place| !is_good(place)) {
        None => Ok(()),
        Some(i) => Err(Error::Usage(format!(
            "place {i}: its position must be finite and its normal of unit length"
        ))),
    }
}

fn directed(on: &Problem, light: &ReliefLight) -> Option<SentByDirection> {
    let relief = on.elements.relief.as_ref()?;
    let mut meso = vec![None; on.elements.len()];
    for (m, &e) in (0..).zip(&light.elements) {
        meso[e as usize] = Some(m);
    }
    let frame = |&e: &u32| {
        let e = e as usize;
        let normal = on.elements.normal[e].as_vec3();
        [relief.tangent[e], relief.bitangent[e], normal]
    };
    Some(SentByDirection {
        directions: relief.directions,
        meso,
        frames: light.elements.iter().map(frame).collect(),
        exitant: light.exitant.clone(),
    })
}

impl<'a> Lit<'a> {
    /// With the radiosity of the elements, emission included, `[element]`.
    pub fn new(
        of: Senders<'a>,
        radiosity: &[Vec3],
        by_direction: Option<&'a SentByDirection>,
    ) -> Self {
        let outlook = Outlook::new(of.elements, of.sources, of.occluders);
        let sources = 0..of.sources.len();
        let sent: Vec<Sent> = (sources.clone().into_par_iter())
            .map(|s| Sent::of(of.elements, &outlook, s, radiosity, by_direction))
            .collect();
        let elements = of.elements;
        let whole: f64 = elements.area.iter().sum();
        let mean = |of: &dyn Fn(usize) -> Vec3| -> f64 {
            let power =
                (0..elements.len()).map(|e| elements.area[e] * f64::from(of(e).max_element()));
            power.sum::<f64>() / whole
        };
        let emitted = mean(&|e| elements.emitted[e]);
        let reflected = mean(&|e| radiosity[e] - elements.emitted[e]);
        Self {
            allowed: [emitted, reflected].map(|mean| UNEVEN * mean),
            of,
            outlook,
            sent,
            by_direction,
        }
    }

    /// Irradiance at `places`: form factors to the parts of all sources, in f64, with a ray to each
    /// part of 1/192 of the view or less, and the light that each part sends; of emitters what is
    /// seen of them up to the edges of shadows. Costs about half a millisecond a place on one core
    /// in the Cornell box, and more where there are more elements.
    ///
    /// # Errors
    /// A place that is not finite, a normal that is not of unit length.
    pub fn at(&self, places: &[Place]) -> Result<Vec<LightAt>> {
        self.each(places, |looking, p, normal| {
            let mut indirect = DVec3::ZERO;
            self.reflected(p, normal, looking, false, |_, _, light| indirect += light);
            if let Some(sky) = self.of.sky {
                (self.outlook).sky(sky, p, normal, |_, light| indirect += light);
            }
            LightAt {
                direct: self.direct(p, normal).as_vec3(),
                indirect: indirect.max(DVec3::ZERO).as_vec3(),
            }
        })
    }

    /// The direct part of [`Self::at`] alone, in a small part of the time.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub fn direct_at(&self, places: &[Place]) -> Result<Vec<Vec3>> {
        self.each(places, |_, p, normal| self.direct(p, normal).as_vec3())
    }

    /// Light by the way on which it arrives, direct or indirect: what `add` makes of it at each
    /// place, beginning with `start` of its index. The sum of `light · (way · normal)` is what
    /// [`Self::at`] finds.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub fn arriving<T: Send>(
        &self,
        places: &[Place],
        direct: bool,
        start: impl Fn(usize) -> T + Sync,
        add: impl Fn(&mut T, Arriving) + Sync,
    ) -> Result<Vec<T>> {
        check(places)?;
        let Elements { origin, unit, .. } = *self.of.elements;
        let at = |looking: &mut Looking, (i, place): (usize, &Place)| {
            let (p, normal) = ((place.position - origin) / unit, place.normal);
            let mut found = start(i);
            let mut along = |way: DVec3, light: DVec3| {
                let height = way.dot(normal);
                if height > LEAST_HEIGHT {
                    let light = light / height;
                    add(&mut found, Arriving { way, light });
                }
            };
            match direct {
                true => self.emitted(p, normal, true, |s, part, vector| {
                    let way = vector.normalize_or(normal);
                    along(way, vector.dot(normal) * self.emission(s, part));
                }),
                false => {
                    self.reflected(p, normal, looking, true, |s, part, light| {
                        let towards = self.outlook.towards(s, part, p, normal);
                        along(towards.normalize_or(normal), light);
                    });
                    if let Some(sky) = self.of.sky {
                        self.outlook.sky(sky, p, normal, &mut along);
                    }
                }
            }
            found
        };
        Ok((places.par_iter().enumerate())
            .map_init(|| self.outlook.looking(), at)
            .collect())
    }

    /// Whether each place lies beneath what stands on its surface, where no one sees it.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub fn covered(&self, places: &[Place]) -> Result<Vec<bool>> {
        self.each(places, |_, p, normal| self.outlook.is_covered(p, normal))
    }

    /// Whether each place sees a back first along its normal, as it does within a solid.
    ///
    /// # Errors
    /// As [`Self::at`].
    pub fn backs(&self, places: &[Place]) -> Result<Vec<bool>> {
        self.each(places, |_, p, normal| self.outlook.sees_a_back(p, normal))
    }

    /// Finds a value at each place, internal units.
    fn each<T: Send>(
        &self,
        places: &[Place],
        find: impl Fn(&mut Looking, DVec3, DVec3) -> T + Sync,
    ) -> Result<Vec<T>> {
        check(places)?;
        let Elements { origin, unit, .. } = *self.of.elements;
        Ok((places.par_iter())
            .map_init(
                || self.outlook.looking(),
                |looking, place| find(looking, (place.position - origin) / unit, place.normal),
            )
            .collect())
    }

    /// Irradiance straight from emitters, point lights, beams and suns.
    fn direct(&self, p: DVec3, normal: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        self.emitted(p, normal, false, |s, part, vector| {
            sum += vector.dot(normal) * self.emission(s, part);
        });
        sum
    }

    /// What is seen of each light: source, part of an emitter, and form factor as a vector; see
    /// [`Outlook::emitters`].
    fn emitted(
        &self,
        p: DVec3,
        normal: DVec3,
        by_direction: bool,
        mut each: impl FnMut(usize, Option<Part>, DVec3),
    ) {
        let uneven = |s: usize, part: Part, factor: f64| {
            factor * self.sent[s].unevenness[0][part.index] > self.allowed[0]
        };
        let outlook = &self.outlook;
        outlook.emitters(p, normal, by_direction, uneven, |s, part, vector| {
            each(s, Some(part), vector);
        });
        outlook.points(p, normal, |s, vector| each(s, None, vector));
        outlook.far(p, normal, |s, vector| each(s, None, vector));
    }

    /// Radiosity of a part of an emitter; of a light without parts what it emits.
    fn emission(&self, s: usize, part: Option<Part>) -> DVec3 {
        match part {
            Some(part) => self.sent[s].emitted[part.index],
            None => self.of.sources[s].emitted.as_dvec3(),
        }
    }

    /// Each part of a source that is seen, and irradiance by what it reflects; `by_direction`, of
    /// parts that are small for facets that are tilted towards them too.
    fn reflected(
        &self,
        p: DVec3,
        normal: DVec3,
        looking: &mut Looking,
        by_direction: bool,
        mut each: impl FnMut(usize, Part, DVec3),
    ) {
        let cut = |s: usize, part: Part, factor: f64| {
            let most = match by_direction {
                true => self.outlook.towards(s, part, p, normal).length(),
                false => factor,
            };
            most > PART || most * self.sent[s].unevenness[1][part.index] > self.allowed[1]
        };
        (self.outlook).parts(p, normal, looking, cut, |s, part, factor| {
            let sent = &self.sent[s];
            let radiosity = match (self.by_direction, self.outlook.tree(s)) {
                (Some(by), Some(tree)) if sent.directed => {
                    let members = &tree.members[part.first..part.first + part.count];
                    self.towards(by, members, p, sent, part.index) - sent.emitted[part.index]
                }
                _ => sent.reflected[part.index],
            };
            each(s, part, factor * radiosity);
        });
    }

    /// Mean radiosity that members of a part send towards a place, emission included.
    fn towards(
        &self,
        by: &SentByDirection,
        members: &[u32],
        p: DVec3,
        sent: &Sent,
        part: usize,
    ) -> DVec3 {
        let elements = self.of.elements;
        let k = by.directions.count();
        let even = sent.emitted[part] + sent.reflected[part];
        let (mut power, mut area) = (DVec3::ZERO, 0.0);
        for &e in members {
            let e = e as usize;
            area += elements.area[e];
            let Some(m) = by.meso[e] else {
                power += elements.area[e] * even;
                continue;
            };
            let way = (p - elements.centroid[e]).normalize_or_zero();
            let local = by.frames[m as usize].map(|axis| axis.as_dvec3().dot(way));
            let first = m as usize * k;
            let sent: DVec3 = (by.directions.bilinear(DVec3::from_array(local)).into_iter())
                .map(|(slot, weight)| weight * by.exitant[first + slot].as_dvec3())
                .sum();
            power += elements.area[e] * sent;
        }
        power / area
    }
}

impl Sent {
    fn of(
        elements: &Elements,
        outlook: &Outlook,
        source: usize,
        radiosity: &[Vec3],
        by_direction: Option<&SentByDirection>,
    ) -> Self {
        let Some(tree) = outlook.tree(source) else {
            return Self {
                emitted: Vec::new(),
                reflected: Vec::new(),
                unevenness: Default::default(),
                directed: false,
            };
        };
        let areas = tree.sums(|e| elements.area[e as usize]);
        let mean = |of: &dyn Fn(usize) -> Vec3| -> Vec<DVec3> {
            let power = tree.sums(|e| elements.area[e as usize] * of(e as usize).as_dvec3());
            (power.iter().zip(&areas))
                .map(|(power, area)| power / area)
                .collect()
        };
        let is_directed =
            |by: &SentByDirection| tree.members.iter().any(|&e| by.meso[e as usize].is_some());
        let emitted = |e: usize| elements.emitted[e];
        let reflected = |e: usize| radiosity[e] - elements.emitted[e];
        let deviations = |of: &dyn Fn(usize) -> Vec3, means: &[DVec3]| -> Vec<f64> {
            let squares = mean(&|e| of(e).powf(2.0));
            (squares.iter().zip(means))
                .map(|(square, mean)| (square - mean * mean).max_element().max(0.0).sqrt())
                .collect()
        };
        let means = [mean(&emitted), mean(&reflected)];
        let unevenness = [
            deviations(&emitted, &means[0]),
            deviations(&reflected, &means[1]),
        ];
        let [emitted, reflected] = means;
        Self {
            unevenness,
            emitted,
            reflected,
            directed: by_direction.is_some_and(is_directed),
        }
    }
}
