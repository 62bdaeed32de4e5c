//! What each source has sent, and what it still has to send.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Problem;
use super::coupling::{CouplingRow, Targets};
use super::gather::LitRow;
use super::makers::RowKind;
use super::near::Sent;
use super::progress::Bound;
use super::row_maker::looks_closer;
use super::system::{Carrier, System};
use crate::constants::KIND_SKY;
use crate::vk::Device;

/// The system of the sources, and how far the elements have its light.
pub(super) struct Ledger {
    pub system: System,
    /// `[source]`
    pub sources: Vec<Drawn>,
    pub bound: Bound,
    /// See [`crate::mesh::near::NearPairs::shares`]; empty where nothing is carried.
    near_shares: Vec<f64>,
    /// Of the missing power at which the solution is done: what is to be left to undrawn sources.
    aim: f64,
}

/// Sources that are to be drawn, with the power that they have to send.
pub(super) struct Candidates {
    pub powers: Vec<(u32, f64)>,
    /// Of all of them.
    pub kind: RowKind,
}

/// The order of sources with their powers: those that differ by rounding alone are equal.
pub(super) fn strongest_first(a: &(u32, f64), b: &(u32, f64)) -> std::cmp::Ordering {
    let power = |(_, power): &(u32, f64)| *power as f32;
    power(b).total_cmp(&power(a)).then(a.0.cmp(&b.0))
}

/// A row that is kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// Of its form factors.
    pub scale: f32,
    /// Rows are added up in the order in which they were made.
    pub order: u32,
}

/// What has been done with a source.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Drawn {
    pub kind: RowKind,
    /// Its elements have a relief.
    pub relief: bool,
    /// It is a part of the sky.
    pub is_sky: bool,
    pub under_way: bool,
    /// Times that it was drawn.
    pub times: u32,
    /// Its row, where it is kept.
    pub row: Option<Kept>,
    pub emission_gathered: bool,
    /// Reflected radiosity that the elements have received.
    pub gathered: DVec3,
    /// Scale of the form factors through which the elements have received it.
    pub scale: Option<f32>,
    /// With a relief: what it sends has been corrected by direction.
    pub directed: bool,
}

/// Of the missing power at which the solution is done: what undrawn sources may lack, and what need
/// not be drawn again. With what sweeps and turns leave (`spine.rs`, `spine/settling.rs`) these sum
/// to less than 1; what is not gathered counts twice, with its first bounce.
const UNDRAWN: f64 = 0.74;
const UNGATHERED: f64 = 0.02;

/// Of [`UNDRAWN`] what drawing aims at first: carried light bounces, which adds to what is unshot.
const AIM: f64 = 0.95;

/// Sources of a batch, at least, where so many are left.
const FEWEST: usize = 4;

/// About the share of a relief's light that leaves in other directions than if it left evenly.
const UNEVEN: f64 = 0.1;

/// A source whose row carries the light of another lies beside it and faces as it does: how much a
/// unit of 1 − cos of the angle between the two counts as squared distance, internal units.
const TURNED: f64 = 0.05;

/// How often the importance of sources is lowered before the first is drawn, for those with rows.
const RESTORED_WEIGHINGS: usize = 8;

impl Ledger {
    /// Begins with the rows that there are, and with what is known of their coupling, by source and
    /// number of words.
    pub fn new(
        device: &Device,
        on: &Problem,
        bound: Bound,
        row: impl Fn(usize) -> Option<Kept>,
        mut coupling: impl FnMut(usize, usize) -> Option<CouplingRow>,
    ) -> Self {
        let list = &on.sources.list;
        let targets = Targets::new(&on.elements, list);
        let words = targets.words();
        let memory = on.settings.coupling_memory;
        let mut system = System::new(targets, list, memory, bound.importance());
        let looks = looks_closer(device, &on.settings);
        let drawn = |(s, strong): (usize, bool)| Drawn {
            kind: RowKind::new(&list[s], looks && strong),
            relief: on.sources.relief.contains(&s),
            is_sky: list[s].kind == KIND_SKY,
            row: row(s),
            ..Drawn::default()
        };
        let sources: Vec<Drawn> = on.strong().into_iter().enumerate().map(drawn).collect();
        for (s, drawn) in sources.iter().enumerate() {
            if drawn.row.is_some() {
                system.draw(s, coupling(s, words));
            }
        }
        let mut ledger = Self {
            system,
            sources,
            bound,
            near_shares: match on.settings.carries {
                true => on.near.shares(&on.elements, list),
                false => Vec::new(),
            },
            aim: AIM * UNDRAWN,
        };
        (0..RESTORED_WEIGHINGS).for_each(|_| ledger.weigh(on));
        ledger
    }

