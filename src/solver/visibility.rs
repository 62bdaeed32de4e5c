//! Kept rows and their coupling outside the device: what lights a scene again without drawing it.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::coupling::CouplingRow;
use super::kept_parts::{merged, slice};
use super::ledger;
use super::messages::RestoredRows;
use super::problem::GroupedBy;
use super::shares::Share;
use super::word_file::{Kind, hexadecimal};
use super::{Problem, Settings};
use crate::constants::NONE;
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::mesh::near::NearPairs;
use crate::mesh::sources::Source;
use crate::meso::Transport;
use crate::passes::fresh_rows::RowShape;
use crate::passes::types::KeptRow;
use crate::passes::words::Words;
use crate::scene::{Lights, PointLight, Scene};

/// Form factors of the sources of a scene that had been drawn, for the same scene with other
/// emission and point lights.
pub struct Visibility {
    header: Header,
    lists: Lists,
    /// First run and value of each source.
    starts: Vec<[usize; 2]>,
}

/// What a solver keeps.
pub(super) struct Kept<'a> {
    pub rows: Vec<Option<ledger::Kept>>,
    pub coupling: Vec<Option<&'a CouplingRow>>,
    /// `[member]`
    pub parts: Vec<(Arc<Share>, RestoredRows)>,
    /// Of all elements.
    pub shape: RowShape,
    /// Of a member that has all.
    pub chunk_words: u32,
}

#[derive(Serialize, Deserialize)]
struct Header {
    /// A hash of the geometry, the reflectances and the settings that form factors depend on.
    key: String,
    /// Emitted radiosity by which the elements were grouped, `[material]`, W·m⁻².
    emitted: Vec<[f32; 3]>,
    /// Position and radiant intensity of the point lights then.
    lights: Vec<([f64; 3], [f32; 3])>,
    /// Direction and irradiance of the far lights then.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    far: Vec<([f64; 3], f64)>,
    /// Sources that are no point lights.
    surfaces: usize,
    chunk_words: u32,
    state: [u32; 3],
    /// Chunks of them; the lists behind are those of [`NearPairs::lists`].
    chunks: usize,
}

const FILE: Kind = Kind {
    magic: b"mesolux rows   1",
    name: "kept form factors",
};

fn key(scene: &Scene, settings: &Settings) -> String {
    let mut unlit = scene.clone();
    unlit.lights = Lights::default();
    unlit.materials.iter_mut().for_each(|m| m.ke = [0.0; 3]);
    let mut hash = Sha256::new();
    hash.update(unlit.hash());
    let flat = settings.relief.transport == Transport::Lambert;
    let estimator = settings.estimator;
    let sizes = (settings.hemicube, settings.emitter_shadows());
    let (seed, grouping) = (settings.seed, settings.grouping);
    let near = (
        settings.nearness,
        settings.silhouettes,
        settings.normalise,
        settings.emitter_places,
        settings.places,
    );
    hash.update(format!(
        "10 {estimator:?} {sizes:?} {seed} {grouping:?} {near:?} {flat}"
    ));
    hexadecimal(hash)
}

/// Lists of numbers as they lie in a file, one behind another.
#[derive(Default)]
struct Lists {
    /// `[source]`; chunk `NONE` where a source has none.
    rows: Vec<KeptRow>,
    /// Runs and values of each source's coupling row.
    counts: Vec<[u32; 2]>,
    runs: Vec<[u32; 2]>,
    values: Vec<f32>,
    chunks: Vec<Vec<u32>>,
    /// See [`NearPairs::lists`].
    near: Vec<Vec<u32>>,
}

impl Lists {
    fn words(&self) -> Vec<&[u32]> {
        let lists: [&[u32]; 4] = [
            bytemuck::cast_slice(&self.rows),
            self.counts.as_flattened(),
            self.runs.as_flattened(),
            bytemuck::cast_slice(&self.values),
        ];
        let words = self.chunks.iter().chain(&self.near).map(Vec::as_slice);
        lists.into_iter().chain(words).collect()
    }

    /// The inverse of [`Self::words`], with so many chunks.
    fn from_words(words: Vec<Vec<u32>>, chunks: usize) -> Option<Self> {
        let mut words = words.into_iter();
        let mut next = || words.next();
        let lists = Self {
            rows: bytemuck::try_cast_slice(&next()?).ok()?.to_vec(),
            counts: bytemuck::try_cast_slice(&next()?).ok()?.to_vec(),
            runs: bytemuck::try_cast_slice(&next()?).ok()?.to_vec(),
            values: bytemuck::cast_slice(&next()?).to_vec(),
            chunks: words.by_ref().take(chunks).collect(),
            near: words.collect(),
        };
        (lists.chunks.len() == chunks && lists.counts.len() == lists.rows.len()).then_some(lists)
    }

