//! How much of what a source sends each other source reflects:
//! G[s,t] = Σ_{j∈t} ρ_j w_j F_js / A_t, by colour, where F_js is the form factor from element j to
//! source s, and w_j its area as it counts in its source's mean. One sparse row a source, found
//! while its form factors are at hand.
//!
//! A target whose members have one reflectance takes one number a pair, its mean form factor
//! Σ w_j F_js / A_t; the reflectance is applied to the sum over all sources. Any other takes three.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;
use crate::passes::types::CouplingTarget;

/// Where a source's share of a coupling row lies.
#[derive(Debug, Clone, Copy)]
enum Receives {
    /// It reflects nothing.
    Nothing,
    /// One word, and the reflectance of all members.
    Evenly { word: usize, reflectance: DVec3 },
    /// Three words, RGB, and the largest reflectance of a member.
    ByColour { word: usize, reflectance: DVec3 },
}

/// The sources as they receive.
pub(super) struct Targets {
    /// For the coupling pass; those of one word come first.
    pub list: Vec<CouplingTarget>,
    receives: Vec<Receives>,
    /// Words of one number a target; those of three follow.
    even_words: usize,
    words: usize,
}

impl Targets {
    pub fn new(elements: &Elements, sources: &[Source]) -> Self {
        let even = elements.even_reflectance();
        let one_reflectance = |source: &Source| {
            let mut range = source.members();
            let first = even[range.start];
            range.all(|e| even[e] == first).then_some(first)
        };
        let mut receives = vec![Receives::Nothing; sources.len()];
        let mut list = Vec::new();
        let mut words = 0;
        let mut coloured = Vec::new();
        for (s, source) in sources.iter().enumerate() {
            if !source.is_surface() || source.members().all(|e| even[e] == Vec3::ZERO) {
                continue;
            }
            let Some(reflectance) = one_reflectance(source) else {
                coloured.push(s);
                continue;
            };
            let reflectance = reflectance.as_dvec3();
            receives[s] = Receives::Evenly {
                word: words,
                reflectance,
            };
            list.push(target(elements, source, words, 1));
            words += 1;
        }
        let even_words = words;
        for s in coloured {
            let largest = sources[s]
                .members()
                .map(|e| even[e])
                .fold(Vec3::ZERO, Vec3::max);
            receives[s] = Receives::ByColour {
                word: words,
                reflectance: largest.as_dvec3(),
            };
            list.push(target(elements, &sources[s], words, 3));
            words += 3;
        }
        Self {
            list,
            receives,
            even_words,
            words,
        }
    }

    /// Words of a row.
    pub fn words(&self) -> usize {
        self.words
    }

    /// The largest reflectance of a member of source `t`.
    pub fn reflectance(&self, t: usize) -> DVec3 {
        match self.receives[t] {
            Receives::Nothing => DVec3::ZERO,
            Receives::Evenly { reflectance, .. } | Receives::ByColour { reflectance, .. } => {
                reflectance
            }
        }
    }
}

fn target(elements: &Elements, source: &Source, word: usize, word_count: u32) -> CouplingTarget {
    let area: f64 = source.members().map(|e| elements.area[e]).sum();
    CouplingTarget {
        first_element: source.first_element,
        element_count: source.element_count,
        first_word: word as u32,
        word_count,
        inverse_area: (1.0 / area) as f32,
    }
}

/// One row without its zeros.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct CouplingRow {
    /// First word and number of words of each run of values.
    runs: Vec<[u32; 2]>,
    values: Vec<f32>,
}

/// Zeros that a run may hold: a new run costs as much as two values.
const GAP: usize = 2;

impl CouplingRow {
    /// From all words of a row, times the scale of its form factors.
    pub fn new(words: &[f32], scale: f32) -> Self {
        let mut row = Self::default();
        let mut end = 0;
        for (w, &value) in words.iter().enumerate() {
            if value == 0.0 {
                continue;
            }
            match row.runs.last_mut() {
                Some([first, count]) if w - end <= GAP => {
                    row.values.extend(words[end..w].iter().map(|v| v * scale));
                    *count = (w + 1) as u32 - *first;
                }
                _ => row.runs.push([w as u32, 1]),
            }
            row.values.push(value * scale);
            end = w + 1;
        }
        row
    }

    /// The lists that [`Self::lists`] gives; none if they are no row of so many words.
    pub fn from_lists(runs: Vec<[u32; 2]>, values: Vec<f32>, words: usize) -> Option<Self> {
        let mut end = 0;
        for &[first, count] in &runs {
            if (first as usize) < end {
                return None;
            }
            end = first as usize + count as usize;
        }
        let count: usize = runs.iter().map(|r| r[1] as usize).sum();
        (end <= words && count == values.len()).then_some(Self { runs, values })
    }

