//! Compute pipelines.

use std::sync::Arc;

use ash::vk;

use super::pipeline::{Module, PipelineOwner};
use super::{Bind, Binding, DescriptorSet, Device};
use crate::error::Result;

/// A compute shader with its bindings, its push constants and the specialisation constants 0, 1, ….
/// A clone is another handle to the same pipeline.
///
/// Commands that record it keep it alive.
#[derive(Clone)]
pub struct ComputePipeline {
    pub(super) owner: Arc<PipelineOwner>,
}

impl ComputePipeline {
    /// `spirv` is a whole compute module with the entry point `main`. With `subgroups`, the
    /// workgroup (its size must be a multiple of the subgroup size) consists of full subgroups of
    /// the device's own size.
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        spirv: &[u32],
        bindings: &[Binding],
        push_bytes: usize,
        constants: &[u32],
        subgroups: bool,
    ) -> Result<Self> {
        let stages = vk::ShaderStageFlags::COMPUTE;
        let mut owner = PipelineOwner::with_layouts(device, name, bindings, push_bytes, stages)?;
        let module = Module::new(device, spirv)?;
        let entries: Vec<_> = (0..constants.len() as u32)
            .map(|id| {
                vk::SpecializationMapEntry::default()
                    .constant_id(id)
                    .offset(id * 4)
                    .size(4)
            })
            .collect();
        let specialisation = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(bytemuck::cast_slice(constants));
        let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(device.limits().subgroup_size);
        let mut stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(stages)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&specialisation);
        if subgroups {
            stage = stage
                .flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS)
                .push_next(&mut size);
        }
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(owner.layout);
        // SAFETY: module, layout and constants outlive the call.
        owner.raw = unsafe {
            device
                .raw
                .create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
        }
        .map_err(|(_, e)| device.error("creating a compute pipeline")(e))?[0];
        device.set_name(owner.raw, name);
        Ok(Self {
            owner: Arc::new(owner),
        })
    }

    /// A pipeline that binds only storage buffers and has no specialisation constants.
    ///
    /// # Errors
    /// A device that fails.
    pub fn storage(
        device: &Arc<Device>,
        name: &str,
        spirv: &[u32],
        buffers: usize,
        push_bytes: usize,
    ) -> Result<Self> {
        let bindings = vec![Binding::Storage; buffers];
        Self::new(device, name, spirv, &bindings, push_bytes, &[], false)
    }

    /// A descriptor set for this pipeline, one bind for each binding.
    ///
    /// # Errors
    /// A device that fails.
    pub fn bind(&self, name: &str, binds: &[Bind<'_>]) -> Result<DescriptorSet> {
        self.owner.descriptors.bind(name, binds)
    }
}
