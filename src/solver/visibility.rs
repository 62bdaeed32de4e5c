//! Kept rows and their coupling outside the device: what lights a scene again without drawing it.

use std::io::Read;
use std::path::Path;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::Settings;
use super::coupling::CouplingRow;
use crate::atomic_file::write_atomically;
use crate::constants::NONE;
use crate::error::{Error, Result};
use crate::meso::Transport;
use crate::passes::kept_rows::RestoredSize;
use crate::passes::types::{KeptRow, KeptState};
use crate::scene::{PointLight, Scene};

/// Form factors of the sources of a scene that had been drawn, for the same scene with other
/// emission and point lights.
pub struct Visibility {
    header: Header,
    /// `[source]`; chunk `NONE` where a source has none.
    rows: Vec<KeptRow>,
    /// Runs and values of each source's coupling row, behind one another.
    counts: Vec<[u32; 2]>,
    runs: Vec<[u32; 2]>,
    values: Vec<f32>,
    /// First run and value of each source.
    starts: Vec<[usize; 2]>,
    pub(super) chunks: Vec<Vec<u32>>,
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
    /// Emission `[material]` by which the elements were grouped, W·m⁻²·sr⁻¹.
    emission: Vec<[f32; 3]>,
    /// Position and radiant intensity of the point lights then.
    lights: Vec<([f64; 3], [f32; 3])>,
    chunk_words: u32,
    state: [u32; 3],
    rows: usize,
    runs: usize,
    values: usize,
    words: Vec<usize>,
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
    unlit.point_lights.clear();
    unlit.materials.iter_mut().for_each(|m| m.ke = [0.0; 3]);
    let mut hash = Sha256::new();
    hash.update(unlit.hash());
    let flat = settings.relief.transport == Transport::Lambert;
    let estimator = settings.estimator;
    let sizes = (settings.hemicube, settings.emitter_shadows());
    let (seed, grouping) = (settings.seed, settings.grouping);
    hash.update(format!(
        "5 {estimator:?} {sizes:?} {seed} {grouping:?} {flat}"
    ));
    hexadecimal(hash)
}

impl Visibility {
    pub(super) fn new(scene: &Scene, settings: &Settings, kept: Kept<'_>) -> Self {
        let lights = scene.point_lights.iter();
        let none = KeptRow {
            chunk: NONE,
            first: 0,
            scale: 1.0,
        };
        let rows: Vec<KeptRow> = kept.rows.iter().map(|row| row.unwrap_or(none)).collect();
        let lists = || {
            kept.coupling
                .iter()
                .map(|row| row.map(CouplingRow::lists).unwrap_or_default())
        };
        let counts: Vec<[u32; 2]> = lists()
            .map(|(runs, values)| [runs.len() as u32, values.len() as u32])
            .collect();
        let runs: Vec<[u32; 2]> = lists().flat_map(|(runs, _)| runs.iter().copied()).collect();
        let values: Vec<f32> = lists()
            .flat_map(|(_, values)| values.iter().copied())
            .collect();
        let Kept {
            state,
            chunks,
            chunk_words,
            ..
        } = kept;
        Self {
            header: Header {
                key: key(scene, settings),
                emission: scene.materials.iter().map(|m| m.ke).collect(),
                lights: lights
                    .map(|l| (l.position.to_array(), l.intensity))
                    .collect(),
                chunk_words,
                state: [state.chunk, state.used, state.rows],
                rows: rows.len(),
                runs: runs.len(),
                values: values.len(),
                words: chunks.iter().map(Vec::len).collect(),
                sha256: digest(
                    &[
                        bytemuck::cast_slice(&rows),
                        bytemuck::cast_slice(&counts),
                        bytemuck::cast_slice(&runs),
                        bytemuck::cast_slice(&values),
                    ],
                    &chunks,
                ),
            },
            starts: starts(&counts),
            rows,
            counts,
            runs,
            values,
            chunks,
        }
    }

    /// Of the chunks on the device.
    pub(super) fn size(&self) -> RestoredSize {
        RestoredSize {
            chunk_words: self.header.chunk_words,
            chunks: self.chunks.len(),
        }
    }

    pub(super) fn state(&self) -> KeptState {
        let [chunk, used, rows] = self.header.state;
        KeptState { chunk, used, rows }
    }

    /// Where the row of a source is kept, if it is.
    pub(super) fn row(&self, s: usize) -> Option<KeptRow> {
        self.rows.get(s).copied().filter(|row| row.chunk != NONE)
    }

    /// The coupling row of a source, of so many words; none where it was not kept.
    pub(super) fn coupling(&self, s: usize, words: usize) -> Option<CouplingRow> {
        let &[runs, values] = self.counts.get(s)?;
        let &[first_run, first_value] = self.starts.get(s)?;
        let runs = self.runs.get(first_run..first_run + runs as usize)?;
        let values = self
            .values
            .get(first_value..first_value + values as usize)?;
        // A row that sees nothing has no runs, as one that was not kept: both are measured.
        (!runs.is_empty())
            .then(|| CouplingRow::from_lists(runs.to_vec(), values.to_vec(), words))
            .flatten()
    }

