//! The `receiver` estimator: the form factor from every element to every source of a batch.
//! Elements that see a source are listed by how their form factor is computed, then it is. Shaders:
//! `sort_receivers.comp`, `form_factors.comp`, and where a scene has relief
//! `form_factors_relief.comp`; `_rays.comp` of each where shadow rays decide what is seen; twin:
//! [`crate::reference::form_factors`].

use std::sync::Arc;

use super::batch::{Batch, Hemicubes, Sight};
use super::buffers::SceneBuffers;
use super::fresh_rows::{FreshRows, ReceiverLists, Span};
use super::near_marks::NearMarks;
use super::occluder_tree::OccluderTree;
use super::shaders::{
    form_factors, form_factors_rays, form_factors_relief, form_factors_relief_rays,
    resolve_receivers, sort_receivers, sort_receivers_rays,
};
use super::types::ReceiverList;
use super::{Parts, groups, pieces};
use crate::constants::{
    RECEIVE_CROSSED, RECEIVE_DOUBTFUL, RECEIVE_KINDS, RECEIVE_LISTS, SORT_ELEMENTS, SORT_SLOTS,
};
use crate::error::Result;
use crate::vk::{
    BoundCompute, Buffer, Commands, ComputePipeline, ComputeShader, Device, ShaderBindings, Stage,
};

/// What is looked at more closely, or not at all.
#[derive(Debug, Clone, Copy)]
pub struct Care {
    /// Blocks of elements that see nothing of a source are passed over as a whole, which leaves the
    /// lists the same.
    pub culls: bool,
    /// Where a silhouette may cut a source, rays find the share of it that an element sees.
    pub silhouettes: bool,
    /// Places on a source from which rays find that share; divides
    /// [`crate::constants::SOURCE_EYES`]. 0: where the pixels of a hemicube about an element do not
    /// agree, it sees the share of the source that they show, and no rays are followed.
    pub places: u32,
}

/// Pairs that are sorted by item buffers in the time in which rays sort one.
const SORT_RATE: u64 = 4;

/// Elements of a piece of a list whose form factors are found, over those that rays look at.
const FORM_FACTOR_RATE: u64 = 8;

/// Bound to a batch.
pub struct FormFactors {
    /// Elements without relief, and in scenes that have some those with it.
    ranges: Vec<Range>,
    rows: FreshRows,
    slot_count: u32,
    /// Pixels a side of the batch's hemicubes; 0 where it has none.
    face_size: u32,
    /// Slots that a dispatch sorts for.
    at_once: u32,
}

/// The elements of a dispatch.
struct Range {
    span: Span,
    first_block: u32,
    lists: ReceiverLists,
    fresh: Buffer,
    near: NearMarks,
    sort: BoundCompute,
    /// What rays decide about, with its list.
    resolve: Vec<(u32, BoundCompute)>,
    /// One a kind.
    form_factors: Vec<BoundCompute>,
}

