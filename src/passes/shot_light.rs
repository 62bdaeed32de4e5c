//! Light by the paper's equations as integers on the device: what elements received and what they
//! have sent. Integer sums depend on no order, and no light is lost to rounding as they grow.

use std::sync::Arc;

use glam::DVec2;

use super::buffers::{filled, upload};
use super::types::{ReliefPatch, ReliefTexel, Shot};
use crate::error::{Error, Result};
use crate::math::directions::Directions;
use crate::mesh::elements::Elements;
use crate::meso::{MesoTexel, Relief, Texels, TextureFacet, slot_shares};
use crate::vk::{Buffer, BufferUse, Device, TEXEL_BYTES};

/// Most directions: the bits of [`ReliefTexel`].
pub const MOST_DIRECTIONS: usize = 64;

/// Units of the emitted power: patches send no more than 2¹³ times that before a sum overflows.
const EMITTED_UNITS: f64 = (1_u64 << 50) as f64;

/// Units of a power of 1, at most: of fainter scenes sums are coarser.
const MOST_UNITS: f64 = 1e30;

/// Sums of direct and indirect light, RGB each.
pub const RECEIVED_SUMS: usize = 6;
/// All that texels reflect and the share that leaves, RGB each.
pub const REFLECTED_SUMS: usize = 6;

/// The sums, and what of the scene only this method reads.
pub struct ShotLight {
    /// Units of a power of 1, internal units.
    pub unit: f32,
    /// Without relief, of 16.
    pub directions: Directions,
    /// Elements from here on have a relief: patches.
    pub first_relief: u32,
    /// `[element][RECEIVED_SUMS]`, zero of patches.
    pub received: Buffer,
    /// `[patch][direction][RECEIVED_SUMS]`.
    pub incoming: Buffer,
    /// `[patch][REFLECTED_SUMS]`.
    pub reflected: Buffer,
    /// Reflected power that does not leave in a direction, `[patch][direction][colour]`.
    pub hidden: Buffer,
    /// What was received, or leaves, when an element last shot, `[element][colour]`.
    pub sent: Buffer,
    /// The same of a patch, `[patch][direction][colour]`.
    pub sent_by: Buffer,
    /// [`ReliefPatch`], `[patch]`.
    pub patches: Buffer,
    /// [`ReliefTexel`], of all textures.
    pub texels: Buffer,
    /// Middles, `[direction]`, a texel each.
    pub direction_list: Buffer,
    /// [`Shot`], `[slot]`.
    pub shots: Buffer,
    /// Reflected radiosity, `[slot][direction]`, a texel each.
    pub exits: Buffer,
}

impl ShotLight {
    /// For patches that emit a power of `emitted` (internal units) in all, and batches of so many
    /// slots.
    ///
    /// # Errors
    /// More directions or patches than fit; a device that lacks the memory.
    pub fn new(
        device: &Arc<Device>,
        elements: &Elements,
        emitted: f64,
        slots: u32,
    ) -> Result<Self> {
        let relief = elements.relief.as_ref();
        let (directions, patch_count) = match relief {
            Some(relief) => (relief.directions, relief.count()),
            None => (Directions::new(16)?, 0),
        };
        let k = directions.count();
        check_room(device, patch_count, k)?;
        let (patches, texels) = match relief {
            Some(relief) => lists(elements, relief),
            None => (Vec::new(), Vec::new()),
        };
        let middles: Vec<[f32; 4]> = (0..k)
            .map(|slot| directions.centre(slot).as_vec3().extend(0.0).to_array())
            .collect();
        let sums = |name, count: usize| filled(device, name, 8 * count as u64, 0);
        let texel_buffer =
            |name, texels: u64| Buffer::new(device, name, TEXEL_BYTES * texels, BufferUse::Texels);
        let shot_texels = size_of::<Shot>() as u64 / TEXEL_BYTES;
        Ok(Self {
            unit: match emitted > 0.0 {
                true => (EMITTED_UNITS / emitted).min(MOST_UNITS) as f32,
                false => 1.0,
            },
            directions,
            first_relief: (elements.len() - patch_count) as u32,
            received: sums("received", RECEIVED_SUMS * elements.len())?,
            incoming: sums("incoming", RECEIVED_SUMS * k * patch_count)?,
            reflected: sums("reflected", REFLECTED_SUMS * patch_count)?,
            hidden: sums("hidden", 3 * k * patch_count)?,
            sent: sums("sent", 3 * elements.len())?,
            sent_by: sums("sent by direction", 3 * k * patch_count)?,
            patches: upload(device, "relief patches", &patches, BufferUse::Texels)?,
            texels: upload(device, "relief texels", &texels, BufferUse::Texels)?,
            direction_list: upload(device, "directions", &middles, BufferUse::Texels)?,
            shots: texel_buffer("shots", shot_texels * u64::from(slots))?,
            exits: texel_buffer("exits", k as u64 * u64::from(slots))?,
        })
    }

