//! Several devices for one bake.

use std::sync::Arc;

use super::exchange::{Exchange, Meeting};
use super::messages::{MemberData, MemberShare};
#[cfg(feature = "mpi")]
use super::near_search::{NearSearch, joined, looked, own};
#[cfg(feature = "mpi")]
use super::ranks::{OnRanks, Ranks};
use super::team::Others;
use super::threads::Threads;
use super::{Estimator, Settings, choose_device, open_device};
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::mesh::near::{NearPairs, Nearness, pairs_of};
use crate::mesh::open_eyes::{Wanted, open_eyes};
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::passes::types::ShadowOccluder;
use crate::vk::{Candidate, Device, Instance, SOFTWARE};

/// Opens the devices asked for: one as [`open_device`] does, or several, divided by commas. One
/// that is named twice is opened twice: a software device has threads of its own each time.
///
/// # Errors
/// A device that is not there or cannot run this program, or a list with a gap.
pub fn open_devices(wanted: Option<&str>, validation: bool) -> Result<Vec<Arc<Device>>> {
    let Some(list) = wanted.filter(|wanted| wanted.contains(',')) else {
        return Ok(vec![open_device(wanted, validation)?]);
    };
    let names: Vec<&str> = list.split(',').map(str::trim).collect();
    if names.contains(&"") {
        return Err(Error::Usage(format!(
            "--device {list}: a device is missing between two commas or at an end"
        )));
    }
    // Names have commas too.
    let instance = Instance::new(validation)?;
    if choose_device(&instance, wanted).is_ok() {
        return Ok(vec![open_device(wanted, validation)?]);
    }
    // All are looked for before the first is opened.
    for name in &names {
        choose_device(&instance, Some(name))?;
    }
    (names.into_iter())
        .map(|name| open_device(Some(name), validation))
        .collect()
}

/// What the host does, over what a software device does of all members together: measured with
/// 100,000 elements and a core a device.
const HOST_WORK: f64 = 0.01;
const LEAST_WEIGHT: f64 = 0.2;

/// Where `mpirun` says how many processes there are: Open MPI, MPICH, and Slurm by PMIx.
const SIZES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_SIZE"];

/// Processes that were started together by `mpirun`; 1 of one that was started alone.
pub fn started_together() -> usize {
    let size = |name| std::env::var(name).ok()?.parse().ok();
    SIZES.into_iter().find_map(size).unwrap_or(1)
}

/// Opens the device of one of the processes of a machine, by its number among them: of a list the
/// one in its turn, without one the next of those that are like the best.
///
/// # Errors
/// As [`open_devices`].
pub fn open_in_turn(wanted: Option<&str>, turn: usize, validation: bool) -> Result<Arc<Device>> {
    let instance = Instance::new(validation)?;
    let in_turn = |names: &[String]| names[turn % names.len()].clone();
    let name = match wanted {
        Some(list) if choose_device(&instance, wanted).is_err() => {
            let names: Vec<String> = list.split(',').map(|name| name.trim().to_owned()).collect();
            in_turn(&names)
        }
        Some(name) => name.to_owned(),
        None => {
            let all = instance.candidates()?;
            let best = all.first();
            let is_alike = |c: &&Candidate| best.is_some_and(|best| best.name == c.name);
            let alike: Vec<String> = all
                .iter()
                .filter(is_alike)
                .map(|c| c.index.to_string())
                .collect();
            if alike.is_empty() {
                return open_device(None, validation);
            }
            in_turn(&alike)
        }
    };
    open_device(Some(&name), validation)
}

/// The devices that bake together: of this process, and under `mpirun` of others.
#[derive(Clone)]
pub struct Crew {
    devices: Vec<Arc<Device>>,
    #[cfg(feature = "mpi")]
    ranks: Option<Arc<Ranks>>,
}

