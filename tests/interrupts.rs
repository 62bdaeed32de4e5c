//! A bake keeps its result when stdout or stderr is closed, when the disk is full, and when Ctrl-C
//! or another signal stops it; a series keeps its pictures.
#![cfg(unix)]

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn bake(folder: &Path, more: &[&str]) -> Command {
    let mut command = mesolux(folder, &["bake", "cornell", "--no-cache"]);
    command.args(more);
    command
}

fn mesolux(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mesolux"));
    command
        .args(args)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .env("TMPDIR", folder);
    if let Ok(device) = std::env::var("MESOLUX_TEST_DEVICE") {
        command.args(["--device", &device]);
    }
    command
}

const QUICK: [&str; 6] = [
    "--quality",
    "preview",
    "--patches",
    "4000",
    "-o",
    "box.safetensors",
];

/// Its exit code; it must end by itself.
fn code(mut child: Child) -> i32 {
    let status = child.wait().expect("the program ran");
    status.code().expect("an exit code, not a signal")
}

fn send(signal: &str, child: &Child) {
    let number = child.id().to_string();
    let kill = Command::new("kill").args(["-s", signal, &number]).status();
    assert!(kill.expect("kill runs").success());
}

#[test]
fn closed_streams_do_not_stop_a_bake() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("box.safetensors");
    for closed in ["stderr", "stdout"] {
        let mut command = bake(folder.path(), &QUICK);
        command.arg("--json");
        match closed {
            "stderr" => command.stderr(Stdio::piped()),
            _ => command.stdout(Stdio::piped()),
        };
        let mut child = command.spawn().expect("the program starts");
        drop(child.stderr.take());
        drop(child.stdout.take());
        assert_eq!(code(child), 0, "{closed}");
        std::fs::remove_file(&output).expect("a bake");
    }
}

/// `--json` to a full disk is an error, after the bake is written.
#[cfg(target_os = "linux")]
#[test]
fn a_full_stdout_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let full = File::options().write(true).open("/dev/full");
    let mut command = bake(folder.path(), &QUICK);
    command.arg("--json").stdout(full.expect("/dev/full"));
    let done = command.stderr(Stdio::piped()).output().expect("it runs");
    let text = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{text}");
    assert!(text.contains("mesolux: stdout: "), "{text}");
    assert!(folder.path().join("box.safetensors").is_file());
}

/// The bake is kept when its form factors cannot be written, and kept elsewhere when its own output
/// cannot be.
#[cfg(target_os = "linux")]
#[test]
fn a_bake_outlives_a_full_disk() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("box.visibility")).expect("a folder in its way");
    let mut command = bake(folder.path(), &QUICK);
    let done = command.arg("--keep-visibility").stderr(Stdio::piped());
    let done = done.output().expect("it runs");
    let text = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{text}");
    assert!(folder.path().join("box.safetensors").is_file(), "{text}");

    let mut args = QUICK;
    args[5] = "/dev/full";
    let mut command = bake(folder.path(), &args);
    let done = command.stderr(Stdio::piped()).output().expect("it runs");
    let text = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{text}");
    let kept = text.lines().find_map(|l| l.split("kept as ").nth(1));
    let kept = kept.unwrap_or_else(|| panic!("no line says where: {text}"));
    assert!(Path::new(kept).starts_with(folder.path()));
    assert!(Path::new(kept).is_file(), "{text}");
}

/// A bake that a signal stops has that signal's exit code and does not replace an earlier file.
#[test]
fn signals_stop_with_their_exit_codes_and_replace_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("box.safetensors");
    let unfinished = folder.path().join("box.unfinished.safetensors");
    for (signal, expected) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        for earlier in [false, true] {
            if earlier {
                std::fs::write(&output, "an earlier bake").expect("a file");
            }
            let long = [
                "--patches",
                "20000",
                "--no-refine",
                "--quality",
                "reference",
            ];
            let mut command = bake(folder.path(), &long);
            command
                .args(["-o", "box.safetensors"])
                .stderr(Stdio::piped());
            let mut child = command.spawn().expect("the program starts");
            let told = BufReader::new(child.stderr.take().expect("stderr"));
            let mut lines = told.lines().map_while(Result::ok);
            let device = lines.find(|line| line.contains("device: "));
            assert!(device.is_some(), "it begins");
            std::thread::sleep(Duration::from_millis(1500));
            send(signal, &child);
            let rest: Vec<String> = lines.collect();
            assert_eq!(code(child), expected, "{signal}: {rest:?}");
            if earlier {
                let kept = std::fs::read(&output).expect("the earlier file");
                assert_eq!(kept, b"an earlier bake");
                std::fs::remove_file(&unfinished).expect("what is solved");
            }
            std::fs::remove_file(&output).expect("a bake");
        }
    }
}

/// A series that a signal stops keeps the pictures that are drawn, whole, and its exit code says
/// so.
#[test]
fn a_stopped_series_keeps_its_pictures() {
    const COUNT: usize = 400;
    let folder = tempfile::tempdir().expect("a folder");
    let baked = bake(folder.path(), &QUICK).status().expect("it runs");
    assert!(baked.success());
    let count = COUNT.to_string();
    let series = ["--frames", &count, "--size", "64x48", "-o", "out.png"];
    let mut command = mesolux(folder.path(), &["render", "box.safetensors"]);
    let mut child = command.args(series).spawn().expect("the program starts");
    let second = folder.path().join("out-0002.png");
    while !second.exists() {
        let ended = child.try_wait().expect("the program runs");
        assert!(ended.is_none(), "it ends without pictures: {ended:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
    send("INT", &child);
    assert_eq!(code(child), 130);
    let drawn = (1..=COUNT).map(|i| folder.path().join(format!("out-{i:04}.png")));
    let drawn: Vec<_> = drawn.take_while(|path| path.exists()).collect();
    println!("{} of {COUNT} pictures", drawn.len());
    assert!((2..COUNT).contains(&drawn.len()));
    for path in drawn {
        image::open(&path).expect("a whole picture");
    }
}

/// A file beyond the limit on its size is an error, and leaves nothing behind.
#[test]
fn a_limit_on_files_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = bake(folder.path(), &QUICK);
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "ulimit -f 8; exec \"$@\"", "sh"])
        .arg(whole.get_program())
        .args(whole.get_args())
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .env("TMPDIR", folder.path());
    assert_eq!(code(limited.spawn().expect("the program starts")), 2);
    let left = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(left, 0);
}
