//! Watches the files of a scene for changes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use super::{Wake, background};
use crate::scene::Scene;

/// Between two looks at the files.
const EVERY: Duration = Duration::from_millis(500);
/// Most files that are looked at.
const MOST: usize = 512;
/// Endings of files that scenes are read from.
const ENDINGS: [&str; 11] = [
    "toml", "obj", "mtl", "gltf", "glb", "bin", "png", "jpg", "jpeg", "exr", "hdr",
];

/// Looks at files until it is dropped.
pub struct Watch {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Calls `changed` each time that a file has changed and its new content is complete. None where
    /// there is no file.
    pub fn new(files: Vec<PathBuf>, changed: Wake) -> Option<Self> {
        if files.is_empty() {
            return None;
        }
        let (stop, stopped) = channel();
        let thread = background("files", move || {
            let mut known = times(&files);
            let mut last = known.clone();
            while stopped.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
                let now = times(&files);
                // Until it is written in full.
                if now != known && now == last {
                    changed();
                    known = now.clone();
                }
                last = now;
            }
        });
        Some(Self {
            stop: Some(stop),
            thread: Some(thread),
        })
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// When each was last written; none of one that is not there.
fn times(files: &[PathBuf]) -> Vec<Option<SystemTime>> {
    let written = |path: &PathBuf| path.metadata().and_then(|about| about.modified()).ok();
    files.iter().map(written).collect()
}

/// Files that a scene, opened by `name`, was probably read from: that file, what lies beside it,
/// and its textures.
pub fn files(name: &str, scene: &Scene) -> Vec<PathBuf> {
    let mut files = BTreeSet::new();
    let named = Some(Path::new(name)).filter(|path| path.is_file());
    files.extend(named.map(Path::to_owned));
    if let Some(path) = &scene.path {
        let folder = path.parent().filter(|folder| *folder != Path::new(""));
        let beside = std::fs::read_dir(folder.unwrap_or(Path::new(".")));
        let beside = beside.into_iter().flatten().flatten();
        files.extend(
            beside
                .map(|entry| entry.path())
                .filter(|path| is_read(path)),
        );
        files.insert(path.clone());
    }
    for material in &scene.materials {
        let maps = [&material.map_kd, &material.map_ke].into_iter().flatten();
        files.extend(maps.map(|map| map.path.clone()));
        files.extend(material.map_height.iter().map(|map| map.path.clone()));
        files.extend(material.map_normal.iter().map(|map| map.path.clone()));
    }
    let there = files.into_iter().filter(|path| path.is_file());
    there.take(MOST).collect()
}

fn is_read(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| ENDINGS.contains(&&ending.to_lowercase()[..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::mpsc::channel;

    #[test]
    fn a_file_that_is_written_again_is_told_of() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, "one").expect("written");
        let (told, telling) = channel();
        let changed: Wake = Arc::new(move || {
            let _ = told.send(());
        });
        let watch = Watch::new(vec![path.clone()], changed).expect("there is a file");
        assert!(
            telling.recv_timeout(3 * EVERY).is_err(),
            "nothing has changed"
        );
        // Also after a change that nobody could read.
        for text in ["two", "three"] {
            std::fs::write(&path, text).expect("written");
            telling
                .recv_timeout(Duration::from_secs(30))
                .expect("it has changed");
        }
        drop(watch);
    }

    #[test]
    fn what_lies_beside_a_scene_is_looked_at() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        for name in ["scene.toml", "room.obj", "notes.txt", "bake.safetensors"] {
            std::fs::write(folder.path().join(name), "").expect("written");
        }
        let scene = Scene {
            path: Some(folder.path().join("scene.toml")),
            ..Scene::default()
        };
        let found = files("cornell", &scene);
        let expected = ["room.obj", "scene.toml"].map(|name| folder.path().join(name));
        assert_eq!(found, expected);
        assert!(files("cornell", &Scene::default()).is_empty());
    }
}
