//! What compute and graphics pipelines share.

use std::sync::Arc;

use ash::vk;

use super::descriptors::{DescriptorLayout, DescriptorSetOwner};
use super::{Device, Interface, ShaderParameters, stored_texels};
use crate::error::Result;

/// A pipeline with its layouts.
pub(super) struct PipelineOwner {
    /// Null until the pipeline itself is created.
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) name: String,
    interface: Interface,
    pub(super) descriptors: DescriptorLayout,
    device: Arc<Device>,
}

impl PipelineOwner {
    /// The layouts of a pipeline with one descriptor set, whose push constants are visible to
    /// `stages`.
    pub(super) fn with_layouts(
        device: &Arc<Device>,
        name: &str,
        interface: Interface,
        stages: vk::ShaderStageFlags,
    ) -> Result<Self> {
        let descriptors = DescriptorLayout::new(device, name, interface.bindings)?;
        let sets = [descriptors.raw];
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(stages)
            .size(interface.parameter_bytes as u32)];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        if interface.parameter_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: `info` outlives the call.
        let layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .map_err(device.error("creating a pipeline layout"))?;
        device.set_name(layout, name);
        Ok(Self {
            raw: vk::Pipeline::null(),
            layout,
            name: name.to_owned(),
            interface,
            descriptors,
            device: Arc::clone(device),
        })
    }

    /// The push constants as bytes, after a check that they are those of the pipeline.
    pub(super) fn push_constants<'a, P: ShaderParameters>(&self, push: &'a P) -> &'a [u8] {
        assert_eq!(
            self.interface.parameters,
            P::FIELDS,
            "the push constants of the pipeline"
        );
        bytemuck::bytes_of(push)
    }

    /// Checks that a set has the bindings of the pipeline.
    pub(super) fn check_set(&self, set: &DescriptorSetOwner) {
        assert_eq!(
            self.interface.bindings, set.bindings,
            "a set with the bindings of the pipeline"
        );
    }
}

impl Drop for PipelineOwner {
    fn drop(&mut self) {
        // SAFETY: commands that record the pipeline hold its owner, so none is left; a null
        // pipeline is allowed.
        unsafe {
            self.device.raw.destroy_pipeline(self.raw, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}

/// A shader module, needed only until its pipeline is created.
pub(super) struct Module<'a> {
    pub(super) raw: vk::ShaderModule,
    device: &'a Device,
}

impl<'a> Module<'a> {
    pub(super) fn new(device: &'a Device, spirv: &[u32]) -> Result<Self> {
        let stored = device.limits().stored_texels.then(|| stored_texels(spirv));
        let code = stored.as_deref().unwrap_or(spirv);
        let info = vk::ShaderModuleCreateInfo::default().code(code);
        // SAFETY: the words are a module that the build checked.
        let raw = unsafe { device.raw.create_shader_module(&info, None) }
            .map_err(device.error("loading a shader"))?;
        Ok(Self { raw, device })
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules after creation.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}

/// Where each of the specialisation constants 0, 1, … stands among their words.
pub(super) fn constant_entries(constants: &[u32]) -> Vec<vk::SpecializationMapEntry> {
    let entry = |id| {
        vk::SpecializationMapEntry::default()
            .constant_id(id)
            .offset(id * 4)
            .size(4)
    };
    (0..constants.len() as u32).map(entry).collect()
}
