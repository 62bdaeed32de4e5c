//! Commands and what they share.

mod bake;
mod bake_scene;
mod baked;
mod bench;
mod bench_pictures;
mod bench_report;
mod camera;
mod compare;
mod develop;
mod devices;
mod export;
mod info;
mod inside;
#[cfg(unix)]
mod out_of_memory;
mod output;
mod pareto;
mod progress;
mod reference;
mod render;
mod scene;
mod series;
mod shell;
mod show;
mod solve_options;
#[cfg(feature = "window")]
mod view;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use mesolux::bake::quality::Quality;
use mesolux::beside::beside;
use mesolux::console;
use mesolux::error::{Error, Result};
use mesolux::scene::{ImportOptions, LoadOptions, Refinement, Scene};
use mesolux::solver::Crew;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

/// Bake and draw global illumination with Vulkan: progressive radiosity through hemicube item
/// buffers.
///
/// SCENE is a built-in name (cornell, cornell-box, cornell-relief, bowl-and-bunny, fruit-platter,
/// brick-court, brick-corner, brick-wall, woven-cloth, embossed-plate), an .obj, .gltf or .glb file,
/// or a scene.toml. Results go to files and stdout, everything else to stderr. Exit code 2 means
/// that an input was wrong or an output could not be written; 130, 143 and 129 that Ctrl-C, `kill`
/// or a closed terminal stopped the work, and that what was done by then is kept.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    /// Say warnings and errors alone
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Colours on stderr
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t = Colours::Auto)]
    color: Colours,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Colours {
    /// On a terminal, unless NO_COLOR is set
    Auto,
    Always,
    Never,
}

impl Colours {
    fn are_shown(self) -> bool {
        let refused = || std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        match self {
            Self::Auto => std::io::stderr().is_terminal() && !refused(),
            Self::Always => true,
            Self::Never => false,
        }
    }
}

#[derive(Subcommand)]
enum Command {
    Bake(bake::Options),
    Render(render::Options),
    #[cfg(feature = "window")]
    View(view::Options),
    /// Takes what the other takes, to say what it lacks.
    #[cfg(not(feature = "window"))]
    #[command(hide = true, disable_help_flag = true)]
    View {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        _given: Vec<std::ffi::OsString>,
    },
    Export(export::Options),
    Compare(compare::Options),
    Scene(scene::Options),
    Info(info::Options),
    Bench(bench::Options),
    Completions(shell::CompletionsOptions),
    Man(shell::ManOptions),
}

/// How a scene is read: options of built-in scenes, and how finely others are cut.
#[derive(Args, Clone)]
struct Builtin {
    /// Built-in scenes: exactly this many elements, before they are cut
    #[arg(long, value_name = "N")]
    patches: Option<usize>,
    /// Built-in scenes: this mesh as the statue
    #[arg(long, value_name = "MESH.obj")]
    statue: Option<PathBuf>,
    /// Cut triangles whose edges are longer than this, in scene units, and shorter ones where
    /// surfaces are close or shadows end [default: by the scene's area; built-in scenes are cut
    /// only where this or --fineness asks for it]
    #[arg(long, value_name = "X")]
    element_size: Option<f64>,
    /// Cut to triangles this much smaller than by default, 1 to 16, and built-in scenes too from
    /// above 1 on [default: that of --quality, 1 for normal, 2 for high]
    #[arg(long, value_name = "X")]
    fineness: Option<f64>,
    /// Cut to no more triangles than this
    #[arg(long, value_name = "N", default_value_t = Refinement::default().max_elements)]
    max_elements: usize,
    /// Light every triangle as it is
    #[arg(long, conflicts_with_all = ["element_size", "fineness"])]
    no_refine: bool,
    /// Leave a normal map without a height map out, instead of integrating heights from it
    #[arg(long)]
    no_heights_from_normals: bool,
    /// The z axis of OBJ files points up
    #[arg(long)]
    z_up: bool,
    /// Leave surfaces that show light only their backs, instead of turning them
    #[arg(long)]
    sides_as_given: bool,
}

impl Builtin {
    fn import(&self) -> ImportOptions {
        ImportOptions {
            heights_from_normals: !self.no_heights_from_normals,
            z_up: self.z_up,
            sides_as_given: self.sides_as_given,
        }
    }

