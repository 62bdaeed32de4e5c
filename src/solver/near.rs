//! Light from near sources, part by part: what their members send differs from the mean that their
//! rows bring. See [`crate::mesh::near`].

use glam::DVec3;
use rayon::prelude::*;

use super::Problem;
use crate::mesh::near::{NearPairs, Pair};
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
    /// `[element]`, W·m⁻², RGB: of what the members reflect, and of what they emit.
    pub indirect: Vec<DVec3>,
    pub direct: Vec<DVec3>,
    /// Pairs of each element that has any, a range of [`NearPairs::pairs`].
    of_element: Vec<std::ops::Range<usize>>,
    /// Sources that are near an element, with the first of their parts among all.
    sources: Vec<NearSource>,
    /// The first part of each source, `[source]`.
    first_part: Vec<usize>,
    parts: usize,
    /// Of even light, `[element]`.
    reflectance: Vec<DVec3>,
    /// Sweeps so far.
    pub sweeps: u64,
}

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
const CHUNK: usize = 256;

impl NearLight {
    pub fn new(on: &Problem) -> Self {
        let NearPairs { trees, pairs, .. } = &on.near;
        let even = on.elements.even_reflectance();
        let mut start = 0;
        let of_element = (pairs.chunk_by(|a, b| a.element == b.element))
            .map(|pairs| {
                start += pairs.len();
                start - pairs.len()..start
            })
            .collect();
        let mut is_near = vec![false; trees.len()];
        pairs
            .iter()
            .for_each(|pair| is_near[pair.source as usize] = true);
        let mut first_part = vec![0; trees.len()];
        let mut sources = Vec::new();
        let mut parts = 0;
        for (source, tree) in trees.iter().enumerate().filter(|&(s, _)| is_near[s]) {
            first_part[source] = parts;
            parts += tree.part_count();
            let areas = tree.sums(|e| on.elements.area[e as usize]);
            let emitted = emitted_beyond(on, source, &areas);
            sources.push(NearSource {
                source,
                areas,
                emitted,
            });
        }
        Self {
            indirect: vec![DVec3::ZERO; on.elements.len()],
            direct: vec![DVec3::ZERO; on.elements.len()],
            of_element,
            sources,
            first_part,
            parts,
            reflectance: even.iter().map(|r| r.as_dvec3()).collect(),
            sweeps: 0,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Takes the emission of `on`, and forgets all light.
    pub fn relight(&mut self, on: &Problem) {
        self.indirect.fill(DVec3::ZERO);
        self.direct.fill(DVec3::ZERO);
        for near in &mut self.sources {
            near.emitted = emitted_beyond(on, near.source, &near.areas);
        }
    }

    /// Irradiance of an element.
    fn irradiance(&self, e: usize) -> DVec3 {
        self.direct[e] + self.indirect[e]
    }

    /// Solves E' = N (ρ (E + E') − B), where E is the irradiance that rows have `brought`,
    /// `[element]`, N the form factors to the near parts, and B the reflected radiosity that each
    /// source has `sent`, `[source]`. Sweeps until no element changes by more than `most`: contacts
    /// are a small part of a scene, and light between two close surfaces settles slowly.
    pub fn solve(&mut self, on: &Problem, brought: &[DVec3], sent: &[Option<Sent>], most: f64) {
        if self.sources.iter().any(|near| near.emitted.is_some()) {
            let emitted = |near: &NearSource| match &near.emitted {
                Some(emitted) if sent[near.source].is_some_and(|sent| sent.emission) => {
                    let scale = sent[near.source].map_or(1.0, |sent| sent.scale);
                    emitted.iter().map(|&m| scale * m).collect()
                }
                _ => vec![DVec3::ZERO; near.areas.len()],
            };
            let received = self.received(on, emitted);
            for (e, now) in received {
                self.direct[e] = now;
            }
        }
        for _ in 0..MOST_SWEEPS {
            self.sweeps += 1;
            if self.sweep(on, brought, sent) <= most {
                break;
            }
        }
    }

    /// One sweep of Jacobi's. The largest change of an element's irradiance.
    fn sweep(&mut self, on: &Problem, brought: &[DVec3], sent: &[Option<Sent>]) -> f64 {
        let (near, area, reflectance) = (&on.near, &on.elements.area, &self.reflectance);
        let beyond = |of: &NearSource| -> Vec<DVec3> {
            let Some(sent) = sent[of.source] else {
                return vec![DVec3::ZERO; of.areas.len()];
            };
            let power = near.trees[of.source].sums(|e| {
                let e = e as usize;
                area[e] * reflectance[e] * (brought[e] + self.irradiance(e))
            });
            (power.iter().zip(&of.areas))
                .map(|(&power, &area)| (power / area - sent.reflected) * sent.scale)
                .collect()
        };
        let mut changed = 0.0_f64;
        for (e, now) in self.received(on, beyond) {
            let before = std::mem::replace(&mut self.indirect[e], now);
            changed = changed.max((now - before).abs().max_element());
        }
        changed
    }

    /// What the elements receive where each part sends so much beyond its source's mean.
    fn received(
        &self,
        on: &Problem,
        beyond: impl Fn(&NearSource) -> Vec<DVec3> + Send + Sync,
    ) -> Vec<(usize, DVec3)> {
        let near = &on.near;
        let by_source: Vec<Vec<DVec3>> = self.sources.par_iter().map(beyond).collect();
        let mut beyond: Vec<DVec3> = Vec::with_capacity(self.parts);
        by_source.iter().for_each(|parts| beyond.extend(parts));
        let of_pair = |pair: &Pair| -> DVec3 {
            let first = self.first_part[pair.source as usize];
            let entries = pair.first_entry as usize..(pair.first_entry + pair.entry_count) as usize;
            (near.entries[entries].iter())
                .map(|entry| f64::from(entry.factor) * beyond[first + entry.part as usize])
                .sum()
        };
        (self.of_element.par_iter().with_min_len(CHUNK))
            .map(|pairs| {
                let element = near.pairs[pairs.start].element as usize;
                (element, near.pairs[pairs.clone()].iter().map(of_pair).sum())
            })
            .collect()
    }

    /// Radiosity that a source reflects of this light.
    pub fn reflected(&self, on: &Problem, source: &Source) -> DVec3 {
        let first = source.first_element as usize;
        let (mut power, mut area) = (DVec3::ZERO, 0.0);
        for e in first..first + source.element_count as usize {
            let weight = on.near.weights[e];
            power += weight * self.reflectance[e] * self.irradiance(e);
            area += weight;
        }
        power / area
    }
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
