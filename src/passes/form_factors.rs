//! The `receiver` estimator: the form factor from every element to every source of a batch. Elements that see a source are
//! listed by how it is found, then found. Shaders: `sort_receivers.comp`, `form_factors.comp`, and where a scene has relief
//! `form_factors_relief.comp`; `_rays.comp` of each where shadow rays are asked what is seen; twin: [`crate::reference::form_factors`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::{Batch, Sight};
use super::buffers::{SceneBuffers, write};
use super::factor_buffers::{FactorBuffers, ReceiverLists};
use super::types::ReceiverList;
use super::{groups, shaders};
use crate::constants::{RECEIVE_KINDS, SORT_ELEMENTS, SORT_SLOTS};
use crate::error::Result;
use crate::vk::{Bind, Binding, Buffer, Commands, ComputePipeline, DescriptorSet, Device, Stage};

pub struct FormFactors {
    sort: ComputePipeline,
    /// One a kind.
    plain: Vec<ComputePipeline>,
    /// For elements with relief, in scenes that have some.
    meso: Vec<ComputePipeline>,
}

/// What is asked whether an element sees a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeenBy {
    ItemBuffer,
    ShadowRays,
}

/// How elements are counted that see nothing of a source, whatever stands between: it lies behind them or shows them its back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FacingAway {
    /// At one of a few neighbouring elements, over all batches.
    ByElement,
    /// By slot, of one batch.
    BySlot,
}

/// How receivers are sorted.
#[derive(Debug, Clone, Copy)]
pub struct Sorting {
    pub seen_by: SeenBy,
    pub facing_away: FacingAway,
    /// Whether blocks of elements that see nothing of a source are passed over as a whole. The lists are the same.
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
    kinds: Vec<DescriptorSet>,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    face_size: u32,
    first_slot: u32,
    end_slot: u32,
    first_block: u32,
    block_count: u32,
}

/// Place of the item buffer, or of the tree's nodes, among the bindings, and how many there are for sorting and in all.
const ITEMS: usize = 6;
const SORT: usize = 9;
const PLAIN: usize = 12;

fn pipeline(
    device: &Arc<Device>,
    (name, spirv): (&str, &[u32]),
    bindings: usize,
    (seen_by, constants): (SeenBy, &[u32]),
) -> Result<ComputePipeline> {
    let mut kinds = vec![Binding::Storage; bindings];
    match seen_by {
        SeenBy::ItemBuffer => kinds[ITEMS] = Binding::Sampled,
        // What the nodes hold comes last.
        SeenBy::ShadowRays => kinds.push(Binding::Storage),
    }
    ComputePipeline::new(
        device,
        name,
        spirv,
        &kinds,
        size_of::<Parameters>(),
        constants,
        true,
    )
}

impl FormFactors {
    pub fn new(device: &Arc<Device>, with_relief: bool, sorting: Sorting) -> Result<Self> {
        let seen_by = sorting.seen_by;
        let kinds = |shader, bindings| -> Result<Vec<_>> {
            (0..RECEIVE_KINDS)
                .map(|kind| pipeline(device, shader, bindings, (seen_by, &[kind])))
                .collect()
        };
        let [sort, plain, meso] = match seen_by {
            SeenBy::ItemBuffer => [
                shaders::SORT_RECEIVERS_COMP,
                shaders::FORM_FACTORS_COMP,
                shaders::FORM_FACTORS_RELIEF_COMP,
            ],
            SeenBy::ShadowRays => [
                shaders::SORT_RECEIVERS_RAYS_COMP,
                shaders::FORM_FACTORS_RAYS_COMP,
                shaders::FORM_FACTORS_RELIEF_RAYS_COMP,
            ],
        };
        let by_slot = sorting.facing_away == FacingAway::BySlot;
        let sort_constants = [by_slot.into(), sorting.culls.into()];
        let sort = ("sort receivers", sort);
        let plain = ("form factors", plain);
        let meso = ("form factors to relief", meso);
        Ok(Self {
            sort: pipeline(device, sort, SORT, (seen_by, &sort_constants))?,
            plain: kinds(plain, PLAIN)?,
            meso: if with_relief {
                kinds(meso, PLAIN + 1)?
            } else {
                Vec::new()
            },
        })
    }

    /// Workgroups that sort the elements without and with relief.
    pub fn sort_groups(&self, factors: &FactorBuffers) -> [u32; 2] {
        [factors.plain_count, factors.meso_count].map(|count| groups(count.div_ceil(SORT_ELEMENTS)))
    }

