//! The `pixel` estimator in a scene with relief: what a source sends by direction arrives pixel by
//! pixel, the paper's equations (2) to (4). Shaders: `pixels_from_relief.comp`,
//! `pixels_to_relief.comp`; twin: [`crate::reference::pixels_relief`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, State, upload};
use super::groups;
use super::relief_buffers::ReliefBuffers;
use super::shaders::{pixels_from_relief, pixels_to_relief};
use crate::error::Result;
use crate::math::hemicube::pixel_form_factors;
use crate::vk::{BoundCompute, BufferUse, Commands, ComputePipeline, Device, Stage};

/// First the elements without relief, then those with one.
pub struct PixelsRelief {
    from: BoundCompute,
    to: BoundCompute,
}

/// Pixels that one invocation may look at: half of the turns after which lavapipe ends a shader's
/// loops without a word.
const MOST_PIXELS: u32 = 1 << 15;

impl PixelsRelief {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
        relief: &ReliefBuffers,
    ) -> Result<Self> {
        let hemicubes = batch.hemicubes();
        let table = pixel_form_factors(hemicubes.face_size);
        let deltas = upload(device, "pixel form factors", &table, BufferUse::Storage)?;
        let from = pixels_from_relief::Bindings {
            slots: &batch.slots,
            sources: &scene.sources,
            corners: &scene.corners,
            vertices: &scene.vertices,
            planes: &scene.planes,
            element_area: &scene.areas,
            deltas: &deltas,
            direct: &state.direct,
            direct_error: &state.direct_error,
            indirect: &state.indirect,
            indirect_error: &state.indirect_error,
            exits: &relief.exits,
            items: hemicubes.sampled_items(),
        };
        let to = pixels_to_relief::Bindings {
            slots: from.slots,
            sources: from.sources,
            corners: from.corners,
            vertices: from.vertices,
            planes: from.planes,
            element_area: from.element_area,
            deltas: from.deltas,
            direct: from.direct,
            direct_error: from.direct_error,
            indirect: from.indirect,
            indirect_error: from.indirect_error,
            exits: from.exits,
            items: from.items,
            meso_elements: &relief.elements,
            albedos: &relief.albedos,
            moments_direct: &relief.moments_direct,
            moments_indirect: &relief.moments_indirect,
            meso_reflected: &relief.reflected,
            direction_list: &relief.directions_list,
            meso_texels: &relief.texels,
            texture_facets: &relief.facets,
            outgoing: &relief.outgoing,
            bases: &relief.bases,
            coefficients: &relief.coefficients,
        };
        let shaders = (&pixels_from_relief::SHADER, &pixels_to_relief::SHADER);
        Ok(Self {
            from: ComputePipeline::new(device, "pixels from relief", shaders.0)?.bind(&from)?,
            to: ComputePipeline::new(device, "pixels to relief", shaders.1)?.bind(&to)?,
        })
    }

    /// Slot after slot, some rows at a time; elements without relief and those with one are
    /// different elements.
    pub fn record(&self, cmd: &Commands, relief: &ReliefBuffers, batch: &Batch) {
        let hemicubes = batch.hemicubes();
        let rows = 3 * hemicubes.face_size;
        // Turns for a pixel: itself, and each direction that its light leaves in.
        let turns = match relief.by_pixel {
            true => 1 + relief.directions.count() as u32,
            false => 1,
        };
        let band = (MOST_PIXELS / (turns * hemicubes.face_size)).max(1);
        for slot in 0..batch.slot_count {
            for first_row in (0..rows).step_by(band as usize) {
                for (bound, first_element, element_count) in [
                    (&self.from, 0, relief.first_element),
                    (&self.to, relief.first_element, relief.element_count),
                ] {
                    // Both shaders have the same.
                    let parameters = pixels_from_relief::Parameters {
                        first_element,
                        element_count,
                        slot,
                        face_size: hemicubes.face_size,
                        first_relief_source: relief.first_source,
                        relief_source_count: relief.source_count,
                        cells: relief.cells(),
                        kept_cells: relief.kept_cells(),
                        by_pixel: u32::from(relief.by_pixel),
                        first_row,
                        end_row: (first_row + band).min(rows),
                    };
                    if element_count > 0 {
                        cmd.dispatch(bound, &parameters, [groups(element_count), 1, 1]);
                    }
                }
                // The next rows add to the same sums.
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            }
        }
    }
}
