//! Members in other processes, which `mpirun` starts, a device each.
//!
//! The first process reads, solves and writes; each other one does what it is asked, from scene to
//! scene, until the first has ended. All calls of MPI are made by one thread a process. It waits for
//! what is asked without using its core, since a software device may need it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use mpi::datatype::PartitionMut;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};
use mpi::{Count, Rank, Threading};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::devices::started_together;
use super::exchange::Exchange;
use super::member::{Command, Member, MemberData, MemberShare, Reply};
use super::team::Others;
use crate::error::{Error, Result};
use crate::vk::Device;

/// The processes of an `mpirun`, as one of them reaches the others.
pub struct Ranks {
    requests: Mutex<Sender<Request>>,
    thread: Mutex<Option<JoinHandle<()>>>,
    rank: usize,
    count: usize,
    local: usize,
    /// One has failed while others may wait for it: they are ended.
    broken: AtomicBool,
}

/// What the thread that calls MPI is asked.
enum Request {
    Send(usize, Vec<u8>),
    Receive(usize, Sender<Vec<u8>>),
    /// To all others, or from the first.
    Broadcast(Vec<u8>, Sender<Vec<u8>>),
    AllGather(Vec<u8>, Sender<Vec<Vec<u8>>>),
    Abort,
    End,
}

const TAG: i32 = 1;

/// Bytes of a message, at most: MPI counts them in 31 bits.
const PIECE: usize = 1 << 28;

/// Between two looks for a message.
const SHORTEST_WAIT: Duration = Duration::from_micros(20);
const LONGEST_WAIT: Duration = Duration::from_micros(500);

impl Ranks {
    /// Joins the other processes; none where this one was started alone.
    ///
    /// # Errors
    /// An MPI that does not start.
    pub fn join() -> Result<Option<Self>> {
        if started_together() < 2 {
            return Ok(None);
        }
        let (requests, asked) = channel();
        let (joined, place) = channel();
        let thread = thread::spawn(move || {
            let Some((universe, _)) = mpi::initialize_with_threading(Threading::Funneled) else {
                return;
            };
            let world = universe.world();
            let local = world.split_shared(world.rank()).rank();
            let place = [world.rank(), world.size(), local].map(|number| number as usize);
            if joined.send(place).is_ok() {
                answer(&world, &asked);
            }
        });
        let Ok([rank, count, local]) = place.recv() else {
            return Err(Error::Device("MPI does not start".into()));
        };
        let ranks = Self {
            requests: Mutex::new(requests),
            thread: Mutex::new(Some(thread)),
            rank,
            count,
            local,
            broken: AtomicBool::new(false),
        };
        Ok((count > 1).then_some(ranks))
    }

