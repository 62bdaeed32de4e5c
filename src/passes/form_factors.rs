//! The `receiver` estimator: the form factor from every element to every source of a batch.
//! Elements that see a source are listed by how their form factor is computed, then it is. Shaders:
//! `sort_receivers.comp`, `form_factors.comp`, and where a scene has relief
//! `form_factors_relief.comp`; `_rays.comp` of each where shadow rays decide what is seen; twin:
//! [`crate::reference::form_factors`].

use std::sync::Arc;

use super::batch::{Batch, Sight};
use super::buffers::SceneBuffers;
use super::fresh_rows::{FreshRows, ReceiverLists};
use super::groups;
use super::shaders::{
    form_factors, form_factors_rays, form_factors_relief, form_factors_relief_rays, sort_receivers,
    sort_receivers_rays,
};
use super::types::ReceiverList;
use crate::constants::{RECEIVE_KINDS, SORT_ELEMENTS, SORT_SLOTS};
use crate::error::Result;
use crate::vk::{Buffer, Commands, ComputePipeline, ComputeShader, DescriptorSet, Device, Stage};

pub struct FormFactors {
    sort: ComputePipeline,
    /// One a kind.
    plain: Vec<ComputePipeline>,
    /// For elements with relief, in scenes that have some.
    meso: Vec<ComputePipeline>,
}

/// What decides whether an element sees a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeenBy {
    ItemBuffer,
    ShadowRays,
}

/// How receivers are sorted.
#[derive(Debug, Clone, Copy)]
pub struct Sorting {
    pub seen_by: SeenBy,
    /// Whether blocks of elements that see nothing of a source are passed over as a whole. The
    /// lists are the same.
    pub culls: bool,
}

/// Sets of [`FormFactors`].
pub struct Sets {
    plain: Range,
    meso: Option<Range>,
}

/// The elements of a dispatch.
struct Range {
    first_element: u32,
    element_count: u32,
    first_block: u32,
    sort: DescriptorSet,
    /// For the pipelines of all kinds.
    form_factors: DescriptorSet,
}

/// What the sets of a range bind, beside what decides what is seen.
struct Bound<'a> {
    scene: &'a SceneBuffers,
    batch: &'a Batch,
    rows: &'a FreshRows,
    lists: &'a ReceiverLists,
    fresh: &'a Buffer,
    /// The elements with a relief, of a range of those.
    meso: Option<&'a Buffer>,
}

/// The bindings of `shared/receivers.glsl`, and those that a shader has beside them.
macro_rules! receivers {
    ($shader:ident, $on:expr, $($own:tt)*) => {
        $shader::Bindings {
            slots: &$on.batch.slots,
            sources: &$on.scene.sources,
            planes: &$on.scene.planes,
            balls: &$on.scene.balls,
            lists: &$on.lists.counts,
            listed: &$on.lists.listed,
            $($own)*
        }
    };
}

/// The bindings of every variant of `shared/form_factors.glsl`, and those of one.
macro_rules! found {
    ($shader:ident, $on:expr, $($own:tt)*) => {
        receivers!(
            $shader,
            $on,
            contours: &$on.scene.contours,
            triangles: &$on.scene.triangles,
            parts: &$on.scene.parts,
            occupied: &$on.rows.occupied,
            fresh: $on.fresh,
            $($own)*
        )
    };
}

