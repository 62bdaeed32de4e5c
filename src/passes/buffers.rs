//! What the passes share on the device: the scene, the state of the solution, and the batch under
//! way.

use std::sync::Arc;

use bytemuck::Pod;
use glam::{DVec3, Vec3};

use super::receiver_blocks::receiver_blocks;
use super::types::{Component, Meshlet, Source, Triangle, contour_corners};
use crate::error::Result;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::meshlets;
use crate::mesh::near::{NearPairs, Rows};
use crate::mesh::occluders::Occluders;
use crate::mesh::sources::{self, PART_MEMBERS, SourcePlace, Sources};
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage};

/// The scene in internal units: read by the passes, never written.
pub struct SceneBuffers {
    pub element_count: u32,
    pub occluder_count: u32,
    pub source_count: u32,
    pub meshlet_count: u32,
    /// Whatever is sent arrives: see [`Connections::enclosed`].
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
    /// Blocks of GROUP elements without relief, then of those with it.
    pub receiver_blocks: Buffer,
    pub areas: Buffer,
    /// See [`NearPairs::weights`].
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
    /// Form factors from near elements without and with a relief.
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
    fn new<T: Pod>(device: &Arc<Device>, rows: &Rows<T>) -> Result<Self> {
        let storage = BufferUse::Storage;
        Ok(Self {
            factors: upload(device, "near factors", &rows.factors, storage)?,
            starts: upload(device, "near starts", &rows.starts, storage)?,
            most: rows.longest(),
        })
    }
}

impl SceneBuffers {
    pub fn new(
        device: &Arc<Device>,
        elements: &Elements,
        sources: &Sources,
        connections: &Connections,
        occluders: &Occluders,
        near: &NearPairs,
    ) -> Result<Self> {
        let vertices: Vec<Vec3> = elements.vertices.iter().map(|v| v.as_vec3()).collect();
        let planes = planes(elements);
        let triangles = triangles(elements, &planes);
        let narrow = |values: &[f64]| -> Vec<f32> { values.iter().map(|&v| v as f32).collect() };
        let (areas, weights) = (narrow(&elements.area), narrow(&near.weights));
        let Outlined {
            list,
            contours,
            parts,
            webs,
        } = Outlined::new(&sources.list);
        let meshlets: Vec<Meshlet> =
            meshlets::build(elements, connections, occluders, &sources.chart)
                .iter()
                .map(Meshlet::from)
                .collect();
        let blocks = receiver_blocks(elements);
        let components = components(elements, connections);
        let reflectance = elements.even_reflectance();
        let starts = eye_starts(&sources.list);
        let (geometry, storage, texels) =
            (BufferUse::Geometry, BufferUse::Storage, BufferUse::Texels);
        Ok(Self {
            element_count: elements.len() as u32,
            occluder_count: occluders.len() as u32,
            source_count: sources.list.len() as u32,
            meshlet_count: meshlets.len() as u32,
            enclosed: connections.enclosed,
            vertices: upload(device, "vertices", &vertices, geometry)?,
            corners: upload(device, "corners", &elements.corners, geometry)?,
            occluder_corners: upload(device, "occluder corners", &occluders.corners, storage)?,
            occluder_items: upload(device, "occluder items", &occluders.items, storage)?,
            triangles: upload(device, "triangles", &triangles, texels)?,
            parts: upload(device, "parts", &parts, texels)?,
            planes: upload(device, "planes", &planes, texels)?,
            balls: upload(device, "balls", &balls(elements), texels)?,
            receiver_blocks: upload(device, "receiver blocks", &blocks, storage)?,
            areas: upload(device, "areas", &areas, storage)?,
            weights: upload(device, "weights", &weights, storage)?,
            reflectance: upload(device, "reflectance", &reflectance, storage)?,
            sources: upload(device, "sources", &list, texels)?,
            eyes: upload(device, "eyes", &eyes(&sources.list), storage)?,
            eye_starts: upload(device, "eye starts", &starts, storage)?,
            contours: upload(device, "contours", &contours, texels)?,
            webs: upload(device, "webs", &webs, texels)?,
            meshlets: upload(device, "meshlets", &meshlets, storage)?,
            components: upload(device, "components", &components, storage)?,
            near_rows: NearBuffers::new(device, &near.rows)?,
            near_relief_rows: NearBuffers::new(device, &near.relief_rows)?,
        })
    }
}

