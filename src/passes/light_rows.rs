//! The form factor from every element to each light without a surface of a batch: suns, parts of
//! the sky, beams. A few rays find the elements that an edge cuts a light for, and more rays what
//! these see of it. Shaders: `light_survey.comp`, `light_rows.comp`, and where a scene has relief
//! `_relief.comp` of each; twin: [`crate::reference::light_rows`].

use std::sync::Arc;

use super::batch::{Batch, Sight};
use super::buffers::SceneBuffers;
use super::fresh_rows::{FreshRows, ReceiverLists, Span};
use super::shaders::{light_rows, light_rows_relief, light_survey, light_survey_relief};
use super::types::ReceiverList;
use super::{Parts, groups, pieces};
use crate::constants::{RECEIVE_CROSSED, RECEIVE_LISTS, SURVEY_ELEMENTS};
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, Commands, ComputePipeline, Device, Stage};

/// Of a pair, over those of one with a source on a surface, about.
const RAYS: u64 = 8;

/// Bound to a batch of lights of one kind.
pub struct LightRows {
    /// Elements without relief, and in scenes that have some those with it.
    ranges: Vec<Range>,
    rows: FreshRows,
    slot_count: u32,
}

struct Range {
    span: Span,
    first_block: u32,
    lists: ReceiverLists,
    fresh: Buffer,
    survey: BoundCompute,
    lit: BoundCompute,
}

/// The bindings of every variant of `shared/light_rows.glsl`, and those of one.
macro_rules! bindings {
    ($shader:ident, $scene:expr, $batch:expr, $tree:expr, $rows:expr, $lists:expr, $fresh:expr,
     $($own:tt)*) => {
        $shader::Bindings {
            slots: &$batch.slots,
            sources: &$scene.sources,
            triangles: &$scene.triangles,
            eyes: &$scene.eyes,
            shadow_nodes: &$tree.nodes,
            shadow_occluders: &$tree.occluders,
            lists: &$lists.counts,
            listed: &$lists.listed,
            occupied: &$rows.occupied,
            fresh: $fresh,
            webs: &$scene.webs,
            $($own)*
        }
    };
}

impl LightRows {
    /// `meso`: the elements with a relief. `beams`: whether the lights are at a finite distance.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
        meso: Option<&Buffer>,
        beams: bool,
    ) -> Result<Self> {
        let Sight::Rays(tree) = &batch.sight else {
            unreachable!("lights are asked for by rays");
        };
        let constants = [u32::from(beams)];
        let pipeline =
            |name, shader| ComputePipeline::in_subgroups(device, name, shader, &constants);
        let (lists, fresh) = (&rows.plain_lists, &rows.plain);
        let survey = bindings!(light_survey, scene, batch, tree, rows, lists, fresh,);
        let lit = bindings!(light_rows, scene, batch, tree, rows, lists, fresh,);
        let mut ranges = vec![Range {
            span: rows.shape.plain,
            first_block: 0,
            lists: lists.clone(),
            fresh: fresh.clone(),
            survey: pipeline("survey lights", &light_survey::SHADER)?.bind(&survey)?,
            lit: pipeline("light rows", &light_rows::SHADER)?.bind(&lit)?,
        }];
        if let Some(meso_elements) = meso {
            let (lists, fresh) = (&rows.meso_lists, &rows.meso);
            let survey = bindings!(
                light_survey_relief,
                scene,
                batch,
                tree,
                rows,
                lists,
                fresh,
                meso_elements
            );
            let lit = bindings!(
                light_rows_relief,
                scene,
                batch,
                tree,
                rows,
                lists,
                fresh,
                meso_elements
            );
            ranges.push(Range {
                span: rows.shape.meso,
                first_block: rows.shape.plain_blocks(),
                lists: lists.clone(),
                fresh: fresh.clone(),
                survey: pipeline("survey lights", &light_survey_relief::SHADER)?.bind(&survey)?,
                lit: pipeline("light rows", &light_rows_relief::SHADER)?.bind(&lit)?,
            });
        }
        ranges.retain(|range| range.span.count > 0);
        Ok(Self {
            ranges,
            rows: rows.clone(),
            slot_count: batch.slot_count,
        })
    }

    /// After a barrier between earlier readers of the rows and transfers.
    pub fn record(&self, cmd: &Commands) {
        let rows = &self.rows;
        for Range { lists, fresh, .. } in &self.ranges {
            cmd.copy(&lists.empty, 0, &lists.counts, 0, lists.empty.bytes());
            cmd.fill(fresh, 0);
        }
        cmd.fill(&rows.occupied, 0);
        cmd.fill(&rows.facing_away, 0);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        // All of these shaders have the same.
        let parameters = |range: &Range, first_slot| light_survey::Parameters {
            first_element: range.span.first,
            element_count: range.span.count,
            first_block: range.first_block,
            block_count: rows.shape.blocks(),
            first_slot,
            own_begin: range.span.own[0],
            own_end: range.span.own[1],
            piece: 0,
            pieces: 1,
        };
        for range in &self.ranges {
            let size = [
                groups(range.span.count.div_ceil(SURVEY_ELEMENTS)),
                self.slot_count,
                1,
            ];
            cmd.dispatch(&range.survey, &parameters(range, 0), size);
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let most = rows.part_pairs / RAYS;
        let mut parts = Parts::of(most);
        for range in &self.ranges {
            // Each takes a piece of what the list holds, and has invocations for all of it.
            let work = u64::from(range.span.count);
            let pieces = pieces(work, most);
            let all = (0..self.slot_count).flat_map(|slot| (0..pieces).map(move |p| (slot, p)));
            for (slot, piece) in all {
                parts.step(cmd, work / u64::from(pieces));
                let list = u64::from(slot * RECEIVE_LISTS + RECEIVE_CROSSED);
                let at = size_of::<ReceiverList>() as u64 * list;
                let mut push = parameters(range, slot);
                (push.piece, push.pieces) = (piece, pieces);
                cmd.dispatch_indirect(&range.lit, &push, &range.lists.counts, at);
            }
        }
    }
}
