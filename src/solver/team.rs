//! The members of a bake, as the first of them asks them: each does the same for its share of the
//! elements, and what they answer is put together here.
//!
//! Which member an element is of changes nothing of what it receives, and sums over elements are
//! added up parcel by parcel. So members of one kind of device and driver give the same bytes,
//! however many they are, where all rows find room.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

use glam::{DVec3, Vec3};

use super::coupling::Targets;
use super::devices::Crew;
use super::exchange::other_failed;
use super::gather::LitRow;
use super::joined::{Joined, put};
use super::makers::{Batch, RowKind, UNDER_WAY};
use super::member::Member;
use super::messages::{Command, Reply, RestoredRows, kept_state, state_words};
use super::near::ByLight;
use super::problem::{Problem, Relit};
use super::relief_light::ReliefSums;
use super::rows::{Made, Row, RowPart, Stages};
use super::shares::{Parcels, Share};
use crate::error::{Error, Result};
use crate::mesh::sources::Source;
use crate::passes::fresh_rows::RowShape;
use crate::passes::scene_data::{LitSources, SceneData};
use crate::passes::types::KeptState;
use crate::passes::words::Words;

/// The members beside the first, as it reaches them. Each does what it is asked, in that order.
pub(super) trait Others: Send {
    /// Asks each.
    ///
    /// # Errors
    /// One that does not listen.
    fn ask(&mut self, commands: Vec<Command>) -> Result<()>;

    /// Asks all the same.
    ///
    /// # Errors
    /// As [`Self::ask`].
    fn ask_all(&mut self, command: &Command) -> Result<()>;

    /// What each answers.
    fn answers(&mut self) -> Vec<Result<Reply>>;

    /// None of them waits for another any more.
    fn close(&mut self);
}

/// What makes rows, keeps them, and brings light by them.
pub(super) struct Team {
    first: Mutex<Member>,
    /// None where the first is alone.
    others: Option<Mutex<Box<dyn Others>>>,
    joined: Joined,
    elements: usize,
    sources: usize,
    /// Room for kept rows, `[member]`: words of a chunk, and chunks.
    pub room: Vec<[u32; 2]>,
    /// Names with drivers, `[member]`.
    pub devices: Vec<[String; 2]>,
    /// Sources of a batch of each kind, at most; none before the first is drawn.
    prepared: Option<Vec<(RowKind, usize)>>,
    /// Oldest first.
    under_way: VecDeque<UnderWay>,
}

struct UnderWay {
    kind: RowKind,
    /// Rows that were made before; those of them without room are drawn again.
    recorded: Option<Vec<Row>>,
    is_drawn: bool,
}

/// A batch that was taken in.
pub(super) struct Taken {
    pub kind: RowKind,
    pub made: Made,
    /// Whether it was made before.
    pub recorded: bool,
}

impl Team {
    /// A member a device of the crew. `restored`: the rows that each is to begin with, by their
    /// shares.
    ///
    /// # Errors
    /// A device that fails, or without the memory.
    pub fn new(
        crew: &Crew,
        on: &Problem,
        scene: SceneData,
        targets: &Targets,
        restored: impl FnOnce(&[Arc<Share>]) -> Option<Vec<RestoredRows>>,
    ) -> Result<Self> {
        let data = Arc::new(on.member_data(scene));
        let members = on.sources.list.iter().map(Source::members);
        let parcels = Parcels::new(members, data.scene.shape);
        let normalises = on.settings.normalise;
        let (joined, mut own) = Joined::new(&parcels, &crew.weights()?, targets, normalises);
        for (own, restored) in own
            .iter_mut()
            .zip(restored(&joined.shares).into_iter().flatten())
        {
            own.restored = Some(restored);
        }
        let mut own = own.into_iter();
        let of_first = own.next().expect("a team has a member");
        let device = crew.first()?;
        let (first, others) = match crew.others(&data, own.collect())? {
            None => (Member::new(device, &data, of_first, None)?, None),
            Some((mut others, seat)) => {
                let first = Member::new(device, &data, of_first, Some(seat));
                (all_made(first, &mut others)?, Some(others))
            }
        };
        let mut team = Self {
            first: Mutex::new(first),
            others: others.map(Mutex::new),
            joined,
            elements: on.elements.len(),
            sources: on.sources.list.len(),
            room: Vec::new(),
            devices: Vec::new(),
            prepared: None,
            under_way: VecDeque::new(),
        };
        for reply in team.ask(Command::Room)? {
            let Reply::Room(room, device) = reply else {
                return Err(strange());
            };
            team.room.push(room);
            team.devices.push(device);
        }
        Ok(team)
    }