impl SceneBuffers {
    /// Other light of the same sources, and other places of point lights; sources that see from
    /// more places than before have theirs in other buffers then.
    pub fn write_sources(
        &mut self,
        device: &Arc<Device>,
        sources: &[sources::Source],
        more_eyes: bool,
    ) -> Result<()> {
        let Outlined { list, webs, .. } = Outlined::new(sources);
        self.sources.set(&list)?;
        if more_eyes {
            let starts = eye_starts(sources);
            self.eyes = upload(device, "eyes", &eyes(sources), BufferUse::Storage)?;
            self.eye_starts = upload(device, "eye starts", &starts, BufferUse::Storage)?;
        }
        if sources.iter().any(sources::Source::is_far) {
            self.eyes.set(&eyes(sources))?;
            self.webs.set(&webs)?;
        }
        Ok(())
    }
}

/// Places on each source, with the packed normals of curved ones, one source after another. Only
/// the `receiver` estimator gives sources places, and reads them.
fn eyes(sources: &[sources::Source]) -> Vec<[f32; 4]> {
    let texels = |source: &sources::Source| {
        let is_curved = source.cone > 0.0;
        let texel = move |place: &SourcePlace| {
            let normal = if is_curved { place.normal } else { DVec3::ZERO };
            place.at.as_vec3().extend(packed(normal)).to_array()
        };
        source.places.iter().map(texel).collect::<Vec<_>>()
    };
    sources.iter().flat_map(texels).collect()
}

/// Where the places of each source begin among those of all; one more than the sources.
fn eye_starts(sources: &[sources::Source]) -> Vec<u32> {
    let mut starts = vec![0];
    let mut end = 0;
    starts.extend(sources.iter().map(|source| {
        end += source.places.len() as u32;
        end
    }));
    starts
}

/// The bits of a vector with components from -1 to 1, as `unpackSnorm4x8` reads them.
fn packed(vector: DVec3) -> f32 {
    let bytes = vector.to_array().map(|c| (c * 127.0).round() as i8 as u8);
    let [x, y, z] = bytes;
    f32::from_bits(u32::from_le_bytes([x, y, z, 0]))
}

/// Normal n and n · x, `[element]`.
fn planes(elements: &Elements) -> Vec<[f32; 4]> {
    (0..elements.len())
        .map(|e| {
            let n = elements.normal[e];
            let height = n.dot(elements.centroid[e]) as f32;
            n.as_vec3().extend(height).to_array()
        })
        .collect()
}

/// Centroid and radius, `[element]`.
fn balls(elements: &Elements) -> Vec<[f32; 4]> {
    (0..elements.len())
        .map(|e| {
            let centroid = elements.centroid[e].as_vec3();
            centroid.extend(elements.radius(e) as f32).to_array()
        })
        .collect()
}

fn triangles(elements: &Elements, planes: &[[f32; 4]]) -> Vec<Triangle> {
    (0..elements.len())
        .map(|e| {
            let [a, b, c] = elements.triangle(e).map(|v| v.as_vec3());
            Triangle {
                a,
                area: elements.area[e] as f32,
                b,
                height: planes[e][3],
                c,
                unused_c: 0.0,
                normal: elements.normal[e].as_vec3(),
                unused: 0.0,
            }
        })
        .collect()
}

/// Words of a part in [`SceneBuffers::parts`], whole texels.
const PART_WORDS: usize = (8 + PART_MEMBERS).next_multiple_of(4);