    /// Lowers the importance of sources. Relief may send to other places than its row says, which
    /// is of even light, and may reflect more of what it receives.
    pub fn weigh(&mut self, on: &Problem) {
        if !on.has_relief() {
            self.system.weigh();
        }
    }

    /// Sources that are to be drawn, with their unshot power, of one kind: the strong emitters,
    /// then other lights; after them all others, until little is left; then what still emits.
    pub fn undrawn(&self) -> Option<Candidates> {
        let (mut first, mut emitting, mut others) = (Vec::new(), Vec::new(), Vec::new());
        for (s, drawn) in self.sources.iter().enumerate() {
            if self.system.is_drawn(s) || drawn.under_way {
                continue;
            }
            let (power, emitted) = self.system.unshot_power(s);
            if power <= 0.0 {
                continue;
            }
            let candidate = (s as u32, power);
            if drawn.kind != RowKind::Common {
                first.push((drawn.kind, candidate));
            } else if emitted > 0.0 {
                emitting.push(candidate);
            } else {
                others.push(candidate);
            }
        }
        if let Some(kind) = first.iter().map(|(kind, _)| *kind).min() {
            let of_kind = first.into_iter().filter(|(of, _)| *of == kind);
            return Some(Candidates {
                powers: of_kind.map(|(_, candidate)| candidate).collect(),
                kind,
            });
        }
        let mut powers = emitting;
        others.sort_by(strongest_first);
        others.truncate(self.until_little(&others));
        powers.extend(others);
        (!powers.is_empty()).then_some(Candidates {
            powers,
            kind: RowKind::Common,
        })
    }

    /// How many of these, in this order, are to be drawn until little is left; none if it is.
    fn until_little(&self, sources: &[(u32, f64)]) -> usize {
        let missing = |s: &(u32, f64)| self.system.missing(s.0 as usize);
        let squared = |s: &(u32, f64)| self.system.unshot_squared(s.0 as usize);
        let (mut missed, mut squares) = (
            self.aim * self.bound.most_missing(),
            self.bound.most_squared(),
        );
        // From the weakest on, those that may be left.
        let left = sources.iter().rev().take_while(|s| {
            missed -= missing(s);
            squares -= squared(s);
            missed >= 0.0 && squares >= 0.0
        });
        let many = sources.len() - left.count();
        // What they reflect makes others strong: no batch is of very few.
        match many {
            0 => 0,
            many => many.max(FEWEST).min(sources.len()),
        }
    }

    /// Sources without rows that owe the elements light, with its power, unless little is left.
    pub fn owing(&self) -> Option<Candidates> {
        let owes = |(s, drawn): (usize, &Drawn)| {
            let loose = self.system.is_drawn(s) && drawn.row.is_none() && !drawn.under_way;
            let power = self.owed_power(s);
            (loose && power > 0.0).then_some((s as u32, power))
        };
        let mut owing: Vec<(u32, f64)> = self.sources.iter().enumerate().filter_map(owes).collect();
        owing.sort_by(|a, b| b.1.total_cmp(&a.1));
        // The last ones may keep what is little together.
        let mut kept_back = 0.0;
        while let Some(&(_, power)) = owing.last()
            && kept_back + power <= UNGATHERED * self.bound.stop_power()
        {
            kept_back += power;
            owing.pop();
        }
        let kind_of = |&(s, _): &(u32, f64)| self.sources[s as usize].kind;
        let kind = owing.iter().map(kind_of).min()?;
        owing.retain(|candidate| kind_of(candidate) == kind);
        Some(Candidates {
            powers: owing,
            kind,
        })
    }