    /// Refuses a scene whose form factors these are not.
    pub fn check(&self, scene: &Scene, settings: &Settings) -> Result<()> {
        if self.header.emission.len() == scene.materials.len()
            && self.header.key == key(scene, settings)
        {
            return Ok(());
        }
        Err(Error::Scene {
            scene: scene.name.clone(),
            what: "its kept form factors are of other geometry, reflectance or settings: only emission and point lights may change; bake it again with --keep-visibility".into(),
        })
    }

    /// The point lights of the bake.
    pub(super) fn lights(&self) -> Vec<PointLight> {
        let lights = self.header.lights.iter();
        lights
            .map(|&(position, intensity)| PointLight {
                name: String::new(),
                position: position.into(),
                intensity,
            })
            .collect()
    }

    /// Radiosity from emission of each material then.
    pub(super) fn emitted(&self) -> Vec<Vec3> {
        let emission = self.header.emission.iter();
        emission
            .map(|&ke| Vec3::from(ke) * std::f32::consts::PI)
            .collect()
    }

    pub fn save(&self, path: &Path) -> Result<()> {
        let header = serde_json::to_vec(&self.header)
            .map_err(|e| Error::write(path, std::io::Error::other(e)))?;
        write_atomically(path, |out| {
            out.write_all(MAGIC)?;
            out.write_all(&(header.len() as u64).to_le_bytes())?;
            out.write_all(&header)?;
            out.write_all(bytemuck::cast_slice(&self.rows))?;
            out.write_all(bytemuck::cast_slice(&self.counts))?;
            out.write_all(bytemuck::cast_slice(&self.runs))?;
            out.write_all(bytemuck::cast_slice(&self.values))?;
            for chunk in &self.chunks {
                out.write_all(bytemuck::cast_slice(chunk))?;
            }
            Ok(())
        })
    }

    /// Reads what [`Self::save`] wrote; refuses damaged files.
    pub fn load(path: &Path) -> Result<Self> {
        let bad = |what: &str| Error::file(path, what);
        let file = std::fs::File::open(path).map_err(|e| Error::read(path, e))?;
        let length = file.metadata().map_err(|e| Error::read(path, e))?.len();
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
        let words: usize = header.words.iter().fold(0, |sum, &n| sum.saturating_add(n));
        let row_bytes = size_of::<KeptRow>() + size_of::<[u32; 2]>();
        let expected = [
            words.saturating_mul(4),
            header.rows.saturating_mul(row_bytes),
            header.runs.saturating_mul(8),
            header.values.saturating_mul(4),
        ];
        let expected = expected
            .iter()
            .fold(0, |sum: usize, &n| sum.saturating_add(n));
        if expected as u64 != length - header_length - 24
            || header
                .words
                .iter()
                .any(|&n| n > header.chunk_words as usize)
        {
            return Err(bad("its length is not what its header says"));
        }
        let mut rows = vec![bytemuck::Zeroable::zeroed(); header.rows];
        read(bytemuck::cast_slice_mut(&mut rows))?;
        let mut counts = vec![[0_u32; 2]; header.rows];
        read(bytemuck::cast_slice_mut(&mut counts))?;
        let mut runs = vec![[0_u32; 2]; header.runs];
        read(bytemuck::cast_slice_mut(&mut runs))?;
        let mut values = vec![0_f32; header.values];
        read(bytemuck::cast_slice_mut(&mut values))?;
        let mut chunks = Vec::new();
        for &count in &header.words {
            let mut chunk = vec![0_u32; count];
            read(bytemuck::cast_slice_mut(&mut chunk))?;
            chunks.push(chunk);
        }
        let lists = [
            bytemuck::cast_slice(&rows),
            bytemuck::cast_slice(&counts),
            bytemuck::cast_slice(&runs),
            bytemuck::cast_slice(&values),
        ];
        if digest(&lists, &chunks) != header.sha256 {
            return Err(bad(
                "damaged: its form factors are not those that were written",
            ));
        }
        Ok(Self {
            header,
            starts: starts(&counts),
            rows,
            counts,
            runs,
            values,
            chunks,
        })
    }
}

/// Where the lists of each source begin.
fn starts(counts: &[[u32; 2]]) -> Vec<[usize; 2]> {
    let next = |at: &mut [usize; 2], &[runs, values]: &[u32; 2]| {
        let start = *at;
        *at = [start[0] + runs as usize, start[1] + values as usize];
        Some(start)
    };
    counts.iter().scan([0, 0], next).collect()
}

fn digest(lists: &[&[u8]], chunks: &[Vec<u32>]) -> String {
    let mut hash = Sha256::new();
    for list in lists {
        hash.update(list);
    }
    for chunk in chunks {
        hash.update(bytemuck::cast_slice::<_, u8>(chunk));
    }
    hexadecimal(hash)
}
