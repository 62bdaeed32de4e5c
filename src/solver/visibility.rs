//! Kept rows and their coupling outside the device: what lights a scene again without drawing it.

use std::io::Read;
use std::path::Path;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::coupling::CouplingRow;
use super::problem::GroupedBy;
use super::{Problem, Settings};
use crate::atomic_file::write_atomically;
use crate::constants::NONE;
use crate::error::{Error, Result};
use crate::input_file;
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
    rows: usize,
    runs: usize,
    values: usize,
    words: Vec<usize>,
    /// Lengths of [`NearPairs::lists`].
    near: Vec<usize>,
    /// Of this header without it, and of the lists.
    sha256: String,
}

const MAGIC: &[u8; 16] = b"mesolux factors\n";
/// Most bytes of a header.
const LONGEST: u64 = 64 << 20;

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

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
    /// Of the lengths that a header says, to be read.
    fn of(header: &Header) -> Self {
        let zeros = |lengths: &[usize]| lengths.iter().map(|&count| vec![0; count]).collect();
        Self {
            rows: vec![KeptRow::default(); header.rows],
            counts: vec![[0; 2]; header.rows],
            runs: vec![[0; 2]; header.runs],
            values: vec![0.0; header.values],
            chunks: zeros(&header.words),
            near: zeros(&header.near),
        }
    }

    fn bytes(&self) -> impl Iterator<Item = &[u8]> {
        let lists: [&[u8]; 4] = [
            bytemuck::cast_slice(&self.rows),
            bytemuck::cast_slice(&self.counts),
            bytemuck::cast_slice(&self.runs),
            bytemuck::cast_slice(&self.values),
        ];
        let words = self.chunks.iter().chain(&self.near);
        lists
            .into_iter()
            .chain(words.map(|words| bytemuck::cast_slice(words)))
    }

    fn bytes_mut(&mut self) -> impl Iterator<Item = &mut [u8]> {
        let lists: [&mut [u8]; 4] = [
            bytemuck::cast_slice_mut(&mut self.rows),
            bytemuck::cast_slice_mut(&mut self.counts),
            bytemuck::cast_slice_mut(&mut self.runs),
            bytemuck::cast_slice_mut(&mut self.values),
        ];
        let words = self.chunks.iter_mut().chain(&mut self.near);
        lists
            .into_iter()
            .chain(words.map(|words| bytemuck::cast_slice_mut(words)))
    }

    fn digest(&self, header: &Header) -> String {
        let mut hash = Sha256::new();
        let Header {
            key,
            emitted,
            lights,
            chunk_words,
            state,
            ..
        } = header;
        let lengths = (header.surfaces, header.rows, header.runs, header.values);
        let numbers = (chunk_words, state, lengths, &header.words, &header.near);
        hash.update(format!("{key} {emitted:?} {lights:?} {numbers:?}"));
        self.bytes().for_each(|bytes| hash.update(bytes));
        hexadecimal(hash)
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
}

impl Header {
    /// Whether all chunks but the last are full, so that there are no more of them than fit a file.
    fn is_full(&self) -> bool {
        let most = self.chunk_words as usize;
        let full = |(i, &words): (usize, &usize)| match i + 1 < self.words.len() {
            true => words == most && words > 0,
            false => words <= most,
        };
        self.words.iter().enumerate().all(full)
    }

    /// Bytes of the lists; no more than `u64::MAX` of a damaged one.
    fn list_bytes(&self) -> u64 {
        let row_bytes = size_of::<KeptRow>() + size_of::<[u32; 2]>();
        let words = self.words.iter().chain(&self.near);
        let words = words.map(|&words| (words, 4));
        let lists = [(self.rows, row_bytes), (self.runs, 8), (self.values, 4)];
        (words.chain(lists))
            .map(|(count, bytes)| (count as u64).saturating_mul(bytes as u64))
            .fold(0, u64::saturating_add)
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
        let mut header = Header {
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
            rows: lists.rows.len(),
            runs: lists.runs.len(),
            values: lists.values.len(),
            words: lists.chunks.iter().map(Vec::len).collect(),
            near: lists.near.iter().map(Vec::len).collect(),
            sha256: String::new(),
        };
        header.sha256 = lists.digest(&header);
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
        let header = serde_json::to_vec(&self.header)
            .map_err(|e| Error::write(path, std::io::Error::other(e)))?;
        write_atomically(path, |out| {
            out.write_all(MAGIC)?;
            out.write_all(&(header.len() as u64).to_le_bytes())?;
            out.write_all(&header)?;
            self.lists
                .bytes()
                .try_for_each(|bytes| out.write_all(bytes))
        })
    }

    /// Reads what [`Self::save`] wrote; refuses damaged files.
    pub fn load(path: &Path) -> Result<Self> {
        let bad = |what: &str| Error::file(path, what);
        let (file, length) = input_file::open(path)?;
        let mut input = std::io::BufReader::new(file);
        let mut read = |bytes: &mut [u8]| {
            input
                .read_exact(bytes)
                .map_err(|_| bad("ends before its form factors do"))
        };
        let mut magic = [0; 16];
        read(&mut magic)?;
        if magic != *MAGIC {
            return Err(bad("not a file of kept form factors"));
        }
        let mut header_length = [0; 8];
        read(&mut header_length)?;
        let header_length = u64::from_le_bytes(header_length);
        if header_length > LONGEST.min(length) {
            return Err(bad("its header is damaged"));
        }
        let mut header = vec![0; header_length as usize];
        read(&mut header)?;
        let header: Header =
            serde_json::from_slice(&header).map_err(|_| bad("its header is damaged"))?;
        if header.list_bytes() != length - header_length - 24 || !header.is_full() {
            return Err(bad("its length is not what its header says"));
        }
        let mut lists = Lists::of(&header);
        lists.bytes_mut().try_for_each(&mut read)?;
        let is_kept =
            |row: &KeptRow| row.chunk == NONE || (row.chunk as usize) < lists.chunks.len();
        if lists.digest(&header) != header.sha256 || !lists.rows.iter().all(is_kept) {
            return Err(bad(
                "damaged: its form factors are not those that were written",
            ));
        }
        Ok(Self {
            header,
            starts: lists.starts(),
            lists,
        })
    }
}
