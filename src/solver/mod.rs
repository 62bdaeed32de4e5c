//! The progressive solver: it alone orders the passes.
//!
//! A batch is one submission: measure → select → cull → item buffer → form factors → keep → gather. Two batches are under way at a time; the
//! device chooses what to shoot and when to stop, and the CPU looks on one batch behind.

mod ambient;
mod batch;
mod devices;
mod drawer;
mod emitters;
mod estimate;
mod helpers;
mod look;
mod readback;
mod relief_light;
mod report;
mod schedule;
mod self_test;
mod settings;
mod several;
mod visibility;

use std::cell::Cell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;

use crate::charts::Connections;
use crate::constants::REPLAYS;
use crate::elements::Elements;
use crate::error::Result;
use crate::occluders::Occluders;
use crate::passes::batch::{Batch, Hemicubes};
use crate::passes::buffers::{SceneBuffers, State, download};
use crate::passes::factor_buffers::FactorBuffers;
use crate::passes::item_buffer::ItemBuffer;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::types::{KeptState, Progress, Reflected, Slot};
use crate::scene::{PointLight, Scene};
use crate::sources::{self, Sources};
use crate::vk::Device;

pub use ambient::Ambient;
use batch::{BatchLoop, OnDevice, Passes, Rule};
pub use devices::{check_devices, open_devices};
pub use look::ItemPicture;
pub use readback::{BatchResult, Stages};
pub use relief_light::ReliefLight;
pub use report::{Report, Seconds, Skipped, StopReason};
pub use self_test::{choose_device, ids_come_back_right, open_device};
pub use settings::{
    EMITTER_SCALE, EmitterShadows, Estimator, HEMICUBE_RANGE, Settings, VISIBILITY_MEMORY,
};
pub use visibility::Visibility;

/// How far a solution has come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Update {
    pub shots: u32,
    pub sources: u32,
    /// Unshot power as a share of all that was emitted.
    pub unshot_share: f64,
    /// Power that can still be missing, as a share of all that was emitted; none where a reflectance is 1.
    pub error_bound: Option<f64>,
    /// Since the start of the solution.
    pub elapsed: Duration,
    /// An estimate, from how fast the bound has fallen lately.
    pub left: Option<Duration>,
}

/// Irradiance and radiosity, `[element]` in internal order, W·m⁻², RGB.
pub struct Light {
    pub irradiance_direct: Vec<Vec3>,
    pub irradiance: Vec<Vec3>,
    pub radiosity: Vec<Vec3>,
    /// Of the elements with a relief; none where no element has one.
    pub relief: Option<ReliefLight>,
}

/// A scene on the device with its solution under way.
pub struct Solver {
    device: Arc<Device>,
    settings: Settings,
    pub elements: Elements,
    pub sources: Sources,
    pub connections: Connections,
    pub occluders: Occluders,
    // Before the buffers that its commands use.
    /// Shoots what strong emitters emit; gone once that is done.
    emitters: Option<BatchLoop>,
    batches: BatchLoop,
    scene: SceneBuffers,
    state: State,
    relief: Option<ReliefBuffers>,
    factors: Option<FactorBuffers>,
    report: Report,
    emitted_power: f64,
    setup: Duration,
}

impl Solver {
    /// Groups the elements into sources and brings everything to the device.
    pub fn new(
        device: &Arc<Device>,
        elements: Elements,
        lights: &[PointLight],
        settings: &Settings,
    ) -> Result<Self> {
        Self::on_devices(&[Arc::clone(device)], elements, lights, settings, None)
    }

    /// As [`Self::new`], for the `elements` of a scene whose form factors were kept when it was lit otherwise. The sources are cut
    /// as they were then; point lights are drawn anew. See [`Visibility::check`].
    ///
    /// # Errors
    /// Emission of elements that neither emitted nor reflected then.
    pub fn relit(
        device: &Arc<Device>,
        elements: Elements,
        lights: &[PointLight],
        settings: &Settings,
        kept: &Visibility,
    ) -> Result<Self> {
        let devices = [Arc::clone(device)];
        Self::on_devices(&devices, elements, lights, settings, Some(kept))
    }

