//! Calls of Vulkan that fail: the program ends with one line, or gives the right result; files that
//! were there before stay whole, and nothing else is left.
//!
//! The first and the last call of each function fail, of each command; with `MESOLUX_TEST_FIGURES`
//! every call does, which takes an hour.
#![cfg(target_os = "linux")]

#[cfg(feature = "window")]
#[allow(dead_code)] // it is of the tests of the window
#[path = "../view/display.rs"]
mod display;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use safetensors::SafeTensors;
use tempfile::TempDir;

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nvt 0 0\n\
    vt 1 0\nvt 0 1\nusemtl wall\nf 1/1 2/2 3/3\nusemtl lamp\nf 6/3 5/2 4/1\n";
const MTL: &str = "newmtl lamp\nKd 0 0 0\nKe 1 2 3\nnewmtl wall\nKd 0.5 0.4 0.3\n";
const RELIEF: &str = "disp -mm 0 0.05 a.png\n";
const OLD: &str = "of an earlier run";
/// A file that the layer makes when it lets a call fail.
const MADE: &str = "made";
/// A run takes a second.
const HANGS: Duration = Duration::from_secs(60);

/// The layer, compiled once, and its manifest: the folder of both.
fn layer() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().expect("a folder");
        let library = folder.path().join("layer.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults/layer.rs");
        let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
        let done = Command::new(rustc)
            .args(["--edition", "2024", "-O", "--crate-type", "cdylib", "-o"])
            .args([&library, &source])
            .status();
        assert!(done.expect("rustc compiles the layer").success());
        let manifest = serde_json::json!({
            "file_format_version": "1.1.2",
            "layer": {
                "name": "VK_LAYER_MESOLUX_fault", "type": "GLOBAL", "library_path": library,
                "api_version": "1.3.0", "implementation_version": "1", "description": "faults"
            }
        });
        fs::write(folder.path().join("layer.json"), manifest.to_string()).expect("written");
        folder
    };
    FOLDER.get_or_init(make).path()
}

/// A folder with a scene: a wall below a lamp.
fn room(relief: bool) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        fs::write(folder.path().join(name), bytes).expect("written");
    };
    write("a.obj", OBJ.as_bytes());
    write(
        "a.mtl",
        format!("{MTL}{}", if relief { RELIEF } else { "" }).as_bytes(),
    );
    image::GrayImage::from_fn(8, 8, |x, y| image::Luma([(16 * x + 15 * y) as u8]))
        .save(folder.path().join("a.png"))
        .expect("written");
    folder
}

/// How a run ended: its exit code (none: by a signal), and what it wrote to stderr.
type End = (Option<i32>, String);

/// Runs the program below the layer, on a display if it opens a window.
fn run(folder: &Path, arguments: &str, display: &str, (variable, value): (&str, &str)) -> End {
    let device = std::env::var("MESOLUX_TEST_DEVICE").unwrap_or("0".into());
    let log = folder.join("stderr");
    let mut child = Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(arguments.replace("DEVICE", &device).split(' '))
        .current_dir(folder)
        .env("VK_LAYER_PATH", layer())
        .env("VK_INSTANCE_LAYERS", "VK_LAYER_MESOLUX_fault")
        // A layer of Mesa, which reads what it was not given.
        .env("NODEVICE_SELECT", "1")
        // Its layer is not in that folder.
        .env_remove("MESOLUX_VALIDATE")
        .env("DISPLAY", display)
        .env_remove("WAYLAND_DISPLAY")
        .env("MESOLUX_FAULT_MADE", folder.join(MADE))
        .env(variable, value)
        .stdout(Stdio::null())
        .stderr(fs::File::create(&log).expect("a file"))
        .spawn()
        .expect("the program starts");
    let began = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().expect("it is a child") {
            break status.code();
        }
        if began.elapsed() > HANGS {
            let _ = child.kill();
            let _ = child.wait();
            panic!(
                "{arguments}, {value}: hangs\n{}",
                fs::read_to_string(log).expect("text")
            );
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    (code, fs::read_to_string(&log).expect("text"))
}

/// What became of a fault.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    WorkedAround,
    Ended,
    /// The run made fewer calls.
    NotReached,
}

