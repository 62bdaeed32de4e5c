//! `mesolux bake`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::baked::program;
use super::progress::{Bar, catch_interrupts, interrupted};
use super::{BakingDevices, Builtin};
use mesolux::atomic_file::with_ending;
use mesolux::bake::quality::{self, Quality};
use mesolux::bake::solution::{Origin, Solution};
use mesolux::error::{Error, Result};
use mesolux::math::directions::Directions;
use mesolux::mesh::sources::Grouping;
use mesolux::meso::{self, Transport};
use mesolux::scene::Scene;
use mesolux::solver::{
    Checkpoints, Estimator, Report, Settings, Solver, StopReason, Update, Visibility,
};
use mesolux::vk::Device;

/// Solve a scene and write the light on every element
///
/// The result is a safetensors file: vertices [E,3,3], area [E], normal [E,3], material [E],
/// irradiance [E,3], irradiance_direct [E,3], radiosity [E,3], in scene units and in the order of
/// the input. Elements with a relief (M of them, whose material has a height map) add meso_elements
/// [M], meso_frames [M,3,3], directions [K,3], incident_moment and incident_moment_direct [M,K,3,3]
/// (colour, vector), exitant [M,K,3]. Ctrl-C stops the solver and keeps what it has.
#[derive(Args)]
pub struct Options {
    /// A built-in name (cornell, cornell-box, cornell-relief, bowl-and-bunny, fruit-platter,
    /// brick-court, brick-wall, woven-cloth, embossed-plate), an .obj, .gltf or .glb
    /// file, or a scene.toml
    scene: String,
    /// The file to write
    #[arg(short, long, value_name = "OUT.safetensors")]
    output: PathBuf,
    /// Keep the form factors beside the bake, as OUT.visibility: some hundred MiB that --relight
    /// needs
    #[arg(long)]
    keep_visibility: bool,
    /// Light SCENE, of which emission and point lights may have changed, by the form factors that
    /// were kept with this bake
    #[arg(long, value_name = "BAKE.safetensors", conflicts_with_all = ["estimator", "preset"])]
    relight: Option<PathBuf>,
    /// Save progress every so many seconds in the folder OUT.checkpoint. After a crash, a kill or
    /// Ctrl-C the same command resumes from it; it is removed when the bake is done. 0 turns
    /// checkpoints off and starts from the beginning, as --preset paper always does
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    checkpoint: f64,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: BakingDevices,
    /// Threads of the CPU's own work; the result does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// How the scene is solved.
#[derive(Args, Clone, Serialize)]
pub struct SolveOptions {
    /// The paper's method to the letter, in place of ours: each element shoots from its own
    /// hemicube, and pixels bring light by the paper's equations; --residual is 0.05 unless given
    #[arg(
        long,
        value_enum,
        conflicts_with_all = [
            "estimator", "quality", "transport", "emitter_hemicube", "source_elements",
            "source_area", "source_power", "no_normalise", "no_carry", "visibility_memory",
        ],
    )]
    preset: Option<PresetName>,
    /// Form factors by Lambert's formula for each receiver, or by the pixels' sums as in the paper
    #[arg(long, value_enum, default_value = "receiver")]
    estimator: EstimatorName,
    /// Sets --hemicube, --residual and the sizes of the sources where they are not given, and how
    /// closely shadows of emitters and light beside surfaces are looked at; `bench pareto` measures
    /// what each gains. From high on it sets --fineness too
    #[arg(long, value_enum, default_value = "normal")]
    quality: QualityName,
    /// Pixels a side of a hemicube face [default: that of --quality, 128 for normal]
    #[arg(long, value_name = "N")]
    hemicube: Option<u32>,
    /// The same for sources that emit strongly, whose shadows are the sharpest, in place of shadow
    /// rays; as --hemicube draws them as all others [default: none, but with --estimator pixel four
    /// times --hemicube, at most 1024]
    #[arg(long, value_name = "N")]
    emitter_hemicube: Option<u32>,
    /// Stop when the error bound, as a share of the emitted power, is no more than this [default:
    /// that of --quality, 0.001 for normal]
    #[arg(long, value_name = "X")]
    residual: Option<f64>,
    /// Most elements of a relief that shoot together from one hemicube, and half as many as of a
    /// curved surface [default: that of --quality, 48 for normal]
    #[arg(long, value_name = "N")]
    source_elements: Option<usize>,
    /// Most area that shoots together, as a share of the scene's, less where it is lit unevenly;
    /// larger elements are cut [default: that of --quality, 1/256 for normal]
    #[arg(long, value_name = "X")]
    source_area: Option<f64>,
    /// Most emitted power that shoots together, as a share of the scene's [default: that of
    /// --quality, 1/32 for normal]
    #[arg(long, value_name = "X")]
    source_power: Option<f64>,
    /// Leave the form factors of closed rooms as they were found, in place of scaling them so that
    /// all light arrives; the report gives their sums either way
    #[arg(long)]
    no_normalise: bool,
    /// Leave the light of sources that are not drawn missing, in place of letting those beside them
    /// send it
    #[arg(long)]
    no_carry: bool,
    /// Stop after this many seconds
    #[arg(long, value_name = "SECONDS")]
    budget: Option<f64>,
    /// Stop after drawing this many sources
    #[arg(long, value_name = "N")]
    shots: Option<u32>,
    /// MiB on the device for the form factors of sources that have been drawn, which then need no
    /// drawing for their further shots; 0 draws for every shot [default: 768, or a third of the
    /// device's memory]
    #[arg(long, value_name = "MIB")]
    visibility_memory: Option<u64>,
    /// Turns the hemicubes about their axes: another seed, other aliasing
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Directions in which relief sends light: 16, 32, 64, 128 or 256; with --preset paper up to 64
    #[arg(long, value_name = "K", default_value_t = 64)]
    directions: u32,
    /// How relief takes part: keeping energy, by the paper's equations, or not at all
    #[arg(long, value_enum, default_value = "physical")]
    transport: TransportName,
    /// Folder that keeps the visibility of reliefs from run to run, and bakes that `render` makes
    /// of scenes, the 16 used last and 1 GiB at most [default: mesolux in the user's cache folder]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Compute everything anew and keep nothing
    #[arg(long, conflicts_with = "cache")]
    no_cache: bool,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PresetName {
    Paper,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum TransportName {
    /// Masking, shadowing and bounces inside the relief
    Physical,
    /// By equation (3) of the paper, all else as by default; loses energy
    Paper,
    /// Every element flat: no directions
    Lambert,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum QualityName {
    Preview,
    Draft,
    Normal,
    High,
    Reference,
}

#[derive(Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum EstimatorName {
    Receiver,
    Pixel,
}

/// Shares of the scene that a source may have at most: a smaller one would cut a scene into
/// millions of sources.
const SOURCE_SHARES: std::ops::RangeInclusive<f64> = 1e-6..=1.0;

impl SolveOptions {
    pub fn budget(&self) -> Result<Option<Duration>> {
        match self.budget {
            None => Ok(None),
            Some(seconds) if (0.0..=1e9).contains(&seconds) => {
                Ok(Some(Duration::from_secs_f64(seconds)))
            }
            Some(seconds) => Err(Error::Usage(format!(
                "--budget {seconds}: must be seconds, 0 or more"
            ))),
        }
    }

    /// The same with nothing left to the preset, to be kept beside the result.
    pub fn filled(&self) -> Result<Self> {
        let settings = self.settings()?;
        if self.preset.is_some() {
            // It leaves no choice of the others.
            return Ok(Self {
                hemicube: Some(settings.hemicube),
                residual: Some(settings.residual),
                ..self.clone()
            });
        }
        Ok(Self {
            hemicube: Some(settings.hemicube),
            emitter_hemicube: settings.emitter_shadows().face(),
            residual: Some(settings.residual),
            source_elements: Some(settings.grouping.max_elements),
            source_area: Some(settings.grouping.max_area),
            source_power: Some(settings.grouping.max_power),
            ..self.clone()
        })
    }

    fn grouping(&self, preset: Grouping) -> Result<Grouping> {
        let share = |name: &str, value: Option<f64>, preset| match value {
            None => Ok(preset),
            Some(share) if SOURCE_SHARES.contains(&share) => Ok(share),
            Some(share) => Err(Error::Usage(format!(
                "{name} {share}: must be in {} to {}",
                SOURCE_SHARES.start(),
                SOURCE_SHARES.end()
            ))),
        };
        if self.source_elements == Some(0) {
            return Err(Error::Usage(
                "--source-elements 0: must be at least 1".into(),
            ));
        }
        Ok(Grouping {
            max_elements: self.source_elements.unwrap_or(preset.max_elements),
            max_area: share("--source-area", self.source_area, preset.max_area)?,
            max_power: share("--source-power", self.source_power, preset.max_power)?,
            ..preset
        })
    }

    pub fn quality(&self) -> Quality {
        match self.quality {
            QualityName::Preview => Quality::Preview,
            QualityName::Draft => Quality::Draft,
            QualityName::Normal => Quality::Normal,
            QualityName::High => Quality::High,
            QualityName::Reference => Quality::Reference,
        }
    }

    pub fn settings(&self) -> Result<Settings> {
        if self.preset.is_some() {
            let preset = quality::paper(self.directions)?;
            return Ok(Settings {
                hemicube: self.hemicube.unwrap_or(preset.hemicube),
                residual: self.residual.unwrap_or(preset.residual),
                budget: self.budget()?,
                shots: self.shots,
                seed: self.seed,
                ..preset
            });
        }
        let preset = self.quality().settings();
        Ok(Settings {
            estimator: match self.estimator {
                EstimatorName::Receiver => Estimator::Receiver,
                EstimatorName::Pixel => Estimator::Pixel,
            },
            hemicube: self.hemicube.unwrap_or(preset.hemicube),
            emitter_hemicube: self.emitter_hemicube.or(preset.emitter_hemicube),
            residual: self.residual.unwrap_or(preset.residual),
            grouping: self.grouping(preset.grouping)?,
            normalise: !self.no_normalise,
            carries: !self.no_carry,
            budget: self.budget()?,
            shots: self.shots,
            seed: self.seed,
            visibility_memory: match self.visibility_memory {
                Some(mib) => Some(mib.checked_mul(1 << 20).ok_or_else(|| {
                    Error::Usage(format!("--visibility-memory {mib}: too large"))
                })?),
                None => None,
            },
            relief: meso::Options {
                transport: match self.transport {
                    TransportName::Physical => Transport::Physical,
                    TransportName::Paper => Transport::Paper,
                    TransportName::Lambert => Transport::Lambert,
                },
                directions: Directions::new(self.directions)?,
                cache: match &self.cache {
                    Some(dir) => Some(dir.clone()),
                    None if self.no_cache => None,
                    None => cache_folder(),
                },
            },
            ..preset
        })
    }
}

/// Where programs of this user keep what they can make again.
pub fn cache_folder() -> Option<PathBuf> {
    let absolute = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|p| p.is_absolute())
    };
    let folder = absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("LOCALAPPDATA"))
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")));
    folder.map(|folder| folder.join("mesolux"))
}

