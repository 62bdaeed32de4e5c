//! What compute and graphics pipelines share.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use ash::vk;
use sha2::{Digest, Sha256};

use super::descriptors::{DescriptorLayout, DescriptorSetOwner};
use super::{Device, Interface, ShaderParameters, lock, stored_texels};
use crate::error::Result;

/// The pipelines of a device, by what they are made of: drivers take long to make one.
#[derive(Default)]
pub(super) struct Pipelines(Mutex<HashMap<Recipe, Entry>>);

/// A hash of what a pipeline is made of.
pub(super) type Recipe = [u8; 32];

/// Locked while the pipeline is made: other threads that need it wait.
type Entry = Arc<Mutex<Option<Arc<PipelineOwner>>>>;

/// A pipeline with its layouts. It lives as long as its device, which destroys it.
pub(super) struct PipelineOwner {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) name: String,
    interface: Interface,
    pub(super) descriptors: DescriptorLayout,
}

/// The hash of shaders and all else that a pipeline is made of.
pub(super) fn recipe(shaders: &[&[u32]], rest: std::fmt::Arguments<'_>) -> Recipe {
    let mut hash = Sha256::new();
    for words in shaders {
        hash.update(words.len().to_le_bytes());
        hash.update(bytemuck::cast_slice(words));
    }
    hash.update(rest.to_string());
    hash.finalize().into()
}

impl Pipelines {
    /// The pipeline of a recipe, which is made if there is none yet.
    pub(super) fn find_or_make(
        &self,
        of: Recipe,
        make: impl FnOnce() -> Result<PipelineOwner>,
    ) -> Result<Arc<PipelineOwner>> {
        let entry = Arc::clone(lock(&self.0).entry(of).or_default());
        let mut found = lock(&entry);
        match &*found {
            Some(owner) => Ok(Arc::clone(owner)),
            None => Ok(Arc::clone(found.insert(Arc::new(make()?)))),
        }
    }

    pub(super) fn count(&self) -> usize {
        let made = |entry: &&Entry| lock(entry).is_some();
        lock(&self.0).values().filter(made).count()
    }

    /// # Safety
    /// No pipeline is in use, nor will be.
    pub(super) unsafe fn destroy(&self, device: &ash::Device) {
        for (_, entry) in lock(&self.0).drain() {
            if let Some(owner) = &*lock(&entry) {
                // SAFETY: as the caller says.
                unsafe { owner.destroy(device) };
            }
        }
    }
}

impl PipelineOwner {
    /// A pipeline with one descriptor set, whose push constants are visible to `stages`; `create`
    /// makes it of its layout.
    pub(super) fn new(
        device: &Device,
        name: &str,
        interface: Interface,
        stages: vk::ShaderStageFlags,
        create: impl FnOnce(vk::PipelineLayout) -> Result<vk::Pipeline>,
    ) -> Result<Self> {
        let mut owner = Self {
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            name: name.to_owned(),
            interface,
            descriptors: DescriptorLayout::new(device, name, interface.bindings)?,
        };
        match owner.create(device, stages, create) {
            Ok(()) => Ok(owner),
            Err(e) => {
                // SAFETY: nobody has seen it.
                unsafe { owner.destroy(&device.raw) };
                Err(e)
            }
        }
    }

    fn create(
        &mut self,
        device: &Device,
        stages: vk::ShaderStageFlags,
        create: impl FnOnce(vk::PipelineLayout) -> Result<vk::Pipeline>,
    ) -> Result<()> {
        let sets = [self.descriptors.raw];
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(stages)
            .size(self.interface.parameter_bytes as u32)];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        if self.interface.parameter_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: `info` outlives the call.
        self.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .map_err(device.error("creating a pipeline layout"))?;
        device.set_name(self.layout, &self.name);
        self.raw = create(self.layout)?;
        device.set_name(self.raw, &self.name);
        Ok(())
    }

    /// # Safety
    /// It is not in use, nor will it be.
    unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: as the caller says; what is null was not created.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.descriptors.raw, None);
        }
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
