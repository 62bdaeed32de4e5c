//! Scenes and bakes that were opened before, in a file of the cache: a path a line, the latest
//! first.

use std::path::Path;

use crate::atomic_file::write_atomically;
use crate::input_file::read_text;

/// Name of the file.
const NAME: &str = "recent";
/// Most paths that are kept.
const MOST: usize = 12;

/// The paths whose files are still there; none where the list cannot be read.
pub fn read(folder: &Path) -> Vec<String> {
    let path = folder.join(NAME);
    let text = match path.is_file() {
        true => read_text(&path).unwrap_or_default(),
        false => String::new(),
    };
    let there = text.lines().filter(|line| Path::new(line).is_file());
    there.take(MOST).map(str::to_owned).collect()
}

/// Puts a path first; the list. A list that cannot be written is only shorter the next time.
pub fn add(folder: &Path, path: &str) -> Vec<String> {
    let mut list = read(folder);
    list.retain(|known| known != path);
    list.insert(0, path.to_owned());
    list.truncate(MOST);
    let text: String = list.iter().map(|path| format!("{path}\n")).collect();
    let written = std::fs::create_dir_all(folder)
        .map_err(|e| crate::error::Error::file(folder, e.to_string()))
        .and_then(|()| write_atomically(&folder.join(NAME), |out| out.write_all(text.as_bytes())));
    if let Err(error) = written {
        tracing::debug!("recent files are not kept: {error}");
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_comes_first_and_what_is_gone_is_left_out() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let file = |name: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, "").expect("written");
            path.display().to_string()
        };
        let [a, b, c] = ["a.toml", "b.toml", "c.toml"].map(file);
        for path in [&a, &b, &c, &a] {
            add(folder.path(), path);
        }
        assert_eq!(read(folder.path()), [a.clone(), c.clone(), b]);
        std::fs::remove_file(&c).expect("it was there");
        assert!(!read(folder.path()).contains(&c));
        assert!(read(&folder.path().join("nowhere")).is_empty());
    }
}