/// What `--json` prints beside the solver's report.
#[derive(Serialize)]
struct Printed<'a> {
    scene: &'a str,
    scene_hash: &'a str,
    /// Names need not be UTF-8.
    output: String,
    read_seconds: f64,
    wall_seconds: f64,
    peak_resident_bytes: Option<u64>,
    #[serde(flatten)]
    report: &'a Report,
}

pub fn run(options: &Options) -> Result<()> {
    let start = Instant::now();
    set_threads(options.threads)?;
    let mut settings = Settings {
        checkpoints: options.checkpoints()?,
        ..options.solve.settings()?
    };
    settings.check()?;
    if (options.output.extension()).is_some_and(|e| !e.eq_ignore_ascii_case("safetensors")) {
        return Err(Error::file(
            &options.output,
            "a bake is a .safetensors file; `render` draws pictures",
        ));
    }
    writable(&options.output)?;
    let quality = options.solve.quality();
    let scene = options.builtin.load_for(quality, &options.scene)?;
    let read_seconds = start.elapsed().as_secs_f64();
    let kept = options
        .relight
        .as_ref()
        .map(|bake| kept_with(bake))
        .transpose()?;
    let devices = options.device.open()?;
    let budget = settings.budget;
    settings.budget = budget.map(|budget| budget.saturating_sub(start.elapsed()));
    let solver = solve_visibly(&devices, &scene, &settings, kept.as_ref())?;
    let solution = mesolux::bake::solution(&scene, &solver)?;
    refuse_darkness(&scene, &solution)?;
    options.device.check()?;
    let origin = origin(&options.scene, &options.builtin, scene.input_hash());
    let report = &solution.report;
    let output = match report.stop {
        StopReason::Interrupted => unfinished(&options.output),
        _ => options.output.clone(),
    };
    let filled = options.solve.filled()?;
    save_somewhere(&output, |path| solution.save(path, &origin, &filled))?;
    match (report.stop, &settings.checkpoints) {
        (_, None) => {}
        (StopReason::Interrupted, Some(checkpoints)) => {
            if checkpoints.exist() {
                let folder = checkpoints.folder.display();
                tracing::info!("the same command goes on from {folder}");
            }
        }
        (_, Some(checkpoints)) => checkpoints.remove(),
    }
    if options.keep_visibility {
        let path = beside(&output);
        match solver.visibility(&scene)? {
            Some(visibility) => visibility.save(&path)?,
            None => tracing::warn!("no form factors are kept: --keep-visibility writes nothing"),
        }
    }
    tracing::info!(
        "{}: {} elements, {} sources, {} hemicubes in {:.1} s; unshot {:.3} %, stopped by {:?}",
        output.display(),
        report.elements,
        report.sources,
        report.hemicubes,
        report.seconds.solve_wall,
        100.0 * report.unshot_share,
        report.stop
    );
    if let Some(found) = &report.discretisation {
        tracing::info!("estimated error of cutting into elements: {found}");
    }
    if let Some(relief) = &report.relief {
        tracing::info!(
            "{} elements with relief in {} directions, {} kinds of relief",
            relief.elements,
            relief.directions,
            relief.classes.len()
        );
    }
    if options.json {
        let printed = Printed {
            scene: &options.scene,
            scene_hash: &origin.hash,
            output: output.display().to_string(),
            read_seconds,
            wall_seconds: start.elapsed().as_secs_f64(),
            peak_resident_bytes: peak_resident_bytes(),
            report,
        };
        let text = serde_json::to_string(&printed).map_err(|e| Error::Usage(e.to_string()))?;
        mesolux::say!("{text}");
    }
    Ok(())
}

