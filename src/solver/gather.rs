//! Light at the elements: Σ rows × what their sources send.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::Problem;
use super::near::ByLight;
use crate::error::Result;
use crate::passes::buffers::{State, download, download_all};
use crate::passes::gather::{ChunkSlots, Gather, GatherList, Part, most_rows};
use crate::passes::kept_rows::KeptRows;
use crate::passes::measure::Measure;
use crate::passes::measure_relief::MeasureRelief;
use crate::passes::near_to_relief::NearToRelief;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::send_relief::SendRelief;
use crate::passes::types::{KeptRow, Slot};
use crate::vk::{Buffer, Commands, Device, Stage};

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
    list: GatherList,
    /// Rows that are gathered at once, at most.
    most: usize,
    measure: Measure,
    /// What is measured, `[source]`.
    reflected: Buffer,
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
}

impl Gathering {
    /// For as many rows at once as the problem has sources.
    pub fn new(device: &Arc<Device>, on: &Problem, kept: &KeptRows) -> Result<Self> {
        let Problem {
            scene,
            state,
            relief,
            ..
        } = on;
        let relief = relief.as_ref();
        let most = scene.source_count.max(on.slots);
        let list = GatherList::new(device, most)?;
        let by_direction = |relief: &ReliefBuffers| {
            Ok::<_, crate::error::Error>(ByDirection {
                send: SendRelief::new(device, scene, &list.slots, relief)?,
                measure: MeasureRelief::new(device, scene, state, relief)?,
                sources: relief.first_source..relief.first_source + relief.source_count,
            })
        };
        Ok(Self {
            device: Arc::clone(device),
            gather: Gather::new(device, scene, state, kept, &list, relief)?,
            most: most_rows(scene.element_count, relief) as usize,
            measure: Measure::new(device, scene, state)?,
            reflected: state.reflected.clone(),
            near: relief
                .map(|relief| NearToRelief::new(device, &on.near, state, relief))
                .transpose()?
                .flatten(),
            sources: scene.source_count as usize,
            relief: relief.map(by_direction).transpose()?,
            list,
        })
    }

    /// Adds what these rows bring, part by part, and passes the rows of each part to `go_on`.
    /// Returns whether it never said no.
    pub fn run(
        &self,
        mut rows: Vec<LitRow>,
        mut go_on: impl FnMut(&[LitRow]) -> bool,
    ) -> Result<bool> {
        if rows.is_empty() {
            return Ok(true);
        }
        rows.sort_by_key(|row| row.row.chunk);
        let slot = |row: &LitRow| Slot {
            emitted: row.emitted,
            source: row.source,
            reflected: row.reflected,
            scale: row.row.scale,
        };
        let slots: Vec<Slot> = rows.iter().map(slot).collect();
        let places: Vec<KeptRow> = rows.iter().map(|row| row.row).collect();
        self.list.write(&slots, &places)?;
        let of_chunks = rows.chunk_by(|a, b| a.row.chunk == b.row.chunk);
        let mut first = 0;
        for some in of_chunks.flat_map(|rows| rows.chunks(self.most)) {
            let end = first + some.len() as u32;
            let of = ChunkSlots {
                chunk: some[0].row.chunk,
                slots: first..end,
            };
            Commands::run(&self.device, "gather", |cmd| {
                cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
                self.record(cmd, some, &of);
                Ok(())
            })?;
            if !go_on(some) {
                return Ok(false);
            }
            first = end;
        }
        Ok(true)
    }

    /// Finds what those of the rows with a relief send by direction, and gathers.
    fn record(&self, cmd: &Commands, rows: &[LitRow], of: &ChunkSlots) {
        let sends = |by: &&ByDirection| rows.iter().any(|row| by.sources.contains(&row.source));
        let directed = self.relief.as_ref().filter(sends);
        if let Some(ByDirection { send, .. }) = directed {
            send.record(cmd, of.slots.clone());
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
        if rows.iter().any(|row| row.emitted != Vec3::ZERO) {
            self.gather.record(cmd, of, Part::Emitted);
        }
        // By direction a source may have light to move that sums to none.
        if directed.is_some() || rows.iter().any(|row| row.reflected != Vec3::ZERO) {
            self.gather.record(cmd, of, Part::Reflected);
        }
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

    /// Irradiance of each element, direct and indirect.
    pub fn irradiance(&self, on: &Problem) -> Result<Vec<DVec3>> {
        let count = on.elements.len();
        let State {
            direct, indirect, ..
        } = &on.state;
        let [direct, indirect] = download_all::<Vec3, 2>(&self.device, [direct, indirect], count)?;
        let sum = |(d, i): (&Vec3, &Vec3)| d.as_dvec3() + i.as_dvec3();
        Ok(direct.iter().zip(&indirect).map(sum).collect())
    }

    /// Radiosity that each source reflects of what has been gathered.
    pub fn measure(&self) -> Result<Vec<DVec3>> {
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
        Ok(reflected.into_iter().map(Vec3::as_dvec3).collect())
    }

    /// Slots of the list as it was gathered last, for comparison with the twins.
    pub fn slots(&self, count: usize) -> Result<Vec<Slot>> {
        download(&self.device, &self.list.slots, count)
    }
}
