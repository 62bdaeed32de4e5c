//! Descriptor layouts and sets. A set is written once, for the buffers of one problem size.

use std::sync::Arc;

use ash::vk;

use super::held::Held;
use super::{Buffer, Device, Image, Sampler, ShaderBinding, ShaderBindings};
use crate::error::Result;

/// The kind of a binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binding {
    Storage,
    /// An image with its sampler.
    Sampled,
    /// A buffer as texels of four words.
    Texels,
}

/// An image with its sampler.
#[derive(Clone, Copy)]
pub struct Sampled<'a> {
    pub image: &'a Image,
    pub sampler: &'a Sampler,
}

/// What is bound to a binding.
#[derive(Clone, Copy)]
pub enum Bind<'a> {
    Storage(&'a Buffer),
    Sampled(Sampled<'a>),
    /// A [`super::BufferUse::Texels`] or [`super::BufferUse::AddressedTexels`] buffer.
    Texels(&'a Buffer),
}

/// The bindings of a pipeline, which destroys it.
pub(super) struct DescriptorLayout {
    pub(super) raw: vk::DescriptorSetLayout,
    pub(super) bindings: &'static [ShaderBinding],
}

/// A descriptor set with its own pool. A clone is another handle to the same set.
///
/// It keeps alive what it binds; commands that record it keep it alive.
#[derive(Clone)]
pub struct DescriptorSet {
    pub(super) owner: Arc<DescriptorSetOwner>,
}

pub(super) struct DescriptorSetOwner {
    pub(super) raw: vk::DescriptorSet,
    pub(super) bindings: &'static [ShaderBinding],
    pool: vk::DescriptorPool,
    bound: Held,
    device: Arc<Device>,
}

impl DescriptorLayout {
    /// # Errors
    /// A device that fails.
    pub(super) fn new(
        device: &Device,
        name: &str,
        bindings: &'static [ShaderBinding],
    ) -> Result<Self> {
        let numbered: Vec<_> = (0..)
            .zip(bindings)
            .map(|(number, binding)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(number)
                    .descriptor_type(binding.kind.raw(device))
                    .descriptor_count(1)
                    .stage_flags(
                        vk::ShaderStageFlags::COMPUTE
                            | vk::ShaderStageFlags::VERTEX
                            | vk::ShaderStageFlags::FRAGMENT,
                    )
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&numbered);
        // SAFETY: `info` outlives the call.
        let raw = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .map_err(device.error("creating a descriptor layout"))?;
        device.set_name(raw, name);
        Ok(Self { raw, bindings })
    }

    /// A set with everything bound.
    ///
    /// # Errors
    /// A device that fails.
    pub(super) fn bind<B: ShaderBindings>(
        &self,
        device: &Arc<Device>,
        name: &str,
        bindings: &B,
    ) -> Result<DescriptorSet> {
        assert_eq!(
            self.bindings,
            B::BINDINGS,
            "{name}: the bindings of the pipeline"
        );
        let mut set = self.allocate(device, name)?;
        for (number, bind) in (0..).zip(&bindings.binds()) {
            set.write(number, bind);
        }
        Ok(DescriptorSet {
            owner: Arc::new(set),
        })
    }

    /// A set without content, in a pool that has room for this set alone.
    fn allocate(&self, device: &Arc<Device>, name: &str) -> Result<DescriptorSetOwner> {
        let sizes: Vec<_> = [Binding::Storage, Binding::Sampled, Binding::Texels]
            .into_iter()
            .filter_map(|kind| {
                let count = self.bindings.iter().filter(|b| b.kind == kind).count() as u32;
                (count > 0).then(|| {
                    vk::DescriptorPoolSize::default()
                        .ty(kind.raw(device))
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
        let mut set = DescriptorSetOwner {
            raw: vk::DescriptorSet::null(),
            bindings: self.bindings,
            pool,
            bound: Held::default(),
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
        Ok(set)
    }
}

impl DescriptorSetOwner {
    fn write(&mut self, binding: u32, bind: &Bind<'_>) {
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.raw)
            .dst_binding(binding)
            .descriptor_type(bind.kind().raw(&self.device));
        match bind {
            Bind::Texels(buffer) if !self.device.limits().stored_texels => {
                self.bound.hold(&buffer.owner);
                let views = [buffer.view()];
                self.update(write.texel_buffer_view(&views));
            }
            Bind::Storage(buffer) | Bind::Texels(buffer) => {
                self.bound.hold(&buffer.owner);
                let infos = [vk::DescriptorBufferInfo::default()
                    .buffer(buffer.owner.raw)
                    .range(vk::WHOLE_SIZE)];
                self.update(write.buffer_info(&infos));
            }
            Bind::Sampled(Sampled { image, sampler }) => {
                self.bound.hold(&image.owner);
                self.bound.hold(&sampler.owner);
                let infos = [vk::DescriptorImageInfo::default()
                    .image_view(image.owner.view)
                    .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
                    .sampler(sampler.owner.raw)];
                self.update(write.image_info(&infos));
            }
        }
    }

    fn update(&self, write: vk::WriteDescriptorSet<'_>) {
        // SAFETY: the set is not in use yet, and it holds what the write refers to.
        unsafe { self.device.raw.update_descriptor_sets(&[write], &[]) };
    }
}

impl Bind<'_> {
    fn kind(&self) -> Binding {
        match self {
            Self::Storage(_) => Binding::Storage,
            Self::Sampled(_) => Binding::Sampled,
            Self::Texels(_) => Binding::Texels,
        }
    }
}

impl Binding {
    fn raw(self, device: &Device) -> vk::DescriptorType {
        match self {
            Self::Storage => vk::DescriptorType::STORAGE_BUFFER,
            Self::Texels if device.limits().stored_texels => vk::DescriptorType::STORAGE_BUFFER,
            Self::Sampled => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::Texels => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        }
    }
}

impl Drop for DescriptorSetOwner {
    fn drop(&mut self) {
        // SAFETY: commands that record the set hold its owner, so none is left.
        unsafe { self.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