    /// The member of this thread.
    pub fn first(&self) -> MutexGuard<'_, Member> {
        self.first.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Asks all members the same, and returns what each answers.
    fn ask(&self, command: Command) -> Result<Vec<Reply>> {
        match &self.others {
            None => Ok(vec![self.first().run(command)?]),
            Some(others) => {
                let mut others = others.lock().unwrap_or_else(|e| e.into_inner());
                others.ask_all(&command)?;
                self.with_answers(&mut others, command)
            }
        }
    }

    /// Asks each member something of its own.
    fn ask_each(&self, commands: Vec<Command>) -> Result<Vec<Reply>> {
        let mut commands = commands.into_iter();
        let of_first = commands.next().ok_or_else(strange)?;
        let Some(others) = &self.others else {
            return Ok(vec![self.first().run(of_first)?]);
        };
        let mut others = others.lock().unwrap_or_else(|e| e.into_inner());
        others.ask(commands.collect())?;
        self.with_answers(&mut others, of_first)
    }

    /// What the first answers, and the others, which have been asked.
    fn with_answers(&self, others: &mut Box<dyn Others>, of_first: Command) -> Result<Vec<Reply>> {
        let is_answered = of_first.is_answered();
        let mut first = self.first();
        let own = first.run(of_first);
        if own.is_err() {
            others.close();
        }
        let mut replies = vec![own];
        if is_answered {
            replies.extend(others.answers());
        }
        first_error(replies)
    }

    /// Names of the devices but the first.
    pub fn other_devices(&self) -> Vec<String> {
        self.devices
            .iter()
            .skip(1)
            .map(|[name, _]| name.clone())
            .collect()
    }

    /// Whether anything can be kept.
    pub fn keeps(&self) -> bool {
        self.room.iter().all(|[_, chunks]| *chunks > 0)
    }

    /// Whether rows of a kind are made other than those of all others.
    pub fn has(&self, kind: RowKind) -> bool {
        let is_of = |(of, _): &(RowKind, usize)| *of == kind;
        self.prepared
            .as_ref()
            .is_some_and(|prepared| prepared.iter().any(is_of))
    }

    /// Makes ready to draw sources of these kinds, if that was not done.
    ///
    /// # Errors
    /// A device that fails, or without the memory.
    pub fn prepare(&mut self, kinds: impl FnOnce() -> Vec<RowKind>) -> Result<()> {
        if self.prepared.is_some() {
            return Ok(());
        }
        let mut fewest: Option<Vec<(RowKind, usize)>> = None;
        for reply in self.ask(Command::Prepare(kinds()))? {
            let Reply::Prepared(slots) = reply else {
                return Err(strange());
            };
            let fewest = fewest.get_or_insert_with(|| slots.clone());
            for ((_, fewest), (_, slots)) in fewest.iter_mut().zip(slots) {
                *fewest = slots.min(*fewest);
            }
        }
        self.prepared = fewest;
        Ok(())
    }

    /// Sources of a batch of one kind, at most.
    pub fn slots(&self, kind: RowKind) -> usize {
        let prepared = self.prepared.as_deref().unwrap_or_default();
        let of = |kind| {
            prepared
                .iter()
                .find(|(of, _)| *of == kind)
                .map(|(_, slots)| *slots)
        };
        of(kind).or(of(RowKind::Common)).unwrap_or(0)
    }

    /// Whether another batch can begin.
    pub fn has_room(&self) -> bool {
        self.under_way.len() < UNDER_WAY
    }

    /// Whether a batch is under way.
    pub fn is_drawing(&self) -> bool {
        !self.under_way.is_empty()
    }

    /// Begins a batch, of which rows may be `recorded`.
    pub fn submit(&mut self, batch: Batch, recorded: Option<Vec<Row>>) -> Result<()> {
        let kind = batch.kind;
        let sources: Vec<u32> = match &recorded {
            None => batch.sources,
            Some(rows) => {
                let loose = rows.iter().filter(|row| row.places.is_none());
                loose.map(|row| row.source).collect()
            }
        };
        let is_drawn = !sources.is_empty();
        if is_drawn {
            self.ask(Command::Submit(Batch { sources, kind }))?;
        }
        self.under_way.push_back(UnderWay {
            kind,
            recorded,
            is_drawn,
        });
        Ok(())
    }

