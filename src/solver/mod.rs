//! Solves the light of a scene: it alone orders the passes.
//!
//! ```text
//! rows ─► coupling ─► solve ─► gather
//! ```
//!
//! `spine` is the method. The paper's own is `shots`: progressive radiosity, pixel by pixel.

mod ambient;
mod coupling;
mod devices;
mod drawing;
mod estimate;
mod exchange;
mod gather;
mod joined;
mod journal;
mod kept_parts;
mod ledger;
mod look;
mod makers;
mod member;
mod messages;
mod near;
#[cfg(feature = "mpi")]
mod near_search;
mod packed;
mod places;
mod problem;
mod progress;
#[cfg(feature = "mpi")]
mod ranks;
mod relief_light;
mod report;
mod row_maker;
mod rows;
mod self_test;
mod settings;
mod shared_items;
mod shares;
mod shots;
mod spine;
mod system;
mod team;
mod threads;
mod turns;
mod visibility;
mod word_file;

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DVec3, Vec3, Vec4};
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::passes::buffers::{SceneBuffers, download};
use crate::passes::fresh_rows::RowShape;
use crate::passes::types::{CouplingTarget, Slot};
use crate::scene::{Lights, Scene};
use crate::vk::Device;

pub use ambient::Ambient;
pub use devices::{Crew, open_devices, open_in_turn, started_together};
pub use journal::Checkpoints;
pub use look::ItemPicture;
pub use places::{Arriving, LightAt, Lit, Place, Senders, SentByDirection};
pub use problem::Problem;
pub use progress::Update;
use progress::{Bound, Watch};
#[cfg(feature = "mpi")]
pub use ranks::Ranks;
pub use relief_light::ReliefLight;
pub use report::{BY_PAPER, Discretisation, Report, Seconds, Skipped, StopReason, SurfaceError};
pub use rows::Stages;
pub use self_test::{choose_device, ids_come_back_right, open_device};
pub use settings::{
    COUPLING_MEMORY, EMITTER_SCALE, EmitterShadows, Estimator, HEMICUBE_RANGE, Settings,
    VISIBILITY_MEMORY,
};
use shots::Shots;
use spine::Spine;
pub use visibility::Visibility;

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
    pub problem: Problem,
    method: Method,
    report: Report,
    bound: Bound,
}

/// How light is brought from source to element.
#[allow(clippy::large_enum_variant)] // one of them lives as long as the solver
enum Method {
    Rows(Spine),
    Shots(Shots),
}

impl Method {
    /// Names of the devices but the first.
    fn other_devices(&self) -> Vec<String> {
        match self {
            Self::Rows(spine) => spine.team.other_devices(),
            Self::Shots(_) => Vec::new(),
        }
    }
}

impl Solver {
    /// Groups the elements into sources and brings everything to the device.
    pub fn new(
        device: &Arc<Device>,
        elements: Elements,
        lights: &Lights,
        settings: &Settings,
    ) -> Result<Self> {
        Self::by(&device.into(), elements, lights, settings, None)
    }

    /// As [`Self::new`], for the `elements` of a scene whose rows were kept when it was lit
    /// otherwise. The sources are cut as they were then; point lights are drawn. See
    /// [`Visibility::check`].
    ///
    /// # Errors
    /// Emission of elements that neither emitted nor reflected then.
    pub fn relit(
        device: &Arc<Device>,
        elements: Elements,
        lights: &Lights,
        settings: &Settings,
        kept: &Visibility,
    ) -> Result<Self> {
        Self::by(&device.into(), elements, lights, settings, Some(kept))
    }

    /// As [`Self::new`] or [`Self::relit`], with all devices of a crew: each finds and keeps the
    /// form factors of its share of the elements. Devices that draw alike, as those of one kind and
    /// driver do, give the same bytes as one, if all rows find room.
    ///
    /// # Errors
    /// No device, or several for what one alone can do; see [`Crew::check`].
    pub fn by(
        crew: &Crew,
        elements: Elements,
        lights: &Lights,
        settings: &Settings,
        kept: Option<&Visibility>,
    ) -> Result<Self> {
        settings.check()?;
        let device = crew.check(settings)?;
        let start = Instant::now();
        let (problem, scene) = Problem::new(crew, elements, lights, settings, kept)?;
        let bound = Bound::new(&problem);
        let method = match settings.estimator {
            Estimator::Paper => {
                let scene = SceneBuffers::new(device, &scene, scene.shape)?;
                Method::Shots(Shots::new(device, &problem, scene, bound)?)
            }
            _ => Method::Rows(Spine::new(crew, &problem, scene, bound, kept)?),
        };
        let mut report = Report::new(device, &problem, &method.other_devices());
        report.seconds.setup = start.elapsed().as_secs_f64();
        Ok(Self {
            device: Arc::clone(device),
            problem,
            method,
            report,
            bound,
        })
    }

