//! Light from near sources, part by part: what their members send differs from the mean that their
//! rows bring. See [`crate::mesh::near`].

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Problem;
use crate::constants::NONE;
use crate::mesh::sources::Source;

/// What a source has sent through its row, and the scale of its form factors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    /// Whether it has sent what it emits.
    pub emission: bool,
    /// Radiosity.
    pub reflected: DVec3,
    pub scale: f64,
}

/// Irradiance from near sources beyond what their means bring.
pub(super) struct NearLight {
    /// Of elements without relief, `[element]`, W·m⁻², RGB: of what the members reflect, and of
    /// what they emit.
    pub indirect: Vec<DVec3>,
    pub direct: Vec<DVec3>,
    /// What elements with a relief, `[meso element]`, received of it since it was last measured:
    /// the device holds their light.
    relief: Vec<DVec3>,
    /// Radiosity of each part beyond its source's mean, of light that is emitted and reflected.
    beyond: ByLight<Vec<DVec3>>,
    /// Of this what relief has received.
    given: ByLight<Vec<DVec3>>,
    sources: Vec<NearSource>,
    /// Of even light, `[element]`.
    reflectance: Vec<DVec3>,
    /// Sweeps so far.
    pub sweeps: u64,
}

/// Something of light that is emitted, and of light that is reflected.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct ByLight<T> {
    pub emitted: T,
    pub reflected: T,
}

/// A source that elements receive part by part.
struct NearSource {
    source: usize,
    /// `[part]`
    areas: Vec<f64>,
    /// Emitted radiosity of each part less that of the source; none where all members emit alike.
    emitted: Option<Vec<DVec3>>,
}

/// Sweeps of one solution, at most.
const MOST_SWEEPS: usize = 500;

/// Elements that a thread takes at once.
const CHUNK: usize = 1024;

impl NearLight {
    pub fn new(on: &Problem) -> Self {
        let near_source = |(source, _): (usize, &u32)| {
            let areas = on.near.trees[source].sums(|e| on.elements.area[e as usize]);
            NearSource {
                source,
                emitted: emitted_beyond(on, source, &areas),
                areas,
            }
        };
        let firsts = on.near.first_part.iter().enumerate();
        let plain = on.elements.plain_count();
        let mut light = Self {
            indirect: vec![DVec3::ZERO; plain],
            direct: vec![DVec3::ZERO; plain],
            relief: vec![DVec3::ZERO; on.elements.len() - plain],
            beyond: ByLight::default(),
            given: ByLight::default(),
            sources: firsts.filter(|of| *of.1 != NONE).map(near_source).collect(),
            reflectance: (on.elements.even_reflectance().iter())
                .map(|r| r.as_dvec3())
                .collect(),
            sweeps: 0,
        };
        light.forget(on);
        light
    }

    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Takes the emission of `on`, and forgets all light.
    pub fn relight(&mut self, on: &Problem) {
        for near in &mut self.sources {
            near.emitted = emitted_beyond(on, near.source, &near.areas);
        }
        self.forget(on);
    }

    fn forget(&mut self, on: &Problem) {
        let none = || vec![DVec3::ZERO; on.near.parts as usize];
        for light in [&mut self.beyond, &mut self.given] {
            (light.emitted, light.reflected) = (none(), none());
        }
        for light in [&mut self.indirect, &mut self.direct, &mut self.relief] {
            light.fill(DVec3::ZERO);
        }
        self.sweeps = 0;
    }

    /// Solves E' = N (ρ (E + E') − B), where E is the irradiance that rows have `brought`,
    /// `[element]`, N the form factors to the near parts, and B the reflected radiosity that each
    /// source has `sent`, `[source]`. Sweeps until no element changes by more than `most`: contacts
    /// are a small part of a scene, and light between two close surfaces settles slowly.
    pub fn solve(&mut self, on: &Problem, brought: &[DVec3], sent: &[Option<Sent>], most: f64) {
        if self.sources.iter().any(|near| near.emitted.is_some()) {
            self.beyond.emitted = self.of_parts(on, |near| {
                let sent = sent[near.source].filter(|sent| sent.emission)?;
                let emitted = near.emitted.as_ref()?.iter();
                Some(emitted.map(|&m| sent.scale * m).collect())
            });
            self.direct = received(on, &self.beyond.emitted);
        }
        let area = &on.elements.area;
        for _ in 0..MOST_SWEEPS {
            self.sweeps += 1;
            self.beyond.reflected = self.of_parts(on, |near| {
                let sent = sent[near.source]?;
                let power = on.near.trees[near.source].sums(|e| {
                    let e = e as usize;
                    let irradiance = brought[e] + self.direct[e] + self.indirect[e];
                    area[e] * self.reflectance[e] * irradiance
                });
                let parts = power.iter().zip(&near.areas);
                let beyond = |(&power, &area)| (power / area - sent.reflected) * sent.scale;
                Some(parts.map(beyond).collect())
            });
            let now = received(on, &self.beyond.reflected);
            let change = |(now, before): (&DVec3, &DVec3)| (*now - *before).abs().max_element();
            let changed = now.iter().zip(&self.indirect).map(change);
            let changed = changed.fold(0.0, f64::max);
            self.indirect = now;
            if changed <= most {
                break;
            }
        }
    }