    /// What a source has to send the elements: emitted and reflected radiosity.
    fn owed(&self, s: usize) -> (Vec3, DVec3) {
        let drawn = &self.sources[s];
        let emitted = match self.system.emission_is_shot(s) && !drawn.emission_gathered {
            true => self.system.emitted(s).as_vec3(),
            false => Vec3::ZERO,
        };
        let shot = self.system.shot(s) + self.system.carried(s);
        let reflected = shot - drawn.gathered;
        // What rounding to f32 has left is nothing.
        let rounding = f64::from(f32::EPSILON) * shot.abs();
        let reflected = DVec3::select(reflected.abs().cmpgt(rounding), reflected, DVec3::ZERO);
        (emitted, reflected)
    }

    fn owed_power(&self, s: usize) -> f64 {
        let drawn = &self.sources[s];
        let (emitted, reflected) = self.owed(s);
        let turned = match drawn.relief && !drawn.directed {
            true => UNEVEN * drawn.gathered.abs(),
            false => DVec3::ZERO,
        };
        let light = emitted.as_dvec3() + reflected.abs() + turned;
        self.system.area(s) * light.element_sum()
    }

    /// Lets rows that are kept carry the light of sources without rows, see [`System::carry`]: each
    /// by the row of the source beside it that faces most as it does. Without that all that such
    /// sources reflect is missing; with it, that light may arrive beside where it should.
    pub fn carry(&mut self, on: &Problem) {
        let list = &on.sources.list;
        let has_rows = |s: usize| self.sources[s].row.is_some() && self.system.has_row(s);
        let carries = |s: &usize| list[*s].is_surface() && has_rows(*s);
        // Relief sends by direction: it carries for relief.
        let (relief, plain): (Vec<usize>, Vec<usize>) = (0..list.len())
            .filter(carries)
            .partition(|&s| self.sources[s].relief);
        let is_dark = |s: usize| self.system.reflected(s) == DVec3::ZERO;
        let waits = |&s: &usize| list[s].is_surface() && !self.system.is_drawn(s) && !is_dark(s);
        let waiting: Vec<usize> = (0..list.len()).filter(waits).collect();
        let near = &self.near_shares;
        let found: Vec<_> = (waiting.par_iter())
            .map(|&s| {
                let apart = |c: usize| {
                    let turned = 1.0 - list[s].normal.dot(list[c].normal);
                    list[s].centroid.distance_squared(list[c].centroid) + TURNED * turned
                };
                let carriers = if self.sources[s].relief {
                    &relief
                } else {
                    &plain
                };
                let faces = |&&c: &&usize| list[s].normal.dot(list[c].normal) > 0.0;
                let nearest = carriers.iter().filter(faces).map(|&c| (apart(c), c));
                let (_, source) = nearest.min_by(|a, b| a.0.total_cmp(&b.0))?;
                // Its near elements receive it part by part.
                let share = list[s].area * (1.0 - near[s]) / list[source].area;
                Some((s, Carrier { source, share }))
            })
            .collect();
        for (s, carrier) in found.into_iter().flatten() {
            self.system.carry(s, carrier);
        }
    }

    /// Of [`Self::missing`], what sources lack that were not drawn.
    pub fn undrawn_missing(&self) -> f64 {
        let undrawn = (0..self.sources.len()).filter(|&s| !self.system.is_drawn(s));
        undrawn.map(|s| self.system.missing(s)).sum()
    }

    /// Whether undrawn sources lack more than they may, now that their light is carried: then less
    /// is to be left to them.
    pub fn lacks(&mut self) -> bool {
        let missing = self.undrawn_missing();
        let most = UNDRAWN * self.bound.most_missing();
        if missing <= most {
            return false;
        }
        self.aim *= AIM * most / missing;
        true
    }

    /// What each source has sent to the elements through its row; none of one that sent nothing.
    pub fn sent(&self, on: &Problem) -> Vec<Option<Sent>> {
        let sent = |(s, drawn): (usize, &Drawn)| {
            Some(Sent {
                emission: drawn.emission_gathered,
                // What its row carries for others is not of its own members.
                reflected: drawn.gathered - self.system.carried(s),
                // A source that was not drawn has sent nothing: its parts send all that they have.
                scale: (drawn.scale.map(f64::from)).or(on.settings.carries.then_some(1.0))?,
            })
        };
        self.sources.iter().enumerate().map(sent).collect()
    }