    /// As [`Self::new`] or [`Self::relit`], with all of `devices`, the first of which holds the solution. The others draw for it. Devices
    /// that draw alike, as those of one kind and driver do, give the same bytes as one.
    ///
    /// # Errors
    /// No device, or several for what one alone can do; see [`check_devices`].
    pub fn on_devices(
        devices: &[Arc<Device>],
        mut elements: Elements,
        lights: &[PointLight],
        settings: &Settings,
        kept: Option<&Visibility>,
    ) -> Result<Self> {
        settings.check()?;
        let (device, others) = check_devices(devices, settings)?;
        let start = Instant::now();
        let (grouping, seed) = (&settings.grouping, settings.seed);
        let (sources, connections) = match kept {
            None => sources::build(&mut elements, lights, grouping, seed),
            Some(kept) => {
                let now = elements.emitted_by_material(&kept.emitted());
                let (mut sources, connections) =
                    sources::build(&mut elements, &kept.lights(), grouping, seed);
                elements.emitted_by_material(&now);
                sources.relight(&elements, lights, seed)?;
                (sources, connections)
            }
        };
        let occluders = match settings.estimator {
            Estimator::Receiver if settings.merging => Occluders::merged(&elements, &connections),
            _ => Occluders::elements(&elements),
        };
        let parts = devices::Parts {
            elements: &elements,
            sources: &sources,
            connections: &connections,
            occluders: &occluders,
        };
        let scene = parts.scene(device)?;
        let state = State::new(device, &scene)?;
        let item_buffer = ItemBuffer::new(device)?;
        let wanted = settings.batch.clamp(1, scene.source_count.max(1));
        let slots = Hemicubes::fitting_slots(device, &scene, settings.hemicube, wanted);
        let memory = settings
            .visibility_memory
            .unwrap_or_else(|| VISIBILITY_MEMORY.min(device.limits().heap_bytes / 3));
        let replays = match settings.estimator {
            Estimator::Receiver if memory > 0 => REPLAYS,
            _ => 0,
        };
        let (face, slots) = (settings.hemicube, (slots, replays));
        let batch = Batch::drawing(
            device,
            &item_buffer.pass,
            &scene,
            (face, settings.list_room),
            slots,
        )?;
        let relief = elements
            .relief
            .as_ref()
            .map(|relief| {
                let by_pixel = settings.estimator == Estimator::Pixel && relief.texels.is_some();
                let slots = batch.all_slots();
                ReliefBuffers::new(device, &elements, relief, &sources, slots, by_pixel)
            })
            .transpose()?;
        let factors = match settings.estimator {
            Estimator::Receiver => Some(FactorBuffers::new(
                device,
                &scene,
                relief.as_ref().map_or(0, |r| r.element_count),
                slots.0,
                (memory, kept.map(|k| (k.header.chunk_words, k.chunks.len()))),
            )?),
            Estimator::Pixel => None,
        };
        let emitted_power: f64 = sources
            .list
            .iter()
            .map(sources::Source::emitted_power)
            .sum();
        if let (Some(kept), Some(factors)) = (kept, &factors) {
            let lasting = scene.source_count as usize - 2 * lights.len();
            state.keep_rows(device, &kept.rows[..lasting.min(kept.rows.len())])?;
            factors.restore(device, &kept.chunks, kept.header.state)?;
        }
        let bound_factor = bound_factor(&elements);
        // The bound is bound_factor · unshot / emitted; never stop on more unshot than the residual itself.
        let stop_power = settings.residual * emitted_power / bound_factor.unwrap_or(1e3).max(1.0);
        let on = OnDevice {
            scene: &scene,
            state: &state,
            relief: relief.as_ref(),
            factors: factors.as_ref(),
        };
        let passes = Arc::new(Passes::new(device, settings, item_buffer, &on)?);
        let emitters = emitters::new(device, settings, &passes, &on, (&parts, slots.0), kept)?;
        let rule = Rule {
            shots: settings.shots,
            stop_power: stop_power as f32,
            least_emitted: 0.0,
        };
        let team = parts.team(settings, (device, &scene), others)?;
        let batches = BatchLoop::new(device, &passes, batch, &on, rule, team)?;
        let mut report = Report::new(devices, settings, &elements, &sources, slots.0);
        let finer = emitters.as_ref().and_then(BatchLoop::face_size);
        report.emitter_hemicube = finer.unwrap_or(face);
        report.set_meshlets(scene.meshlet_count);
        report.skipped.triangles_merged = (elements.len() - occluders.len()) as u64;
        Ok(Self {
            device: Arc::clone(device),
            settings: settings.clone(),
            elements,
            sources,
            connections,
            occluders,
            emitters,
            batches,
            scene,
            state,
            relief,
            factors,
            report,
            emitted_power,
            setup: start.elapsed(),
        })
    }

    /// Shoots until a stop rule holds, or `go_on` says no. What has been solved so far is always valid.
    pub fn run(&mut self, go_on: impl FnMut(&Update) -> bool) -> Result<()> {
        self.turn(go_on)?;
        if self.batches.recall()? {
            self.look_at_the_rest()?;
        }
        Ok(())
    }

