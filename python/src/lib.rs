//! Python bindings: `mesolux.bake` and what it returns.

use std::collections::HashMap;
use std::path::PathBuf;
use std::time::Duration;

use mesolux::bake::quality::Quality;
use mesolux::bake::solution::{Dtype, Origin, Solution, Tensor};
use mesolux::error::Error;
use mesolux::math::directions::Directions;
use mesolux::meso::Transport;
use mesolux::scene::{self, LoadOptions, Refinement};
use mesolux::solver::{self, Settings, Update};
use numpy::PyArray1;
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyList;

/// Errors of devices are RuntimeError, of files OSError, all others ValueError.
fn raised(error: Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::Device(_) => PyRuntimeError::new_err(text),
        Error::Write { .. } => PyOSError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}

fn one_of<T: Copy>(name: &str, value: &str, known: &[(&str, T)]) -> PyResult<T> {
    let found = known.iter().find(|(of, _)| *of == value);
    found.map(|(_, of)| *of).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(of, _)| *of).collect();
        PyValueError::new_err(format!(
            "{name} {value:?}: must be one of {}",
            names.join(", ")
        ))
    })
}

const QUALITIES: [(&str, Quality); 5] = [
    ("preview", Quality::Preview),
    ("draft", Quality::Draft),
    ("normal", Quality::Normal),
    ("high", Quality::High),
    ("reference", Quality::Reference),
];

const TRANSPORTS: [(&str, Transport); 3] = [
    ("physical", Transport::Physical),
    ("paper", Transport::Paper),
    ("lambert", Transport::Lambert),
];

/// What a bake has reached.
#[pyclass(frozen, get_all)]
struct Progress {
    sources_drawn: u32,
    sources: u32,
    /// Of the emitted power.
    unshot_share: f64,
    /// Power that can still be missing, as a share of the emitted; None at a reflectance of 1.
    error_bound: Option<f64>,
    seconds: f64,
}

/// Where progress is reported.
enum Watch {
    Silent,
    Line,
    Call(Py<PyAny>),
}

impl Watch {
    fn of(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if given.is_callable() {
            return Ok(Self::Call(given.clone().unbind()));
        }
        Ok(match given.extract::<bool>()? {
            true => Self::Line,
            false => Self::Silent,
        })
    }

    /// Whether to go on.
    fn show(&self, update: &Update) -> PyResult<bool> {
        match self {
            Self::Silent => Ok(true),
            Self::Line => {
                let bound = update
                    .error_bound
                    .map_or("none".to_owned(), |b| format!("{:.2} %", 100.0 * b));
                eprint!(
                    "\r{} of {} sources, error bound {bound} ",
                    update.shots, update.sources
                );
                Ok(true)
            }
            Self::Call(call) => Python::attach(|py| {
                let state = Progress {
                    sources_drawn: update.shots,
                    sources: update.sources,
                    unshot_share: update.unshot_share,
                    error_bound: update.error_bound,
                    seconds: update.elapsed.as_secs_f64(),
                };
                let answer = call.call1(py, (state,))?;
                Ok(answer.is_none(py) || answer.is_truthy(py)?)
            }),
        }
    }
}

/// Light on the elements of a scene.
#[pyclass(frozen)]
struct Bake {
    solution: Solution,
    origin: Origin,
    settings: HashMap<&'static str, String>,
    tensors: Vec<Tensor>,
}

impl Bake {
    fn array<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(tensor) = self.tensors.iter().find(|tensor| tensor.name == name) else {
            return Ok(None);
        };
        let words = || tensor.bytes.as_chunks::<4>().0.iter();
        let flat = match tensor.dtype {
            Dtype::U32 => {
                PyArray1::from_iter(py, words().map(|w| u32::from_le_bytes(*w))).into_any()
            }
            _ => PyArray1::from_iter(py, words().map(|w| f32::from_le_bytes(*w))).into_any(),
        };
        Ok(Some(flat.call_method1("reshape", (tensor.shape.clone(),))?))
    }
}

#[pymethods]
impl Bake {
    /// Names of the arrays.
    fn keys(&self) -> Vec<&'static str> {
        self.tensors.iter().map(|tensor| tensor.name).collect()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.array(py, name)?;
        found.ok_or_else(|| PyKeyError::new_err(format!("no array {name:?} in this bake")))
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.array(py, name)?;
        found.ok_or_else(|| PyAttributeError::new_err(format!("a bake has no {name:?}")))
    }

    fn __len__(&self) -> usize {
        self.solution.area.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<mesolux.Bake of {}: {} elements>",
            self.origin.scene,
            self.__len__()
        )
    }

    /// The report of the solver, as `mesolux bake --json` prints it.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.solution.report);
        let text = text.map_err(|e| PyValueError::new_err(e.to_string()))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    /// What was noted and warned of as the scene was read.
    #[getter]
    fn notes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, &self.solution.report.notes)
    }

    /// Writes a .safetensors file that `mesolux render`, `view` and `export` open.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.solution.save(&path, &self.origin, &self.settings))
            .map_err(raised)
    }
}