    /// The scene as it is read, with what there is to say of it, and cut.
    fn load(&self, name: &str) -> Result<Scene> {
        self.load_for(Quality::default(), name)
    }

    /// The same, cut only where options ask for it.
    fn load_as_made(&self, name: &str) -> Result<Scene> {
        match self.element_size.is_none() && self.fineness.is_none() {
            true => self.read(name),
            false => self.load(name),
        }
    }

    /// The same, cut as finely as a bake of that quality wants it.
    fn load_for(&self, quality: Quality, name: &str) -> Result<Scene> {
        let scene = self.read(name)?;
        for note in &scene.notes {
            tracing::info!("{note}");
        }
        for warning in &scene.warnings {
            tracing::warn!("{warning}");
        }
        if scene.dropped_degenerate > 0 {
            tracing::warn!(
                "{} triangles without area were left out",
                scene.dropped_degenerate
            );
        }
        Ok(self.refined(name, scene, quality))
    }

    fn read(&self, name: &str) -> Result<Scene> {
        if let Some(size) = self.element_size
            && !(size.is_finite() && size > 0.0)
        {
            return Err(Error::Usage(format!(
                "--element-size {size}: must be above 0"
            )));
        }
        if let Some(fineness) = self.fineness
            && !(1.0..=16.0).contains(&fineness)
        {
            return Err(Error::Usage(format!(
                "--fineness {fineness}: must be in 1 to 16"
            )));
        }
        mesolux::scene::load(
            name,
            &LoadOptions {
                patches: self.patches,
                statue: self.statue.clone(),
                import: self.import(),
            },
        )
    }

    fn refined(&self, name: &str, scene: Scene, quality: Quality) -> Scene {
        let refinement = Refinement {
            element_size: self.element_size,
            fineness: self.fineness.unwrap_or(quality.fineness()),
            max_elements: self.max_elements,
        };
        if self.no_refine || !refinement.is_for(name) {
            return scene;
        }
        let before = scene.triangles.len();
        let scene = scene.refined(&refinement);
        let now = scene.triangles.len();
        if now > before {
            tracing::info!("{before} triangles are cut to {now} elements; --no-refine leaves them");
        }
        if let Some(note) = scene
            .notes
            .last()
            .filter(|note| note.contains("--max-elements"))
        {
            tracing::warn!("{note}");
        }
        scene
    }
}

/// The choice of device, and validation.
#[derive(Args, Clone)]
struct DeviceOptions {
    /// Vulkan device by its index or a part of its name (see `mesolux info`); the best one if not
    /// given
    #[arg(long, value_name = "INDEX|NAME")]
    device: Option<String>,
    /// Watch every Vulkan call with the validation layer
    #[arg(long)]
    validate: bool,
}

/// Set to anything, the validation layer watches every run: the tests set it for those they start.
const VALIDATE: &str = "MESOLUX_VALIDATE";

fn watched(asked: bool) -> bool {
    asked || std::env::var_os(VALIDATE).is_some()
}

impl DeviceOptions {
    fn open(&self) -> Result<std::sync::Arc<mesolux::vk::Device>> {
        let (device, ()) = self.open_beside(|| Ok(()))?;
        Ok(device)
    }

    /// Opens the device while `read` reads what is given, whose errors come first.
    fn open_beside<T>(
        &self,
        read: impl FnOnce() -> Result<T>,
    ) -> Result<(std::sync::Arc<mesolux::vk::Device>, T)> {
        let open = || mesolux::solver::open_device(self.device.as_deref(), watched(self.validate));
        let (given, device) = beside(read, open);
        let (given, device) = (given?, device?);
        tracing::info!("device: {}", device.name());
        Ok((device, given))
    }

    /// Fails if the validation layer has reported a message.
    fn check(&self) -> Result<()> {
        check_validation()
    }
}

/// The choice of baking devices, and validation.
#[derive(Args, Clone)]
struct BakingDevices {
    /// Vulkan device by its index or a part of its name (see `mesolux info`); the best one if not
    /// given. Several, as in 0,1, bake together, and 0,0 opens a software device twice; the result
    /// is the same to the byte as with one of their kind. Under `mpirun` each process of a machine
    /// takes one of the list in its turn
    #[arg(long, value_name = "INDEX|NAME[,…]")]
    device: Option<String>,
    /// Watch every Vulkan call with the validation layer
    #[arg(long)]
    validate: bool,
}

