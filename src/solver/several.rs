//! Several devices that make rows: a thread each claims sources from a board, and the first device
//! keeps what comes back.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};

use super::makers::{Batch, Makers, RowKind, TeamParts};
use super::rows::{FactorWords, Factors, Made, Row, Stages};

use crate::error::{Error, Result};
use crate::passes::fresh_rows::FreshRows;
use crate::passes::keep::Keep;
use crate::passes::kept_rows::{KeptRows, SCRATCH};
use crate::passes::types::{KeptRow, KeptState, Slot};
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage};

/// Devices that make rows, each on a thread of its own, and the first one, which keeps them.
pub(super) struct Several {
    board: Arc<Board>,
    _workers: Vec<Worker>,
    under_way: VecDeque<Batch>,
    keeper: Keeper,
    turn: u32,
}

impl Several {
    pub fn new(devices: &[Arc<Device>], parts: TeamParts<'_>, kept: &KeptRows) -> Result<Self> {
        let problem = parts.problem;
        let board = Arc::new(Board::default());
        let workers = thread::scope(|scope| {
            let make = |(i, device): (usize, &Arc<Device>)| {
                let device = Arc::clone(device);
                let board = Arc::clone(&board);
                scope.spawn(move || {
                    if i == 0 {
                        let makers = Makers::new(&device, parts, &problem.scene, None)?;
                        return Ok(Worker::start(board, makers));
                    }
                    let scene = problem.buffers(&device)?;
                    let makers = Makers::new(&device, parts, &scene, None)?;
                    Ok::<_, Error>(Worker::start(board, makers))
                })
            };
            let workers: Vec<_> = devices.iter().enumerate().map(make).collect();
            (workers.into_iter())
                .map(|worker| {
                    let made = worker.join();
                    made.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
                })
                .collect::<Result<Vec<_>>>()
        })?;
        let share = (problem.slots as usize).div_ceil(2 * devices.len());
        board.notes().share = share.max(1);
        Ok(Self {
            board,
            _workers: workers,
            under_way: VecDeque::new(),
            keeper: Keeper::new(&devices[0], kept, problem.slots)?,
            turn: 0,
        })
    }

    /// Sources of a batch, at most.
    pub fn slots(&self) -> usize {
        self.keeper.slots
    }

    pub fn submit(&mut self, batch: Batch) {
        let jobs = batch.sources.iter().map(|&source| (source, batch.kind));
        self.board.notes().wanted.extend(jobs);
        self.board.changed.notify_all();
        self.under_way.push_back(batch);
    }

    /// The oldest batch under way, kept; none if there is none.
    pub fn take(&mut self, kept: &KeptRows) -> Result<Option<Made>> {
        let Some(batch) = self.under_way.pop_front() else {
            return Ok(None);
        };
        let mut rows = (batch.sources.iter())
            .map(|&source| self.board.take(source))
            .collect::<Result<Vec<Row>>>()?;
        let stages = std::mem::take(&mut self.board.notes().stages);
        let state = self.keeper.keep(kept, &mut rows, self.turn % SCRATCH)?;
        self.turn += 1;
        Ok(Some(Made {
            rows,
            stages,
            state: Some(state),
        }))
    }
}

/// Keeps rows that come from the host.
struct Keeper {
    device: Arc<Device>,
    keep: Keep,
    fresh: FreshRows,
    slots_buffer: Buffer,
    upload: Buffer,
    readback: Buffer,
    slots: usize,
}

impl Keeper {
    fn new(device: &Arc<Device>, kept: &KeptRows, slots: u32) -> Result<Self> {
        let fresh = FreshRows::new(device, kept.shape, slots, false)?;
        let slot_bytes = u64::from(slots) * size_of::<Slot>() as u64;
        let slots_buffer = Buffer::new(device, "slots", slot_bytes, BufferUse::Storage)?;
        let keep = Keep::new(device, &slots_buffer, slots, &fresh, kept)?;
        let parts = [&fresh.plain, &fresh.meso, &fresh.occupied];
        let bytes = slot_bytes + parts.iter().map(|part| part.bytes()).sum::<u64>();
        let read = keep.rows.bytes() + size_of::<KeptState>() as u64;
        Ok(Self {
            upload: Buffer::new(device, "rows of others", bytes, BufferUse::Upload)?,
            readback: Buffer::new(device, "rows of a batch", read, BufferUse::Readback)?,
            device: Arc::clone(device),
            keep,
            fresh,
            slots_buffer,
            slots: slots as usize,
        })
    }

