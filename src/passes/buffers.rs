//! What the passes share on the device: the scene, the state of the solution, and the batch under
//! way.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::Pod;

use super::fresh_rows::RowShape;
use super::scene_data::{LitSources, NearRows, SceneData};
use super::words::Words;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage};

/// The scene in internal units: read by the passes, never written.
pub struct SceneBuffers {
    pub element_count: u32,
    pub occluder_count: u32,
    pub source_count: u32,
    pub meshlet_count: u32,
    /// See [`crate::mesh::charts::Connections::enclosed`].
    pub enclosed: bool,
    pub vertices: Buffer,
    /// Three a element, `[element][corner]`.
    pub corners: Buffer,
    /// `[occluder][corner]`.
    pub occluder_corners: Buffer,
    /// The element that each is drawn as.
    pub occluder_items: Buffer,
    pub triangles: Buffer,
    /// Of curved sources, 16 words a part: centroid, sum of area times normal, radius; how
    /// many members it has, and these.
    pub parts: Buffer,
    /// Normal and n · x.
    pub planes: Buffer,
    /// Centroid and radius.
    pub balls: Buffer,
    /// Of a row: blocks of GROUP elements without relief, then of those with it.
    pub receiver_blocks: Buffer,
    pub areas: Buffer,
    /// See [`crate::mesh::near::NearPairs::weights`].
    pub weights: Buffer,
    /// Of an element with a relief: that of even light.
    pub reflectance: Buffer,
    pub sources: Buffer,
    /// Places on each source but point lights, one source after another.
    pub eyes: Buffer,
    /// Where those of each source begin; one more than the sources.
    pub eye_starts: Buffer,
    pub contours: Buffer,
    /// Shares of the intensity of beams by angle.
    pub webs: Buffer,
    pub meshlets: Buffer,
    pub components: Buffer,
    /// Form factors from near elements of a row, without and with a relief.
    pub near_rows: NearBuffers,
    pub near_relief_rows: NearBuffers,
}

/// Form factors from near elements, one source after another.
pub struct NearBuffers {
    pub factors: Buffer,
    /// Where those of each source begin; one more than the sources.
    pub starts: Buffer,
    /// Of one source, at most.
    pub most: u32,
}

impl NearBuffers {
    fn new(device: &Arc<Device>, rows: &NearRows) -> Result<Self> {
        let storage = BufferUse::Storage;
        Ok(Self {
            factors: upload_words(device, "near factors", &rows.factors, storage)?,
            starts: upload_words(device, "near starts", &rows.starts, storage)?,
            most: rows.longest(),
        })
    }
}

impl SceneBuffers {
    /// The scene, to find rows of this shape.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, data: &SceneData, shape: RowShape) -> Result<Self> {
        let geometry = |name, words| upload_words(device, name, words, BufferUse::Geometry);
        let storage = |name, words| upload_words(device, name, words, BufferUse::Storage);
        let texels = |name, words| upload_words(device, name, words, BufferUse::Texels);
        let read = |name, words| upload_words(device, name, words, BufferUse::ReadTexels);
        let blocks = data.blocks_of(shape);
        let [near, near_relief] = data.near_of(shape);
        let lit = &data.lit;
        Ok(Self {
            element_count: data.element_count,
            occluder_count: data.occluder_count,
            source_count: data.source_count,
            meshlet_count: data.meshlet_count,
            enclosed: data.enclosed,
            vertices: geometry("vertices", &data.vertices)?,
            corners: geometry("corners", &data.corners)?,
            occluder_corners: storage("occluder corners", &data.occluder_corners)?,
            occluder_items: storage("occluder items", &data.occluder_items)?,
            triangles: read("triangles", &data.triangles)?,
            parts: texels("parts", &lit.parts)?,
            planes: read("planes", &data.planes)?,
            balls: read("balls", &data.balls)?,
            receiver_blocks: upload(device, "receiver blocks", &blocks, BufferUse::Storage)?,
            areas: storage("areas", &data.areas)?,
            weights: storage("weights", &data.weights)?,
            reflectance: storage("reflectance", &data.reflectance)?,
            sources: texels("sources", &lit.sources)?,
            eyes: storage("eyes", &lit.eyes)?,
            eye_starts: storage("eye starts", &lit.eye_starts)?,
            contours: texels("contours", &lit.contours)?,
            webs: texels("webs", &lit.webs)?,
            meshlets: storage("meshlets", &data.meshlets)?,
            components: storage("components", &data.components)?,
            near_rows: NearBuffers::new(device, &near)?,
            near_relief_rows: NearBuffers::new(device, &near_relief)?,
        })
    }

    /// Other light of the same sources, and other places of point lights; sources that see from
    /// more places than before (`more_eyes`) have theirs in other buffers then.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn write_sources(
        &mut self,
        device: &Arc<Device>,
        lit: &LitSources,
        more_eyes: bool,
    ) -> Result<()> {
        self.sources.set(lit.sources.words())?;
        if more_eyes {
            self.eyes = upload_words(device, "eyes", &lit.eyes, BufferUse::Storage)?;
            let starts = &lit.eye_starts;
            self.eye_starts = upload_words(device, "eye starts", starts, BufferUse::Storage)?;
        }
        if lit.any_far {
            self.eyes.set(lit.eyes.words())?;
            self.webs.set(lit.webs.words())?;
        }
        Ok(())
    }
}