    /// What a source has to send through its row.
    pub fn to_send(&self, s: usize, scale: f32, by_direction: bool) -> Option<LitRow> {
        let (emitted, reflected) = self.owed(s);
        let reflected = reflected.as_vec3();
        let drawn = &self.sources[s];
        let turns = drawn.relief && by_direction;
        if emitted == Vec3::ZERO && reflected == Vec3::ZERO && !turns {
            return None;
        }
        // Light of the sky, which reflects none, counts as indirect.
        let (emitted, reflected) = match drawn.is_sky {
            true => (Vec3::ZERO, emitted),
            false => (emitted, reflected),
        };
        Some(LitRow {
            source: s as u32,
            scale,
            emitted,
            reflected,
        })
    }

    /// Notes that the elements have what a row has sent.
    pub fn sent_by(&mut self, lit: &LitRow) {
        let s = lit.source as usize;
        let drawn = &mut self.sources[s];
        // As it was rounded, so that nothing is lost.
        if !drawn.is_sky {
            drawn.gathered += lit.reflected.as_dvec3();
        }
        drawn.scale = Some(lit.scale);
        drawn.emission_gathered |= self.system.emission_is_shot(s);
        drawn.directed |= drawn.relief && drawn.times > 1;
    }

    /// Whether a source emits that is neither drawn nor under way.
    pub fn lacks_emitters(&self) -> bool {
        let waits = |(s, drawn): (usize, &Drawn)| {
            !self.system.is_drawn(s) && !drawn.under_way && self.system.unshot_power(s).1 > 0.0
        };
        self.sources.iter().enumerate().any(waits)
    }

    /// As [`Self::to_send`], but only what a source emits as direct light.
    pub fn emitted_to_send(&self, s: usize, scale: f32) -> Option<LitRow> {
        let (emitted, _) = self.owed(s);
        if emitted == Vec3::ZERO || self.sources[s].is_sky {
            return None;
        }
        Some(LitRow {
            source: s as u32,
            scale,
            emitted,
            reflected: Vec3::ZERO,
        })
    }

    /// What sources without rows owe to the elements, by source and colour, with its first bounce:
    /// it is in no element's light yet, though the system takes it for shot.
    fn owed_by_loose(&self) -> impl Iterator<Item = (usize, DVec3)> {
        let loose = |s: &usize| self.system.is_drawn(*s) && self.sources[*s].row.is_none();
        (0..self.sources.len()).filter(loose).map(|s| {
            let (emitted, reflected) = self.owed(s);
            let light = emitted.as_dvec3() + reflected.abs();
            (s, 2.0 * self.system.area(s) * light)
        })
    }

    /// Power that is in no element's light yet, nor bounced: the residual of the system, and what
    /// is owed to the elements.
    pub fn unshot(&self) -> f64 {
        let owed: f64 = self
            .owed_by_loose()
            .map(|(_, power)| power.element_sum())
            .sum();
        self.system.unshot().all + owed
    }

    /// Power that the elements lack for it, at most.
    pub fn missing(&self) -> f64 {
        let owed = |(s, power): (usize, DVec3)| power.dot(self.system.importance(s));
        let owed: f64 = self.owed_by_loose().map(owed).sum();
        let unshot = (0..self.sources.len()).map(|s| self.system.missing(s));
        unshot.sum::<f64>() + owed
    }

    /// Unshot power by colour.
    pub fn unshot_by_colour(&self) -> DVec3 {
        let left = |s: usize| {
            let emitted = match self.system.emission_is_shot(s) {
                true => DVec3::ZERO,
                false => self.system.emitted(s),
            };
            let reflected = self.system.reflected(s) - self.system.shot(s);
            (emitted + reflected) * self.system.area(s)
        };
        (0..self.sources.len()).map(left).sum()
    }

    /// The row of each source, if it is kept.
    pub fn rows(&self) -> Vec<Option<Kept>> {
        self.sources.iter().map(|drawn| drawn.row).collect()
    }
}
