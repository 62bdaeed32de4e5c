//! Which device draws which source, where several do.
//!
//! Form factors do not depend on light, so that other devices draw sources before the first one chooses them. Who draws what is told by
//! a clock that counts work done instead of time passed: it is the same every run, whatever the devices' speed.

use std::collections::HashMap;

/// Work in drawings of a hemicube with its form factors: choosing the sources of a batch, a shot, and what a strong emitter sees.
/// Measured on lavapipe; where they are off, devices wait for one another, and nothing else changes.
const SELECT: f64 = 1.25;
const SHOT: f64 = 0.02;
const FINE: f64 = 2.0;
/// What is asked for at once waits until a device has drawn what it is at.
const LATE: f64 = 3.0;

/// A drawing that has been given to a device and is not yet taken.
struct Given {
    device: usize,
    done: f64,
}

/// Device 0 chooses sources and gathers, and draws where it has time; the others draw.
pub(super) struct Schedule {
    given: HashMap<u32, Given>,
    /// What device 0 has done, …
    now: f64,
    /// … strong emitters that it shoots before it takes what others draw, …
    ahead: f64,
    /// … drawings that were given to it and wait until they are chosen, …
    own: u32,
    /// … and its work beside drawing, over drawings taken.
    gathered: f64,
    taken: u64,
    /// When the others have done what they were given.
    busy: Vec<f64>,
}

impl Schedule {
    pub fn new(others: usize) -> Self {
        Self {
            given: HashMap::new(),
            now: 0.0,
            ahead: 0.0,
            own: 0,
            gathered: 0.0,
            taken: 0,
            busy: vec![0.0; others],
        }
    }

    /// The devices that draw the sources of a batch, which has so many shots in all.
    pub fn choose(&mut self, chosen: &[u32], shots: u32) -> Vec<usize> {
        self.ahead = 0.0;
        self.work(SELECT);
        let mut rows = vec![0.0; 1 + self.busy.len()];
        let devices = chosen
            .iter()
            .map(|source| match self.given.remove(source) {
                Some(Given { device: 0, .. }) => {
                    self.own -= 1;
                    rows[0] += 1.0;
                    0
                }
                Some(given) => {
                    rows[given.device] += f64::from(given.done > self.now);
                    given.device
                }
                None => {
                    let busy = |d: usize| d > 0 && self.busy[d - 1] > self.now;
                    let device =
                        least((0..rows.len()).map(|d| rows[d] + LATE * f64::from(busy(d))));
                    rows[device] += 1.0;
                    if device > 0 {
                        self.busy[device - 1] += 1.0;
                    }
                    device
                }
            })
            .collect();
        self.now += rows.iter().copied().fold(0.0, f64::max);
        let gathering = f64::from(shots) * SHOT;
        self.work(gathering);
        self.gathered += SELECT + gathering;
        self.taken += chosen.len() as u64;
        devices
    }

    /// Device 0 has shot so many strong emitters, and so many are left.
    pub fn emitters(&mut self, count: u32, left: u32) {
        self.work(SELECT + f64::from(count) * (FINE + SHOT));
        self.ahead = f64::from(left) * (FINE + SHOT);
    }

    /// Gives sources that are likely to be chosen next, in that order, until `most` are given: those that other devices are to draw now.
    pub fn foresee(
        &mut self,
        sources: impl IntoIterator<Item = u32>,
        most: usize,
    ) -> Vec<(usize, u32)> {
        let mut asked = Vec::new();
        let share = self.gathered / self.taken.max(1) as f64;
        for source in sources {
            if self.given.len() >= most {
                break;
            }
            if self.given.contains_key(&source) {
                continue;
            }
            let of_first =
                self.now + self.ahead + f64::from(self.own) + share * self.given.len() as f64;
            let other = least(self.busy.iter().copied());
            let device = if self.busy[other] < of_first {
                self.busy[other] += 1.0;
                asked.push((other + 1, source));
                other + 1
            } else {
                self.own += 1;
                0
            };
            let done = if device > 0 { self.busy[other] } else { 0.0 };
            self.given.insert(source, Given { device, done });
        }
        asked
    }

    /// Device 0 works; others that have nothing to do are idle.
    fn work(&mut self, work: f64) {
        self.now += work;
        for busy in &mut self.busy {
            *busy = busy.max(self.now);
        }
    }
}

/// Place of the least value, the first of equal ones.
fn least(values: impl Iterator<Item = f64>) -> usize {
    values
        .enumerate()
        .reduce(|a, b| if b.1 < a.1 { b } else { a })
        .map_or(0, |(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is given ahead of 16 a batch.
    const MOST: usize = 32 * 16;

    /// Batches of 16 that choose what was foreseen: how many sources each device draws.
    fn drawn(others: usize, shots: u32) -> Vec<u32> {
        let mut schedule = Schedule::new(others);
        let mut drawn = vec![0; 1 + others];
        let mut asked = HashMap::new();
        for batch in 0..100 {
            let chosen: Vec<u32> = (16 * batch..16 * (batch + 1)).collect();
            for (source, device) in chosen.iter().zip(schedule.choose(&chosen, shots)) {
                drawn[device] += 1;
                // What was asked of a device is taken from that one, and nothing is drawn twice.
                assert_eq!(asked.remove(source).unwrap_or(device), device);
            }
            let next = 16 * (batch + 1)..1600;
            for (device, source) in schedule.foresee(next, MOST) {
                assert!(device > 0 && asked.insert(source, device).is_none());
            }
            assert!(schedule.given.len() <= MOST);
        }
        drawn
    }

    #[test]
    fn devices_work_alike() {
        for (others, shots) in [(1, 16), (1, 160), (2, 16), (3, 100)] {
            let drawn = drawn(others, shots);
            let first = f64::from(drawn[0]) + 100.0 * (SELECT + SHOT * f64::from(shots));
            println!(
                "{others} others, {shots} shots a batch: drawn {drawn:?}, work of the first {first:.0}"
            );
            let all = drawn[1..].iter().map(|&d| f64::from(d)).chain([first]);
            let mean = all.clone().sum::<f64>() / (1 + others) as f64;
            // Where the first one has no more to do than its share beside drawing. It may wait for what it chooses before the
            // others have got ahead.
            assert!(all.into_iter().all(|work| (work / mean - 1.0).abs() < 0.1));
        }
    }

    /// What is drawn ahead lasts until the first device takes any of it.
    #[test]
    fn others_draw_while_strong_emitters_are_shot() {
        let mut schedule = Schedule::new(1);
        schedule.emitters(16, 180);
        let asked = schedule.foresee(0..1000, MOST).len();
        println!("{asked} of {MOST}");
        assert!(asked as f64 >= 180.0 * FINE);
    }

    #[test]
    fn a_first_device_that_has_enough_to_do_draws_little() {
        let drawn = drawn(1, 496);
        println!("{drawn:?}");
        assert!(drawn[0] < drawn[1] / 4);
    }
}