/// Sources with what they refer to in the buffers of all.
struct Outlined {
    list: Vec<Source>,
    contours: Vec<[f32; 4]>,
    /// See [`SceneBuffers::parts`].
    parts: Vec<[f32; PART_WORDS]>,
    /// Of beams, `[row][column]` of each, to whole texels.
    webs: Vec<f32>,
}

impl Outlined {
    fn new(sources: &[sources::Source]) -> Self {
        let mut outlined = Self {
            list: Vec::with_capacity(sources.len()),
            contours: Vec::new(),
            parts: Vec::new(),
            webs: Vec::new(),
        };
        // Lights have no elements; of a far one the first eye stands there.
        let with_eyes = |mut row: Source, source: &sources::Source, first_eye: u32| {
            if source.is_far() {
                row.first_element = first_eye;
            }
            row
        };
        for (source, first_eye) in sources.iter().zip(eye_starts(sources)) {
            if let Some(web) = &source.web {
                let (first, rows) = (outlined.webs.len() as u32, web.rows);
                let beam = Source::beam(source, (first, web.columns), rows);
                outlined.list.push(with_eyes(beam, source, first_eye));
                outlined.webs.extend(&web.shares);
                continue;
            }
            let corners = contour_corners(source);
            let outline = (outlined.contours.len() as u32, corners.len() as u32);
            let first_part = outlined.parts.len() as u32;
            let row = Source::new(source, outline, first_part);
            outlined.list.push(with_eyes(row, source, first_eye));
            outlined.contours.extend(corners);
            outlined.parts.extend(source.parts.iter().map(|part| {
                let mut words = [0.0; PART_WORDS];
                words[..3].copy_from_slice(&part.centroid.as_vec3().to_array());
                words[3..6].copy_from_slice(&part.vector_area.as_vec3().to_array());
                words[6] = part.radius as f32;
                words[7] = f32::from_bits(part.members.len() as u32);
                for (word, &member) in words[8..].iter_mut().zip(&part.members) {
                    *word = f32::from_bits(member);
                }
                words
            }));
        }
        let texels = outlined.webs.len().div_ceil(4);
        outlined.webs.resize(4 * texels, 0.0);
        outlined
    }
}

fn components(elements: &Elements, connections: &Connections) -> Vec<Component> {
    let mut components: Vec<_> = connections
        .closed
        .iter()
        .map(|&closed| Component {
            low: Vec3::INFINITY,
            closed: closed.into(),
            high: Vec3::NEG_INFINITY,
        })
        .collect();
    for (e, &c) in connections.component.iter().enumerate() {
        for v in elements.triangle(e) {
            let component = &mut components[c as usize];
            component.low = component.low.min(v.as_vec3());
            component.high = component.high.max(v.as_vec3());
        }
    }
    components
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

/// The first `count` values of a device buffer; everything submitted before is done first.
pub fn download<T: Pod>(device: &Arc<Device>, buffer: &Buffer, count: usize) -> Result<Vec<T>> {
    let [values] = download_all(device, [buffer], count)?;
    Ok(values)
}

/// As [`download`], of several buffers.
pub fn download_all<T: Pod, const N: usize>(
    device: &Arc<Device>,
    buffers: [&Buffer; N],
    count: usize,
) -> Result<[Vec<T>; N]> {
    let bytes = (count * size_of::<T>()) as u64;
    let readback = Buffer::new(device, "readback", N as u64 * bytes, BufferUse::Readback)?;
    Commands::run(device, "download", |cmd| {
        cmd.barrier(
            &[Stage::Compute, Stage::Transfer, Stage::Attachment],
            &[Stage::Transfer],
        );
        for (i, buffer) in (0..).zip(buffers) {
            cmd.copy(buffer, 0, &readback, i * bytes, bytes);
        }
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
        Ok(())
    })?;
    Ok(std::array::from_fn(|i| {
        readback.read(i as u64 * bytes, count)
    }))
}
