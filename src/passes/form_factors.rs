//! The `receiver` estimator: the form factor from every element to every source of a batch. Elements that see a source are
//! listed by how it is found, then found. Shaders: `sort_receivers.comp`, `form_factors.comp`, and where a scene has relief
//! `form_factors_relief.comp`; `_rays.comp` of each where shadow rays are asked what is seen; twin: [`crate::reference::form_factors`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::{Batch, Sight};
use super::buffers::SceneBuffers;
use super::fresh_rows::{FreshRows, ReceiverLists};
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

/// How receivers are sorted.
#[derive(Debug, Clone, Copy)]
pub struct Sorting {
    pub seen_by: SeenBy,
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
/// Texels: sources, planes, balls; contours, triangles, parts.
const SOURCES: usize = 1;
const BALLS: usize = 3;
const CONTOURS: usize = 7;
const PARTS: usize = 9;
const SORT: usize = 9;
const PLAIN: usize = 12;

/// A shader that lists or evaluates receivers.
#[derive(Clone, Copy)]
struct Shader<'a> {
    name: &'a str,
    spirv: &'a [u32],
    /// How many it has, those of what is asked what is seen included.
    bindings: usize,
    seen_by: SeenBy,
}

fn pipeline(
    device: &Arc<Device>,
    shader: Shader<'_>,
    constants: &[u32],
) -> Result<ComputePipeline> {
    let Shader { name, spirv, .. } = shader;
    let mut kinds = vec![Binding::Storage; shader.bindings];
    match shader.seen_by {
        SeenBy::ItemBuffer => kinds[ITEMS] = Binding::Sampled,
        // What the nodes hold comes last.
        SeenBy::ShadowRays => {
            kinds[ITEMS] = Binding::Texels;
            kinds.push(Binding::Texels);
        }
    }
    kinds[SOURCES..=BALLS].fill(Binding::Texels);
    if shader.bindings >= PLAIN {
        kinds[CONTOURS..=PARTS].fill(Binding::Texels);
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
        let shader = |name, spirv, bindings| Shader {
            name,
            spirv,
            bindings,
            seen_by,
        };
        let kinds = |shader| -> Result<Vec<_>> {
            (0..RECEIVE_KINDS)
                .map(|kind| pipeline(device, shader, &[kind]))
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
        let sort_constants = [sorting.culls.into()];
        let sort = shader("sort receivers", sort, SORT);
        let plain = shader("form factors", plain, PLAIN);
        let meso = shader("form factors to relief", meso, PLAIN + 1);
        Ok(Self {
            sort: pipeline(device, sort, &sort_constants)?,
            plain: kinds(plain)?,
            meso: if with_relief {
                kinds(meso)?
            } else {
                Vec::new()
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
        let (seen, last) = match &batch.sight {
            Sight::Hemicubes(h) => (Bind::Image(&h.items, &h.sampler), None),
            Sight::Rays(tree) => (
                Bind::Texels(&tree.nodes),
                Some(Bind::Texels(&tree.occluders)),
            ),
        };
        let bind =
            |pipelines: &[ComputePipeline], lists: &ReceiverLists, fresh, more: Option<&Buffer>| {
                let mut binds = vec![Bind::Buffer(&batch.slots)];
                let receivers = [&scene.sources, &scene.planes, &scene.balls];
                binds.extend(receivers.map(Bind::Texels));
                binds.extend([&lists.counts, &lists.listed].map(Bind::Buffer));
                binds.push(seen);
                let mut sort = binds.clone();
                sort.extend([&rows.facing_away, &scene.receiver_blocks].map(Bind::Buffer));
                sort.extend(last);
                let sort = self.sort.bind("sort receivers", &sort)?;
                let shapes = [&scene.contours, &scene.triangles, &scene.parts];
                binds.extend(shapes.map(Bind::Texels));
                binds.extend([&rows.occupied, fresh].map(Bind::Buffer));
                binds.extend(more.map(Bind::Buffer));
                binds.extend(last);
                let kinds = pipelines.iter().map(|p| p.bind("form factors", &binds));
                Ok::<_, crate::error::Error>((sort, kinds.collect::<Result<Vec<_>>>()?))
            };
        let (sort, kinds) = bind(&self.plain, &rows.plain_lists, &rows.plain, None)?;
        let plain = Range {
            first_element: 0,
            element_count: rows.shape.plain_count,
            first_block: 0,
            sort,
            kinds,
        };
        let meso = meso.map(|elements| {
            let (lists, fresh) = (&rows.meso_lists, &rows.meso);
            let (sort, kinds) = bind(&self.meso, lists, fresh, Some(elements))?;
            Ok::<_, crate::error::Error>(Range {
                first_element: rows.shape.plain_count,
                element_count: rows.shape.meso_count,
                first_block: rows.shape.plain_blocks(),
                sort,
                kinds,
            })
        });
        Ok(Sets {
            plain,
            meso: meso.transpose()?,
        })
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
        let parameters = |range: &Range, slots: std::ops::Range<u32>| Parameters {
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
                for (kind, (pipeline, set)) in pipelines.iter().zip(&range.kinds).enumerate() {
                    let push = parameters(range, slot..slot + 1);
                    let list = u64::from(slot * RECEIVE_KINDS) + kind as u64;
                    let at = size_of::<ReceiverList>() as u64 * list;
                    cmd.dispatch_indirect(pipeline, set, &push, &lists.counts, at);
                }
            }
        }
    }
}
