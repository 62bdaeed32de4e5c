//! `mesolux bake`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;

use super::baked::program;
use super::output::{save_somewhere, unfinished, writable};
use super::progress::{Bar, catch_interrupts, interrupted};
use super::solve_options::SolveOptions;
use super::{BakingDevices, Builtin};
use mesolux::atomic_file::with_ending;
use mesolux::bake::solution::{Origin, Solution};
use mesolux::error::{Error, Result};
use mesolux::scene::Scene;
use mesolux::solver::{
    Checkpoints, Crew, Report, Settings, Solver, StopReason, Update, Visibility,
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
    /// brick-court, brick-corner, brick-wall, woven-cloth, embossed-plate), an .obj, .gltf or .glb
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
    pub threads: Option<usize>,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
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

#[cfg(not(feature = "mpi"))]
pub fn run(options: &Options) -> Result<()> {
    match mesolux::solver::started_together() {
        1 => bake(options, || options.device.open()),
        many => Err(Error::Usage(format!(
            "{many} processes were started together, and this build has no MPI: \
             cargo build --release --features mpi"
        ))),
    }
}

/// One of the processes of an `mpirun`, or alone.
#[cfg(feature = "mpi")]
pub fn run(options: &Options) -> Result<()> {
    let Some(ranks) = mesolux::solver::Ranks::join()?.map(Arc::new) else {
        return bake(options, || options.device.open());
    };
    let open = || options.device.open_in_turn(ranks.local_rank());
    let done = match ranks.rank() {
        0 => bake(options, || {
            let device = open()?;
            let (name, others) = (device.name(), ranks.count() - 1);
            let of = if others == 1 { "process" } else { "processes" };
            tracing::info!("device: {name}, and one in each of {others} other {of}");
            Ok(Crew::with_ranks(&device, Arc::clone(&ranks)))
        }),
        _ => open().and_then(|device| ranks.serve(&device)),
    };
    // Only the first is waited for by nobody.
    let is_awaited = ranks.is_broken() || ranks.rank() > 0;
    if let (Err(error), true) = (&done, is_awaited) {
        mesolux::console::tell_error(error);
        ranks.abort();
    }
    ranks.end();
    done
}

fn bake(options: &Options, open: impl FnOnce() -> Result<Crew>) -> Result<()> {
    let start = Instant::now();
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
    let crew = open()?;
    let budget = settings.budget;
    settings.budget = budget.map(|budget| budget.saturating_sub(start.elapsed()));
    let solver = solve_visibly(&crew, &scene, &settings, kept.as_ref())?;
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

/// Bakes with progress on stderr; Ctrl-C stops the bake and keeps what it has.
pub fn bake_visibly(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<Solution> {
    let solver = solve_visibly(&device.into(), scene, settings, None)?;
    let solution = mesolux::bake::solution(scene, &solver)?;
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
    crew: &Crew,
    scene: &Scene,
    settings: &Settings,
    kept: Option<&Visibility>,
) -> Result<Solver> {
    catch_interrupts();
    let bar = Bar::new();
    let solver = mesolux::bake::solve_by(crew, scene, settings, kept, |update| {
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