/// What a range binds, beside what decides what is seen.
#[derive(Clone, Copy)]
struct On<'a> {
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
    /// `meso`: the elements with a relief.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
        meso: Option<&Buffer>,
        care: Care,
    ) -> Result<Self> {
        let plain = On {
            scene,
            batch,
            rows,
            lists: &rows.plain_lists,
            fresh: &rows.plain,
            meso: None,
        };
        let mut ranges = vec![Range::new(device, &plain, care)?];
        if meso.is_some() {
            let with_relief = On {
                lists: &rows.meso_lists,
                fresh: &rows.meso,
                meso,
                ..plain
            };
            ranges.push(Range::new(device, &with_relief, care)?);
        }
        // Rays of one slot at a time.
        let (face_size, at_once) = match &batch.sight {
            Sight::Hemicubes(hemicubes) => {
                let elements = rows.shape.plain.count + rows.shape.meso.count;
                let most = (SORT_RATE * rows.part_pairs / u64::from(elements.max(1))) as u32;
                let most = most.clamp(1, SORT_SLOTS);
                (hemicubes.face_size, most)
            }
            Sight::Rays(_) => (0, 1),
        };
        Ok(Self {
            ranges,
            rows: rows.clone(),
            slot_count: batch.slot_count,
            face_size,
            at_once,
        })
    }

    /// After a barrier between earlier readers of the rows and transfers. Calls `stamp` when the
    /// elements are sorted, and when rays have decided.
    pub fn record(&self, cmd: &Commands, mut stamp: impl FnMut()) {
        let rows = &self.rows;
        for Range {
            lists, fresh, near, ..
        } in &self.ranges
        {
            cmd.copy(&lists.empty, 0, &lists.counts, 0, lists.empty.bytes());
            cmd.fill(fresh, 0);
            near.clear(cmd);
        }
        cmd.fill(&rows.occupied, 0);
        cmd.fill(&rows.facing_away, 0);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        self.ranges.iter().for_each(|range| range.near.record(cmd));
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        // All of these shaders have the same.
        let parameters = |range: &Range, slots: std::ops::Range<u32>| sort_receivers::Parameters {
            first_element: range.span.first,
            element_count: range.span.count,
            face_size: self.face_size,
            first_slot: slots.start,
            end_slot: slots.end,
            first_block: range.first_block,
            block_count: rows.shape.blocks(),
            own_begin: range.span.own[0],
            own_end: range.span.own[1],
            piece: 0,
            pieces: 1,
        };
        let mut parts = Parts::of(rows.part_pairs);
        for first in (0..self.slot_count).step_by(self.at_once as usize) {
            for range in &self.ranges {
                let slots = first..(first + self.at_once).min(self.slot_count);
                let pairs = u64::from(range.span.count) * slots.len() as u64;
                let rate = if self.face_size > 0 { SORT_RATE } else { 1 };
                let push = parameters(range, slots);
                let all = groups(range.span.count.div_ceil(SORT_ELEMENTS));
                let pieces = pieces(pairs / rate, rows.part_pairs);
                let piece = all.div_ceil(pieces).max(1);
                for first in (0..all).step_by(piece as usize) {
                    parts.step(cmd, pairs / rate / u64::from(pieces));
                    let size = [piece.min(all - first), 1, 1];
                    cmd.dispatch_from(&range.sort, &push, [first, 0, 0], size);
                }
            }
        }
        stamp();
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let list_at = |slot: u32, list: u32| {
            size_of::<ReceiverList>() as u64 * u64::from(slot * RECEIVE_LISTS + list)
        };
        for range in &self.ranges {
            for &(list, ref resolve) in &range.resolve {
                // Each takes a piece of what the list holds, and has invocations for all of it.
                let work = u64::from(range.span.count);
                let pieces = pieces(work, rows.part_pairs);
                let all = (0..self.slot_count).flat_map(|slot| (0..pieces).map(move |p| (slot, p)));
                for (slot, piece) in all {
                    parts.step(cmd, work / u64::from(pieces));
                    let mut push = parameters(range, slot..slot + 1);
                    (push.piece, push.pieces) = (piece, pieces);
                    let at = list_at(slot, list);
                    cmd.dispatch_indirect(resolve, &push, &range.lists.counts, at);
                }
            }
        }
        stamp();
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        // Every element is in one list of a slot at most.
        for range in &self.ranges {
            let work = u64::from(range.span.count);
            let pieces = pieces(work, FORM_FACTOR_RATE * rows.part_pairs);
            let all = (0..self.slot_count).flat_map(|slot| (0..pieces).map(move |p| (slot, p)));
            for (slot, piece) in all {
                parts.step(cmd, work / u64::from(pieces));
                for (kind, form_factors) in (0..).zip(&range.form_factors) {
                    let mut push = parameters(range, slot..slot + 1);
                    (push.piece, push.pieces) = (piece, pieces);
                    let at = list_at(slot, kind);
                    cmd.dispatch_indirect(form_factors, &push, &range.lists.counts, at);
                }
            }
        }
    }
}

impl Range {
    fn new(device: &Arc<Device>, on: &On<'_>, care: Care) -> Result<Self> {
        let shape = on.rows.shape;
        let (span, first_block) = match on.meso {
            None => (shape.plain, 0),
            Some(_) => (shape.meso, shape.plain_blocks()),
        };
        let relief = on.meso.is_some();
        let pairs = match relief {
            false => &on.scene.near_rows,
            true => &on.scene.near_relief_rows,
        };
        let near = NearMarks::new(device, on.batch, pairs, span.count, relief)?;
        Ok(Self {
            span,
            first_block,
            lists: on.lists.clone(),
            fresh: on.fresh.clone(),
            sort: sort(device, on, &near.marks, care)?,
            near,
            resolve: resolve(device, on, care.places)?,
            form_factors: form_factors(device, on)?,
        })
    }
}