    /// As [`Self::run`], but where `go_on` has said no it is to go on later, as if it had not stopped; until then elements with a
    /// relief may lack the directions of their light.
    pub fn turn(&mut self, mut go_on: impl FnMut(&Update) -> bool) -> Result<()> {
        let start = Instant::now();
        let factor = bound_factor(&self.elements);
        let budget = self.settings.budget.unwrap_or(Duration::MAX);
        let sources = self.scene.source_count;
        let emitted = self.emitted_power;
        let mut history: Vec<(f64, f64)> = Vec::new();
        let stop = Cell::new(None);
        let report = &mut self.report;
        let mut look = |batch: &BatchResult, of_emitters: bool| {
            report.add(batch, of_emitters);
            let Progress {
                unshot_emitted,
                unshot_reflected,
                shots,
                selected,
                replayed,
            } = batch.progress;
            let unshot_share = ratio(f64::from(unshot_emitted + unshot_reflected), emitted);
            let error_bound = factor.map(|f| bound(f, unshot_share));
            let elapsed = start.elapsed();
            history.push((elapsed.as_secs_f64(), unshot_share));
            report.unshot_share = unshot_share;
            report.error_bound = error_bound;
            if stop.get().is_some() {
                return false;
            }
            if selected + replayed == 0 && of_emitters {
                return false;
            }
            if selected + replayed == 0 {
                stop.set(Some(match self.settings.shots {
                    Some(limit) if shots >= limit => StopReason::Shots,
                    _ => StopReason::Residual,
                }));
                return false;
            }
            let update = Update {
                shots,
                sources,
                unshot_share,
                error_bound,
                elapsed,
                left: time_left(
                    &history,
                    self.settings.residual / factor.unwrap_or(1e3).max(1.0),
                ),
            };
            if !go_on(&update) {
                stop.set(Some(StopReason::Interrupted));
            } else if elapsed >= budget {
                stop.set(Some(StopReason::Budget));
            }
            stop.get().is_none()
        };
        if let Some(emitters) = &mut self.emitters {
            emitters.run_before(&mut self.batches, |batch| look(batch, true))?;
        }
        if stop.get().is_none() {
            self.emitters = None;
            self.batches.run(|batch| look(batch, false))?;
        }
        if stop.get() == Some(StopReason::Residual) && self.batches.recall()? {
            stop.set(None);
            self.batches.run(|batch| look(batch, false))?;
        }
        self.look_at_the_rest()?;
        let report = &mut self.report;
        report.stop = stop.get().unwrap_or(StopReason::Residual);
        report.seconds.setup = self.setup.as_secs_f64();
        report.seconds.solve_wall += start.elapsed().as_secs_f64();
        if let Some(factors) = &self.factors {
            let [state] = download::<KeptState>(&self.device, &factors.state, 1)?[..] else {
                unreachable!("one was asked for");
            };
            report.kept_sources = state.rows.into();
        }
        let facing_away = &self.state.facing_away;
        let away: Vec<u32> = download(&self.device, facing_away, self.elements.len())?;
        let away: u64 = away.iter().map(|&a| u64::from(a)).sum();
        report.skipped.receivers_facing_away = away + self.batches.facing_away();
        if let Some(relief) = &self.relief {
            let sources = relief.source_count as usize;
            let dark: Vec<u32> = download(&self.device, &relief.dark_slots, sources)?;
            report.skipped.dark_slots = dark.iter().map(|&d| u64::from(d)).sum();
        }
        Ok(())
    }

    /// Whether elements with a relief lack the directions of their light still: see [`Self::turn`].
    pub fn lacks_directions(&self) -> bool {
        self.batches.sends_evenly()
    }

    /// The last batches have shot since the last look: what is left now is what a measurement finds.
    fn look_at_the_rest(&mut self) -> Result<()> {
        let last = self.batches.remeasure()?;
        let unshot = f64::from(last.unshot_emitted + last.unshot_reflected);
        let report = &mut self.report;
        report.shots = last.shots;
        report.unshot_share = ratio(unshot, self.emitted_power);
        report.error_bound = bound_factor(&self.elements).map(|f| bound(f, report.unshot_share));
        Ok(())
    }

