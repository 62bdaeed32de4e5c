//! Members in other processes, which `mpirun` starts, a device each.
//!
//! The first process reads, solves and writes; each other one does what it is asked, from scene to
//! scene, until the first has ended. All calls of MPI are made by one thread a process. It waits
//! for what is asked without using its core, since a software device may need it.

mod wire;

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use mpi::traits::Communicator;
use mpi::{Tag, Threading};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::devices::started_together;
use super::exchange::{Exchange, Gift, Gifts};
use super::member::Member;
use super::messages::{Command, MemberData, MemberShare, Reply};
use super::near_search::{Found, NearSearch};
use super::team::Others;
use crate::error::{Error, Result};
use crate::vk::Device;
use wire::{ASKED, LEAST_GIVEN, MOST_GIVEN, Request, answer};

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

/// What a process is to begin; nothing where it is to end.
const SEARCH: u8 = 1;
const BAKE: u8 = 2;

impl Ranks {
    /// Joins the other processes; none where this one was started alone. Before anything else runs:
    /// MPI sets variables of the environment, which others may not read meanwhile.
    ///
    /// # Errors
    /// An MPI that does not start, or is another than that of `mpirun`.
    pub fn join() -> Result<Option<Self>> {
        let started = started_together();
        if started < 2 {
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
        if count != started {
            return Err(Error::Usage(format!(
                "{started} processes were started together, and MPI joins {count} of them: use \
                 the mpirun of the MPI that this program was built with"
            )));
        }
        let ranks = Self {
            requests: Mutex::new(requests),
            thread: Mutex::new(Some(thread)),
            rank,
            count,
            local,
            broken: AtomicBool::new(false),
        };
        Ok(Some(ranks))
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
        loop {
            match self.receive(0)?[..] {
                [] => return Ok(()),
                [SEARCH] => {
                    self.search_own()?;
                    continue;
                }
                _ => {}
            }
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
    }

    /// Finds the near pairs of its own sources.
    fn search_own(&self) -> Result<()> {
        let search: NearSearch = read(&self.broadcast(Vec::new())?)?;
        self.send(0, written(&search.find([self.rank, self.count]))?)
    }

    /// Lets the other processes search, and collects what they have found when this one has found
    /// its `own`.
    ///
    /// # Errors
    /// Processes that are gone.
    pub(super) fn search<T>(
        &self,
        search: NearSearch,
        own: impl FnOnce() -> T,
    ) -> Result<(T, Vec<Found>)> {
        for rank in 1..self.count {
            self.send(rank, vec![SEARCH])?;
        }
        let message = written(&search)?;
        drop(search);
        self.broadcast(message)?;
        let own = own();
        let found = (1..self.count).map(|rank| read(&self.receive(rank)?));
        Ok((own, found.collect::<Result<_>>()?))
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
            ranks.send(rank, vec![BAKE])?;
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
