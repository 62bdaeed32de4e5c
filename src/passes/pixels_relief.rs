//! The `pixel` estimator in a scene with relief: what a source sends by direction arrives pixel by pixel, the paper's equations
//! (2) to (4). Shaders: `pixels_from_relief.comp`, `pixels_to_relief.comp`; twin: [`crate::reference::pixels_relief`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::Batch;
use super::buffers::{SceneBuffers, State, upload};
use super::relief_buffers::ReliefBuffers;
use super::{groups, shaders};
use crate::error::Result;
use crate::math::hemicube::pixel_form_factors;
use crate::vk::{
    Bind, Binding, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage,
};

/// First the elements without relief, then those with one.
pub struct PixelsRelief {
    from: ComputePipeline,
    to: ComputePipeline,
}

/// Sets of [`PixelsRelief`].
pub struct Bound {
    from: DescriptorSet,
    to: DescriptorSet,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    slot: u32,
    face_size: u32,
    first_source: u32,
    source_count: u32,
    cells: [u32; 2],
    by_pixel: u32,
    first_row: u32,
    end_row: u32,
}

/// Pixels that one invocation may look at: half of the turns after which lavapipe ends a shader's loops without a word.
const MOST_PIXELS: u32 = 1 << 15;

/// Place of the item buffer among the bindings; buffers of the relief follow it.
const ITEMS: usize = 12;

impl PixelsRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let make = |name, spirv, bindings| {
            let mut kinds = vec![Binding::Storage; bindings];
            kinds[ITEMS] = Binding::Sampled;
            let push = size_of::<Parameters>();
            ComputePipeline::new(device, name, spirv, &kinds, push, &[], false)
        };
        let (from, to) = (
            shaders::PIXELS_FROM_RELIEF_COMP,
            shaders::PIXELS_TO_RELIEF_COMP,
        );
        Ok(Self {
            from: make("pixels from relief", from, ITEMS + 1)?,
            to: make("pixels to relief", to, ITEMS + 10)?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
        relief: &ReliefBuffers,
    ) -> Result<Bound> {
        let hemicubes = batch.hemicubes();
        let table = pixel_form_factors(hemicubes.face_size);
        let deltas = upload(device, "pixel form factors", &table, BufferUse::Storage)?;
        let mut binds: Vec<Bind<'_>> = [
            &batch.slots,
            &scene.sources,
            &scene.corners,
            &scene.vertices,
            &scene.planes,
            &scene.areas,
            &deltas,
            &state.direct,
            &state.direct_error,
            &state.indirect,
            &state.indirect_error,
            &relief.exits,
        ]
        .map(Bind::Buffer)
        .to_vec();
        binds.push(Bind::Image(&hemicubes.items, &hemicubes.sampler));
        let from = self.from.bind("pixels from relief", &binds)?;
        binds.extend(
            [
                &relief.elements,
                &relief.albedos,
                &relief.moments_direct,
                &relief.moments_indirect,
                &relief.reflected,
                &relief.shares,
                &relief.texels,
                &relief.facets,
                &relief.outgoing,
            ]
            .map(Bind::Buffer),
        );
        let to = self.to.bind("pixels to relief", &binds)?;
        Ok(Bound { from, to })
    }

    /// Slot after slot, some rows at a time; elements without relief and those with one are different elements.
    pub fn record(&self, cmd: &Commands, bound: &Bound, relief: &ReliefBuffers, batch: &Batch) {
        let hemicubes = batch.hemicubes();
        let rows = 3 * hemicubes.face_size;
        let band = (MOST_PIXELS / hemicubes.face_size).max(1);
        for slot in 0..batch.slot_count {
            for first_row in (0..rows).step_by(band as usize) {
                for (pipeline, set, first_element, element_count) in [
                    (&self.from, &bound.from, 0, relief.first_element),
                    (
                        &self.to,
                        &bound.to,
                        relief.first_element,
                        relief.element_count,
                    ),
                ] {
                    let parameters = Parameters {
                        first_element,
                        element_count,
                        slot,
                        face_size: hemicubes.face_size,
                        first_source: relief.first_source,
                        source_count: relief.source_count,
                        cells: relief.cells(),
                        by_pixel: u32::from(relief.by_pixel),
                        first_row,
                        end_row: (first_row + band).min(rows),
                    };
                    if element_count > 0 {
                        cmd.dispatch(pipeline, set, &parameters, [groups(element_count), 1, 1]);
                    }
                }
                // The next rows add to the same sums.
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            }
        }
    }
}