/// The calls of a run that goes well, by function.
fn calls(folder: &Path, arguments: &str, display: &str) -> BTreeMap<String, usize> {
    let file = folder.join("calls");
    let name = file.to_str().expect("UTF-8");
    let (code, told) = run(folder, arguments, display, ("MESOLUX_FAULT_CALLS", name));
    assert_eq!(code, Some(0), "{told}");
    let text = fs::read_to_string(&file).expect("the layer is called");
    fs::remove_file(&file).expect("it is there");
    let mut calls = BTreeMap::new();
    text.lines()
        .for_each(|name| *calls.entry(name.to_owned()).or_default() += 1);
    calls
}

/// What a function may return of its own: `VkResult`s.
fn results(function: &str) -> &'static [i32] {
    const OUT_OF_HOST_MEMORY: i32 = -1;
    const OUT_OF_DEVICE_MEMORY: i32 = -2;
    const INITIALIZATION_FAILED: i32 = -3;
    const DEVICE_LOST: i32 = -4;
    const MEMORY_MAP_FAILED: i32 = -5;
    match function {
        "vkCreateInstance" | "vkCreateDevice" | "vkEnumeratePhysicalDevices" => {
            &[INITIALIZATION_FAILED, OUT_OF_HOST_MEMORY]
        }
        "vkMapMemory" => &[MEMORY_MAP_FAILED, OUT_OF_HOST_MEMORY],
        "vkQueueSubmit2"
        | "vkWaitForFences"
        | "vkWaitSemaphores"
        | "vkDeviceWaitIdle"
        | "vkGetQueryPoolResults" => &[DEVICE_LOST, OUT_OF_DEVICE_MEMORY],
        _ => &[OUT_OF_DEVICE_MEMORY, OUT_OF_HOST_MEMORY],
    }
}

/// What of an output must be the same: all of a picture, of a bake its tensors.
fn content(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    match SafeTensors::deserialize(&bytes) {
        Ok(tensors) => {
            let mut names = tensors.names();
            names.sort();
            let data = names
                .iter()
                .flat_map(|name| tensors.tensor(name).expect("named").data());
            data.copied().collect()
        }
        Err(_) => bytes,
    }
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into())
        .collect();
    names.sort();
    names
}

/// Lets calls of a command fail that writes `output`.
fn sweep(made: &(dyn Fn() -> TempDir + Sync), arguments: &str, output: &str) {
    sweep_on("", made, arguments, output);
}