    /// What has been solved so far.
    pub fn light(&self) -> Result<Light> {
        let count = self.elements.len();
        let direct: Vec<Vec3> = download(&self.device, &self.state.direct, count)?;
        let indirect: Vec<Vec3> = download(&self.device, &self.state.indirect, count)?;
        let irradiance: Vec<Vec3> = direct.iter().zip(&indirect).map(|(d, i)| d + i).collect();
        let mut radiosity: Vec<Vec3> = (0..count)
            .map(|e| self.elements.emitted[e] + self.elements.reflectance[e] * irradiance[e])
            .collect();
        let relief = match (&self.relief, &self.elements.relief) {
            (Some(buffers), Some(relief)) => {
                let light = ReliefLight::download(&self.device, &self.elements, relief, buffers)?;
                let reflected: Vec<Reflected> =
                    download(&self.device, &buffers.reflected, light.elements.len())?;
                for (&e, reflected) in light.elements.iter().zip(&reflected) {
                    radiosity[e as usize] = self.elements.emitted[e as usize] + reflected.sum;
                }
                Some(light)
            }
            _ => None,
        };
        Ok(Light {
            irradiance_direct: direct,
            irradiance,
            radiosity,
            relief,
        })
    }

    /// The form factors that the device keeps of `scene`, whose elements these are; none where nothing is kept.
    pub fn visibility(&self, scene: &Scene) -> Result<Option<Visibility>> {
        let Some(factors) = self.factors.as_ref().filter(|f| f.keeps()) else {
            return Ok(None);
        };
        let count = self.scene.source_count as usize;
        let rows = download(&self.device, &self.state.kept_rows, count)?;
        let (state, chunks) = factors.download(&self.device)?;
        let state = (state, factors.chunk_words);
        Ok(Some(Visibility::new(
            scene,
            &self.settings,
            (rows, chunks),
            state,
        )))
    }

    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Runs a number of batches, for benchmarks, and shows what each did.
    pub fn run_batches(&mut self, count: usize, mut look: impl FnMut(&BatchResult)) -> Result<()> {
        let mut left = count;
        self.batches.run(|batch| {
            look(batch);
            left = left.saturating_sub(1);
            left > 1
        })
    }

    /// What the sources with a relief sent by direction in the last batch, and all that they have been given to send; for
    /// comparison with the pass's twin. None without relief.
    pub fn relief_exits(&self) -> Result<Option<ReliefExits>> {
        let Some(relief) = &self.relief else {
            return Ok(None);
        };
        let k = relief.directions.count();
        let slots = self.batches.slots(&self.device)?;
        Ok(Some(ReliefExits {
            exits: download(&self.device, &relief.exits, 2 * k * slots.len())?,
            kept: download(
                &self.device,
                &relief.shot_exits,
                k * relief.source_count as usize,
            )?,
            slots,
        }))
    }

    /// The item buffers of the last batch, `[row][slot][column]`, and the sources that they belong to.
    pub fn item_buffers(&self) -> Result<(Vec<u32>, Vec<u32>)> {
        self.batches.item_buffers(&self.device)
    }
}

/// See [`Solver::relief_exits`]; radiosity πL, RGB, W·m⁻².
pub struct ReliefExits {
    /// The chosen sources, with what each had to send.
    pub slots: Vec<Slot>,
    /// `[slot][emitted, reflected][direction]` in the hemicube's frame; of slots without such a source, anything.
    pub exits: Vec<Vec3>,
    /// `[relief source][direction]`.
    pub kept: Vec<Vec3>,
}

/// Power that a unit of unshot power can still turn into: ρ + ρ² + … = ρ/(1 − ρ) for the largest ρ. None at ρ = 1.
fn bound_factor(elements: &Elements) -> Option<f64> {
    let rho = f64::from(elements.max_reflectance());
    (rho < 1.0).then(|| rho / (1.0 - rho))
}

/// Light still missing, as a share of the emitted: what is unshot can turn into no more; and sums in f32 may lose half a step of
/// every shot's light, which lacks as many bounces.
fn bound(factor: f64, unshot_share: f64) -> f64 {
    let rounding = f64::from(f32::EPSILON) / 2.0 * (1.0 + factor);
    (unshot_share + rounding) * factor.max(1.0)
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// Time until the unshot share falls to `target`, if it goes on falling as over the last half of the run.
fn time_left(history: &[(f64, f64)], target: f64) -> Option<Duration> {
    let &(now, share) = history.last()?;
    let &(then, share_then) = history.get(history.len() / 2)?;
    if share <= 0.0 || share >= share_then || now <= then {
        return None;
    }
    let rate = (share_then / share).ln() / (now - then);
    let left = ((share / target).ln() / rate).max(0.0);
    (left.is_finite() && left < 1e6).then(|| Duration::from_secs_f64(left))
}
