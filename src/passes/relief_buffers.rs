//! What the passes share about elements with a relief: only scenes that have some allocate it.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use serde::{Deserialize, Serialize};

use super::buffers::{filled, upload_words};
use super::types::{MesoElement, Reflected};
use super::words::Words;
use crate::error::{Error, Result};
use crate::math::directions::Directions;
use crate::mesh::elements::Elements;
use crate::mesh::sources::Sources;
use crate::meso::{RANK, Relief, slot_shares};
use crate::vk::{Buffer, BufferUse, Device, TEXEL_BYTES};

/// The elements with a relief, in their order.
fn meso_elements(elements: &Elements, relief: &Relief) -> Vec<MesoElement> {
    (elements.len() - relief.count()..elements.len())
        .map(|e| MesoElement {
            tangent: relief.tangent[e],
            response: relief.class[e],
            bitangent: relief.bitangent[e],
            scale: relief.scale[e],
        })
        .collect()
}

/// Elements and sources with a relief are the last of their kinds, point lights aside: each is a
/// contiguous range.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct ReliefShape {
    /// That sources send in, and slots in which elements keep what arrives.
    pub directions: Directions,
    pub kept: Directions,
    pub first_element: u32,
    pub element_count: u32,
    pub first_source: u32,
    pub source_count: u32,
    /// Most elements of a source.
    pub most_members: u32,
}

impl ReliefShape {
    /// Columns and rows of the directions' square.
    pub fn cells(self) -> [u32; 2] {
        [self.directions.columns, self.directions.rows]
    }

    /// Of the square of the slots that elements keep.
    pub fn kept_cells(self) -> [u32; 2] {
        [self.kept.columns, self.kept.rows]
    }
}

/// What any device holds of the relief of a scene, list by list: see [`ReliefBuffers`].
#[derive(Clone, Serialize, Deserialize)]
pub struct ReliefData {
    pub shape: ReliefShape,
    pub elements: Words,
    pub bases: Words,
    pub matrices: Words,
    pub albedos: Words,
    pub emissions: Words,
    pub directions_list: Words,
}

impl ReliefData {
    pub fn new(elements: &Elements, relief: &Relief, sources: &Sources) -> Self {
        let of_relief = sources.relief.clone();
        let members = sources.list[of_relief.clone()].iter();
        let responses = Responses::new(relief);
        let directions_list: Vec<Vec4> = (slot_shares(&relief.directions).iter().enumerate())
            .map(|(slot, &share)| relief.directions.centre(slot).extend(share).as_vec4())
            .collect();
        Self {
            shape: ReliefShape {
                directions: relief.directions,
                kept: relief.kept(),
                first_element: (elements.len() - relief.count()) as u32,
                element_count: relief.count() as u32,
                first_source: of_relief.start as u32,
                source_count: of_relief.len() as u32,
                most_members: members.map(|s| s.element_count).max().unwrap_or(1),
            },
            elements: Words::of(&meso_elements(elements, relief)),
            bases: Words::of(&responses.bases),
            matrices: Words::of(&responses.matrices),
            albedos: Words::of(&responses.albedos),
            emissions: Words::of(&responses.emissions),
            directions_list: Words::of(&directions_list),
        }
    }
}

/// The relief of a scene on a device.
pub struct ReliefBuffers {
    pub shape: ReliefShape,
    /// Sources that send by direction at once, at most.
    pub slots: u32,
    pub elements: Buffer,
    /// u_r, `[response][fine cell][rank]`, four in a texel.
    pub bases: Buffer,
    /// R, `[response][rank][out]`, a texel each.
    pub matrices: Buffer,
    /// `[response][rank]`, a texel each.
    pub albedos: Buffer,
    /// H over its mean, `[response][out]`.
    pub emissions: Buffer,
    /// Of each slot the middle, and its share of a uniform sender's power, `[slot]`.
    pub directions_list: Buffer,
    /// Of all light, `[meso element][rank]`, a texel each.
    pub coefficients: Buffer,
    /// `[meso element][direction][colour]`, vectors.
    pub moments_direct: Buffer,
    pub moments_indirect: Buffer,
    pub reflected: Buffer,
    /// `[relief source][direction]`.
    pub shot_exits: Buffer,
    /// `[slot][member][direction]`.
    pub member_exits: Buffer,
    /// `[slot][emitted, reflected][direction]`, a texel each.
    pub exits: Buffer,
}

