//! Light at the elements: Σ rows × what their sources send.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::error::Result;
use crate::passes::buffers::{SceneBuffers, State, download};
use crate::passes::gather::{self, ChunkSlots, Gather, GatherList, Part};
use crate::passes::kept_rows::KeptRows;
use crate::passes::measure::Measure;
use crate::passes::measure_relief::MeasureRelief;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::send_relief::SendRelief;
use crate::passes::types::{KeptRow, Slot};
use crate::vk::{Commands, DescriptorSet, Device, Stage};

/// A row on the device, and what its source sends through it.
#[derive(Debug, Clone, Copy)]
pub(super) struct LitRow {
    pub row: KeptRow,
    pub source: u32,
    /// Radiosity, RGB; a point light's emitted intensity.
    pub emitted: Vec3,
    pub reflected: Vec3,
}

/// The passes that bring light to the elements and measure what the sources reflect of it.
pub(super) struct Gathering {
    device: Arc<Device>,
    gather: Gather,
    sets: gather::Sets,
    list: GatherList,
    measure: Measure,
    measure_set: DescriptorSet,
    relief: Option<ByDirection>,
}

/// What sources with a relief send, and what they reflect.
pub(super) struct ByDirection {
    send: SendRelief,
    send_set: DescriptorSet,
    measure: MeasureRelief,
    measure_set: DescriptorSet,
}

/// What light is gathered on.
#[derive(Clone, Copy)]
pub(super) struct Lit<'a> {
    pub scene: &'a SceneBuffers,
    pub state: &'a State,
    pub kept: &'a KeptRows,
    pub relief: Option<&'a ReliefBuffers>,
}

impl Gathering {
    /// For as many rows at once.
    pub fn new(device: &Arc<Device>, lit: Lit<'_>, most: u32) -> Result<Self> {
        let Lit {
            scene,
            state,
            kept,
            relief,
        } = lit;
        let gather = Gather::new(device, relief.is_some())?;
        let list = GatherList::new(device, most)?;
        let measure = Measure::new(device)?;
        let by_direction = |relief: &ReliefBuffers| {
            let send = SendRelief::new(device)?;
            let measure = MeasureRelief::new(device)?;
            Ok::<_, crate::error::Error>(ByDirection {
                send_set: send.bind(scene, &list.slots, relief)?,
                measure_set: measure.bind(scene, state, relief)?,
                send,
                measure,
            })
        };
        Ok(Self {
            device: Arc::clone(device),
            sets: gather.bind(scene, state, kept, &list, relief)?,
            measure_set: measure.bind(scene, state)?,
            relief: relief.map(by_direction).transpose()?,
            gather,
            list,
            measure,
        })
    }

    /// Adds what these rows bring.
    pub fn run(&self, lit: Lit<'_>, rows: &[LitRow]) -> Result<()> {
        if rows.is_empty() {
            return Ok(());
        }
        let mut rows = rows.to_vec();
        rows.sort_by_key(|row| row.row.chunk);
        let slot = |row: &LitRow| Slot {
            emitted: row.emitted,
            source: row.source,
            reflected: row.reflected,
            scale: row.row.scale,
        };
        let slots: Vec<Slot> = rows.iter().map(slot).collect();
        let places: Vec<KeptRow> = rows.iter().map(|row| row.row).collect();
        self.list.write(&self.device, &slots, &places)?;
        Commands::run(&self.device, "gather", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            let mut first = 0;
            for of_chunk in rows.chunk_by(|a, b| a.row.chunk == b.row.chunk) {
                match (&self.relief, lit.relief) {
                    (Some(by_direction), Some(relief)) => {
                        for some in of_chunk.chunks(relief.slots as usize) {
                            self.record_relief(cmd, lit.kept, by_direction, relief, some, first);
                            first += some.len() as u32;
                        }
                    }
                    _ => {
                        let of = chunk_slots(of_chunk, first);
                        for part in parts(of_chunk) {
                            self.gather.record(cmd, &self.sets, lit.kept, &of, part);
                        }
                        first += of_chunk.len() as u32;
                    }
                }
            }
            Ok(())
        })
    }

    /// Finds what those of the rows with a relief send by direction, and gathers; the first has
    /// slot `first`.
    fn record_relief(
        &self,
        cmd: &Commands,
        kept: &KeptRows,
        by_direction: &ByDirection,
        relief: &ReliefBuffers,
        rows: &[LitRow],
        first: u32,
    ) {
        let of = chunk_slots(rows, first);
        let of_relief = relief.first_source..relief.first_source + relief.source_count;
        let directed = rows.iter().any(|row| of_relief.contains(&row.source));
        if directed {
            let ByDirection { send, send_set, .. } = by_direction;
            send.record(cmd, send_set, relief, of.slots.clone());
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
        for part in [Part::Emitted, Part::Reflected] {
            // By direction a source may have light to move that sums to none.
            if part == Part::Reflected && directed || parts(rows).any(|p| p == part) {
                (self.gather).record_relief(cmd, &self.sets, kept, relief, &of, part);
            }
        }
    }

    /// Radiosity that each source reflects of what has been gathered.
    pub fn measure(&self, lit: Lit<'_>) -> Result<Vec<DVec3>> {
        Commands::run(&self.device, "measure", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            (self.measure).record(cmd, &self.measure_set, lit.scene.source_count);
            if let (Some(by_direction), Some(relief)) = (&self.relief, lit.relief) {
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                (by_direction.measure).record(cmd, &by_direction.measure_set, relief);
            }
            Ok(())
        })?;
        let count = lit.scene.source_count as usize;
        let reflected: Vec<Vec3> = download(&self.device, &lit.state.reflected, count)?;
        Ok(reflected.into_iter().map(Vec3::as_dvec3).collect())
    }

    /// Slots of the list as it was gathered last, for comparison with the twins.
    pub fn slots(&self, count: usize) -> Result<Vec<Slot>> {
        download(&self.device, &self.list.slots, count)
    }
}

/// Rows of one chunk as slots of the list.
fn chunk_slots(rows: &[LitRow], first: u32) -> ChunkSlots {
    ChunkSlots {
        chunk: rows[0].row.chunk,
        slots: first..first + rows.len() as u32,
    }
}

/// The parts of light that any of the rows has.
fn parts(rows: &[LitRow]) -> impl Iterator<Item = Part> {
    let emits = rows.iter().any(|row| row.emitted != Vec3::ZERO);
    let reflects = rows.iter().any(|row| row.reflected != Vec3::ZERO);
    let emitted = emits.then_some(Part::Emitted);
    emitted
        .into_iter()
        .chain(reflects.then_some(Part::Reflected))
}
