//! Kept form factors outside the device: what lets a scene be lit anew without drawing its sources again.

use std::io::Read;
use std::path::Path;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::Settings;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::meso::Transport;
use crate::passes::types::{KeptRow, KeptState};
use crate::scene::{PointLight, Scene};

/// Form factors of the sources of a scene that had been drawn, for the same scene with other emission and point lights.
pub struct Visibility {
    pub(super) header: Header,
    pub(super) rows: Vec<KeptRow>,
    pub(super) chunks: Vec<Vec<u32>>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Header {
    /// Tells the geometry, the reflectances and the settings that form factors depend on.
    key: String,
    /// Emission `[material]` by which the elements were grouped, W·m⁻²·sr⁻¹.
    pub emission: Vec<[f32; 3]>,
    /// Position and radiant intensity of the point lights then.
    pub lights: Vec<([f64; 3], [f32; 3])>,
    pub chunk_words: u32,
    pub state: [u32; 3],
    rows: usize,
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
    let sizes = (settings.hemicube, settings.emitter_shadows());
    let (seed, grouping) = (settings.seed, settings.grouping);
    hash.update(format!("4 {sizes:?} {seed} {grouping:?} {flat}"));
    hexadecimal(hash)
}

impl Visibility {
    pub(super) fn new(
        scene: &Scene,
        settings: &Settings,
        (rows, chunks): (Vec<KeptRow>, Vec<Vec<u32>>),
        (state, chunk_words): (KeptState, u32),
    ) -> Self {
        let lights = scene.point_lights.iter();
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
                words: chunks.iter().map(Vec::len).collect(),
                sha256: digest(&rows, &chunks),
            },
            rows,
            chunks,
        }
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
            what: "its kept form factors are of other geometry, reflectance or settings: only emission and point lights may change; bake it anew with --keep-visibility".into(),
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
        let told = words
            .saturating_mul(4)
            .saturating_add(header.rows.saturating_mul(size_of::<KeptRow>()));
        if told as u64 != length - header_length - 24
            || header
                .words
                .iter()
                .any(|&n| n > header.chunk_words as usize)
        {
            return Err(bad("its length is not what its header says"));
        }
        let mut rows = vec![bytemuck::Zeroable::zeroed(); header.rows];
        read(bytemuck::cast_slice_mut(&mut rows))?;
        let mut chunks = Vec::new();
        for &count in &header.words {
            let mut chunk = vec![0_u32; count];
            read(bytemuck::cast_slice_mut(&mut chunk))?;
            chunks.push(chunk);
        }
        if digest(&rows, &chunks) != header.sha256 {
            return Err(bad(
                "damaged: its form factors are not those that were written",
            ));
        }
        Ok(Self {
            header,
            rows,
            chunks,
        })
    }
}

fn digest(rows: &[KeptRow], chunks: &[Vec<u32>]) -> String {
    let mut hash = Sha256::new();
    hash.update(bytemuck::cast_slice::<_, u8>(rows));
    for chunk in chunks {
        hash.update(bytemuck::cast_slice::<_, u8>(chunk));
    }
    hexadecimal(hash)
}