fn sort(
    device: &Arc<Device>,
    on: &On<'_>,
    near_marks: &Buffer,
    care: Care,
) -> Result<BoundCompute> {
    let pipeline = |shader: &ComputeShader<'_>| {
        let constants = [
            care.culls,
            care.silhouettes && care.places > 0,
            care.places == 0,
        ];
        let constants = constants.map(u32::from);
        ComputePipeline::in_subgroups(device, "sort receivers", shader, &constants)
    };
    let (away_count, blocks) = (&on.rows.facing_away, &on.scene.receiver_blocks);
    match &on.batch.sight {
        Sight::Hemicubes(hemicubes) => {
            let items = hemicubes.sampled_items();
            let bindings = receivers!(sort_receivers, on, items, away_count, blocks, near_marks);
            pipeline(&sort_receivers::SHADER)?.bind(&bindings)
        }
        Sight::Rays(tree) => {
            let (shadow_nodes, shadow_occluders) = (&tree.nodes, &tree.occluders);
            let bindings = receivers!(
                sort_receivers_rays,
                on,
                shadow_nodes,
                away_count,
                blocks,
                shadow_occluders,
                near_marks,
                eyes: &on.scene.eyes,
                eye_starts: &on.scene.eye_starts
            );
            pipeline(&sort_receivers_rays::SHADER)?.bind(&bindings)
        }
    }
}

/// What decides where item buffers leave open what is seen.
fn rays(hemicubes: &Hemicubes) -> &OccluderTree {
    let tree = hemicubes.occluders.as_ref();
    tree.expect("a batch for form factors has rays")
}

/// One a list that is left open.
fn resolve(device: &Arc<Device>, on: &On<'_>, places: u32) -> Result<Vec<(u32, BoundCompute)>> {
    if places == 0 {
        return Ok(Vec::new());
    }
    let tree = match &on.batch.sight {
        Sight::Rays(tree) => tree,
        Sight::Hemicubes(hemicubes) => rays(hemicubes),
    };
    let (shadow_nodes, shadow_occluders) = (&tree.nodes, &tree.occluders);
    let bindings = receivers!(
        resolve_receivers,
        on,
        shadow_nodes,
        shadow_occluders,
        eyes: &on.scene.eyes,
        eye_starts: &on.scene.eye_starts
    );
    let bind = |list: u32| {
        let shader = &resolve_receivers::SHADER;
        let pipeline =
            ComputePipeline::in_subgroups(device, "resolve receivers", shader, &[list, places])?;
        Ok((list, pipeline.bind(&bindings)?))
    };
    [RECEIVE_DOUBTFUL, RECEIVE_CROSSED]
        .into_iter()
        .map(bind)
        .collect()
}

/// One a kind.
fn form_factors(device: &Arc<Device>, on: &On<'_>) -> Result<Vec<BoundCompute>> {
    match (&on.batch.sight, on.meso) {
        (Sight::Hemicubes(hemicubes), None) => {
            let items = hemicubes.sampled_items();
            let OccluderTree {
                nodes: shadow_nodes,
                occluders: shadow_occluders,
            } = rays(hemicubes);
            let bindings = found!(form_factors, on, items, shadow_occluders, shadow_nodes);
            kinds(device, &form_factors::SHADER, &bindings)
        }
        (Sight::Hemicubes(hemicubes), Some(meso_elements)) => {
            let items = hemicubes.sampled_items();
            let OccluderTree {
                nodes: shadow_nodes,
                occluders: shadow_occluders,
            } = rays(hemicubes);
            let bindings = found!(
                form_factors_relief,
                on,
                items,
                meso_elements,
                shadow_occluders,
                shadow_nodes
            );
            kinds(device, &form_factors_relief::SHADER, &bindings)
        }
        (Sight::Rays(tree), None) => {
            let (shadow_nodes, shadow_occluders) = (&tree.nodes, &tree.occluders);
            let bindings = found!(form_factors_rays, on, shadow_nodes, shadow_occluders);
            kinds(device, &form_factors_rays::SHADER, &bindings)
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
            kinds(device, &form_factors_relief_rays::SHADER, &bindings)
        }
    }
}

fn kinds(
    device: &Arc<Device>,
    shader: &ComputeShader<'_>,
    bindings: &impl ShaderBindings,
) -> Result<Vec<BoundCompute>> {
    (0..RECEIVE_KINDS)
        .map(|kind| {
            ComputePipeline::in_subgroups(device, "form factors", shader, &[kind])?.bind(bindings)
        })
        .collect()
}
