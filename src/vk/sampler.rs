//! Samplers.

use std::sync::Arc;

use ash::vk;

use super::Device;
use crate::error::Result;

/// How shaders sample an image: nearest (for integer images read by texel) or linear, between
/// levels of detail too. A clone is another handle to the same sampler.
///
/// Descriptor sets that bind it keep it alive.
#[derive(Clone)]
pub struct Sampler {
    pub(super) owner: Arc<SamplerOwner>,
}

pub(super) struct SamplerOwner {
    pub(super) raw: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    /// A sampler that repeats the image.
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, name: &str, linear: bool) -> Result<Self> {
        let repeat = vk::SamplerAddressMode::REPEAT;
        Self::with_edges(device, name, linear, repeat)
    }

    /// A linear sampler that extends the texels at the edges.
    ///
    /// # Errors
    /// A device that fails.
    pub fn held(device: &Arc<Device>, name: &str) -> Result<Self> {
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        Self::with_edges(device, name, true, edge)
    }

    fn with_edges(
        device: &Arc<Device>,
        name: &str,
        linear: bool,
        edges: vk::SamplerAddressMode,
    ) -> Result<Self> {
        let (filter, between_levels) = match linear {
            true => (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR),
            false => (vk::Filter::NEAREST, vk::SamplerMipmapMode::NEAREST),
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(between_levels)
            .max_lod(vk::LOD_CLAMP_NONE)
            .address_mode_u(edges)
            .address_mode_v(edges);
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_sampler(&info, None) }
            .map_err(device.error("creating a sampler"))?;
        device.set_name(raw, name);
        let device = Arc::clone(device);
        Ok(Self {
            owner: Arc::new(SamplerOwner { raw, device }),
        })
    }
}

impl Drop for SamplerOwner {
    fn drop(&mut self) {
        // SAFETY: sets that bind the sampler hold its owner, so none is left.
        unsafe { self.device.raw.destroy_sampler(self.raw, None) };
    }
}
