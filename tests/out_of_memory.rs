//! Too little memory for the process: one line and exit code 2, and nothing is damaged. Lavapipe
//! itself may crash where it finds none as it makes a device; the bake here has enough for that.
#![cfg(target_os = "linux")]

use std::fs;
use std::process::{Command, Output};

/// Runs the program in so many MiB of addresses.
fn run(limit: u32, arguments: &[&str]) -> Output {
    Command::new("sh")
        .args(["-c", "ulimit -v $0 && exec \"$@\""])
        .arg((1024 * limit).to_string())
        .arg(env!("CARGO_BIN_EXE_mesolux"))
        .args(arguments)
        // Threads of the driver and pools of malloc take addresses by the number of cores.
        .env("LP_NUM_THREADS", "2")
        .env("MALLOC_ARENA_MAX", "2")
        // Its layer needs memory, too.
        .env_remove("MESOLUX_VALIDATE")
        .output()
        .expect("sh")
}

#[track_caller]
fn assert_refused(limit: u32, done: &Output) {
    let told = String::from_utf8_lossy(&done.stderr);
    let lines = told.lines().filter(|line| line.starts_with("mesolux: "));
    let lines: Vec<&str> = lines.collect();
    println!("{limit} MiB: {lines:?}");
    assert_eq!(done.status.code(), Some(2), "{limit} MiB: {told}");
    assert!(
        lines.len() == 1 && lines[0].contains("out of memory"),
        "{told}"
    );
    assert!(!told.contains("panicked"), "{told}");
}

#[test]
fn a_scene_that_finds_no_memory_is_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene");
    let path = path.to_str().expect("UTF-8");
    let arguments = ["scene", "cornell", "--patches", "400000", "-o", path];
    for limit in [40, 60, 80, 100, 120, 150, 200] {
        assert_refused(limit, &run(limit, &arguments));
    }
    let done = run(1000, &arguments);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
}

#[test]
fn a_bake_that_finds_no_memory_keeps_the_earlier_file() {
    const OLD: &str = "of an earlier run";
    let device = std::env::var("MESOLUX_TEST_DEVICE").unwrap_or("0".into());
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("out.safetensors");
    fs::write(&output, OLD).expect("written");
    let path = output.to_str().expect("UTF-8");
    let scene = ["bake", "cornell", "--patches", "400000", "-o", path];
    let how = [
        "--no-cache",
        "--checkpoint",
        "0",
        "--threads",
        "2",
        "--device",
        &device,
    ];
    assert_refused(900, &run(900, &[&scene[..], &how].concat()));
    assert_eq!(fs::read(&output).expect("whole"), OLD.as_bytes());
}