impl From<&[Arc<Device>]> for Crew {
    fn from(devices: &[Arc<Device>]) -> Self {
        Self {
            devices: devices.to_vec(),
            #[cfg(feature = "mpi")]
            ranks: None,
        }
    }
}

impl From<&Arc<Device>> for Crew {
    fn from(device: &Arc<Device>) -> Self {
        Self::from(std::slice::from_ref(device))
    }
}

/// The other members as the first reaches them, and its way to give them what all need.
type Reached = (Box<dyn Others>, Box<dyn Exchange>);

impl Crew {
    /// With the devices of the other processes, of which this one is the first.
    #[cfg(feature = "mpi")]
    pub fn with_ranks(device: &Arc<Device>, ranks: Arc<Ranks>) -> Self {
        Self {
            ranks: Some(ranks),
            ..Self::from(device)
        }
    }

    /// The device that holds the solution.
    ///
    /// # Errors
    /// There is none.
    pub fn first(&self) -> Result<&Arc<Device>> {
        let none = || Error::Device("a bake needs a device".into());
        self.devices.first().ok_or_else(none)
    }

    /// How many devices there are.
    pub fn members(&self) -> usize {
        #[cfg(feature = "mpi")]
        if let Some(ranks) = &self.ranks {
            return ranks.count();
        }
        self.devices.len()
    }

    /// How much each member is to find: the first host also solves, and a software device computes
    /// on its cores.
    pub(super) fn weights(&self) -> Result<Vec<f64>> {
        let members = self.members();
        let mut weights = vec![1.0; members];
        if self.first()?.candidate().kind == SOFTWARE {
            weights[0] = (1.0 - HOST_WORK * members as f64).max(LEAST_WEIGHT);
        }
        Ok(weights)
    }

    /// Opens the eyes of sources and finds the near sources of all elements, each process those of
    /// some sources.
    ///
    /// # Errors
    /// Processes that are gone.
    pub(super) fn look(
        &self,
        elements: &Elements,
        sources: &mut [Source],
        tree: &ShadowTree<ShadowOccluder>,
        wanted: &[Wanted],
        nearness: &Nearness,
    ) -> Result<NearPairs> {
        #[cfg(feature = "mpi")]
        if let Some(ranks) = &self.ranks {
            let search = NearSearch::new(elements, sources, tree, wanted, nearness);
            let (found, others) = ranks.search(search, || {
                let (mut own, wanted) = own(sources, wanted, [0, ranks.count()]);
                looked(elements, &mut own, tree, &wanted, nearness)
            })?;
            let found = joined(sources, found, &others);
            return Ok(NearPairs::new(elements, sources, found));
        }
        open_eyes(elements, &mut *sources, tree, wanted);
        let found = pairs_of(elements, &*sources, tree, nearness);
        Ok(NearPairs::new(elements, sources, found))
    }

    /// Starts the other members; none where the first is alone.
    pub(super) fn others(
        &self,
        data: &Arc<MemberData>,
        own: Vec<MemberShare>,
    ) -> Result<Option<Reached>> {
        #[cfg(feature = "mpi")]
        if let Some(ranks) = &self.ranks {
            let (others, seat) = OnRanks::start(ranks, data, own)?;
            return Ok(Some((Box::new(others), seat)));
        }
        let Some(rest) = self.devices.get(1..).filter(|rest| !rest.is_empty()) else {
            return Ok(None);
        };
        let meeting = Meeting::new(self.members());
        let others = Threads::start(rest, data, own, &meeting);
        Ok(Some((Box::new(others), Box::new(meeting.seat(0)))))
    }

    /// # Errors
    /// No device; several for another estimator than `receiver`.
    pub fn check(&self, settings: &Settings) -> Result<&Arc<Device>> {
        if self.members() > 1 && settings.estimator != Estimator::Receiver {
            let what = "--estimator pixel and --preset paper take one --device, not several";
            return Err(Error::Usage(what.into()));
        }
        self.first()
    }
}