impl Options {
    fn checkpoints(&self) -> Result<Option<Checkpoints>> {
        let seconds = self.checkpoint;
        if !(0.0..=1e9).contains(&seconds) {
            let what = format!("--checkpoint {seconds}: must be seconds, 0 or more");
            return Err(Error::Usage(what));
        }
        Ok((seconds > 0.0).then(|| Checkpoints {
            folder: with_ending(&self.output, ".checkpoint"),
            every: Duration::from_secs_f64(seconds),
            maker: program(),
        }))
    }
}

/// Where a bake goes that was stopped: not over a file that may be a whole one.
fn unfinished(output: &Path) -> PathBuf {
    if !output.is_file() {
        return output.to_owned();
    }
    let path = with_ending(output, ".unfinished.safetensors");
    tracing::warn!(
        "{} is left as it is; what is solved goes to {}",
        output.display(),
        path.display()
    );
    path
}

/// Saves to `output`, or where that fails, after all the work, to the folder of temporary files.
///
/// # Errors
/// That of the output, even where the other was written.
fn save_somewhere(output: &Path, save: impl Fn(&Path) -> Result<()>) -> Result<()> {
    let failed = match save(output) {
        Ok(()) => return Ok(()),
        Err(error) => error,
    };
    let folder = tempfile::Builder::new().prefix("mesolux-").tempdir();
    let kept = folder.ok().and_then(|folder| {
        save(&folder.path().join("bake.safetensors")).ok()?;
        Some(folder.keep().join("bake.safetensors"))
    });
    match kept {
        Some(path) => tracing::warn!("the bake is kept as {}", path.display()),
        None => tracing::warn!("nor is there room for the bake among temporary files"),
    }
    Err(failed)
}

