//! What a bake says of itself.

use std::sync::Arc;

use serde::Serialize;

use super::rows::{Row, Stages, emitter_face};
use super::{Estimator, Problem};
use crate::meso::{Class, Relief, Transport};
use crate::passes::cull::Culling;
use crate::vk::Device;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StopReason {
    /// The error bound is no more than what was asked for.
    #[default]
    Residual,
    Budget,
    Shots,
    /// Ctrl-C.
    Interrupted,
    /// All is drawn, and light still goes to and fro: no surface absorbs it.
    Unsolved,
}

/// Seconds by stage; of several devices together.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Seconds {
    /// Wall time of grouping the elements and bringing them to the device.
    pub setup: f64,
    /// Wall time of all batches.
    pub solve_wall: f64,
    #[serde(flatten)]
    pub stages: Stages,
    /// Wall time of solving among the sources.
    pub solve: f64,
    /// Wall time of bringing light to the elements.
    pub gather: f64,
}

/// What the scene did not need.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Skipped {
    /// Triangles without area, left out when the scene was read.
    pub degenerate_triangles: u64,
    /// Groups of elements that neither emit nor reflect.
    pub black_sources: u64,
    /// How many triangles fewer the item buffers are drawn from, since elements of one plane are
    /// merged.
    pub triangles_merged: u64,
    /// Hemicube faces in which nothing was to be drawn.
    pub empty_faces: u64,
    /// Meshlets that a face did not draw.
    pub meshlets_culled: u64,
    /// Triangles of the other meshlets that a face did not draw.
    pub triangles_culled: u64,
    /// Pairs of shot and element that faced away from one another.
    pub receivers_facing_away: u64,
    /// Directions without light that were left out when their element was to send.
    pub dark_slots: u64,
}

#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    pub device: String,
    /// Those that drew for it.
    pub other_devices: Vec<String>,
    pub estimator: &'static str,
    pub hemicube: u32,
    /// Of strong emitters; `hemicube` where no hemicube is finer.
    pub emitter_hemicube: u32,
    pub elements: u64,
    pub sources: u64,
    pub batch: u32,
    pub hemicubes: u64,
    /// Of them, those of strong emitters.
    pub emitter_hemicubes: u64,
    /// Strong emitters for which shadow rays found what they see, in place of a hemicube.
    pub emitters_by_rays: u64,
    pub triangles_drawn: u64,
    /// Sources whose rows are kept.
    pub kept_sources: u64,
    /// Rows that were drawn again, since they had found no room.
    pub drawn_again: u64,
    /// Rows that light was gathered by, each time that it was.
    pub gathered_rows: u64,
    /// Gauss–Seidel sweeps among the sources.
    pub sweeps: u64,
    /// Bytes of the coupling between the sources.
    pub coupling_bytes: u64,
    /// Sources drawn, again or not.
    pub shots: u32,
    pub unshot_share: f64,
    /// Null where a reflectance is 1: nothing bounds what is left then.
    pub error_bound: Option<f64>,
    pub stop: StopReason,
    pub seconds: Seconds,
    pub skipped: Skipped,
    /// Elements that receive and send by direction, and into how many; null where none does.
    pub relief: Option<ReliefReport>,
    #[serde(skip)]
    meshlets: u64,
    #[serde(skip)]
    culls: bool,
}

/// What was relief, and how.
#[derive(Debug, Clone, Serialize)]
pub struct ReliefReport {
    pub elements: u64,
    pub directions: u32,
    pub transport: Transport,
    /// One for each material and size of its tiles.
    pub classes: Vec<Class>,
}

impl ReliefReport {
    fn new(relief: &Relief) -> Self {
        Self {
            elements: relief.count() as u64,
            directions: relief.directions.count() as u32,
            transport: relief.transport,
            classes: relief.classes.clone(),
        }
    }
}

impl Report {
    pub(super) fn new(devices: &[Arc<Device>], problem: &Problem) -> Self {
        let Problem {
            settings,
            elements,
            sources,
            ..
        } = problem;
        let strong = problem.strong().contains(&true);
        let mut names = devices.iter().map(|device| device.name().to_owned());
        Self {
            device: names.next().unwrap_or_default(),
            other_devices: names.collect(),
            estimator: match settings.estimator {
                Estimator::Receiver => "receiver",
                Estimator::Pixel => "pixel",
            },
            hemicube: settings.hemicube,
            emitter_hemicube: match strong {
                true => emitter_face(&devices[0], settings),
                false => settings.hemicube,
            },
            elements: elements.len() as u64,
            sources: sources.list.len() as u64,
            batch: problem.slots,
            unshot_share: 1.0,
            skipped: Skipped {
                black_sources: sources.black as u64,
                triangles_merged: (elements.len() - problem.occluders.len()) as u64,
                ..Skipped::default()
            },
            relief: elements.relief.as_ref().map(ReliefReport::new),
            meshlets: problem.scene.meshlet_count.into(),
            culls: settings.culling != Culling::Off,
            ..Self::default()
        }
    }

    /// Counts a row: of a strong emitter or not, drawn before or not.
    pub(super) fn add(&mut self, row: &Row, strong: bool, again: bool) {
        self.add_drawn(&row.counts, strong);
        self.drawn_again += u64::from(again);
        self.skipped.receivers_facing_away += u64::from(row.facing_away);
    }

    /// Counts a source: `[face]` meshlets kept, triangles tested, triangles drawn; none by rays.
    pub(super) fn add_drawn(&mut self, counts: &[[u32; 3]], strong: bool) {
        self.shots += 1;
        if counts.is_empty() {
            self.emitters_by_rays += 1;
        } else {
            self.hemicubes += 1;
            self.emitter_hemicubes += u64::from(strong);
        }
        for counts in counts {
            let [kept, tested, drawn] = counts.map(u64::from);
            self.triangles_drawn += drawn;
            self.skipped.empty_faces += u64::from(drawn == 0);
            if self.culls {
                self.skipped.meshlets_culled += self.meshlets - kept;
                self.skipped.triangles_culled += tested - drawn;
            }
        }
    }
}
