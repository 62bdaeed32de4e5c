//! Kept rows and their coupling outside the device: what lights a scene again without drawing it.

use std::path::Path;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::coupling::CouplingRow;
use super::problem::GroupedBy;
use super::word_file::{Kind, hexadecimal};
use super::{Problem, Settings};
use crate::constants::NONE;
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::mesh::near::NearPairs;
use crate::mesh::sources::Source;
use crate::meso::Transport;
use crate::passes::kept_rows::RestoredSize;
use crate::passes::types::{KeptRow, KeptState};
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
    pub rows: Vec<Option<KeptRow>>,
    pub coupling: Vec<Option<&'a CouplingRow>>,
    pub state: KeptState,
    pub chunks: Vec<Vec<u32>>,
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
        let mut chunks = kept.chunks;
        while chunks.pop_if(|chunk| chunk.is_empty()).is_some() {}
        let surface = |source: &&Source| source.is_surface();
        let surfaces = problem.sources.list.iter().filter(surface).count();
        let mut lists = Lists {
            rows: kept.rows.iter().map(|row| row.unwrap_or(none)).collect(),
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
            chunk_words: kept.chunk_words,
            state: [kept.state.chunk, kept.state.used, kept.state.rows],
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

    /// What the chunks of the device hold.
    pub(super) fn chunks(&self) -> &[Vec<u32>] {
        &self.lists.chunks
    }

    /// Of the chunks on the device.
    pub(super) fn size(&self) -> RestoredSize {
        RestoredSize {
            chunk_words: self.header.chunk_words,
            chunks: self.lists.chunks.len(),
        }
    }

    pub(super) fn state(&self) -> KeptState {
        let [chunk, used, rows] = self.header.state;
        KeptState { chunk, used, rows }
    }

    /// Where the row of a source is kept, if it is.
    pub(super) fn row(&self, s: usize) -> Option<KeptRow> {
        self.lists
            .rows
            .get(s)
            .copied()
            .filter(|row| row.chunk != NONE)
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