/// Bakes with progress on stderr; Ctrl-C stops the bake and keeps what it has.
pub fn bake_visibly(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<Solution> {
    let devices = [Arc::clone(device)];
    let solution =
        mesolux::bake::solution(scene, &solve_visibly(&devices, scene, settings, None)?)?;
    refuse_darkness(scene, &solution)?;
    Ok(solution)
}

/// # Errors
/// A bake that ran to its end, and on whose surfaces no light arrives.
fn refuse_darkness(scene: &Scene, solution: &Solution) -> Result<()> {
    let is_dark = solution.irradiance.iter().all(|e| *e == glam::Vec3::ZERO);
    if !is_dark || solution.report.stop != StopReason::Residual {
        return Ok(());
    }
    let path = scene.path.as_ref();
    Err(Error::Scene {
        scene: path.map_or_else(|| scene.name.clone(), |path| path.display().to_string()),
        what: "no light arrives on any surface: no front of one faces the front of a lamp; turn \
               lamps or meshes by reverse or sides in scene.toml"
            .into(),
    })
}

fn solve_visibly(
    devices: &[Arc<Device>],
    scene: &Scene,
    settings: &Settings,
    kept: Option<&Visibility>,
) -> Result<Solver> {
    catch_interrupts();
    let bar = Bar::new();
    let solver = mesolux::bake::solve_on(devices, scene, settings, kept, |update| {
        bar.show(progress(update));
        !interrupted()
    });
    bar.finish();
    solver
}

/// Where the form factors of a bake are kept.
pub fn beside(bake: &Path) -> PathBuf {
    bake.with_extension("visibility")
}

fn kept_with(bake: &Path) -> Result<Visibility> {
    let path = beside(bake);
    if bake.is_file() && !path.is_file() {
        return Err(Error::file(
            bake,
            format!(
                "has no {}: bake with --keep-visibility first",
                path.display()
            ),
        ));
    }
    Visibility::load(&path)
}

/// Where the scene came from, for the bake's metadata; paths are made absolute.
pub fn origin(scene: &str, builtin: &Builtin, hash: String) -> Origin {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let named = mesolux::scene::builtin::NAMES.contains(&scene);
    Origin {
        scene: if named {
            scene.to_owned()
        } else {
            absolute(scene.as_ref()).to_string_lossy().into_owned()
        },
        relative: None,
        patches: builtin.patches,
        statue: builtin.statue.as_deref().map(absolute),
        import: builtin.import(),
        hash,
    }
}

fn set_threads(threads: Option<usize>) -> Result<()> {
    let Some(threads) = threads else {
        return Ok(());
    };
    if threads == 0 {
        return Err(Error::Usage("--threads 0: must be at least 1".into()));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| Error::Usage(format!("--threads {threads}: {e}")))
}

/// Refuses an output that cannot be written before the work, not after it.
pub fn writable(path: &std::path::Path) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => std::path::Path::new("."),
    };
    if path.is_dir() {
        return Err(Error::write(path, std::io::ErrorKind::IsADirectory.into()));
    }
    tempfile::Builder::new()
        .prefix(".mesolux-")
        .tempfile_in(folder)
        .map(|_| ())
        // Its own text names the file that was tried.
        .map_err(|e| Error::write(path, e.kind().into()))
}

fn peak_resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// A line on how far the solver is.
pub fn progress(update: &Update) -> String {
    let bound = update
        .error_bound
        .map_or("none".to_owned(), |b| format!("{:.2} %", 100.0 * b));
    let left = update.left.map_or(String::new(), |left| {
        format!(", about {:.0} s left", left.as_secs_f64())
    });
    format!(
        "{} shots from {} sources in {:.0} s, unshot {:.3} %, error bound {bound}{left}",
        update.shots,
        update.sources,
        update.elapsed.as_secs_f64(),
        100.0 * update.unshot_share
    )
}
