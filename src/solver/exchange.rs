//! How the members of a team give each other what all need.

use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use crate::error::{Error, Result};

/// A member's way to all others.
pub(super) trait Exchange: Send {
    /// Its number, and how many there are.
    fn place(&self) -> [usize; 2];

    /// What each member gives, in their order; every one must call this as often.
    ///
    /// # Errors
    /// Another member has failed.
    fn all_gather(&mut self, given: Vec<u8>) -> Result<Arc<Vec<Vec<u8>>>>;
}

/// Where the threads of a process meet.
pub(super) struct Meeting {
    members: usize,
    round: Mutex<Round>,
    changed: Condvar,
}

#[derive(Default)]
struct Round {
    given: Vec<Option<Vec<u8>>>,
    /// What was given in the round that has ended, until all have taken it.
    all: Option<Arc<Vec<Vec<u8>>>>,
    taken: usize,
    /// A member has failed: nobody is waited for.
    closed: bool,
}

impl Meeting {
    pub fn new(members: usize) -> Arc<Self> {
        Arc::new(Self {
            members,
            round: Mutex::new(Round {
                given: vec![None; members],
                ..Round::default()
            }),
            changed: Condvar::new(),
        })
    }

    /// The place of one of its members.
    pub fn seat(self: &Arc<Self>, member: usize) -> Seat {
        Seat {
            meeting: Arc::clone(self),
            member,
        }
    }

    /// A member has failed: nobody waits any more.
    pub fn close(&self) {
        self.round().closed = true;
        self.changed.notify_all();
    }

    fn round(&self) -> MutexGuard<'_, Round> {
        self.round.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn wait<'a>(&self, round: MutexGuard<'a, Round>) -> MutexGuard<'a, Round> {
        self.changed.wait(round).unwrap_or_else(|e| e.into_inner())
    }
}

/// One member's; however it ends, nobody waits for it for ever.
pub(super) struct Seat {
    meeting: Arc<Meeting>,
    member: usize,
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.meeting.close();
    }
}

/// What those say who waited for a member that has failed.
pub(super) fn other_failed() -> Error {
    Error::Device("a device of several has failed".into())
}

impl Exchange for Seat {
    fn place(&self) -> [usize; 2] {
        [self.member, self.meeting.members]
    }

    fn all_gather(&mut self, given: Vec<u8>) -> Result<Arc<Vec<Vec<u8>>>> {
        let meeting = &self.meeting;
        let mut round = meeting.round();
        // The round before may not have been taken by all.
        while round.all.is_some() && !round.closed {
            round = meeting.wait(round);
        }
        if round.closed {
            return Err(other_failed());
        }
        round.given[self.member] = Some(given);
        if round.given.iter().all(Option::is_some) {
            let all = round.given.iter_mut().filter_map(Option::take).collect();
            round.all = Some(Arc::new(all));
            meeting.changed.notify_all();
        }
        while round.all.is_none() && !round.closed {
            round = meeting.wait(round);
        }
        let Some(all) = round.all.clone() else {
            return Err(other_failed());
        };
        round.taken += 1;
        if round.taken == meeting.members {
            (round.all, round.taken) = (None, 0);
            meeting.changed.notify_all();
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_get_what_each_gives_in_every_round() {
        let meeting = Meeting::new(3);
        let given = |member: usize, round: usize| vec![member as u8; round % 5];
        std::thread::scope(|scope| {
            for member in 0..3 {
                let mut seat = meeting.seat(member);
                scope.spawn(move || {
                    for round in 0..200 {
                        let all = seat.all_gather(given(member, round)).expect("all come");
                        let expected: Vec<_> = (0..3).map(|of| given(of, round)).collect();
                        assert_eq!(*all, expected, "round {round}");
                    }
                });
            }
        });
    }

    #[test]
    fn nobody_waits_for_one_that_has_failed() {
        let meeting = Meeting::new(2);
        let (mut first, second) = (meeting.seat(0), meeting.seat(1));
        let waiting = std::thread::spawn(move || first.all_gather(vec![1]).is_err());
        drop(second);
        assert!(waiting.join().expect("it ends"));
    }
}
