//! Compute pipelines.

use std::sync::Arc;

use ash::vk;

use super::{Bind, Binding, DescriptorLayout, DescriptorSet, Device};
use crate::error::Result;

/// A compute shader with its bindings, its push constants and the specialisation constants 0, 1, ….
pub struct ComputePipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) push_bytes: u32,
    descriptors: DescriptorLayout,
    device: Arc<Device>,
}

impl ComputePipeline {
    /// `spirv` is a whole compute module with the entry point `main`. With `subgroups`, the workgroup (its size must be
    /// a multiple of the subgroup size) consists of full subgroups of the device's own size.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        spirv: &[u32],
        bindings: &[Binding],
        push_bytes: usize,
        constants: &[u32],
        subgroups: bool,
    ) -> Result<Self> {
        let descriptors = DescriptorLayout::new(device, name, bindings)?;
        let layout = pipeline_layout(
            device,
            name,
            &descriptors,
            push_bytes,
            vk::ShaderStageFlags::COMPUTE,
        )?;
        let mut pipeline = Self {
            raw: vk::Pipeline::null(),
            layout,
            push_bytes: push_bytes as u32,
            descriptors,
            device: Arc::clone(device),
        };
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
            .stage(stage)
            .layout(layout);
        // SAFETY: module, layout and constants outlive the call.
        pipeline.raw = unsafe {
            device
                .raw
                .create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
        }
        .map_err(|(_, e)| device.error("creating a compute pipeline")(e))?[0];
        device.set_name(pipeline.raw, name);
        Ok(pipeline)
    }

    /// Of storage buffers alone, without constants.
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

    pub fn bind(&self, name: &str, binds: &[Bind<'_>]) -> Result<DescriptorSet> {
        self.descriptors.bind(name, binds)
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the pipeline waits for the submission before dropping it.
        unsafe {
            self.device.raw.destroy_pipeline(self.raw, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}

pub(super) fn pipeline_layout(
    device: &Arc<Device>,
    name: &str,
    descriptors: &DescriptorLayout,
    push_bytes: usize,
    stages: vk::ShaderStageFlags,
) -> Result<vk::PipelineLayout> {
    let sets = [descriptors.raw];
    let ranges = [vk::PushConstantRange::default()
        .stage_flags(stages)
        .size(push_bytes as u32)];
    let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
    if push_bytes > 0 {
        info = info.push_constant_ranges(&ranges);
    }
    // SAFETY: `info` outlives the call.
    let layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
        .map_err(device.error("creating a pipeline layout"))?;
    device.set_name(layout, name);
    Ok(layout)
}

/// A shader module, gone once its pipeline is made.
pub(super) struct Module<'a> {
    pub(super) raw: vk::ShaderModule,
    device: &'a Device,
}

impl<'a> Module<'a> {
    pub(super) fn new(device: &'a Arc<Device>, spirv: &[u32]) -> Result<Self> {
        let info = vk::ShaderModuleCreateInfo::default().code(spirv);
        // SAFETY: the words are a module that the build checked.
        let raw = unsafe { device.raw.create_shader_module(&info, None) }
            .map_err(device.error("loading a shader"))?;
        Ok(Self { raw, device })
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once made.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}
