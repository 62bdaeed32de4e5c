//! The `receiver` estimator: the form factor from every element to every source of a batch. Shaders: `form_factors.comp`, and
//! where a scene has relief `form_factors_relief.comp`; twin: [`crate::reference::form_factors`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{Batch, SceneBuffers};
use super::factor_buffers::FactorBuffers;
use super::relief_buffers::ReliefBuffers;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Binding, Commands, ComputePipeline, DescriptorSet, Device};

pub struct FormFactors {
    plain: ComputePipeline,
    /// For elements with relief, in scenes that have some.
    meso: Option<ComputePipeline>,
}

/// Sets of [`FormFactors`].
pub struct Sets {
    plain: DescriptorSet,
    meso: Option<DescriptorSet>,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    face_size: u32,
    first_block: u32,
    block_count: u32,
}

/// Place of the item buffer among the bindings.
const ITEMS: usize = 8;

fn pipeline(
    device: &Arc<Device>,
    name: &str,
    spirv: &[u32],
    bindings: usize,
) -> Result<ComputePipeline> {
    let mut kinds = vec![Binding::Storage; bindings];
    kinds[ITEMS] = Binding::Sampled;
    let push = size_of::<Parameters>();
    ComputePipeline::new(device, name, spirv, &kinds, push, &[], true)
}

impl FormFactors {
    pub fn new(device: &Arc<Device>, with_relief: bool) -> Result<Self> {
        let spirv = shaders::FORM_FACTORS_COMP;
        let meso = with_relief.then(|| {
            let spirv = shaders::FORM_FACTORS_RELIEF_COMP;
            pipeline(device, "form factors to relief", spirv, ITEMS + 3)
        });
        Ok(Self {
            plain: pipeline(device, "form factors", spirv, ITEMS + 2)?,
            meso: meso.transpose()?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        batch: &Batch,
        factors: &FactorBuffers,
        relief: Option<&ReliefBuffers>,
    ) -> Result<Sets> {
        let binds = |fresh| {
            let mut binds: Vec<_> = [
                &batch.slots,
                &scene.sources,
                &scene.contours,
                &scene.triangles,
                &scene.planes,
                &scene.balls,
                &factors.occupied,
                fresh,
            ]
            .map(Bind::Buffer)
            .to_vec();
            binds.push(Bind::Image(&batch.items, &batch.sampler));
            binds.push(Bind::Buffer(&scene.members));
            binds
        };
        let meso = self.meso.as_ref().zip(relief).map(|(pipeline, relief)| {
            let mut binds = binds(&factors.fresh_meso);
            binds.push(Bind::Buffer(&relief.elements));
            pipeline.bind("form factors to relief", &binds)
        });
        Ok(Sets {
            plain: self.plain.bind("form factors", &binds(&factors.fresh))?,
            meso: meso.transpose()?,
        })
    }

    /// The two dispatches write to different elements.
    pub fn record(&self, cmd: &Commands, sets: &Sets, batch: &Batch, factors: &FactorBuffers) {
        let dispatch = |pipeline, set, first_element, element_count, first_block| {
            let parameters = Parameters {
                first_element,
                element_count,
                face_size: batch.face_size,
                first_block,
                block_count: factors.blocks(),
            };
            if element_count > 0 {
                let size = [groups(element_count), batch.slot_count, 1];
                cmd.dispatch(pipeline, set, &parameters, size);
            }
        };
        let plain = factors.plain_count;
        dispatch(&self.plain, &sets.plain, 0, plain, 0);
        if let (Some(pipeline), Some(set)) = (&self.meso, &sets.meso) {
            let (count, block) = (factors.meso_count, factors.plain_blocks());
            dispatch(pipeline, set, plain, count, block);
        }
    }
}