    /// The oldest batch under way, kept; none if there is none.
    pub fn take(&mut self, sources: &[Source]) -> Result<Option<Taken>> {
        let Some(batch) = self.under_way.pop_front() else {
            return Ok(None);
        };
        let kind = batch.kind;
        let mut made = match batch.is_drawn {
            true => self.take_drawn(sources)?,
            false => Made {
                rows: Vec::new(),
                stages: Stages::default(),
                states: None,
                sent: 0,
            },
        };
        let recorded = batch.recorded.is_some();
        if let Some(rows) = batch.recorded {
            let mut drawn = made.rows.into_iter();
            let known = |row: Row| match row.places.is_some() {
                true => Some(row),
                false => drawn.next(),
            };
            made.rows = rows.into_iter().filter_map(known).collect();
        }
        Ok(Some(Taken {
            kind,
            made,
            recorded,
        }))
    }

    fn take_drawn(&self, sources: &[Source]) -> Result<Made> {
        let mut parts = Vec::new();
        for reply in self.ask(Command::Take)? {
            let Reply::Made(made) = reply else {
                return Err(strange());
            };
            parts.push(made);
        }
        let is_alone = parts.len() == 1;
        let mut stages = Stages::default();
        let (mut sent, mut states) = (0, Vec::new());
        let count = parts[0].rows.len();
        let mut rows: Vec<Vec<RowPart>> = vec![Vec::new(); count];
        for made in parts {
            stages += made.stages;
            states.push(kept_state(made.state));
            if !is_alone {
                sent += made.given + made.rows.iter().map(RowPart::bytes).sum::<u64>();
            }
            if made.rows.len() != count {
                return Err(strange());
            }
            for (row, part) in rows.iter_mut().zip(made.rows) {
                row.push(part);
            }
        }
        let row = |parts: &Vec<RowPart>| self.joined.row(parts, sources).ok_or_else(strange);
        Ok(Made {
            rows: rows.iter().map(row).collect::<Result<_>>()?,
            stages,
            states: Some(states),
            sent,
        })
    }

    /// Rows that are gathered at once, at most.
    pub fn most_rows(&self) -> usize {
        self.first().gathering.most
    }

    /// Brings what these send, which are no more than [`Self::most_rows`].
    ///
    /// # Errors
    /// A device that fails.
    pub fn gather(&self, rows: &[LitRow]) -> Result<()> {
        self.ask(Command::Gather(rows.to_vec())).map(drop)
    }

    /// Adds what relief receives of the parts of near sources.
    ///
    /// # Errors
    /// A device that fails.
    pub fn near(&self, light: ByLight<Vec<Vec3>>) -> Result<()> {
        let dark = |light: &[Vec3]| light.iter().all(|&of| of == Vec3::ZERO);
        if dark(&light.emitted) && dark(&light.reflected) {
            return Ok(());
        }
        self.ask(Command::Near(light)).map(drop)
    }

    /// Radiosity that each source reflects of what has been gathered.
    ///
    /// # Errors
    /// A device that fails.
    pub fn measure(&self) -> Result<Vec<DVec3>> {
        let mut all = vec![DVec3::ZERO; self.sources];
        for (m, reply) in self.ask(Command::Measure)?.into_iter().enumerate() {
            let Reply::Reflected(reflected) = reply else {
                return Err(strange());
            };
            for (&s, reflected) in self.joined.shares[m].sources.iter().zip(reflected) {
                all[s as usize] = reflected.as_dvec3();
            }
        }
        Ok(all)
    }

    /// Irradiance of each element, direct and indirect.
    ///
    /// # Errors
    /// A device that fails.
    pub fn irradiance(&self) -> Result<[Vec<Vec3>; 2]> {
        let replies = self.ask(Command::Irradiance)?;
        let mut all = [(); 2].map(|()| vec![Vec3::ZERO; self.elements]);
        for (share, reply) in self.joined.shares.iter().zip(replies) {
            let Reply::Irradiance(light) = reply else {
                return Err(strange());
            };
            put(&mut all, share, light);
        }
        Ok(all)
    }

    /// Irradiance as [`Self::irradiance`], and what elements with a relief hold.
    ///
    /// # Errors
    /// A device that fails.
    pub fn light(&self) -> Result<([Vec<Vec3>; 2], Option<ReliefSums>)> {
        let replies = self.ask(Command::Light)?;
        let mut all = [(); 2].map(|()| vec![Vec3::ZERO; self.elements]);
        let mut relief: Option<ReliefSums> = None;
        for (share, reply) in self.joined.shares.iter().zip(replies) {
            let Reply::Light(light, sums) = reply else {
                return Err(strange());
            };
            put(&mut all, share, light);
            match (&mut relief, sums) {
                (Some(all), Some(sums)) => all.append(sums),
                (all, sums) => *all = sums,
            }
        }
        Ok((all, relief))
    }

