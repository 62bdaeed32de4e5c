//! A member of a team: a device that holds the scene, finds the form factors of its share of the
//! elements, keeps them, and brings these elements their light.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;

use super::drawing::read_items;
use super::exchange::Exchange;
use super::gather::{Gathering, LitRow};
use super::makers::{Makers, RowKind};
use super::messages::{
    Command, MemberData, MemberShare, Reply, RestoredRows, kept_state, state_words,
};
use super::relief_light::ReliefSums;
use super::row_maker::RowParts;
use super::shares::Share;
use super::{Settings, VISIBILITY_MEMORY};
use crate::error::{Error, Result};
use crate::passes::buffers::{SceneBuffers, State, download_parts, upload};
use crate::passes::fresh_rows::{FreshRows, RowShape};
use crate::passes::kept_rows::{KeptRows, KeptSize, RestoredSize};
use crate::passes::occluder_tree::{OccluderTree, TreeData};
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::scene_data::LitSources;
use crate::passes::types::{CouplingTarget, KeptRow, MesoElement, Slot};
use crate::passes::words::Words;
use crate::vk::{Buffer, BufferUse, Commands, Device};

/// See the module.
pub(super) struct Member {
    pub device: Arc<Device>,
    settings: Settings,
    pub scene: SceneBuffers,
    state: State,
    pub relief: Option<ReliefBuffers>,
    share: Share,
    targets: Vec<CouplingTarget>,
    for_drawing: ForDrawing,
    kept: KeptRows,
    kept_size: KeptSize,
    makers: Option<Makers>,
    pub gathering: Gathering,
    exchange: Option<Box<dyn Exchange>>,
    /// Where the rows of sources lie.
    places: HashMap<u32, KeptRow>,
}

/// What drawing needs, on the host until it is first asked for: light by rows that are kept needs
/// none of it.
#[allow(clippy::large_enum_variant)] // one of them a member
enum ForDrawing {
    Wanted {
        tree: Option<TreeData>,
        meso: Vec<MesoElement>,
        slots: u32,
    },
    Made(DrawingBuffers),
}

struct DrawingBuffers {
    fresh: FreshRows,
    meso: Option<Buffer>,
    occluders: Option<OccluderTree>,
}

impl ForDrawing {
    fn make(
        &mut self,
        device: &Arc<Device>,
        shape: RowShape,
        settings: &Settings,
    ) -> Result<&DrawingBuffers> {
        if let Self::Wanted { tree, meso, slots } = self {
            let tree = tree.as_ref();
            *self = Self::Made(DrawingBuffers {
                fresh: FreshRows::new(device, shape, *slots, Makers::sorts(settings))?
                    .in_parts(settings.part_pairs),
                meso: match &meso[..] {
                    [] => None,
                    own => Some(upload(device, "meso elements", own, BufferUse::Storage)?),
                },
                occluders: tree
                    .map(|tree| OccluderTree::new(device, tree))
                    .transpose()?,
            });
        }
        match self {
            Self::Made(made) => Ok(made),
            Self::Wanted { .. } => unreachable!("it was made above"),
        }
    }
}

impl Member {
    /// # Errors
    /// A device that fails, or without the memory.
    pub fn new(
        device: &Arc<Device>,
        data: &MemberData,
        own: MemberShare,
        exchange: Option<Box<dyn Exchange>>,
    ) -> Result<Self> {
        let MemberShare {
            share,
            targets,
            restored,
        } = own;
        let settings = &data.settings;
        let shape = share.shape;
        shape.check(device.name(), device.limits().max_workgroups)?;
        let scene = SceneBuffers::new(device, &data.scene, shape)?;
        let state = State::new(device, &scene)?;
        let relief = (data.relief.as_ref())
            .map(|relief| ReliefBuffers::new(device, relief))
            .transpose()?;
        let most = VISIBILITY_MEMORY.min(device.limits().heap_bytes / 3);
        let size = KeptSize {
            memory: settings.visibility_memory.unwrap_or(most),
            chunk: settings.chunk_bytes,
            sources: scene.source_count,
            slots: data.slots,
        };
        let restored_size = restored.as_ref().map(|restored| RestoredSize {
            chunk_words: restored.chunk_words,
            chunks: restored.chunks.len(),
        });
        let kept = KeptRows::new(device, shape, size, restored_size)?;
        let meso = match &data.relief {
            Some(relief) if shape.meso.count > 0 => {
                let all: &[MesoElement] = relief.elements.values();
                let first = (shape.meso.first - relief.shape.first_element) as usize;
                all[first..first + shape.meso.count as usize].to_vec()
            }
            _ => Vec::new(),
        };
        let near = data.near.as_ref();
        let buffers = (&scene, &state, relief.as_ref());
        let gathering = Gathering::new(device, buffers, near, &kept, &share, data.slots)?;
        let mut member = Self {
            device: Arc::clone(device),
            for_drawing: ForDrawing::Wanted {
                tree: data.tree.clone(),
                meso,
                slots: data.slots,
            },
            settings: settings.clone(),
            scene,
            state,
            relief,
            share,
            targets: targets.values().to_vec(),
            kept,
            kept_size: size,
            makers: None,
            gathering,
            exchange,
            places: HashMap::new(),
        };
        if let Some(restored) = restored {
            let RestoredRows { state, chunks, .. } = &restored;
            let chunks: Vec<&[u32]> = chunks.iter().map(Words::words).collect();
            member.kept.restore(kept_state(*state), &chunks)?;
            member.place(&restored.places);
        }
        Ok(member)
    }