    /// `facing_away` counts as [`FacingAway`] says; `meso` are the elements with a relief.
    pub fn bind(
        &self,
        device: &Arc<Device>,
        (scene, facing_away): (&SceneBuffers, &Buffer),
        batch: &Batch,
        factors: &FactorBuffers,
        meso: Option<&Buffer>,
    ) -> Result<Sets> {
        let (seen, last) = match &batch.sight {
            Sight::Hemicubes(h) => (Bind::Image(&h.items, &h.sampler), None),
            Sight::Rays(tree) => (
                Bind::Buffer(&tree.nodes),
                Some(Bind::Buffer(&tree.occluders)),
            ),
        };
        let bind =
            |pipelines: &[ComputePipeline], lists: &ReceiverLists, fresh, more: Option<&Buffer>| {
                let mut binds: Vec<_> = [
                    &batch.slots,
                    &scene.sources,
                    &scene.planes,
                    &scene.balls,
                    &lists.counts,
                    &lists.listed,
                ]
                .map(Bind::Buffer)
                .to_vec();
                binds.push(seen);
                let mut sort = binds.clone();
                sort.extend([facing_away, &scene.receiver_blocks].map(Bind::Buffer));
                sort.extend(last);
                let sort = self.sort.bind("sort receivers", &sort)?;
                let rest = [
                    &scene.contours,
                    &scene.triangles,
                    &scene.parts,
                    &factors.occupied,
                    fresh,
                ];
                binds.extend(rest.map(Bind::Buffer));
                binds.extend(more.map(Bind::Buffer));
                binds.extend(last);
                let kinds = pipelines.iter().map(|p| p.bind("form factors", &binds));
                Ok::<_, crate::error::Error>((sort, kinds.collect::<Result<Vec<_>>>()?))
            };
        let commands = self.sort_groups(factors).map(ReceiverList::idle);
        write(device, &batch.drawn_commands, &commands)?;
        let (sort, kinds) = bind(&self.plain, &factors.plain_lists, &factors.fresh, None)?;
        let plain = Range {
            first_element: 0,
            element_count: factors.plain_count,
            first_block: 0,
            sort,
            kinds,
        };
        let meso = meso.map(|elements| {
            let (lists, fresh) = (&factors.meso_lists, &factors.fresh_meso);
            let (sort, kinds) = bind(&self.meso, lists, fresh, Some(elements))?;
            Ok::<_, crate::error::Error>(Range {
                first_element: factors.plain_count,
                element_count: factors.meso_count,
                first_block: factors.plain_blocks(),
                sort,
                kinds,
            })
        });
        Ok(Sets {
            plain,
            meso: meso.transpose()?,
        })
    }

    pub fn record(&self, cmd: &Commands, sets: &Sets, batch: &Batch, factors: &FactorBuffers) {
        let meso = sets.meso.as_ref();
        let of_meso = meso.map(|m| (m, &self.meso, &factors.meso_lists, &factors.fresh_meso));
        let of_plain = (
            &sets.plain,
            &self.plain,
            &factors.plain_lists,
            &factors.fresh,
        );
        let ranges = || std::iter::once(of_plain).chain(of_meso);
        for (.., lists, fresh) in ranges() {
            cmd.copy(&lists.empty, 0, &lists.counts, 0, lists.empty.bytes());
            cmd.fill(fresh, 0);
        }
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        // Rays of one slot at a time.
        let (face_size, at_once) = match &batch.sight {
            Sight::Hemicubes(hemicubes) => (hemicubes.face_size, SORT_SLOTS),
            Sight::Rays(_) => (0, 1),
        };
        let parameters = |range: &Range, slots: std::ops::Range<u32>| Parameters {
            first_element: range.first_element,
            element_count: range.element_count,
            face_size,
            first_slot: slots.start,
            end_slot: slots.end,
            first_block: range.first_block,
            block_count: factors.blocks(),
        };
        for first in (0..batch.slot_count).step_by(at_once as usize) {
            for (i, (range, ..)) in ranges().enumerate() {
                // A batch of replays alone sorts nothing.
                let at = (size_of::<ReceiverList>() * i) as u64;
                let slots = first..(first + at_once).min(batch.slot_count);
                let push = parameters(range, slots);
                cmd.dispatch_indirect(&self.sort, &range.sort, &push, (&batch.drawn_commands, at));
            }
            // What faces away is counted by the next ones too.
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
        // Every element is in one list of a slot at most.
        for (range, pipelines, lists, _) in ranges() {
            for slot in 0..batch.slot_count {
                for (kind, (pipeline, set)) in pipelines.iter().zip(&range.kinds).enumerate() {
                    let push = parameters(range, slot..slot + 1);
                    let list = u64::from(slot * RECEIVE_KINDS) + kind as u64;
                    let at = size_of::<ReceiverList>() as u64 * list;
                    cmd.dispatch_indirect(pipeline, set, &push, (&lists.counts, at));
                }
            }
        }
    }
}
