//! Light at the elements of a member: Σ rows × what their sources send.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::exchange::{Exchange, Gift, Lent};
use super::near::ByLight;
use super::shares::Share;
use crate::error::{Error, Result};
use crate::passes::buffers::{SceneBuffers, State, download};
use crate::passes::gather::{ChunkSlots, Gather, GatherList, Part, most_rows};
use crate::passes::kept_rows::KeptRows;
use crate::passes::measure::Measure;
use crate::passes::measure_relief::MeasureRelief;
use crate::passes::near_to_relief::{NearParts, NearToRelief};
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::send_relief::SendRelief;
use crate::passes::types::{KeptRow, Slot};
use crate::vk::{Buffer, Commands, Device, Stage};

/// A kept row, and what its source sends through it.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct LitRow {
    pub source: u32,
    /// Of its form factors.
    pub scale: f32,
    /// Radiosity, RGB; a point light's emitted intensity.
    pub emitted: Vec3,
    pub reflected: Vec3,
}

/// The passes that bring light to the elements and measure what the sources reflect of it.
pub(super) struct Gathering {
    device: Arc<Device>,
    gather: Gather,
    list: GatherList,
    /// Rows that are gathered at once, at most.
    pub most: usize,
    measure: Measure,
    /// What is measured, `[source]`.
    reflected: Buffer,
    /// The member's, of `sources`.
    own_sources: Vec<u32>,
    sources: usize,
    relief: Option<ByDirection>,
    /// Where relief receives near sources part by part.
    near: Option<NearToRelief>,
}

/// What sources with a relief send, and what they reflect.
pub(super) struct ByDirection {
    send: SendRelief,
    measure: MeasureRelief,
    /// The sources with a relief.
    sources: Range<u32>,
    /// What they send by direction, see [`ReliefBuffers::exits`].
    exits: Buffer,
    /// Numbers of a slot there.
    slot_exits: usize,
}

impl Gathering {
    /// For as many rows at once as the problem has sources.
    pub fn new(
        device: &Arc<Device>,
        (scene, state, relief): (&SceneBuffers, &State, Option<&ReliefBuffers>),
        near: Option<&NearParts>,
        kept: &KeptRows,
        share: &Share,
        slots: u32,
    ) -> Result<Self> {
        let most = scene.source_count.max(slots);
        let list = GatherList::new(device, most)?;
        let by_direction = |relief: &ReliefBuffers| {
            Ok::<_, Error>(ByDirection {
                send: SendRelief::new(device, scene, &list.slots, relief)?,
                measure: MeasureRelief::new(device, scene, state, relief)?,
                sources: relief.shape.first_source
                    ..relief.shape.first_source + relief.shape.source_count,
                exits: relief.exits.clone(),
                slot_exits: 2 * relief.shape.directions.count(),
            })
        };
        let near = match (relief, near) {
            (Some(relief), Some(near)) => NearToRelief::new(device, near, state, relief)?,
            _ => None,
        };
        Ok(Self {
            device: Arc::clone(device),
            gather: Gather::new(device, scene, state, kept, &list, relief)?,
            most: most_rows(scene.element_count, relief) as usize,
            measure: Measure::new(device, scene, state)?,
            reflected: state.reflected.clone(),
            own_sources: share.sources.clone(),
            near,
            sources: scene.source_count as usize,
            relief: relief.map(by_direction).transpose()?,
            list,
        })
    }

