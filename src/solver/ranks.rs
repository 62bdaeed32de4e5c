//! Members in other processes, which `mpirun` starts, a device each.
//!
//! The first process reads, solves and writes; each other one does what it is asked, from scene to
//! scene, until the first has ended. All calls of MPI are made by one thread a process. It waits
//! for what is asked without using its core, since a software device may need it.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, Root, Source};
use mpi::{Rank, Tag, Threading};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::devices::started_together;
use super::exchange::{Exchange, Gift, Gifts};
use super::member::Member;
use super::messages::{Command, MemberData, MemberShare, Reply};
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
    Receive(usize, Tag, Sender<Vec<u8>>),
    /// To all others.
    Give(Tag, Vec<u8>),
    /// To all others, or from the first.
    Broadcast(Vec<u8>, Sender<Vec<u8>>),
    Abort,
    End,
}

/// Of what is asked and answered; those of gifts follow.
const ASKED: Tag = 1;

/// Bytes of a message, at most: MPI counts them in 31 bits.
const PIECE: usize = 1 << 28;

/// Between two looks for a message.
const SHORTEST_WAIT: Duration = Duration::from_micros(20);
const LONGEST_WAIT: Duration = Duration::from_micros(500);

/// Between two calls of MPI while nothing is asked, once nothing was given for so long.
const PROGRESS: Duration = Duration::from_millis(1);
const SOON: Duration = Duration::from_millis(20);