    /// Where the runs and the values of each source begin.
    fn starts(&self) -> Vec<[usize; 2]> {
        let next = |at: &mut [usize; 2], &[runs, values]: &[u32; 2]| {
            let start = *at;
            *at = [start[0] + runs as usize, start[1] + values as usize];
            Some(start)
        };
        self.counts.iter().scan([0, 0], next).collect()
    }

    /// Whether rows lie in chunks, and all of these but the last are full, so that there are no
    /// more of them than fit a file.
    fn fit(&self, chunk_words: u32) -> bool {
        let most = chunk_words as usize;
        let full = |(i, chunk): (usize, &Vec<u32>)| match i + 1 < self.chunks.len() {
            true => chunk.len() == most && most > 0,
            false => chunk.len() <= most,
        };
        let is_kept = |row: &KeptRow| row.chunk == NONE || (row.chunk as usize) < self.chunks.len();
        self.chunks.iter().enumerate().all(full) && self.rows.iter().all(is_kept)
    }
}

impl Visibility {
    pub(super) fn new(scene: &Scene, problem: &Problem, kept: Kept<'_>) -> Self {
        let none = KeptRow {
            chunk: NONE,
            first: 0,
            scale: 1.0,
        };
        let whole = match <[_; 1]>::try_from(kept.parts) {
            Ok([(_, part)]) => part,
            Err(parts) => {
                let mut order: Vec<(u32, u32)> = (0..)
                    .zip(&kept.rows)
                    .filter_map(|(s, row)| Some((row.as_ref()?.order, s)))
                    .collect();
                order.sort_unstable();
                let sources: Vec<u32> = order.into_iter().map(|(_, s)| s).collect();
                merged(&parts, &sources, kept.shape, kept.chunk_words)
            }
        };
        let mut rows = vec![none; kept.rows.len()];
        for &[source, chunk, first] in &whole.places {
            if let Some(row) = kept.rows.get(source as usize).copied().flatten() {
                let scale = row.scale;
                rows[source as usize] = KeptRow {
                    chunk,
                    first,
                    scale,
                };
            }
        }
        let mut chunks: Vec<Vec<u32>> = whole.chunks.into_iter().map(Words::into_words).collect();
        while chunks.pop_if(|chunk| chunk.is_empty()).is_some() {}
        let surface = |source: &&Source| source.is_surface();
        let surfaces = problem.sources.list.iter().filter(surface).count();
        let mut lists = Lists {
            rows,
            chunks,
            near: problem.near.lists(surfaces).into(),
            ..Lists::default()
        };
        for row in &kept.coupling {
            let (runs, values) = row.map(CouplingRow::lists).unwrap_or_default();
            lists.counts.push([runs.len() as u32, values.len() as u32]);
            lists.runs.extend(runs);
            lists.values.extend(values);
        }
        let GroupedBy {
            emitted,
            points,
            far,
        } = &problem.grouped_by;
        let header = Header {
            key: key(scene, &problem.settings),
            emitted: emitted.iter().map(Vec3::to_array).collect(),
            lights: (points.iter())
                .map(|l| (l.position.to_array(), l.intensity))
                .collect(),
            far: (far.iter())
                .map(|&(towards, irradiance)| (towards.to_array(), irradiance))
                .collect(),
            surfaces,
            chunk_words: whole.chunk_words,
            state: whole.state,
            chunks: lists.chunks.len(),
        };
        Self {
            header,
            starts: lists.starts(),
            lists,
        }
    }

    /// The near sources of these elements, which were found then.
    pub(super) fn near(&self, elements: &Elements, sources: &[Source]) -> Result<NearPairs> {
        let near = NearPairs::from_lists(elements, sources, &self.lists.near);
        near.ok_or_else(|| {
            let what = "kept form factors are of other elements: bake again with --keep-visibility";
            Error::Usage(what.into())
        })
    }