    /// Brings rows to the device and keeps them, in their order. Returns how far the chunks are
    /// filled then.
    fn keep(&mut self, kept: &KeptRows, rows: &mut [Row], scratch: u32) -> Result<KeptState> {
        let shape = kept.shape;
        let mut slots = vec![Slot::EMPTY; self.slots];
        for (slot, row) in slots.iter_mut().zip(rows.iter()) {
            *slot = Slot::of(row.source);
            slot.scale = row.scale;
        }
        self.upload.write(0, &slots);
        let plain_at = size_of_val(&slots[..]) as u64;
        let meso_at = plain_at + self.fresh.plain.bytes();
        let occupied_at = meso_at + self.fresh.meso.bytes();
        let sizes = [shape.plain_count, 3 * shape.meso_count, shape.blocks()].map(u64::from);
        for (i, row) in (0..).zip(rows.iter()) {
            let Factors::Host(FactorWords {
                plain,
                meso,
                occupied,
            }) = &row.factors
            else {
                unreachable!("several devices bring their rows to the host");
            };
            self.upload.write(plain_at + 4 * i * sizes[0], plain);
            self.upload.write(meso_at + 4 * i * sizes[1], meso);
            self.upload.write(occupied_at + 4 * i * sizes[2], occupied);
        }
        let count = rows.len() as u64;
        let state_bytes = size_of::<KeptState>() as u64;
        Commands::run(&self.device, "keep rows", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Transfer]);
            cmd.copy(&self.upload, 0, &self.slots_buffer, 0, plain_at);
            for (at, size, to) in [
                (plain_at, sizes[0], &self.fresh.plain),
                (meso_at, sizes[1], &self.fresh.meso),
                (occupied_at, sizes[2], &self.fresh.occupied),
            ] {
                cmd.copy(&self.upload, at, to, 0, 4 * count * size);
            }
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
            self.keep.record(cmd, scratch);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            let bytes = self.keep.rows.bytes();
            cmd.copy(&self.keep.rows, 0, &self.readback, 0, bytes);
            cmd.copy(&kept.state, 0, &self.readback, bytes, state_bytes);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        let places: Vec<KeptRow> = self.readback.read(0, rows.len());
        for (row, place) in rows.iter_mut().zip(places) {
            row.factors = Factors::Kept(place);
        }
        Ok(self.readback.read(self.keep.rows.bytes(), 1)[0])
    }
}

/// Where the solver and the workers meet.
#[derive(Default)]
struct Board {
    notes: Mutex<Notes>,
    changed: Condvar,
}

#[derive(Default)]
struct Notes {
    /// Sources to be drawn.
    wanted: VecDeque<(u32, RowKind)>,
    /// Sources that a worker takes at once, at most.
    share: usize,
    rows: HashMap<u32, Row>,
    /// Of all devices, since the last batch was taken.
    stages: Stages,
    error: Option<Error>,
    /// No more is wanted, or no more is made.
    closed: bool,
}

impl Board {
    fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn wait<'a>(&self, notes: MutexGuard<'a, Notes>) -> MutexGuard<'a, Notes> {
        self.changed.wait(notes).unwrap_or_else(|e| e.into_inner())
    }

    fn close(&self) {
        self.notes().closed = true;
        self.changed.notify_all();
    }

    /// The row of a source that was asked for; waits until it is made.
    fn take(&self, source: u32) -> Result<Row> {
        let mut notes = self.notes();
        loop {
            if let Some(row) = notes.rows.remove(&source) {
                return Ok(row);
            }
            if let Some(error) = notes.error.take() {
                return Err(error);
            }
            if notes.closed {
                return Err(Error::Device("a device of several has failed".into()));
            }
            notes = self.wait(notes);
        }
    }

    /// The next sources for a worker, of one kind. Waits for some unless the worker is `busy`; none
    /// once no more is wanted.
    fn claim(&self, busy: bool) -> Option<Batch> {
        let mut notes = self.notes();
        while notes.wanted.is_empty() && !notes.closed && !busy {
            notes = self.wait(notes);
        }
        let &(_, kind) = notes.wanted.front().filter(|_| !notes.closed)?;
        let of_kind = notes.wanted.iter().take_while(|job| job.1 == kind);
        let count = of_kind.count().min(notes.share.max(1));
        let sources = notes.wanted.drain(..count).map(|job| job.0).collect();
        Some(Batch { sources, kind })
    }
}

/// A thread that makes rows on one device until the board is closed.
struct Worker(Option<JoinHandle<()>>, Arc<Board>);

impl Worker {
    fn start(board: Arc<Board>, makers: Makers) -> Self {
        let of_thread = Arc::clone(&board);
        let thread = thread::spawn(move || {
            let _closes = Closes(&of_thread);
            let mut makers = makers;
            if let Err(error) = work(&of_thread, &mut makers) {
                of_thread.notes().error = Some(error);
            }
        });
        Self(Some(thread), board)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.1.close();
        if let Some(thread) = self.0.take() {
            // What ended it was reported where its rows were awaited.
            let _ = thread.join();
        }
    }
}

/// However a thread ends, nobody waits for it for ever.
struct Closes<'a>(&'a Board);

impl Drop for Closes<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Two batches at a time, so that the device need not wait for the host.
fn work(board: &Board, makers: &mut Makers) -> Result<()> {
    let mut under_way = VecDeque::new();
    loop {
        while under_way.len() < SCRATCH as usize {
            let Some(mut batch) = board.claim(!under_way.is_empty()) else {
                break;
            };
            let maker = makers.of(batch.kind);
            // Only a device with little memory has fewer slots than its share.
            let more = batch
                .sources
                .split_off(batch.sources.len().min(maker.slots()));
            for source in more.into_iter().rev() {
                board.notes().wanted.push_front((source, batch.kind));
            }
            maker.submit(&batch.sources)?;
            under_way.push_back(batch.kind);
        }
        let Some(kind) = under_way.pop_front() else {
            return Ok(());
        };
        if let Some(made) = makers.of(kind).take()? {
            let mut notes = board.notes();
            notes.stages += made.stages;
            notes
                .rows
                .extend(made.rows.into_iter().map(|row| (row.source, row)));
            drop(notes);
            board.changed.notify_all();
        }
    }
}
