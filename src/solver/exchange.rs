//! How the members of a team give each other what all need.

use std::collections::HashMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use crate::error::{Error, Result};

/// What is given: rounds of one kind follow one another, whatever is given of the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Gift {
    /// Item buffers.
    Items,
    /// What sources with a relief send by direction.
    Exits,
}

/// What each member has given, `[member]`.
pub(super) type Gifts = Vec<Vec<u8>>;

/// A member's way to all others. Each gives something in each round; nobody waits for others to
/// give, but only to collect.
pub(super) trait Exchange: Send {
    /// Its number, and how many there are.
    fn place(&self) -> [usize; 2];

    /// Gives something to all in the next round.
    ///
    /// # Errors
    /// Another member has failed.
    fn give(&mut self, gift: Gift, given: Vec<u8>) -> Result<()>;

    /// What each has given in the oldest round that was not collected.
    ///
    /// # Errors
    /// As [`Self::give`].
    fn collect(&mut self, gift: Gift) -> Result<Gifts>;
}

/// Where the threads of a process meet.
pub(super) struct Meeting {
    members: usize,
    table: Mutex<Table>,
    changed: Condvar,
}

#[derive(Default)]
struct Table {
    /// `[member]`
    rounds: HashMap<(Gift, u64), Vec<Option<Vec<u8>>>>,
    /// How many have collected a round.
    collected: HashMap<(Gift, u64), usize>,
    /// A member has failed: nobody is waited for.
    closed: bool,
}

impl Meeting {
    pub fn new(members: usize) -> Arc<Self> {
        Arc::new(Self {
            members,
            table: Mutex::default(),
            changed: Condvar::new(),
        })
    }

    /// The place of one of its members.
    pub fn seat(self: &Arc<Self>, member: usize) -> Seat {
        Seat {
            meeting: Arc::clone(self),
            member,
            given: HashMap::new(),
            collected: HashMap::new(),
        }
    }

    /// A member has failed: nobody waits any more.
    pub fn close(&self) {
        self.table().closed = true;
        self.changed.notify_all();
    }

    fn table(&self) -> MutexGuard<'_, Table> {
        self.table.lock().unwrap_or_else(|e| e.into_inner())
    }
}

/// The way to the other members as it is lent; none where a member is alone.
pub(super) type Lent<'a> = Option<&'a mut (dyn Exchange + 'static)>;

/// One member's; however it ends, nobody waits for it for ever.
pub(super) struct Seat {
    meeting: Arc<Meeting>,
    member: usize,
    /// Rounds so far.
    given: HashMap<Gift, u64>,
    collected: HashMap<Gift, u64>,
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

/// The next number of a row.
fn next(numbers: &mut HashMap<Gift, u64>, gift: Gift) -> u64 {
    let next = numbers.entry(gift).or_default();
    *next += 1;
    *next
}

impl Exchange for Seat {
    fn place(&self) -> [usize; 2] {
        [self.member, self.meeting.members]
    }

    fn give(&mut self, gift: Gift, given: Vec<u8>) -> Result<()> {
        let key = (gift, next(&mut self.given, gift));
        let mut table = self.meeting.table();
        let members = self.meeting.members;
        let round = table
            .rounds
            .entry(key)
            .or_insert_with(|| vec![None; members]);
        round[self.member] = Some(given);
        self.meeting.changed.notify_all();
        Ok(())
    }

    fn collect(&mut self, gift: Gift) -> Result<Gifts> {
        let key = (gift, next(&mut self.collected, gift));
        let meeting = &self.meeting;
        let mut table = meeting.table();
        loop {
            let round = table.rounds.get(&key);
            let all = round.and_then(|round| round.iter().cloned().collect::<Option<Gifts>>());
            if let Some(all) = all {
                let collected = table.collected.entry(key).or_default();
                *collected += 1;
                if *collected == meeting.members {
                    table.rounds.remove(&key);
                    table.collected.remove(&key);
                }
                return Ok(all);
            }
            if table.closed {
                return Err(other_failed());
            }
            table = meeting
                .changed
                .wait(table)
                .unwrap_or_else(|e| e.into_inner());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rounds are given before the first is collected, and another kind between.
    #[test]
    fn all_collect_what_each_gives_round_by_round() {
        let meeting = Meeting::new(3);
        let given = |member: usize, round: usize| vec![member as u8; round % 5];
        let exits = |member: usize, round: usize| vec![member as u8, round as u8];
        std::thread::scope(|scope| {
            for member in 0..3 {
                let mut seat = meeting.seat(member);
                scope.spawn(move || {
                    seat.give(Gift::Items, given(member, 0))
                        .expect("it is given");
                    for round in 0..200 {
                        seat.give(Gift::Items, given(member, round + 1))
                            .expect("it is given");
                        seat.give(Gift::Exits, exits(member, round))
                            .expect("it is given");
                        let all = seat.collect(Gift::Items).expect("all give");
                        let expected: Gifts = (0..3).map(|of| given(of, round)).collect();
                        assert_eq!(all, expected, "round {round}");
                        let all = seat.collect(Gift::Exits).expect("all give");
                        let expected: Gifts = (0..3).map(|of| exits(of, round)).collect();
                        assert_eq!(all, expected, "round {round}");
                    }
                });
            }
        });
    }

    #[test]
    fn nobody_waits_for_one_that_has_failed() {
        let meeting = Meeting::new(2);
        let (mut first, second) = (meeting.seat(0), meeting.seat(1));
        let waiting = std::thread::spawn(move || {
            first.give(Gift::Items, vec![1]).expect("it is given");
            first.collect(Gift::Items).is_err()
        });
        drop(second);
        assert!(waiting.join().expect("it ends"));
    }
}