    /// Radiosity or irradiance of so many units on an area, internal units.
    pub fn per_area(&self, units: u64, area: f64) -> f64 {
        units as f64 / (f64::from(self.unit) * area)
    }
}

/// Refuses sums that no buffer of the device holds, and directions that are no bits of a texel.
fn check_room(device: &Device, patches: usize, directions: usize) -> Result<()> {
    if directions > MOST_DIRECTIONS {
        return Err(Error::Usage(format!(
            "--directions {directions}: --preset paper takes 16, 32 or 64, as the paper does"
        )));
    }
    let bytes = 8 * (RECEIVED_SUMS * directions * patches) as u64;
    let most = device.limits().max_storage_buffer_range;
    if bytes > most {
        return Err(Error::Device(format!(
            "device {}: {patches} elements with relief and {directions} directions need a buffer \
             of {} MiB, and {} MiB is the most: use fewer --directions or patches",
            device.name(),
            bytes >> 20,
            most >> 20
        )));
    }
    if !device.candidate().int64_atomics {
        return Err(Error::Device(format!(
            "device {} has no 64-bit integer atomics on buffers, which --preset paper needs",
            device.name()
        )));
    }
    Ok(())
}

/// What pixels find their texels by, `[patch]`, and these texels.
fn lists(elements: &Elements, relief: &Relief) -> (Vec<ReliefPatch>, Vec<ReliefTexel>) {
    let Some(Texels {
        elements: on,
        facets,
    }) = &relief.texels
    else {
        unreachable!("the paper's transport keeps its texels");
    };
    let first = elements.len() - relief.count();
    let patches = (first..elements.len())
        .map(|e| patch(elements, relief, e, &on[e]))
        .collect();
    let directions = relief.directions;
    let shares = slot_shares(&directions);
    let texel = |facet: &TextureFacet| {
        let hides = |k: usize| facet.normal.dot(directions.centre(k)) <= 0.0;
        let hidden: u64 = (0..directions.count())
            .map(|k| u64::from(hides(k)) << k)
            .sum();
        let shown = (0..directions.count()).filter(|&k| !hides(k));
        ReliefTexel {
            reflectance: facet.reflectance,
            share: shown.map(|k| shares[k]).sum::<f64>() as f32,
            hidden_low: hidden as u32,
            hidden_high: (hidden >> 32) as u32,
            ..ReliefTexel::default()
        }
    };
    (patches, facets.iter().map(texel).collect())
}

/// Texel coordinates of a place p on element `e`: (across, along) · (p − centroid) + at.
fn patch(elements: &Elements, relief: &Relief, e: usize, on: &MesoTexel) -> ReliefPatch {
    let [a, b, c] = elements.triangle(e);
    let n = elements.normal[e];
    let (ab, ac) = (b - a, c - a);
    let twice = n.dot(ab.cross(ac));
    // Gradients of the barycentric coordinates of b and c.
    let (of_b, of_c) = (ac.cross(n) / twice, n.cross(ab) / twice);
    let size = DVec2::new(f64::from(on.columns), f64::from(on.rows));
    let [uv_a, uv_b, uv_c] = on.uv.map(|uv| uv * size);
    let gradient = |axis: usize| of_b * (uv_b - uv_a)[axis] + of_c * (uv_c - uv_a)[axis];
    // A point of the field stands for the middle of its texel.
    let at = (uv_a + uv_b + uv_c) / 3.0 - 0.5;
    ReliefPatch {
        across: gradient(0).as_vec3(),
        across_at: at.x as f32,
        along: gradient(1).as_vec3(),
        along_at: at.y as f32,
        tangent: relief.tangent[e],
        first: on.first,
        bitangent: relief.bitangent[e],
        size: on.columns | on.rows << 16,
    }
}
