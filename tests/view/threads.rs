//! The threads of the window's program.

use std::time::Duration;

use super::display::Display;
use super::harness::{SIZE, finish, start};

/// Name and niceness of each thread of a process.
fn threads(process: u32) -> Vec<(String, i32)> {
    let all = std::fs::read_dir(format!("/proc/{process}/task")).into_iter();
    let told = |thread: std::fs::DirEntry| {
        let stat = std::fs::read_to_string(thread.path().join("stat")).ok()?;
        let (start, fields) = stat.rsplit_once(')')?;
        let (_, name) = start.split_once('(')?;
        // Field 19 of all, the first after the name being the third.
        let niceness = fields.split_whitespace().nth(16)?.parse().ok()?;
        Some((name.to_owned(), niceness))
    };
    all.flatten().flatten().filter_map(told).collect()
}

/// Threads that share work give way to those that draw frames, though the scene is read with them
/// before there is a window.
#[test]
fn workers_give_way_to_frames() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let display = Display::new();
    let script = "frames 1\nwait 1";
    let mut child = start(&display, SIZE, folder.path(), "cornell", script);
    let mut workers = Vec::new();
    while workers.is_empty() && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(5));
        workers = threads(child.id());
        workers.retain(|(name, _)| name.starts_with("worker "));
    }
    finish(child, script);
    assert!(!workers.is_empty(), "no threads share work");
    for (name, niceness) in workers {
        assert_eq!(niceness, 10, "{name}");
    }
}