/// Bytes that may be given and not yet taken, of which a gift may take a share: there are
/// [`super::makers::UNDER_WAY`] rounds of a kind at most.
const ROOM: usize = 1 << 30;
const MOST_GIVEN: usize = ROOM / 8;
/// What it takes to send anything.
const LEAST_GIVEN: usize = 1 << 10;

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
            let Some((mut universe, _)) = mpi::initialize_with_threading(Threading::Funneled)
            else {
                return;
            };
            let world = universe.world();
            let local = world.split_shared(world.rank()).rank();
            let place = [world.rank(), world.size(), local].map(|number| number as usize);
            if joined.send(place).is_ok() {
                answer(&mut universe, &asked);
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
            let exchange = Box::new(RankExchange::new(self));
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
                let is_answered = command.is_answered();
                // Others wait for what this one gives them then.
                let is_awaited = matches!(command, Command::Submit(_) | Command::Gather(_));
                let mut answer = member.run(command);
                if is_awaited {
                    answer = Ok(self.or_all_end(answer));
                }
                if is_answered {
                    self.answer(answer)?;
                }
            }
        }
        Ok(())
    }

    /// What has been done; or all processes end, after a line that says why.
    fn or_all_end<T>(&self, done: Result<T>) -> T {
        done.unwrap_or_else(|error| {
            tracing::error!("rank {}: {error}", self.rank);
            self.abort()
        })
    }

    /// Whether others may wait for one that has failed: only [`Self::abort`] ends them then.
    pub fn is_broken(&self) -> bool {
        self.broken.load(Ordering::Relaxed)
    }

    fn answer(&self, answer: Result<Reply>) -> Result<()> {
        let rank = self.rank;
        let answer = answer.map_err(|error| format!("rank {rank}: {error}"));
        self.send(0, written(&answer)?)
    }

    /// Lets the other processes end, and leaves them.
    pub fn end(&self) {
        if self.is_broken() {
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
        self.receive_with(from, ASKED)
    }

    fn receive_with(&self, from: usize, tag: Tag) -> Result<Vec<u8>> {
        let (send, message) = channel();
        self.ask(Request::Receive(from, tag, send))?;
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
fn answer(universe: &mut Universe, asked: &Receiver<Request>) {
    let world = universe.world();
    // Pages of it that nothing is written to take no memory.
    universe.set_buffer_size(ROOM);
    let mut given = None;
    loop {
        // What was given goes on its way while MPI is called, and others wait for it at first.
        let is_new = given.is_some_and(|given: Instant| given.elapsed() < SOON);
        let wait = if is_new { SHORTEST_WAIT } else { PROGRESS };
        let request = match asked.recv_timeout(wait) {
            Ok(request) => request,
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                let _ = world.any_process().immediate_probe_with_tag(ASKED);
                continue;
            }
        };
        match request {
            Request::Send(to, message) => {
                let to = world.process_at_rank(to as Rank);
                let length = (message.len() as u64).to_le_bytes();
                to.send_with_tag(&length[..], ASKED);
                for piece in message.chunks(PIECE) {
                    to.send_with_tag(piece, ASKED);
                }
            }
            Request::Receive(from, tag, to) => drop(to.send(receive(&world, from, tag))),
            Request::Give(tag, message) => {
                give(&world, tag, &message);
                given = Some(Instant::now());
            }
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
            Request::Abort => world.abort(2),
            Request::End => return,
        }
    }
}

/// The next message from a process. Looks for it again and again: the calls of MPI that wait use
/// their core.
fn receive(world: &SimpleCommunicator, from: usize, tag: Tag) -> Vec<u8> {
    let from = world.process_at_rank(from as Rank);
    let mut wait = SHORTEST_WAIT;
    while from.immediate_probe_with_tag(tag).is_none() {
        thread::sleep(wait);
        wait = (2 * wait).min(LONGEST_WAIT);
    }
    let mut length = [0u8; 8];
    from.receive_into_with_tag(&mut length[..], tag);
    let mut message = vec![0; u64::from_le_bytes(length) as usize];
    for piece in message.chunks_mut(PIECE) {
        from.receive_into_with_tag(piece, tag);
    }
    message
}

/// Sends to all others, without waiting for them.
fn give(world: &SimpleCommunicator, tag: Tag, message: &[u8]) {
    let length = (message.len() as u64).to_le_bytes();
    for rank in (0..world.size()).filter(|&rank| rank != world.rank()) {
        let to = world.process_at_rank(rank);
        to.buffered_send_with_tag(&length[..], tag);
        for piece in message.chunks(PIECE) {
            to.buffered_send_with_tag(piece, tag);
        }
    }
}

struct RankExchange {
    ranks: Arc<Ranks>,
    /// What this one has given and not collected, of each kind.
    own: [VecDeque<Vec<u8>>; 2],
}

impl RankExchange {
    fn new(ranks: &Arc<Ranks>) -> Self {
        Self {
            ranks: Arc::clone(ranks),
            own: Default::default(),
        }
    }
}

fn tag_of(gift: Gift) -> Tag {
    ASKED + 1 + gift as Tag
}

impl Exchange for RankExchange {
    fn place(&self) -> [usize; 2] {
        [self.ranks.rank, self.ranks.count]
    }

    fn give(&mut self, gift: Gift, given: Vec<u8>) -> Result<()> {
        if (given.len() + LEAST_GIVEN) * (self.ranks.count - 1) > MOST_GIVEN {
            let what = "item buffers are too large to be sent: fewer pixels by --hemicube";
            return Err(Error::Usage(what.into()));
        }
        self.own[gift as usize].push_back(given.clone());
        self.ranks.ask(Request::Give(tag_of(gift), given))
    }

    fn collect(&mut self, gift: Gift) -> Result<Gifts> {
        let own = self.own[gift as usize].pop_front().unwrap_or_default();
        let of = |rank| match rank == self.ranks.rank {
            true => Ok(own.clone()),
            false => self.ranks.receive_with(rank, tag_of(gift)),
        };
        (0..self.ranks.count).map(of).collect()
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
        let seat = Box::new(RankExchange::new(ranks));
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
        let from = if ranks.is_broken() { ranks.count } else { 1 };
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
        if !self.0.is_broken() {
            for rank in 1..self.0.count {
                let _ = self.0.send(rank, Vec::new());
            }
        }
    }
}