    fn place(&mut self, places: &[[u32; 3]]) {
        for &[source, chunk, first] in places {
            let place = KeptRow {
                chunk,
                first,
                scale: 1.0,
            };
            self.places.insert(source, place);
        }
    }

    /// Does what is asked.
    ///
    /// # Errors
    /// A device that fails; another member that does.
    pub fn run(&mut self, command: Command) -> Result<Reply> {
        match command {
            Command::Prepare(kinds) => self.prepare(&kinds),
            Command::Submit(batch) => {
                let exchange = self.exchange.as_deref_mut();
                let makers = self.makers.as_mut().ok_or_else(unprepared)?;
                makers.submit(batch, exchange)?;
                Ok(Reply::Done)
            }
            Command::Take => {
                let exchange = self.exchange.as_deref_mut();
                let makers = self.makers.as_mut().ok_or_else(unprepared)?;
                let made = makers.take(exchange)?.unwrap_or_default();
                for row in &made.rows {
                    let [chunk, first] = row.place;
                    self.place(&[[row.source, chunk, first]]);
                }
                Ok(Reply::Made(made))
            }
            Command::Gather(rows) => {
                let lacks = || Error::Device("light of a row that is not kept is asked for".into());
                let place = |lit: LitRow| {
                    let place = self.places.get(&lit.source).ok_or_else(lacks)?;
                    Ok((lit, *place))
                };
                let rows = rows.into_iter().map(place).collect::<Result<Vec<_>>>()?;
                let exchange = self.exchange.as_deref_mut();
                (self.gathering).run(&rows, exchange)?;
                Ok(Reply::Done)
            }
            Command::Measure => Ok(Reply::Reflected(self.gathering.measure()?)),
            Command::Irradiance => Ok(Reply::Irradiance(self.irradiance()?)),
            Command::Near(light) => {
                self.gathering.near(&light)?;
                Ok(Reply::Done)
            }
            Command::Light => self.light(),
            Command::Relight {
                lit,
                more_eyes,
                dropped,
                unprepared,
            } => {
                self.relight(&lit, more_eyes, &dropped)?;
                if unprepared {
                    self.makers = None;
                }
                Ok(Reply::Done)
            }
            Command::Room => {
                let KeptRows { chunk_words, .. } = self.kept;
                let candidate = self.device.candidate();
                let device = [&candidate.name, &candidate.driver].map(String::clone);
                Ok(Reply::Room([chunk_words, self.kept.chunk_count()], device))
            }
            Command::State => {
                let state = self.kept.state_now(&self.device)?;
                Ok(Reply::State(state_words(state)))
            }
            Command::Words(states) => {
                let states = states.map(kept_state);
                let words = self.kept.download_between(&self.device, states)?;
                Ok(Reply::Words(words.into()))
            }
            Command::Restore {
                state,
                words,
                places,
            } => {
                let from = self.kept.state_now(&self.device)?;
                let states = [from, kept_state(state)];
                if words.words().len() != self.kept.words_between(states) {
                    return Err(Error::Device("rows that do not fit are restored".into()));
                }
                self.kept
                    .restore_between(&self.device, states, words.words())?;
                self.place(&places);
                Ok(Reply::Done)
            }
            Command::Rows => self.rows(),
        }
    }

