//! What a bake says of itself.

use std::sync::Arc;

use serde::Serialize;

use super::makers::RowKind;
use super::row_maker::emitter_face;
use super::rows::{Row, Stages};
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
    /// Wall time of what near sources send part by part.
    pub near: f64,
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
}

/// Pairs of source and element whose form factor the device has found, by how.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Pairs {
    /// As of a point.
    pub far: u64,
    /// By the outline of the source.
    pub outline: u64,
    /// By the parts of a curved source, as points.
    pub parts: u64,
    /// By the outline, cut at the element's horizon.
    pub cut: u64,
    /// Member by member, or from several places on the element.
    pub near: u64,
}

/// Pairs of source and element about which rays decided.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct ByRays {
    /// The item buffer left open whether the element sees the source.
    pub doubtful: u64,
    /// A silhouette may cut the source: rays found the share of it that the element sees.
    pub silhouettes: u64,
}

/// Light from near sources, part by part.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Near {
    /// Elements and sources that are near them.
    pub pairs: u64,
    /// Parts of sources in these pairs.
    pub parts: u64,
    /// Rays to see the parts by.
    pub rays: u64,
    /// Sweeps over the parts.
    pub sweeps: u64,
}

/// How much of each source of an enclosed scene its form factors take together, before they are
/// scaled: 1 where they are exact.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct RawSums {
    pub sources: u64,
    /// By the area of the sources.
    pub mean: f64,
    /// Root mean square of what each is off 1, by area.
    pub spread: f64,
    /// The sum that is furthest off 1, and its source.
    pub worst: f64,
    pub worst_source: u32,
    /// Sources that were off by more than sampling explains, and not scaled.
    pub unscaled: u64,
    #[serde(skip)]
    area: f64,
}

impl RawSums {
    fn add(&mut self, source: u32, area: f64, share: f64, scaled: bool) {
        let all = self.area + area;
        let off = share - 1.0;
        self.mean = (self.mean * self.area + share * area) / all;
        self.spread = ((self.spread.powi(2) * self.area + off * off * area) / all).sqrt();
        self.area = all;
        if self.sources == 0 || off.abs() > (self.worst - 1.0).abs() {
            (self.worst, self.worst_source) = (share, source);
        }
        self.sources += 1;
        self.unscaled += u64::from(!scaled);
    }
}

/// An estimate of how far light that is linear over elements is off at random points: rms over the
/// mean irradiance of what has neither relief nor emission. See [`crate::bake::discretisation`].
#[derive(Debug, Clone, Default, Serialize)]
pub struct Discretisation {
    pub rms: f64,
    pub surfaces: Vec<SurfaceError>,
}

/// What has one material.
#[derive(Debug, Clone, Serialize)]
pub struct SurfaceError {
    pub name: String,
    /// Share of the area.
    pub area: f64,
    /// Of this surface, over the mean irradiance of all.
    pub rms: f64,
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
    /// Bytes that several members sent one another of item buffers and parts of rows.
    pub sent_bytes: u64,
    /// Rows that were drawn again, since they had found no room.
    pub drawn_again: u64,
    /// Rows that an earlier run had drawn, which was stopped; see [`super::Checkpoints`]. Times are
    /// of this run alone.
    pub resumed: u64,
    /// Rows that light was gathered by, each time that it was.
    pub gathered_rows: u64,
    /// Gauss–Seidel sweeps among the sources.
    pub sweeps: u64,
    pub near: Near,
    pub by_rays: ByRays,
    pub pairs: Pairs,
    /// Null in open scenes.
    pub raw_sums: Option<RawSums>,
    /// Bytes of the coupling between the sources.
    pub coupling_bytes: u64,
    /// To the first device's queue since it was opened, until the light came to the host.
    pub submissions: u64,
    /// Sources drawn, again or not.
    pub shots: u32,
    pub unshot_share: f64,
    /// Null where a reflectance is 1: nothing bounds what is left then.
    pub error_bound: Option<f64>,
    /// Null of a solution under way.
    pub discretisation: Option<Discretisation>,
    pub stop: StopReason,
    pub seconds: Seconds,
    pub skipped: Skipped,
    /// Elements that receive and send by direction, and into how many; null where none does.
    pub relief: Option<ReliefReport>,
    /// What was made up, ignored or limited when the scene was read and cut.
    pub notes: Vec<String>,
    #[serde(skip)]
    meshlets: u64,
    #[serde(skip)]
    culls: bool,
}

/// [`Report::estimator`] of the paper's method.
pub const BY_PAPER: &str = "paper";

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
    pub(super) fn new(device: &Arc<Device>, problem: &Problem, others: &[String]) -> Self {
        let Problem {
            settings,
            elements,
            sources,
            ..
        } = problem;
        let strong = problem.strong().contains(&true);
        Self {
            device: device.name().to_owned(),
            other_devices: others.to_vec(),
            estimator: match settings.estimator {
                Estimator::Receiver => "receiver",
                Estimator::Pixel => "pixel",
                Estimator::Paper => BY_PAPER,
            },
            hemicube: settings.hemicube,
            emitter_hemicube: match strong {
                true => emitter_face(device, settings),
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
            near: Near {
                pairs: problem.near.pair_count() as u64,
                parts: problem.near.entry_count() as u64,
                rays: problem.near.rays,
                sweeps: 0,
            },
            relief: elements.relief.as_ref().map(ReliefReport::new),
            meshlets: problem.meshlet_count.into(),
            culls: settings.culling != Culling::Off,
            ..Self::default()
        }
    }

    /// Counts a row: of a strong emitter or not, drawn before or not.
    pub(super) fn add(&mut self, row: &Row, area: f64, kind: RowKind, again: bool) {
        if let Some(share) = row.share.filter(|_| !again) {
            let sums = self.raw_sums.get_or_insert_default();
            sums.add(
                row.source,
                area,
                share.into(),
                row.scale != 1.0 || share == 1.0,
            );
        }
        let [far, outline, parts, cut, near, doubtful, silhouettes] = row.listed;
        self.pairs.far += far;
        self.pairs.outline += outline;
        self.pairs.parts += parts;
        self.pairs.cut += cut;
        self.pairs.near += near;
        self.by_rays.doubtful += doubtful;
        self.by_rays.silhouettes += silhouettes;
        self.add_drawn(&row.counts, kind == RowKind::Strong);
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