    /// Rows of the sources that are wanted, in the order in which they were made.
    fn rows(&self, wanted: impl Fn(usize) -> bool) -> Vec<(u32, KeptRow)> {
        let all = (0..).zip(&self.lists.rows);
        let mut rows: Vec<(u32, KeptRow)> = all
            .filter(|(s, row)| row.chunk != NONE && wanted(*s as usize))
            .map(|(s, row)| (s, *row))
            .collect();
        rows.sort_unstable_by_key(|(_, row)| (row.chunk, row.first));
        rows
    }

    /// What is kept of each source that is wanted, `[source]`.
    pub(super) fn kept(&self, wanted: impl Fn(usize) -> bool) -> Vec<Option<ledger::Kept>> {
        let mut kept = vec![None; self.lists.rows.len()];
        for (order, (s, row)) in (0..).zip(self.rows(wanted)) {
            let scale = row.scale;
            kept[s as usize] = Some(ledger::Kept { scale, order });
        }
        kept
    }

    /// What each member is to begin with, of the sources that are wanted. `whole`: the shape of all
    /// elements.
    pub(super) fn slices(
        &self,
        shares: &[Arc<Share>],
        whole: RowShape,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<RestoredRows> {
        let rows = self.rows(wanted);
        let chunks = self.lists.chunks.iter();
        let chunks: Vec<Words> = chunks.map(|chunk| chunk.clone().into()).collect();
        let chunk_words = self.header.chunk_words;
        if let [_] = shares {
            let place = |(source, row): &(u32, KeptRow)| [*source, row.chunk, row.first];
            return vec![RestoredRows {
                chunk_words,
                state: self.header.state,
                places: rows.iter().map(place).collect(),
                chunks,
            }];
        }
        let of = |share: &Arc<Share>| slice(&chunks, &rows, whole, share.shape, chunk_words);
        shares.iter().map(of).collect()
    }

    /// The coupling row of a source, of so many words; none where it was not kept.
    pub(super) fn coupling(&self, s: usize, words: usize) -> Option<CouplingRow> {
        let &[runs, values] = self.lists.counts.get(s)?;
        let &[first_run, first_value] = self.starts.get(s)?;
        let runs = self.lists.runs.get(first_run..first_run + runs as usize)?;
        let values = (self.lists.values).get(first_value..first_value + values as usize)?;
        // A row that sees nothing has no runs, as one that was not kept: both are measured.
        (!runs.is_empty())
            .then(|| CouplingRow::from_lists(runs.to_vec(), values.to_vec(), words))
            .flatten()
    }

    /// Refuses a scene whose form factors these are not.
    pub fn check(&self, scene: &Scene, settings: &Settings) -> Result<()> {
        if self.header.key == key(scene, settings) {
            return Ok(());
        }
        Err(Error::Scene {
            scene: scene.name.clone(),
            what: "its kept form factors are of other geometry, reflectance or settings: only emission and point lights may change; bake it again with --keep-visibility".into(),
        })
    }

    /// What it is of, as text: equal texts, equal form factors.
    pub(crate) fn described(&self) -> String {
        serde_json::to_string(&self.header).unwrap_or_default()
    }

    pub(super) fn grouped_by(&self) -> GroupedBy {
        let light = |&(position, intensity): &([f64; 3], [f32; 3])| PointLight {
            name: String::new(),
            position: position.into(),
            intensity,
            beam: None,
        };
        let lights = self.header.lights.iter().map(light);
        let far = self.header.far.iter();
        let far = far.map(|&(towards, irradiance)| (DVec3::from(towards), irradiance));
        GroupedBy {
            emitted: self
                .header
                .emitted
                .iter()
                .copied()
                .map(Vec3::from)
                .collect(),
            points: lights.collect(),
            far: far.collect(),
        }
    }

    /// Sources that are no point lights.
    pub(super) fn surfaces(&self) -> usize {
        self.header.surfaces
    }

    pub fn save(&self, path: &Path) -> Result<()> {
        FILE.write(path, &self.header, &self.lists.words())
    }

    /// Reads what [`Self::save`] wrote; refuses damaged files.
    pub fn load(path: &Path) -> Result<Self> {
        let (header, words): (Header, _) = FILE.read(path)?;
        let lists = Lists::from_words(words, header.chunks);
        let lists = lists.filter(|lists| lists.fit(header.chunk_words));
        let damaged = || Error::file(path, "its header is damaged: bake again");
        let lists = lists.ok_or_else(damaged)?;
        Ok(Self {
            header,
            starts: lists.starts(),
            lists,
        })
    }
}