    /// A value of each part of each near source, `[part]`; zero of the sources that have none.
    fn of_parts(
        &self,
        on: &Problem,
        of: impl Fn(&NearSource) -> Option<Vec<DVec3>> + Send + Sync,
    ) -> Vec<DVec3> {
        let by_source: Vec<Vec<DVec3>> = (self.sources.par_iter())
            .map(|near| of(near).unwrap_or_else(|| vec![DVec3::ZERO; near.areas.len()]))
            .collect();
        let mut parts = Vec::with_capacity(on.near.parts as usize);
        for of in by_source {
            parts.extend(of);
            // The source itself sends no more than its row brings.
            parts.push(DVec3::ZERO);
        }
        parts
    }

    /// What relief is to receive of each part since the last time, `[part]`: what parts send, in
    /// place of what the row of their source has brought from the direction of its middle.
    pub fn send_to_relief(&mut self, on: &Problem, sent: &[Option<Sent>]) -> ByLight<Vec<Vec3>> {
        let mut whole = self.beyond.clone();
        for near in &self.sources {
            let Some(sent) = sent[near.source] else {
                continue;
            };
            let first = on.near.first_part[near.source] as usize;
            let end = first + near.areas.len();
            let redirect = |light: &mut [DVec3], mean: DVec3| {
                light[first..end].iter_mut().for_each(|part| *part += mean);
                light[end] = -mean;
            };
            redirect(&mut whole.reflected, sent.scale * sent.reflected);
            if sent.emission {
                let emitted = on.sources.list[near.source].emitted.as_dvec3();
                redirect(&mut whole.emitted, sent.scale * emitted);
            }
        }
        let news = |whole: &[DVec3], given: &mut [DVec3]| -> Vec<Vec3> {
            (whole.iter().zip(given))
                .map(|(&whole, given)| {
                    let new = (whole - *given).as_vec3();
                    *given += new.as_dvec3();
                    new
                })
                .collect()
        };
        let given = &mut self.given;
        let news = ByLight {
            emitted: news(&whole.emitted, &mut given.emitted),
            reflected: news(&whole.reflected, &mut given.reflected),
        };
        for (m, light) in self.relief.iter_mut().enumerate() {
            for of in on.near.relief_entries.of(m) {
                let part = of.part as usize;
                let new = news.emitted[part] + news.reflected[part];
                *light += f64::from(of.factor.z) * new.as_dvec3();
            }
        }
        news
    }

    /// What relief reflects of all that it has received was measured.
    pub fn measured(&mut self) {
        self.relief.fill(DVec3::ZERO);
    }

    /// Radiosity that a source reflects of this light beside what was measured.
    pub fn reflected(&self, on: &Problem, source: &Source) -> DVec3 {
        let plain = self.direct.len();
        let irradiance = |e: usize| match e.checked_sub(plain) {
            None => self.direct[e] + self.indirect[e],
            Some(meso) => self.relief[meso],
        };
        let (mut power, mut area) = (DVec3::ZERO, 0.0);
        for e in source.members() {
            let weight = on.near.weights[e];
            power += weight * self.reflectance[e] * irradiance(e);
            area += weight;
        }
        power / area
    }
}

/// What the elements without relief receive where each part sends so much beyond its source's mean.
fn received(on: &Problem, beyond: &[DVec3]) -> Vec<DVec3> {
    let entries = &on.near.entries;
    (0..on.elements.plain_count())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|e| {
            (entries.of(e).iter())
                .map(|entry| f64::from(entry.factor) * beyond[entry.part as usize])
                .sum()
        })
        .collect()
}

/// See [`NearSource::emitted`].
fn emitted_beyond(on: &Problem, source: usize, areas: &[f64]) -> Option<Vec<DVec3>> {
    let (elements, tree) = (&on.elements, &on.near.trees[source]);
    let mut members = tree.members.iter().map(|&e| elements.emitted[e as usize]);
    let first = members.next()?;
    if members.all(|emitted| emitted == first) {
        return None;
    }
    let power = tree.sums(|e| elements.area[e as usize] * elements.emitted[e as usize].as_dvec3());
    let mean = on.sources.list[source].emitted.as_dvec3();
    let parts = power.iter().zip(areas);
    Some(parts.map(|(&power, &area)| power / area - mean).collect())
}
