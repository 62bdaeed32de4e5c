//! Compute pipelines.

use std::sync::Arc;

use ash::vk;

use super::pipeline::{Module, PipelineOwner, constant_entries, recipe};
use super::{ComputeShader, DescriptorSet, Device, ShaderBindings};
use crate::error::Result;

/// A compute shader with its specialisation constants 0, 1, …. A clone is another handle to the
/// same pipeline, and so is one of the same shader and constants: the device makes it once.
#[derive(Clone)]
pub struct ComputePipeline {
    pub(super) owner: Arc<PipelineOwner>,
    device: Arc<Device>,
}

impl ComputePipeline {
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, name: &str, shader: &ComputeShader<'_>) -> Result<Self> {
        Self::create(device, name, shader, &[], false)
    }

    /// With these specialisation constants.
    ///
    /// # Errors
    /// A device that fails.
    pub fn with_constants(
        device: &Arc<Device>,
        name: &str,
        shader: &ComputeShader<'_>,
        constants: &[u32],
    ) -> Result<Self> {
        Self::create(device, name, shader, constants, false)
    }

    /// A pipeline whose workgroup (its size must be a multiple of the subgroup size) consists of
    /// full subgroups of the device's own size.
    ///
    /// # Errors
    /// A device that fails.
    pub fn in_subgroups(
        device: &Arc<Device>,
        name: &str,
        shader: &ComputeShader<'_>,
        constants: &[u32],
    ) -> Result<Self> {
        Self::create(device, name, shader, constants, true)
    }

    fn create(
        device: &Arc<Device>,
        name: &str,
        shader: &ComputeShader<'_>,
        constants: &[u32],
        subgroups: bool,
    ) -> Result<Self> {
        let of = recipe(
            &[shader.spirv],
            format_args!("{constants:?} {subgroups} {:?}", shader.interface),
        );
        let make = || {
            let stages = vk::ShaderStageFlags::COMPUTE;
            PipelineOwner::new(device, name, shader.interface, stages, |layout| {
                Self::make(device, shader.spirv, constants, subgroups, layout)
            })
        };
        Ok(Self {
            owner: device.pipelines.find_or_make(of, make)?,
            device: Arc::clone(device),
        })
    }

    fn make(
        device: &Device,
        spirv: &[u32],
        constants: &[u32],
        subgroups: bool,
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline> {
        let module = Module::new(device, spirv)?;
        let entries = constant_entries(constants);
        let specialisation = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(bytemuck::cast_slice(constants));
        let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(device.limits().subgroup_size);
        let mut stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&specialisation);
        if subgroups {
            stage = stage
                .flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS)
                .push_next(&mut size);
        }
        let info = vk::ComputePipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::DISPATCH_BASE)
            .stage(stage)
            .layout(layout);
        // SAFETY: module, layout and constants outlive the call.
        let made = unsafe {
            device
                .raw
                .create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
        };
        let made = made.map_err(|(_, e)| device.error("creating a compute pipeline")(e))?;
        Ok(made[0])
    }

    /// The pipeline with a descriptor set of its own.
    ///
    /// # Errors
    /// A device that fails.
    pub fn bind(&self, bindings: &impl ShaderBindings) -> Result<BoundCompute> {
        Ok(BoundCompute {
            set: (self.owner.descriptors).bind(&self.device, &self.owner.name, bindings)?,
            pipeline: self.clone(),
        })
    }
}

/// A compute pipeline and what it is bound to. A clone is another handle to the same.
#[derive(Clone)]
pub struct BoundCompute {
    pub(super) pipeline: ComputePipeline,
    pub(super) set: DescriptorSet,
}