    fn prepare(&mut self, kinds: &[RowKind]) -> Result<Reply> {
        let shape = self.share.shape;
        let made = (self.for_drawing).make(&self.device, shape, &self.settings)?;
        let parts = RowParts {
            settings: &self.settings,
            scene: &self.scene,
            targets: &self.targets,
            meso: made.meso.as_ref(),
            fresh: &made.fresh,
            occluders: made.occluders.as_ref(),
            kept: &self.kept,
            parcels: &self.share.parcels,
            members: self
                .exchange
                .as_ref()
                .map_or(1, |exchange| exchange.place()[1]),
        };
        let makers = match self.makers.take() {
            Some(makers) if kinds.iter().all(|kind| is_made(&makers, *kind)) => makers,
            _ => Makers::new(&self.device, &parts, kinds)?,
        };
        let makers = self.makers.insert(makers);
        let kinds = [RowKind::Common].into_iter().chain(makers.kinds());
        let slots = kinds.map(|kind| (kind, makers.slots(kind)));
        Ok(Reply::Prepared(slots.collect()))
    }

    fn irradiance(&self) -> Result<[Vec<Vec3>; 2]> {
        let State {
            direct, indirect, ..
        } = &self.state;
        let [plain, meso] = self.share.elements();
        let parts = [
            (direct, plain.clone()),
            (direct, meso.clone()),
            (indirect, plain),
            (indirect, meso),
        ];
        let [mut direct, of_meso, mut indirect, indirect_of_meso] =
            download_parts::<Vec3, 4>(&self.device, parts)?;
        direct.extend(of_meso);
        indirect.extend(indirect_of_meso);
        Ok([direct, indirect])
    }

    fn light(&self) -> Result<Reply> {
        let relief = match &self.relief {
            Some(buffers) => {
                let [_, meso] = self.share.elements();
                Some(ReliefSums::download(&self.device, buffers, meso)?)
            }
            None => None,
        };
        Ok(Reply::Light(self.irradiance()?, relief))
    }

    /// Forgets all light.
    fn relight(&mut self, lit: &LitSources, more_eyes: bool, dropped: &[u32]) -> Result<()> {
        self.scene.write_sources(&self.device, lit, more_eyes)?;
        Commands::run(&self.device, "no light", |cmd| {
            self.state.buffers().for_each(|buffer| cmd.fill(buffer, 0));
            let relief = self.relief.iter().flat_map(ReliefBuffers::light);
            relief.for_each(|buffer| cmd.fill(buffer, 0));
            Ok(())
        })?;
        let dropped: Vec<KeptRow> = (dropped.iter())
            .filter_map(|source| self.places.remove(source))
            .filter(|place| place.chunk < self.kept.chunk_count())
            .collect();
        let lasts = |place: &&KeptRow| place.chunk < self.kept.chunk_count();
        let kept: Vec<KeptRow> = self.places.values().filter(lasts).copied().collect();
        self.kept.forget(&dropped, &kept)
    }

    fn rows(&self) -> Result<Reply> {
        let (state, chunks) = self.kept.download(&self.device)?;
        let mut places: Vec<[u32; 3]> = (self.places.iter())
            .map(|(&source, place)| [source, place.chunk, place.first])
            .collect();
        places.sort_unstable();
        Ok(Reply::Rows(RestoredRows {
            chunk_words: self.kept.chunk_words,
            state: state_words(state),
            chunks: chunks.into_iter().map(Words::from).collect(),
            places,
        }))
    }

    /// Words of a chunk of rows of this shape.
    pub fn chunk_words(&self, shape: RowShape) -> u32 {
        (KeptRows::chunk_bytes(&self.device, shape, self.kept_size) / 4) as u32
    }

    /// The item buffers of the last batch of common sources, `[row][slot][column]`.
    pub fn items(&self) -> Result<Vec<u32>> {
        match &self.makers {
            Some(makers) => read_items(&self.device, makers.batch()),
            None => Ok(Vec::new()),
        }
    }

    /// The rows that were gathered last with their light, for comparison with the twins.
    pub fn gathered_slots(&self, count: usize) -> Result<Vec<Slot>> {
        self.gathering.slots(count)
    }
}

fn is_made(makers: &Makers, kind: RowKind) -> bool {
    kind == RowKind::Common || makers.kinds().contains(&kind)
}

fn unprepared() -> Error {
    Error::Device("a batch is asked for before its passes are made".into())
}