impl BakingDevices {
    fn open(&self) -> Result<Crew> {
        let devices =
            mesolux::solver::open_devices(self.device.as_deref(), watched(self.validate))?;
        for device in &devices {
            tracing::info!("device: {}", device.name());
        }
        Ok(devices[..].into())
    }

    /// The device of one of the processes of this machine.
    #[cfg(feature = "mpi")]
    fn open_in_turn(&self, turn: usize) -> Result<std::sync::Arc<mesolux::vk::Device>> {
        let watched = watched(self.validate);
        mesolux::solver::open_in_turn(self.device.as_deref(), turn, watched)
    }

    fn check(&self) -> Result<()> {
        check_validation()
    }
}

fn check_validation() -> Result<()> {
    match mesolux::vk::validation_messages() {
        0 => Ok(()),
        n => Err(Error::Device(format!(
            "the validation layer sent {n} messages"
        ))),
    }
}

/// As `MESOLUX_LOG` asks: a level, or levels by module, such as `warn,mesolux::meso=debug`.
fn log_to_stderr(cli: &Cli) {
    let level = if cli.quiet {
        LevelFilter::WARN
    } else {
        LevelFilter::INFO
    };
    let asked = std::env::var("MESOLUX_LOG").ok();
    let filter = asked.and_then(|asked| asked.parse::<Targets>().ok());
    // The window's library warns of what desktops lack and it does without.
    let by_itself = || {
        Targets::new()
            .with_default(level)
            .with_target("winit", LevelFilter::ERROR)
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(|| console::Stderr)
        .with_ansi(cli.color.are_shown())
        .without_time()
        .with_target(false);
    tracing_subscriber::registry()
        .with(lines)
        .with(filter.unwrap_or_else(by_itself))
        .init();
}

/// Starts the CPU's threads before any of them is needed: where there is no room for them, nothing
/// else has been done.
fn start_threads(command: &Command) -> Result<()> {
    let mut pool = rayon::ThreadPoolBuilder::new().thread_name(|i| format!("worker {i}"));
    #[cfg(feature = "window")]
    if matches!(command, Command::View(_)) {
        pool = pool.start_handler(|_| mesolux::view::give_way());
    }
    if let Command::Bake(bake::Options {
        threads: Some(threads),
        ..
    }) = command
    {
        if *threads == 0 {
            return Err(Error::Usage("--threads 0: must be at least 1".into()));
        }
        pool = pool.num_threads(*threads);
    }
    pool.build_global()
        .map_err(|e| Error::Usage(format!("starting threads: {e}")))
}

pub fn main() -> ExitCode {
    #[cfg(feature = "window")]
    let start = std::time::Instant::now();
    let matches = Cli::command().get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let given = matches.subcommand().map_or(&matches, |(_, given)| given);
    log_to_stderr(&cli);
    progress::survive_limits();
    let done = start_threads(&cli.command).and_then(|()| match &cli.command {
        Command::Bake(options) => bake::run(options),
        Command::Render(options) => render::run(options, given),
        Command::Export(options) => export::run(options, given),
        #[cfg(feature = "window")]
        Command::View(options) => view::run(options, start),
        #[cfg(not(feature = "window"))]
        Command::View { .. } => Err(Error::Usage(
            "this build has no window: cargo run --release -- view; or draw a file with `render`"
                .into(),
        )),
        Command::Compare(options) => compare::run(options),
        Command::Scene(options) => scene::run(options),
        Command::Info(options) => info::run(options, given),
        Command::Bench(options) => bench::run(options),
        Command::Completions(options) => shell::completions(options),
        Command::Man(options) => shell::man(options),
    });
    let lost = || match console::lost() {
        Some(source) => Err(Error::write(Path::new("stdout"), source)),
        None => Ok(()),
    };
    match done.and_then(|()| lost()) {
        Ok(()) => progress::stopped_by().map_or(ExitCode::SUCCESS, ExitCode::from),
        Err(error) => {
            console::tell_error(&error);
            ExitCode::from(2)
        }
    }
}