impl FormFactors {
    pub fn new(device: &Arc<Device>, with_relief: bool, sorting: Sorting) -> Result<Self> {
        let [sort, plain, meso] = match sorting.seen_by {
            SeenBy::ItemBuffer => [
                &sort_receivers::SHADER,
                &form_factors::SHADER,
                &form_factors_relief::SHADER,
            ],
            SeenBy::ShadowRays => [
                &sort_receivers_rays::SHADER,
                &form_factors_rays::SHADER,
                &form_factors_relief_rays::SHADER,
            ],
        };
        let kinds = |name, shader: &ComputeShader<'_>| {
            (0..RECEIVE_KINDS)
                .map(|kind| ComputePipeline::in_subgroups(device, name, shader, &[kind]))
                .collect::<Result<Vec<_>>>()
        };
        let culls = [sorting.culls.into()];
        Ok(Self {
            sort: ComputePipeline::in_subgroups(device, "sort receivers", sort, &culls)?,
            plain: kinds("form factors", plain)?,
            meso: match with_relief {
                true => kinds("form factors to relief", meso)?,
                false => Vec::new(),
            },
        })
    }

    /// `meso`: the elements with a relief.
    pub fn bind(
        &self,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
        meso: Option<&Buffer>,
    ) -> Result<Sets> {
        let plain = Bound {
            scene,
            batch,
            rows,
            lists: &rows.plain_lists,
            fresh: &rows.plain,
            meso: None,
        };
        let plain = Range {
            first_element: 0,
            element_count: rows.shape.plain_count,
            first_block: 0,
            sort: self.bind_sort(&plain)?,
            form_factors: bind_form_factors(&self.plain, &plain)?,
        };
        if meso.is_none() {
            return Ok(Sets { plain, meso: None });
        }
        let meso = Bound {
            scene,
            batch,
            rows,
            lists: &rows.meso_lists,
            fresh: &rows.meso,
            meso,
        };
        let meso = Range {
            first_element: rows.shape.plain_count,
            element_count: rows.shape.meso_count,
            first_block: rows.shape.plain_blocks(),
            sort: self.bind_sort(&meso)?,
            form_factors: bind_form_factors(&self.meso, &meso)?,
        };
        Ok(Sets {
            plain,
            meso: Some(meso),
        })
    }

    fn bind_sort(&self, on: &Bound<'_>) -> Result<DescriptorSet> {
        let (away_count, blocks) = (&on.rows.facing_away, &on.scene.receiver_blocks);
        match &on.batch.sight {
            Sight::Hemicubes(hemicubes) => {
                let items = hemicubes.sampled_items();
                let bindings = receivers!(sort_receivers, on, items, away_count, blocks);
                self.sort.bind("sort receivers", &bindings)
            }
            Sight::Rays(tree) => {
                let (shadow_nodes, shadow_occluders) = (&tree.nodes, &tree.occluders);
                let bindings = receivers!(
                    sort_receivers_rays,
                    on,
                    shadow_nodes,
                    away_count,
                    blocks,
                    shadow_occluders
                );
                self.sort.bind("sort receivers", &bindings)
            }
        }
    }

    /// After a barrier between earlier readers of the rows and transfers.
    pub fn record(&self, cmd: &Commands, sets: &Sets, batch: &Batch, rows: &FreshRows) {
        let meso = sets.meso.as_ref();
        let of_meso = meso.map(|m| (m, &self.meso, &rows.meso_lists, &rows.meso));
        let of_plain = (&sets.plain, &self.plain, &rows.plain_lists, &rows.plain);
        let ranges = || std::iter::once(of_plain).chain(of_meso);
        for (.., lists, fresh) in ranges() {
            cmd.copy(&lists.empty, 0, &lists.counts, 0, lists.empty.bytes());
            cmd.fill(fresh, 0);
        }
        cmd.fill(&rows.occupied, 0);
        cmd.fill(&rows.facing_away, 0);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        // Rays of one slot at a time.
        let (face_size, at_once) = match &batch.sight {
            Sight::Hemicubes(hemicubes) => (hemicubes.face_size, SORT_SLOTS),
            Sight::Rays(_) => (0, 1),
        };
        // All of these shaders have the same.
        let parameters = |range: &Range, slots: std::ops::Range<u32>| sort_receivers::Parameters {
            first_element: range.first_element,
            element_count: range.element_count,
            face_size,
            first_slot: slots.start,
            end_slot: slots.end,
            first_block: range.first_block,
            block_count: rows.shape.blocks(),
        };
        for first in (0..batch.slot_count).step_by(at_once as usize) {
            for (range, ..) in ranges() {
                let slots = first..(first + at_once).min(batch.slot_count);
                let size = [groups(range.element_count.div_ceil(SORT_ELEMENTS)), 1, 1];
                if range.element_count > 0 {
                    cmd.dispatch(&self.sort, &range.sort, &parameters(range, slots), size);
                }
            }
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        // Every element is in one list of a slot at most.
        for (range, pipelines, lists, _) in ranges() {
            for slot in 0..batch.slot_count {
                for (kind, pipeline) in pipelines.iter().enumerate() {
                    let set = &range.form_factors;
                    let push = parameters(range, slot..slot + 1);
                    let list = u64::from(slot * RECEIVE_KINDS) + kind as u64;
                    let at = size_of::<ReceiverList>() as u64 * list;
                    cmd.dispatch_indirect(pipeline, set, &push, &lists.counts, at);
                }
            }
        }
    }
}

/// A set for the pipelines of all kinds.
fn bind_form_factors(pipelines: &[ComputePipeline], on: &Bound<'_>) -> Result<DescriptorSet> {
    let pipeline = pipelines.first().expect("a pipeline for each kind");
    let name = "form factors";
    match (&on.batch.sight, on.meso) {
        (Sight::Hemicubes(hemicubes), None) => {
            let items = hemicubes.sampled_items();
            pipeline.bind(name, &found!(form_factors, on, items))
        }
        (Sight::Hemicubes(hemicubes), Some(meso_elements)) => {
            let items = hemicubes.sampled_items();
            let bindings = found!(form_factors_relief, on, items, meso_elements);
            pipeline.bind(name, &bindings)
        }
        (Sight::Rays(tree), None) => {
            let (shadow_nodes, shadow_occluders) = (&tree.nodes, &tree.occluders);
            let bindings = found!(form_factors_rays, on, shadow_nodes, shadow_occluders);
            pipeline.bind(name, &bindings)
        }
        (Sight::Rays(tree), Some(meso_elements)) => {
            let (shadow_nodes, shadow_occluders) = (&tree.nodes, &tree.occluders);
            let bindings = found!(
                form_factors_relief_rays,
                on,
                shadow_nodes,
                meso_elements,
                shadow_occluders
            );
            pipeline.bind(name, &bindings)
        }
    }
}
