//! Descriptor layouts and sets. A set is written once, for the buffers of one problem size.

use std::sync::Arc;

use ash::vk;

use super::{Buffer, Device, Image, Sampler};
use crate::error::Result;

/// The kind of one binding; its number is its place in the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binding {
    Storage,
    /// An image with its sampler.
    Sampled,
}

/// What is bound at one place.
#[derive(Clone, Copy)]
pub enum Bind<'a> {
    Buffer(&'a Buffer),
    Image(&'a Image, &'a Sampler),
}

pub struct DescriptorLayout {
    pub(super) raw: vk::DescriptorSetLayout,
    kinds: Vec<Binding>,
    device: Arc<Device>,
}

impl DescriptorLayout {
    pub fn new(device: &Arc<Device>, name: &str, kinds: &[Binding]) -> Result<Self> {
        let bindings: Vec<_> = kinds
            .iter()
            .enumerate()
            .map(|(i, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(i as u32)
                    .descriptor_type(kind.raw())
                    .descriptor_count(1)
                    .stage_flags(
                        vk::ShaderStageFlags::COMPUTE
                            | vk::ShaderStageFlags::VERTEX
                            | vk::ShaderStageFlags::FRAGMENT,
                    )
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: `info` outlives the call.
        let raw = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .map_err(device.error("creating a descriptor layout"))?;
        device.set_name(raw, name);
        Ok(Self {
            raw,
            kinds: kinds.to_vec(),
            device: Arc::clone(device),
        })
    }

    /// A set of its own pool, with everything bound.
    pub fn bind(&self, name: &str, binds: &[Bind<'_>]) -> Result<DescriptorSet> {
        assert_eq!(
            binds.len(),
            self.kinds.len(),
            "{name}: one bind for each binding"
        );
        let device = &self.device;
        let sizes: Vec<_> = [Binding::Storage, Binding::Sampled]
            .into_iter()
            .filter_map(|kind| {
                let count = self.kinds.iter().filter(|k| **k == kind).count() as u32;
                (count > 0).then(|| {
                    vk::DescriptorPoolSize::default()
                        .ty(kind.raw())
                        .descriptor_count(count)
                })
            })
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: `info` outlives the call.
        let pool = unsafe { device.raw.create_descriptor_pool(&info, None) }
            .map_err(device.error("creating a descriptor pool"))?;
        let mut set = DescriptorSet {
            raw: vk::DescriptorSet::null(),
            pool,
            device: Arc::clone(device),
        };
        let layouts = [self.raw];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(&layouts);
        // SAFETY: the pool has room for exactly this set.
        set.raw = unsafe { device.raw.allocate_descriptor_sets(&info) }
            .map_err(device.error("allocating a descriptor set"))?[0];
        device.set_name(set.raw, name);
        for (i, (bind, kind)) in binds.iter().zip(&self.kinds).enumerate() {
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set.raw)
                .dst_binding(i as u32)
                .descriptor_type(kind.raw());
            match (bind, kind) {
                (Bind::Buffer(buffer), Binding::Storage) => {
                    let infos = [vk::DescriptorBufferInfo::default()
                        .buffer(buffer.raw)
                        .range(vk::WHOLE_SIZE)];
                    // SAFETY: the set is not in use yet, and the buffer is alive.
                    unsafe {
                        device
                            .raw
                            .update_descriptor_sets(&[write.buffer_info(&infos)], &[]);
                    }
                }
                (Bind::Image(image, sampler), Binding::Sampled) => {
                    let infos = [vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
                        .sampler(sampler.raw)];
                    // SAFETY: the set is not in use yet, and image and sampler are alive.
                    unsafe {
                        device
                            .raw
                            .update_descriptor_sets(&[write.image_info(&infos)], &[]);
                    }
                }
                _ => panic!("{name}: binding {i} is of another kind"),
            }
        }
        Ok(set)
    }
}

impl Binding {
    fn raw(self) -> vk::DescriptorType {
        match self {
            Self::Storage => vk::DescriptorType::STORAGE_BUFFER,
            Self::Sampled => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        }
    }
}

impl Drop for DescriptorLayout {
    fn drop(&mut self) {
        // SAFETY: a layout may go before the sets and pipelines made with it.
        unsafe {
            self.device
                .raw
                .destroy_descriptor_set_layout(self.raw, None);
        }
    }
}

pub struct DescriptorSet {
    pub(super) raw: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    device: Arc<Device>,
}

impl Drop for DescriptorSet {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the set waits for the submission before dropping it.
        unsafe { self.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