    /// Adds what these rows bring, which are no more than [`Self::most`]: one sum of all of them,
    /// in this order, whatever chunks they lie in.
    pub fn run(&self, rows: &[(LitRow, KeptRow)], exchange: Lent<'_>) -> Result<()> {
        if rows.is_empty() {
            return Ok(());
        }
        let slot = |(lit, _): &(LitRow, KeptRow)| Slot {
            emitted: lit.emitted,
            source: lit.source,
            reflected: lit.reflected,
            scale: lit.scale,
        };
        let slots: Vec<Slot> = rows.iter().map(slot).collect();
        let places: Vec<KeptRow> = rows.iter().map(|(_, place)| *place).collect();
        self.list.write(&slots, &places)?;
        let directed = self.sends_by_direction(rows);
        let exchanged = match (directed, exchange) {
            (Some(by), Some(exchange)) => {
                self.exchange_exits(by, rows, exchange)?;
                true
            }
            _ => false,
        };
        Commands::run(&self.device, "gather", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            if let Some(by) = directed.filter(|_| !exchanged) {
                by.send.record(cmd, 0..rows.len() as u32);
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            }
            self.record(cmd, rows, directed.is_some());
            Ok(())
        })
    }

    /// What sends by direction, if a source of these rows does.
    fn sends_by_direction(&self, rows: &[(LitRow, KeptRow)]) -> Option<&ByDirection> {
        let by = self.relief.as_ref()?;
        let sends = rows.iter().any(|(lit, _)| by.sources.contains(&lit.source));
        sends.then_some(by)
    }

    /// Gathers from these rows, part by part: emitted light, and reflected light.
    fn record(&self, cmd: &Commands, rows: &[(LitRow, KeptRow)], directed: bool) {
        let emits = rows.iter().any(|(lit, _)| lit.emitted != Vec3::ZERO);
        // By direction a source may have light to move that sums to none.
        let reflects = directed || rows.iter().any(|(lit, _)| lit.reflected != Vec3::ZERO);
        let parts = [(Part::Emitted, emits), (Part::Reflected, reflects)];
        for (part, _) in parts.into_iter().filter(|(_, any)| *any) {
            let mut first = 0;
            for of_chunk in rows.chunk_by(|a, b| a.1.chunk == b.1.chunk) {
                let end = first + of_chunk.len() as u32;
                let of = ChunkSlots {
                    chunk: of_chunk[0].1.chunk,
                    slots: first..end,
                    of: 0..rows.len() as u32,
                };
                self.gather.record(cmd, &of, part);
                first = end;
            }
        }
    }

    /// Finds what the member's own sources send by direction, and takes what others have found of
    /// theirs.
    fn exchange_exits(
        &self,
        by: &ByDirection,
        rows: &[(LitRow, KeptRow)],
        exchange: &mut dyn Exchange,
    ) -> Result<()> {
        let count = rows.len();
        Commands::run(&self.device, "send relief", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            by.send.record(cmd, 0..count as u32);
            Ok(())
        })?;
        let of_slot = by.slot_exits;
        let mut exits: Vec<[f32; 4]> = download(&self.device, &by.exits, count * of_slot)?;
        let is_own = |source: &u32| self.own_sources.binary_search(source).is_ok();
        let mut given = Vec::new();
        for (slot, (lit, _)) in rows.iter().enumerate() {
            if by.sources.contains(&lit.source) && is_own(&lit.source) {
                given.extend((slot as u32).to_le_bytes());
                let of_source = &exits[slot * of_slot..(slot + 1) * of_slot];
                given.extend_from_slice(bytemuck::cast_slice(of_source));
            }
        }
        let size = of_slot * size_of::<[f32; 4]>();
        exchange.give(Gift::Exits, given)?;
        for given in exchange.collect(Gift::Exits)? {
            for one in given.chunks(4 + size) {
                let (slot, sent) = one.split_first_chunk::<4>().ok_or_else(strange)?;
                let first = u32::from_le_bytes(*slot) as usize * of_slot;
                let to = exits.get_mut(first..first + of_slot).ok_or_else(strange)?;
                let to: &mut [u8] = bytemuck::cast_slice_mut(to);
                if to.len() != sent.len() {
                    return Err(strange());
                }
                to.copy_from_slice(sent);
            }
        }
        by.exits.set(&exits)
    }

    /// Adds what relief receives of the parts of near sources.
    pub fn near(&self, light: &ByLight<Vec<Vec3>>) -> Result<()> {
        let Some(near) = &self.near else {
            return Ok(());
        };
        let ByLight { emitted, reflected } = light;
        for (part, light) in [(Part::Emitted, emitted), (Part::Reflected, reflected)] {
            if light.iter().all(|&of| of == Vec3::ZERO) {
                continue;
            }
            near.write(part, light)?;
            Commands::run(&self.device, "near to relief", |cmd| {
                cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
                near.record(cmd, part);
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Radiosity that each source of the member reflects of what has been gathered.
    pub fn measure(&self) -> Result<Vec<Vec3>> {
        Commands::run(&self.device, "measure", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            self.measure.record(cmd);
            if let Some(by_direction) = &self.relief {
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                by_direction.measure.record(cmd);
            }
            Ok(())
        })?;
        let reflected: Vec<Vec3> = download(&self.device, &self.reflected, self.sources)?;
        let own = self.own_sources.iter();
        Ok(own.map(|&s| reflected[s as usize]).collect())
    }

    /// Slots of the list as it was gathered last, for comparison with the twins.
    pub fn slots(&self, count: usize) -> Result<Vec<Slot>> {
        download(&self.device, &self.list.slots, count)
    }
}

fn strange() -> Error {
    Error::Device("a device of several sent damaged light".into())
}