    /// Lights the scene again by the emission and the point lights of `scene`, which is otherwise
    /// the one that is solved: what has been drawn is not drawn again, but for point lights that
    /// have moved. All light is gone until the next [`Self::run`].
    ///
    /// # Errors
    /// Emission of elements that neither emitted nor reflected; another number of point lights; the
    /// paper's method. The solver is then as it was. A device that fails.
    pub fn relight(&mut self, scene: &Scene) -> Result<()> {
        let start = Instant::now();
        let Method::Rows(spine) = &mut self.method else {
            let what = "the paper's method keeps no form factors: bake again";
            return Err(Error::Usage(what.into()));
        };
        let relit = self.problem.relight(scene)?;
        self.bound = Bound::new(&self.problem);
        spine.relight(&self.problem, self.bound, &relit)?;
        let others = spine.team.other_devices();
        self.report = Report::new(&self.device, &self.problem, &others);
        self.report.seconds.setup = start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Goes on from the checkpoint of the settings, if there is one, and writes one from now on.
    /// `scene` is what names the bake: another one's checkpoint is not used. The paper's method
    /// writes none.
    ///
    /// # Errors
    /// A device that fails.
    pub fn keep_checkpoints(&mut self, scene: &str) -> Result<()> {
        let Method::Rows(spine) = &mut self.method else {
            return Ok(());
        };
        let settings = &self.problem.settings;
        let Some(checkpoints) = &settings.checkpoints else {
            return Ok(());
        };
        let devices = &spine.team.devices;
        let maker = &checkpoints.maker;
        let key = format!("{maker}\n{devices:?}\n{scene}\n{}", settings.key());
        let key = word_file::hexadecimal(Sha256::new_with_prefix(key));
        spine.keep_checkpoints(checkpoints, key, &mut self.report)
    }

    /// Takes time that has gone by from the budget.
    pub fn spend(&mut self, time: Duration) {
        let budget = &mut self.problem.settings.budget;
        *budget = budget.map(|budget| budget.saturating_sub(time));
    }

    /// Solves until a stop rule holds, or `go_on` says no. What has been solved so far is always
    /// valid, and a further call goes on from it.
    pub fn run(&mut self, go_on: impl FnMut(&Update) -> bool) -> Result<()> {
        self.turn(go_on)?;
        self.gather()
    }

    /// Brings to the elements the direct light alone, but for the sky's: much sooner than
    /// [`Self::turn`] solves all of it after [`Self::relight`]. Parts of near emitters count evenly
    /// until then. The paper's method brings nothing.
    ///
    /// # Errors
    /// A device that fails.
    pub fn gather_emitted(&mut self) -> Result<()> {
        let start = Instant::now();
        if let Method::Rows(spine) = &mut self.method {
            spine.bring_emitted(&self.problem, &mut self.report)?;
        }
        self.note_left();
        self.report.seconds.solve_wall += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Brings to the elements what coupling makes of the light of the sources that are drawn: nearly
    /// all of it after [`Self::relight`], sooner than [`Self::turn`] draws and measures what is left.
    /// Whether all was brought, since `go_on` did not say no.
    ///
    /// # Errors
    /// A device that fails.
    pub fn gather_coupled(&mut self, mut go_on: impl FnMut() -> bool) -> Result<bool> {
        let start = Instant::now();
        let mut whole = true;
        if let Method::Rows(spine) = &mut self.method {
            let (on, report) = (&self.problem, &mut self.report);
            spine.carry(on, report);
            whole = spine.bring(on, false, report, &mut go_on)?.is_some();
        }
        self.note_left();
        self.report.seconds.solve_wall += start.elapsed().as_secs_f64();
        Ok(whole)
    }

    /// Brings to the elements what has been solved by [`Self::turn`].
    pub fn gather(&mut self) -> Result<()> {
        let start = Instant::now();
        if let Method::Rows(spine) = &mut self.method {
            let _moved = spine.bring(&self.problem, false, &mut self.report, &mut || true)?;
        }
        self.report.seconds.solve_wall += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// As [`Self::run`], but where `go_on` has said no, the elements do not receive what has been
    /// solved since the last time until [`Self::gather`].
    pub fn turn(&mut self, mut go_on: impl FnMut(&Update) -> bool) -> Result<()> {
        let start = Instant::now();
        let on = &self.problem;
        let mut watch = Watch::new(on, self.bound, &mut go_on);
        let report = &mut self.report;
        match &mut self.method {
            Method::Rows(spine) => spine.run(on, report, &mut watch)?,
            Method::Shots(shots) => shots.run(on, report, &mut watch)?,
        }
        report.stop = watch.stop.unwrap_or(StopReason::Residual);
        report.seconds.solve_wall += start.elapsed().as_secs_f64();
        self.note_left();
        Ok(())
    }

    /// Reports what has not been shot.
    fn note_left(&mut self) {
        let (unshot, missing) = match &self.method {
            Method::Rows(spine) => (spine.ledger.unshot(), spine.ledger.missing()),
            Method::Shots(shots) => (shots.left(), self.bound.importance() * shots.left()),
        };
        self.report.unshot_share = self.bound.share(unshot);
        self.report.error_bound = self.bound.of(missing);
    }

    /// What has been solved so far.
    ///
    /// # Errors
    /// A device that fails.
    pub fn light(&self) -> Result<Light> {
        let Problem { elements, .. } = &self.problem;
        let spine = match &self.method {
            Method::Rows(spine) => spine,
            Method::Shots(shots) => return shots.light(elements),
        };
        let ([mut direct, mut indirect], sums) = spine.team.light()?;
        // What rounding leaves below none is none.
        let add = |light: &mut [Vec3], near: &[DVec3]| {
            for (light, near) in light.iter_mut().zip(near) {
                *light = (light.as_dvec3() + near).max(DVec3::ZERO).as_vec3();
            }
        };
        add(&mut direct, &spine.near.direct);
        add(&mut indirect, &spine.near.indirect);
        let irradiance: Vec<Vec3> = direct.iter().zip(&indirect).map(|(d, i)| d + i).collect();
        let mut radiosity: Vec<Vec3> = (0..elements.len())
            .map(|e| elements.emitted[e] + elements.reflectance[e] * irradiance[e])
            .collect();
        let relief = match (sums, &elements.relief) {
            (Some(sums), Some(relief)) => {
                let first = elements.len() - relief.count();
                for (e, &reflected) in (first..).zip(&sums.reflected) {
                    radiosity[e] = elements.emitted[e] + reflected;
                }
                Some(ReliefLight::new(elements, relief, sums))
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

    /// The rows that the device keeps of `scene`, whose elements these are, with their coupling;
    /// none where nothing is kept.
    ///
    /// # Errors
    /// A device that fails.
    pub fn visibility(&self, scene: &Scene) -> Result<Option<Visibility>> {
        let Method::Rows(spine) = &self.method else {
            return Ok(None);
        };
        if !spine.team.keeps() {
            return Ok(None);
        }
        let parts = spine.team.rows()?;
        let elements = &self.problem.elements;
        let meso_count = elements.len() - elements.plain_count();
        let shape = RowShape::whole(elements.len() as u32, meso_count as u32);
        let kept = visibility::Kept {
            rows: spine.ledger.rows(),
            coupling: spine.ledger.system.rows().collect(),
            parts,
            shape,
            chunk_words: spine.team.whole_chunk_words(shape),
        };
        Ok(Some(Visibility::new(scene, &self.problem, kept)))
    }

    /// Draws sources, no more than fit a batch, without taking them into the solution: for
    /// benchmarks and comparisons with the twins. Their rows take room from those of the solution.
    ///
    /// # Panics
    /// Of the paper's method, which makes no rows.
    pub fn draw(&mut self, sources: &[u32]) -> Result<DrawnBatch> {
        let on = &self.problem;
        match &mut self.method {
            Method::Rows(spine) => spine.draw_alone(on, sources),
            Method::Shots(_) => panic!("the paper's method makes no rows"),
        }
    }

    /// The sources as they receive, in the order of the words of [`DrawnBatch::coupling`].
    pub fn coupling_targets(&self) -> &[CouplingTarget] {
        match &self.method {
            Method::Rows(spine) => &spine.ledger.system.targets.list,
            Method::Shots(_) => &[],
        }
    }

    /// To the first device's queue since it was opened.
    pub fn submissions(&self) -> u64 {
        self.device.submissions()
    }

    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The last sources that were gathered and what each sent, with what those with a relief sent
    /// by direction; for comparison with the pass's twin. None without relief.
    pub fn relief_exits(&self, count: usize) -> Result<Option<ReliefExits>> {
        let Method::Rows(spine) = &self.method else {
            return Ok(None);
        };
        let first = spine.team.first();
        let Some(relief) = &first.relief else {
            return Ok(None);
        };
        let k = relief.shape.directions.count();
        let slots = first.gathered_slots(count)?;
        Ok(Some(ReliefExits {
            slots,
            exits: download::<Vec4>(&self.device, &relief.exits, 2 * k * count)?
                .into_iter()
                .map(Vec4::truncate)
                .collect(),
            kept: download(
                &self.device,
                &relief.shot_exits,
                k * relief.shape.source_count as usize,
            )?,
        }))
    }
}

/// What [`Solver::draw`] drew.
#[derive(Debug, Clone)]
pub struct DrawnBatch {
    pub stages: Stages,
    /// `[source][face]`: meshlets kept, triangles tested, triangles drawn.
    pub counts: Vec<Vec<[u32; 3]>>,
    /// Item buffers, `[row][slot][column]`: columns of N × 3N pixels side by side, one a slot of a
    /// batch.
    pub items: Vec<u32>,
    /// Slots of a batch.
    pub slots: u32,
    /// Elements that see nothing of each source, whatever stands between.
    pub facing_away: Vec<u32>,
    /// `[source][word]`; see [`Solver::coupling_targets`].
    pub coupling: Vec<Vec<f32>>,
}

/// See [`Solver::relief_exits`]; radiosity πL, RGB, W·m⁻².
pub struct ReliefExits {
    /// The sources, with what each had to send.
    pub slots: Vec<Slot>,
    /// `[slot][emitted, reflected][direction]` in the hemicube's frame; of slots without such a
    /// source, anything.
    pub exits: Vec<Vec3>,
    /// `[relief source][direction]`.
    pub kept: Vec<Vec3>,
}