    /// Takes the light of the sources as they are now, and forgets all light, and the rows of
    /// `dropped`. Passes that draw are built again if they cannot draw these `kinds`.
    ///
    /// # Errors
    /// A device that fails.
    pub fn relight(
        &mut self,
        on: &Problem,
        relit: &Relit,
        dropped: Vec<u32>,
        kinds: &[RowKind],
    ) -> Result<()> {
        let fits = |&kind: &RowKind| kind == RowKind::Common || self.has(kind);
        let unprepared = relit.more_eyes || !kinds.iter().all(fits);
        if unprepared {
            self.prepared = None;
        }
        self.ask(Command::Relight {
            lit: LitSources::new(&on.sources.list),
            more_eyes: relit.more_eyes,
            dropped,
            unprepared,
        })
        .map(drop)
    }

    /// How far the chunks of each member are filled.
    ///
    /// # Errors
    /// A device that fails.
    pub fn states(&self) -> Result<Vec<KeptState>> {
        let state = |reply| match reply {
            Reply::State(state) => Ok(kept_state(state)),
            _ => Err(strange()),
        };
        self.ask(Command::State)?.into_iter().map(state).collect()
    }

    /// What was filled between two states, `[member]`.
    ///
    /// # Errors
    /// A device that fails.
    pub fn words(&self, filled: &[[KeptState; 2]]) -> Result<Vec<Words>> {
        let between = |states: &[KeptState; 2]| Command::Words(states.map(state_words));
        let words = |reply| match reply {
            Reply::Words(words) => Ok(words),
            _ => Err(strange()),
        };
        let replies = self.ask_each(filled.iter().map(between).collect())?;
        replies.into_iter().map(words).collect()
    }

    /// Goes on from these words, which [`Self::words`] gave, and the places of the rows in them,
    /// `[member]`.
    ///
    /// # Errors
    /// A device that fails.
    pub fn restore(
        &self,
        to: &[KeptState],
        words: Vec<Words>,
        places: Vec<Vec<[u32; 3]>>,
    ) -> Result<()> {
        let of_members = to.iter().zip(words).zip(places);
        let restore = |((&state, words), places)| Command::Restore {
            state: state_words(state),
            words,
            places,
        };
        self.ask_each(of_members.map(restore).collect()).map(drop)
    }

    /// All that is kept, `[member]`, with the shares.
    ///
    /// # Errors
    /// A device that fails.
    pub fn rows(&self) -> Result<Vec<(Arc<Share>, RestoredRows)>> {
        let replies = self.ask(Command::Rows)?;
        let rows = |(share, reply): (&Arc<Share>, Reply)| match reply {
            Reply::Rows(rows) => Ok((Arc::clone(share), rows)),
            _ => Err(strange()),
        };
        self.joined.shares.iter().zip(replies).map(rows).collect()
    }

    /// Words of a chunk where one member keeps rows of this shape, of all elements.
    pub fn whole_chunk_words(&self, shape: RowShape) -> u32 {
        match &self.room[..] {
            [[chunk_words, _]] => *chunk_words,
            _ => self.first().chunk_words(shape),
        }
    }

    /// The item buffers of the last batch that was drawn, `[row][slot][column]`.
    pub fn items(&self) -> Result<Vec<u32>> {
        self.first().items()
    }
}

/// Waits until all others are made too.
fn all_made(first: Result<Member>, others: &mut Box<dyn Others>) -> Result<Member> {
    if first.is_err() {
        others.close();
    }
    let made = others.answers().into_iter().map(|reply| reply.map(drop));
    let made: Vec<Result<()>> = made.collect();
    let first = first?;
    first_error(made)?;
    Ok(first)
}

/// All, or the error that was first: others only say that one has failed.
fn first_error<T>(all: Vec<Result<T>>) -> Result<Vec<T>> {
    let mut good = Vec::new();
    let mut error: Option<Error> = None;
    for one in all {
        match one {
            Ok(one) => good.push(one),
            Err(e) if error.is_none() || !is_of_another(&e) => error = Some(e),
            Err(_) => {}
        }
    }
    match error {
        None => Ok(good),
        Some(error) => Err(error),
    }
}

fn is_of_another(error: &Error) -> bool {
    error.to_string() == other_failed().to_string()
}

fn strange() -> Error {
    Error::Device("a device of several answers what it was not asked".into())
}
