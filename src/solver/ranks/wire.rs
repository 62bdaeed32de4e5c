//! The thread of a process that calls MPI.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, Root, Source};
use mpi::{Rank, Tag};

/// What the thread that calls MPI is asked.
pub(super) enum Request {
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
pub(super) const ASKED: Tag = 1;

/// Bytes of a message, at most: MPI counts them in 31 bits.
const PIECE: usize = 1 << 28;

/// Between two looks for a message.
const SHORTEST_WAIT: Duration = Duration::from_micros(100);
const LONGEST_WAIT: Duration = Duration::from_millis(1);

/// Between two calls of MPI while nothing is asked, once nothing was given for so long.
const PROGRESS: Duration = Duration::from_millis(10);
const SOON: Duration = Duration::from_millis(20);

/// Bytes that may be given and not yet taken, of which a gift may take a share: there are
/// [`crate::solver::makers`]'s `UNDER_WAY` rounds of a kind at most.
const ROOM: usize = 1 << 30;
pub(super) const MOST_GIVEN: usize = ROOM / 8;
/// What it takes to send anything.
pub(super) const LEAST_GIVEN: usize = 1 << 10;

/// Calls MPI for what is asked, until it is to end.
pub(super) fn answer(universe: &mut Universe, asked: &Receiver<Request>) {
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
