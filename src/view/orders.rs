//! What the window and the thread that bakes say to one another.

use std::sync::Arc;

use super::snapshot::{Progress, Snapshot};
use crate::error::Error;
use crate::scene::Scene;
use crate::solver::{ItemPicture, Settings};

/// What the window asks for.
pub enum Order {
    /// Bakes from nothing.
    Bake {
        scene: Arc<Scene>,
        settings: Box<Settings>,
        epoch: u64,
    },
    /// Lights the scene of the last bake, of which emission and point lights have changed, by the
    /// form factors that are kept. What a sketch shows of them need not be shown again before all
    /// of their light.
    Relight {
        scene: Arc<Scene>,
        epoch: u64,
        sketched: bool,
    },
    /// Saves the bake.
    Save,
    /// Finds the sources of a bake from a file.
    Sources,
    /// Draws what a source sees.
    Items { source: u32 },
}

/// What a bake does before it solves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    Device,
    /// Groups elements, and brings the scene to the device.
    Scene,
    /// Lights the scene coarsely, before it is baked as was asked.
    First,
    /// Lights the scene as if it were flat, before its relief is prepared.
    Flat,
    /// Finds what reliefs see of themselves and how they answer light; the scene is lit as if it
    /// were flat meanwhile.
    Relief,
}

impl Stage {
    /// As the panel shows it.
    pub fn line(self) -> &'static str {
        match self {
            Self::Device => "opening the device",
            Self::Scene => "preparing the scene",
            Self::First => "a first light; the bake comes next",
            Self::Flat => "lit as if flat; relief comes next",
            Self::Relief => "preparing the relief; lit as if flat",
        }
    }
}

/// What the thread has found since it was last asked.
#[derive(Default)]
pub struct Latest {
    pub snapshot: Option<Arc<Snapshot>>,
    /// Newer than that of the snapshot, perhaps.
    pub progress: Option<(u64, Progress)>,
    /// With its epoch; none while a bake is solved.
    pub stage: Option<(u64, Option<Stage>)>,
    /// `[triangle]` of the input; of a new bake.
    pub sources: Option<Vec<u32>>,
    pub items: Option<ItemPicture>,
    pub error: Option<Error>,
}

/// What is baked.
pub struct Given {
    pub scene: Arc<Scene>,
    pub settings: Settings,
}