    /// Its number among all processes, of which 0 solves.
    pub fn rank(&self) -> usize {
        self.rank
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Its number among the processes of its machine.
    pub fn local_rank(&self) -> usize {
        self.local
    }

    /// Does on `device` what the first process asks, until that has ended.
    ///
    /// # Errors
    /// A device that fails where others do not wait for it. Where they do, all processes are ended,
    /// after a line that says why.
    pub fn serve(self: &Arc<Self>, device: &Arc<Device>) -> Result<()> {
        while !self.receive(0)?.is_empty() {
            let data: MemberData = read(&self.broadcast(Vec::new())?)?;
            let own: MemberShare = read(&self.receive(0)?)?;
            let exchange = Box::new(RankExchange(Arc::clone(self)));
            let made = Member::new(device, &data, own, Some(exchange));
            drop(data);
            let mut member = match made {
                Ok(member) => member,
                Err(error) => {
                    self.answer(Err(error))?;
                    continue;
                }
            };
            self.answer(Ok(Reply::Done))?;
            loop {
                let asked = self.receive(0)?;
                if asked.is_empty() {
                    break;
                }
                let command: Command = read(&asked)?;
                // Others wait for what this one gives them then.
                let is_awaited = matches!(command, Command::Submit { .. } | Command::Gather(_));
                let answer = member.run(command);
                if let (Err(error), true) = (&answer, is_awaited) {
                    tracing::error!("rank {}: {error}", self.rank);
                    self.abort();
                }
                self.answer(answer)?;
            }
        }
        Ok(())
    }

    fn answer(&self, answer: Result<Reply>) -> Result<()> {
        let rank = self.rank;
        let answer = answer.map_err(|error| format!("rank {rank}: {error}"));
        self.send(0, written(&answer)?)
    }

    /// Lets the other processes end, and leaves them.
    pub fn end(&self) {
        if self.broken.load(Ordering::Relaxed) {
            self.abort();
        }
        for rank in 1..self.count {
            if self.rank == 0 {
                let _ = self.send(rank, Vec::new());
            }
        }
        let _ = self.ask(Request::End);
        let thread = self.thread.lock().unwrap_or_else(|e| e.into_inner()).take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }

    /// Ends all processes at once, this one with exit code 2.
    pub fn abort(&self) -> ! {
        let _ = self.ask(Request::Abort);
        // The other thread ends this one.
        loop {
            thread::park();
        }
    }

    fn ask(&self, request: Request) -> Result<()> {
        let requests = self.requests.lock().unwrap_or_else(|e| e.into_inner());
        requests.send(request).map_err(|_| left())
    }

    fn send(&self, to: usize, message: Vec<u8>) -> Result<()> {
        self.ask(Request::Send(to, message))
    }

    fn receive(&self, from: usize) -> Result<Vec<u8>> {
        let (send, message) = channel();
        self.ask(Request::Receive(from, send))?;
        message.recv().map_err(|_| left())
    }

    fn broadcast(&self, message: Vec<u8>) -> Result<Vec<u8>> {
        let (send, message_of_first) = channel();
        self.ask(Request::Broadcast(message, send))?;
        message_of_first.recv().map_err(|_| left())
    }
}

fn left() -> Error {
    Error::Device("the other processes are gone".into())
}

fn written(value: &impl Serialize) -> Result<Vec<u8>> {
    let damaged = |e: postcard::Error| Error::Device(format!("a message between processes: {e}"));
    postcard::to_stdvec(value).map_err(damaged)
}

fn read<T: DeserializeOwned>(message: &[u8]) -> Result<T> {
    let damaged = |e: postcard::Error| Error::Device(format!("a message between processes: {e}"));
    postcard::from_bytes(message).map_err(damaged)
}

/// Calls MPI for what is asked, until it is to end.
fn answer(world: &SimpleCommunicator, asked: &Receiver<Request>) {
    while let Ok(request) = asked.recv() {
        match request {
            Request::Send(to, message) => {
                let to = world.process_at_rank(to as Rank);
                let length = (message.len() as u64).to_le_bytes();
                to.send_with_tag(&length[..], TAG);
                for piece in message.chunks(PIECE) {
                    to.send_with_tag(piece, TAG);
                }
            }
            Request::Receive(from, to) => drop(to.send(receive(world, from))),
            Request::Broadcast(mut message, to) => {
                let first = world.process_at_rank(0);
                let mut length = message.len() as u64;
                first.broadcast_into(&mut length);
                message.resize(length as usize, 0);
                for piece in message.chunks_mut(PIECE) {
                    first.broadcast_into(piece);
                }
                drop(to.send(message));
            }
            Request::AllGather(given, to) => drop(to.send(all_gather(world, &given))),
            Request::Abort => world.abort(2),
            Request::End => return,
        }
    }
}

/// The next message from a process. Looks for it again and again: the calls of MPI that wait use
/// their core.
fn receive(world: &SimpleCommunicator, from: usize) -> Vec<u8> {
    let from = world.process_at_rank(from as Rank);
    let mut wait = SHORTEST_WAIT;
    while from.immediate_probe_with_tag(TAG).is_none() {
        thread::sleep(wait);
        wait = (2 * wait).min(LONGEST_WAIT);
    }
    let mut length = [0u8; 8];
    from.receive_into_with_tag(&mut length[..], TAG);
    let mut message = vec![0; u64::from_le_bytes(length) as usize];
    for piece in message.chunks_mut(PIECE) {
        from.receive_into_with_tag(piece, TAG);
    }
    message
}

fn all_gather(world: &SimpleCommunicator, given: &[u8]) -> Vec<Vec<u8>> {
    let mut lengths = vec![0u64; world.size() as usize];
    world.all_gather_into(&(given.len() as u64), &mut lengths[..]);
    let mut all: Vec<Vec<u8>> = lengths.iter().map(|_| Vec::new()).collect();
    let mut first = 0;
    // What is left of each, as much as one call may take.
    let most = PIECE / all.len();
    while lengths.iter().any(|&length| first < length as usize) {
        let part = |length: u64| (length as usize).saturating_sub(first).min(most);
        let counts: Vec<Count> = lengths
            .iter()
            .map(|&length| part(length) as Count)
            .collect();
        let starts = counts.iter().scan(0, |end, count| {
            let start = *end;
            *end += count;
            Some(start)
        });
        let starts: Vec<Count> = starts.collect();
        let mut received = vec![0u8; counts.iter().map(|&count| count as usize).sum()];
        let own = part(given.len() as u64);
        let from = first.min(given.len());
        {
            let mut parts = PartitionMut::new(&mut received[..], &counts[..], &starts[..]);
            world.all_gather_varcount_into(&given[from..from + own], &mut parts);
        }
        let mut rest = &received[..];
        for (all, &count) in all.iter_mut().zip(&counts) {
            let (part, after) = rest.split_at(count as usize);
            all.extend_from_slice(part);
            rest = after;
        }
        first += most;
    }
    all
}

struct RankExchange(Arc<Ranks>);

impl Exchange for RankExchange {
    fn place(&self) -> [usize; 2] {
        [self.0.rank, self.0.count]
    }