/// The light gathered so far, `[element]`, W·m⁻², RGB; direct and indirect irradiance with the
/// rounding errors of their last sums.
pub struct State {
    pub direct: Buffer,
    pub direct_error: Buffer,
    pub indirect: Buffer,
    pub indirect_error: Buffer,
    /// Radiosity that each source reflects, as measured last, RGB, `[source]`.
    pub reflected: Buffer,
}

impl State {
    /// Everything zero: no light yet.
    pub fn new(device: &Arc<Device>, scene: &SceneBuffers) -> Result<Self> {
        let elements = u64::from(scene.element_count);
        let sources = u64::from(scene.source_count);
        let zeroed = |name, bytes| filled(device, name, bytes, 0);
        Ok(Self {
            direct: zeroed("direct", 12 * elements)?,
            direct_error: zeroed("direct error", 12 * elements)?,
            indirect: zeroed("indirect", 12 * elements)?,
            indirect_error: zeroed("indirect error", 12 * elements)?,
            reflected: zeroed("source reflected", 12 * sources)?,
        })
    }
}

impl State {
    /// All of them.
    pub fn buffers(&self) -> impl Iterator<Item = &Buffer> {
        let direct = [&self.direct, &self.direct_error];
        let indirect = [&self.indirect, &self.indirect_error, &self.reflected];
        direct.into_iter().chain(indirect)
    }
}

/// A device buffer of one word over and over.
pub fn filled(device: &Arc<Device>, name: &str, bytes: u64, word: u32) -> Result<Buffer> {
    let buffer = Buffer::new(device, name, bytes, BufferUse::Storage)?;
    buffer.set_all(word)?;
    Ok(buffer)
}

/// A device buffer filled with `data`.
pub fn upload<T: Pod>(
    device: &Arc<Device>,
    name: &str,
    data: &[T],
    usage: BufferUse,
) -> Result<Buffer> {
    let buffer = Buffer::new(device, name, size_of_val(data) as u64, usage)?;
    buffer.set(data)?;
    Ok(buffer)
}

/// As [`upload`], of words.
pub fn upload_words(
    device: &Arc<Device>,
    name: &str,
    words: &Words,
    usage: BufferUse,
) -> Result<Buffer> {
    upload(device, name, words.words(), usage)
}

/// The first `count` values of a device buffer; everything submitted before is done first.
pub fn download<T: Pod>(device: &Arc<Device>, buffer: &Buffer, count: usize) -> Result<Vec<T>> {
    let [values] = download_parts(device, [(buffer, 0..count)])?;
    Ok(values)
}

/// As [`download`], values of several buffers, by their numbers.
pub fn download_parts<T: Pod, const N: usize>(
    device: &Arc<Device>,
    parts: [(&Buffer, Range<usize>); N],
) -> Result<[Vec<T>; N]> {
    let size = size_of::<T>() as u64;
    let all: usize = parts.iter().map(|(_, range)| range.len()).sum();
    let readback = Buffer::new(device, "readback", all as u64 * size, BufferUse::Readback)?;
    Commands::run(device, "download", |cmd| {
        cmd.barrier(
            &[Stage::Compute, Stage::Transfer, Stage::Attachment],
            &[Stage::Transfer],
        );
        let mut at = 0;
        for (buffer, range) in &parts {
            let bytes = range.len() as u64 * size;
            cmd.copy(buffer, range.start as u64 * size, &readback, at, bytes);
            at += bytes;
        }
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
        Ok(())
    })?;
    let mut at = 0;
    Ok(parts.map(|(_, range)| {
        let values = readback.read(at, range.len());
        at += range.len() as u64 * size;
        values
    }))
}