/// Bakes a scene: a built-in name, an .obj, .gltf or .glb file, or a scene.toml.
///
/// Settings are those of `mesolux bake`. `progress` is True for a line on stderr, False for none,
/// or a function that is called with a Progress and stops the bake, whose light is kept, by
/// returning False. Ctrl-C raises KeyboardInterrupt.
#[pyfunction]
#[pyo3(signature = (scene, *, quality = "normal", residual = None, patches = None, statue = None,
    directions = 64, transport = "physical", element_size = None, fineness = None,
    max_elements = None, seed = 0, budget = None, shots = None, device = None, progress = None))]
#[allow(clippy::too_many_arguments)] // named arguments of Python
fn bake(
    py: Python<'_>,
    scene: PathBuf,
    quality: &str,
    residual: Option<f64>,
    patches: Option<usize>,
    statue: Option<PathBuf>,
    directions: u32,
    transport: &str,
    element_size: Option<f64>,
    fineness: Option<f64>,
    max_elements: Option<usize>,
    seed: u64,
    budget: Option<f64>,
    shots: Option<u32>,
    device: Option<String>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Bake> {
    let quality_name = quality;
    let quality = one_of("quality", quality, &QUALITIES)?;
    let transport_name = transport;
    let transport = one_of("transport", transport, &TRANSPORTS)?;
    let progress = match &progress {
        None => Watch::Silent,
        Some(given) => Watch::of(given)?,
    };
    let budget = budget.map(Duration::try_from_secs_f64).transpose();
    let budget = budget.map_err(|e| PyValueError::new_err(format!("budget: {e}")))?;
    let preset = quality.settings();
    let mut settings = Settings {
        residual: residual.unwrap_or(preset.residual),
        seed,
        budget,
        shots,
        ..preset
    };
    settings.relief.transport = transport;
    settings.relief.directions = Directions::new(directions).map_err(raised)?;
    settings.check().map_err(raised)?;
    let name = scene.to_string_lossy().into_owned();
    let plain = Refinement::default();
    let refinement = Refinement {
        element_size,
        fineness: fineness.unwrap_or(quality.fineness()),
        max_elements: max_elements.unwrap_or(plain.max_elements),
    };
    let size = element_size.unwrap_or(1.0);
    if !(size.is_finite() && size > 0.0) {
        return Err(PyValueError::new_err("element_size: must be above 0"));
    }
    if !(1.0..=16.0).contains(&refinement.fineness) {
        return Err(PyValueError::new_err("fineness: must be in 1 to 16"));
    }
    let options = LoadOptions {
        patches,
        statue: statue.clone(),
        ..LoadOptions::default()
    };
    let import = options.import.clone();
    let mut stopped = None;
    let (solution, hash) = py
        .detach(|| -> Result<_, Error> {
            let read = scene::load(&name, &options)?;
            let read = match refinement.is_for(&name) {
                true => read.refined(&refinement),
                false => read,
            };
            let device = solver::open_device(device.as_deref(), false)?;
            let solution = mesolux::bake::bake(&device, &read, &settings, |update| {
                let go_on = Python::attach(|py| py.check_signals());
                match go_on.and_then(|()| progress.show(update)) {
                    Ok(go_on) => go_on,
                    Err(error) => {
                        stopped = Some(error);
                        false
                    }
                }
            })?;
            Ok((solution, read.input_hash()))
        })
        .map_err(raised)?;
    if matches!(progress, Watch::Line) {
        eprintln!();
    }
    if let Some(error) = stopped {
        return Err(error);
    }
    let absolute = |path: PathBuf| std::path::absolute(&path).unwrap_or(path);
    let origin = Origin {
        scene: match scene::builtin::NAMES.contains(&name.as_str()) {
            true => name,
            false => absolute(scene).to_string_lossy().into_owned(),
        },
        relative: None,
        patches,
        statue: statue.map(absolute),
        import,
        hash,
    };
    let settings = HashMap::from([
        ("quality", quality_name.to_owned()),
        ("transport", transport_name.to_owned()),
        ("residual", settings.residual.to_string()),
        ("directions", directions.to_string()),
        ("seed", seed.to_string()),
    ]);
    Ok(Bake {
        tensors: solution.tensors(),
        solution,
        origin,
        settings,
    })
}

/// Global illumination by hemicubes on Vulkan.
#[pymodule(name = "mesolux")]
fn exported(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<Bake>()?;
    m.add_class::<Progress>()?;
    m.add_function(wrap_pyfunction!(bake, m)?)
}