    fn all_gather(&mut self, given: Vec<u8>) -> Result<Arc<Vec<Vec<u8>>>> {
        let (send, all) = channel();
        self.0.ask(Request::AllGather(given, send))?;
        all.recv().map(Arc::new).map_err(|_| left())
    }
}

/// The members of the other processes, as the first reaches them.
pub(super) struct OnRanks(Arc<Ranks>);

impl OnRanks {
    /// Each answers when its member is made.
    ///
    /// # Errors
    /// Processes that are gone.
    pub fn start(
        ranks: &Arc<Ranks>,
        data: &MemberData,
        own: Vec<MemberShare>,
    ) -> Result<(Self, Box<dyn Exchange>)> {
        for rank in 1..ranks.count {
            ranks.send(rank, vec![1])?;
        }
        ranks.broadcast(written(data)?)?;
        for (rank, own) in (1..).zip(own) {
            ranks.send(rank, written(&own)?)?;
        }
        let seat = Box::new(RankExchange(Arc::clone(ranks)));
        Ok((Self(Arc::clone(ranks)), seat))
    }
}

impl Others for OnRanks {
    fn ask(&mut self, commands: Vec<Command>) -> Result<()> {
        for (rank, command) in (1..).zip(commands) {
            self.0.send(rank, written(&command)?)?;
        }
        Ok(())
    }

    fn ask_all(&mut self, command: &Command) -> Result<()> {
        let message = written(command)?;
        for rank in 1..self.0.count {
            self.0.send(rank, message.clone())?;
        }
        Ok(())
    }

    fn answers(&mut self) -> Vec<Result<Reply>> {
        let ranks = &self.0;
        // Those that wait for one that has failed do not answer.
        let is_broken = ranks.broken.load(Ordering::Relaxed);
        let from = if is_broken { ranks.count } else { 1 };
        let answer = |rank| {
            let answer: std::result::Result<Reply, String> = read(&ranks.receive(rank)?)?;
            answer.map_err(Error::Device)
        };
        (from..ranks.count).map(answer).collect()
    }

    fn close(&mut self) {
        self.0.broken.store(true, Ordering::Relaxed);
    }
}

impl Drop for OnRanks {
    fn drop(&mut self) {
        if !self.0.broken.load(Ordering::Relaxed) {
            for rank in 1..self.0.count {
                let _ = self.0.send(rank, Vec::new());
            }
        }
    }
}