/// The same of a command that opens a window.
fn sweep_on(display: &str, made: &(dyn Fn() -> TempDir + Sync), arguments: &str, output: &str) {
    let good = made();
    let calls = calls(good.path(), arguments, display);
    let right = content(&good.path().join(output));
    let files = names(good.path());
    let all = std::env::var_os("MESOLUX_TEST_FIGURES").is_some();
    let mut faults = Vec::new();
    for (function, &count) in &calls {
        let [first, second] = [results(function)[0], results(function)[1]];
        match all {
            true => (1..=count).for_each(|call| {
                faults.extend([first, second].map(|result| (function, call, result)));
            }),
            false => {
                faults.push((function, 1, second));
                faults.push((function, count, first));
            }
        }
    }
    let ends: Vec<Result<Fault, String>> = (faults.par_iter())
        .map(|&(function, call, result)| {
            let folder = made();
            let path = folder.path().join(output);
            fs::write(&path, OLD).expect("written");
            let fault = format!("{function} {call} {result}");
            let (code, told) = run(folder.path(), arguments, display, ("MESOLUX_FAULT", &fault));
            let lines = (told.lines().filter(|line| line.starts_with("mesolux: "))).count();
            let end = match fs::remove_file(folder.path().join(MADE)) {
                Ok(()) if code == Some(0) => Fault::WorkedAround,
                Ok(()) => Fault::Ended,
                Err(_) => Fault::NotReached,
            };
            let right = match (end, code) {
                (Fault::Ended, Some(2)) => lines == 1 && content(&path) == OLD.as_bytes(),
                (Fault::WorkedAround | Fault::NotReached, Some(0)) => {
                    lines == 0 && content(&path) == right
                }
                _ => false,
            };
            match right && names(folder.path()) == files && !told.contains("panicked") {
                true => Ok(end),
                false => Err(format!("{fault}: exit code {code:?}\n{told}")),
            }
        })
        .collect();
    let calls: usize = calls.values().sum();
    let of = |fault| ends.iter().filter(|end| **end == Ok(fault)).count();
    let (went_on, missed) = (of(Fault::WorkedAround), of(Fault::NotReached));
    let count = faults.len();
    println!(
        "{arguments}: {calls} calls, {count} faults, {went_on} were worked around, {missed} were \
         not reached"
    );
    let wrong: Vec<String> = ends.into_iter().filter_map(Result::err).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // How many calls a run makes depends on time.
    assert!(missed < count / 2, "the layer lets calls fail");
    assert!(went_on < (count - missed) / 4, "most faults end a run");
}

const BAKE: &str = "bake a.obj --quality preview --no-refine --no-cache --checkpoint 0 -o \
    out.safetensors --device DEVICE";

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_bake() {
    sweep(&|| room(false), BAKE, "out.safetensors");
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_bake_with_relief() {
    let arguments = format!("{BAKE} --directions 16");
    sweep(&|| room(true), &arguments, "out.safetensors");
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_bake_on_two_devices() {
    let arguments = format!("{BAKE},DEVICE");
    sweep(&|| room(false), &arguments, "out.safetensors");
}

/// Folders with the scene and its bake.
fn baked(relief: bool, arguments: &str) -> impl Fn() -> TempDir + Sync {
    let baked = room(relief);
    let (code, told) = run(baked.path(), arguments, "", ("NO_COLOR", "1"));
    assert_eq!(code, Some(0), "{told}");
    move || {
        let folder = room(relief);
        let copy = |name| fs::copy(baked.path().join(name), folder.path().join(name));
        copy("out.safetensors").expect("copied");
        fs::write(folder.path().join("script"), SCRIPT).expect("written");
        folder
    }
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_picture() {
    let arguments = format!("{BAKE} --directions 16");
    let made = baked(true, &arguments);
    let arguments = "render out.safetensors --size 32x24 -o out.png --device DEVICE";
    sweep(&made, arguments, "out.png");
}

/// Frame times differ from run to run.
const SCRIPT: &str = "set panel off\nset detail off\nframes 2\nscreenshot out.png\n";
const VIEW: &str = "view out.safetensors --script script --size 64x48 --device DEVICE";

#[cfg(feature = "window")]
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_window() {
    let display = display::Display::new();
    sweep_on(&display.name, &baked(false, BAKE), VIEW, "out.png");
}

/// A window that takes no frame, for ever.
#[cfg(feature = "window")]
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_window_that_refuses_every_frame() {
    const OUT_OF_DATE: i32 = -1_000_001_004;
    const SURFACE_LOST: i32 = -1_000_000_000;
    let display = display::Display::new();
    let made = baked(false, BAKE);
    for function in ["vkAcquireNextImageKHR", "vkQueuePresentKHR"] {
        for result in [OUT_OF_DATE, SURFACE_LOST] {
            let fault = format!("{function} 1+ {result}");
            let folder = made();
            let (code, told) = run(
                folder.path(),
                VIEW,
                &display.name,
                ("MESOLUX_FAULT", &fault),
            );
            assert_eq!(code, Some(2), "{fault}: {told}");
            assert!(
                told.contains("has refused every frame for 10 s"),
                "{fault}: {told}"
            );
        }
    }
}