    /// All its words, of so many.
    pub fn words(&self, count: usize) -> Vec<f32> {
        let mut words = vec![0.0; count];
        let mut values = &self.values[..];
        for &[first, count] in &self.runs {
            let (run, rest) = values.split_at(count as usize);
            words[first as usize..][..run.len()].copy_from_slice(run);
            values = rest;
        }
        words
    }

    /// Runs and values.
    pub fn lists(&self) -> (&[[u32; 2]], &[f32]) {
        (&self.runs, &self.values)
    }

    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.runs[..]) + size_of_val(&self.values[..])) as u64
    }
}

/// What has arrived at each source.
#[derive(Debug, Clone)]
pub(super) struct Arrived {
    /// Mean irradiance of targets of one word, `[word]`.
    irradiance: Vec<DVec3>,
    /// Radiosity of the others, `[word]`.
    reflected: Vec<f64>,
}

impl Arrived {
    pub fn none(targets: &Targets) -> Self {
        Self {
            irradiance: vec![DVec3::ZERO; targets.even_words],
            reflected: vec![0.0; targets.words - targets.even_words],
        }
    }

    /// Takes in what a source with this row sends.
    pub fn add(&mut self, row: &CouplingRow, light: DVec3) {
        let even_words = self.irradiance.len();
        let mut values = &row.values[..];
        for &[first, count] in &row.runs {
            let (run, rest) = values.split_at(count as usize);
            values = rest;
            let first = first as usize;
            let even = even_words.saturating_sub(first).min(run.len());
            let (of_even, of_others) = run.split_at(even);
            if even > 0 {
                let sums = &mut self.irradiance[first..first + even];
                for (sum, &value) in sums.iter_mut().zip(of_even) {
                    *sum += light * f64::from(value);
                }
            }
            let start = first + even - even_words.min(first + even);
            for (w, &value) in (start..).zip(of_others) {
                self.reflected[w] += light[w % 3] * f64::from(value);
            }
        }
    }

    /// Takes in `other` times a factor a colour.
    pub fn add_scaled(&mut self, other: &Self, factor: DVec3) {
        for (sum, &more) in self.irradiance.iter_mut().zip(&other.irradiance) {
            *sum += factor * more;
        }
        for (w, (sum, &more)) in (0..).zip(self.reflected.iter_mut().zip(&other.reflected)) {
            *sum += factor[w % 3] * more;
        }
    }

    /// Mean irradiance of source `t`; none where its words hold more than form factors.
    pub fn irradiance(&self, targets: &Targets, t: usize) -> Option<DVec3> {
        match targets.receives[t] {
            Receives::Evenly { word, .. } => Some(self.irradiance[word]),
            Receives::Nothing | Receives::ByColour { .. } => None,
        }
    }

    /// Radiosity that source `t` reflects of this.
    pub fn reflected(&self, targets: &Targets, t: usize) -> DVec3 {
        match targets.receives[t] {
            Receives::Nothing => DVec3::ZERO,
            Receives::Evenly { word, reflectance } => reflectance * self.irradiance[word],
            Receives::ByColour { word, .. } => {
                let at = word - self.irradiance.len();
                DVec3::new(
                    self.reflected[at],
                    self.reflected[at + 1],
                    self.reflected[at + 2],
                )
            }
        }
    }
}

/// What radiosity counts for at each source, as [`Arrived`] counts what has arrived.
pub(super) struct Weights {
    /// Times the reflectance, of targets of one word, `[word]`.
    irradiance: Vec<DVec3>,
    /// Of the others, `[word]`.
    reflected: Vec<f64>,
}

impl Weights {
    pub fn none(targets: &Targets) -> Self {
        Self {
            irradiance: vec![DVec3::ZERO; targets.even_words],
            reflected: vec![0.0; targets.words - targets.even_words],
        }
    }

    /// What a unit of radiosity at source `t` counts for.
    pub fn set(&mut self, targets: &Targets, t: usize, weight: DVec3) {
        match targets.receives[t] {
            Receives::Nothing => {}
            Receives::Evenly { word, reflectance } => self.irradiance[word] = reflectance * weight,
            Receives::ByColour { word, .. } => {
                let at = word - self.irradiance.len();
                self.reflected[at..at + 3].copy_from_slice(&weight.to_array());
            }
        }
    }

    /// What a unit of radiosity that is sent with a row counts for, once reflected: Σ_t w_t G[s,t].
    pub fn of_row(&self, row: &CouplingRow) -> DVec3 {
        let even_words = self.irradiance.len();
        let mut values = row.values.iter().map(|&v| f64::from(v));
        let mut sum = DVec3::ZERO;
        for &[first, count] in &row.runs {
            for (w, value) in (first as usize..).zip(values.by_ref().take(count as usize)) {
                match self.irradiance.get(w) {
                    Some(&weight) => sum += weight * value,
                    None => {
                        let at = w - even_words;
                        sum[at % 3] += self.reflected[at] * value;
                    }
                }
            }
        }
        sum
    }
}