/// Memory for what the members of sources send, and the most sources of a dispatch: a software
/// device ends a shader's loops after 65,535 turns of all together.
const SENDING_BYTES: u64 = 32 << 20;
const MOST_SENDING: u64 = 256;

impl ReliefBuffers {
    /// # Errors
    /// More directional state than a buffer of the device may hold.
    pub fn new(device: &Arc<Device>, data: &ReliefData) -> Result<Self> {
        let shape = data.shape;
        let k = shape.directions.count() as u64;
        let elements = u64::from(shape.element_count);
        let slots_kept = shape.kept.count() as u64;
        let moment_bytes = 36 * slots_kept * elements;
        check_room(device, shape.element_count, slots_kept, moment_bytes)?;
        let slot_bytes = 12 * k * u64::from(shape.most_members);
        let batch_slots = (SENDING_BYTES / slot_bytes).clamp(1, MOST_SENDING) as u32;
        let (uses, texels_use) = (BufferUse::Storage, BufferUse::Texels);
        let storage = |name, words| upload_words(device, name, words, uses);
        let texels = |name, words| upload_words(device, name, words, texels_use);
        let zeroed = |name, bytes| filled(device, name, bytes, 0);
        let slots = u64::from(batch_slots);
        let reflected_bytes = size_of::<Reflected>() as u64 * elements;
        Ok(Self {
            shape,
            slots: batch_slots,
            elements: storage("meso elements", &data.elements)?,
            bases: texels("relief bases", &data.bases)?,
            matrices: texels("relief matrices", &data.matrices)?,
            albedos: texels("relief albedos", &data.albedos)?,
            emissions: storage("relief emissions", &data.emissions)?,
            directions_list: storage("directions", &data.directions_list)?,
            coefficients: {
                let bytes = RANK as u64 * TEXEL_BYTES * elements;
                let buffer = Buffer::new(device, "relief coefficients", bytes, texels_use)?;
                buffer.set_all(0)?;
                buffer
            },
            moments_direct: zeroed("moments direct", moment_bytes)?,
            moments_indirect: zeroed("moments indirect", moment_bytes)?,
            reflected: zeroed("meso reflected", reflected_bytes)?,
            shot_exits: zeroed("shot exits", 12 * k * u64::from(shape.source_count))?,
            member_exits: Buffer::new(
                device,
                "member exits",
                12 * k * slots * u64::from(shape.most_members),
                uses,
            )?,
            exits: Buffer::new(device, "exits", 2 * TEXEL_BYTES * k * slots, texels_use)?,
        })
    }

    /// What holds light.
    pub fn light(&self) -> impl Iterator<Item = &Buffer> {
        let moments = [
            &self.moments_direct,
            &self.moments_indirect,
            &self.coefficients,
            &self.reflected,
        ];
        moments.into_iter().chain([&self.shot_exits])
    }
}

/// Refuses moments that no buffer of the device holds.
fn check_room(device: &Device, elements: u32, directions: u64, bytes: u64) -> Result<()> {
    let most = device.limits().max_storage_buffer_range;
    if bytes <= most {
        return Ok(());
    }
    Err(Error::Device(format!(
        "device {}: {elements} elements with relief and {directions} directions need a buffer of \
         {} MiB, and {} MiB is the most: use fewer --directions or patches",
        device.name(),
        bytes >> 20,
        most >> 20
    )))
}

/// All responses, one after another; see [`ReliefBuffers`].
struct Responses {
    bases: Vec<f32>,
    matrices: Vec<Vec4>,
    albedos: Vec<Vec4>,
    emissions: Vec<Vec3>,
}

impl Responses {
    fn new(relief: &Relief) -> Self {
        let responses = || relief.responses.iter();
        Self {
            bases: responses()
                .flat_map(|r| r.basis.values.iter())
                .copied()
                .collect(),
            matrices: responses()
                .flat_map(|r| &r.matrix)
                .map(|sent| sent.extend(0.0))
                .collect(),
            albedos: responses()
                .flat_map(|r| r.albedo)
                .map(|albedo| albedo.extend(0.0))
                .collect(),
            emissions: responses()
                .flat_map(|r| r.emission.iter().map(|h| *h / r.mean_emission))
                .collect(),
        }
    }
}
