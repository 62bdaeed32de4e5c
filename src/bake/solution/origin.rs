//! Where the scene of a bake is found again.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize, Serializer};

use crate::scene::{ImportOptions, builtin};

/// Where a bake's scene came from: enough to read it again.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// As on the command line: a built-in name, or a path made absolute.
    pub scene: String,
    /// The way from the folder of the bake to the file of the scene, or to that of the statue of a
    /// built-in scene, with `/`; found as the bake is saved.
    #[serde(default)]
    pub relative: Option<String>,
    pub patches: Option<usize>,
    /// Kept as text: what is not UTF-8 is found again by its file alone.
    #[serde(serialize_with = "as_text")]
    pub statue: Option<PathBuf>,
    #[serde(default)]
    pub import: ImportOptions,
    /// [`crate::scene::Scene::input_hash`].
    pub hash: String,
}

impl Origin {
    pub fn is_builtin(&self) -> bool {
        builtin::NAMES.contains(&self.scene.as_str())
    }

    /// The file that the scene is read from; none of a built-in scene without a statue from a file.
    pub fn file(&self) -> Option<&Path> {
        match self.is_builtin() {
            true => self.statue.as_deref(),
            false => Some(Path::new(&self.scene)),
        }
    }

    /// Where that file may lie: as it lay from the bake, and where it was.
    pub fn places(&self, bake: &Path) -> Vec<PathBuf> {
        let beside = self.relative.as_ref().map(|way| bake.with_file_name(way));
        let mut places: Vec<PathBuf> = beside.into_iter().collect();
        let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => false,
        };
        if let Some(file) = self.file()
            && !places.iter().any(|place| same(place, file))
        {
            places.push(file.to_owned());
        }
        places
    }

    /// The same with the file at another place.
    pub fn moved(&self, file: &Path) -> Self {
        let mut moved = self.clone();
        match self.is_builtin() {
            true => moved.statue = Some(file.to_owned()),
            false => moved.scene = file.to_string_lossy().into_owned(),
        }
        moved
    }

    /// The same for a bake that is saved at `bake`.
    pub(super) fn seen_from(&self, bake: &Path) -> Self {
        Self {
            relative: self.file().and_then(|file| way(bake, file)),
            ..self.clone()
        }
    }
}

fn as_text<S: Serializer>(path: &Option<PathBuf>, to: S) -> Result<S::Ok, S::Error> {
    path.as_ref()
        .map(|path| path.to_string_lossy())
        .serialize(to)
}

/// The way from the folder of one file to another, where there is one.
fn way(from: &Path, to: &Path) -> Option<String> {
    let folder = |path: &Path| {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        parent.unwrap_or(Path::new(".")).canonicalize().ok()
    };
    let (start, end) = (folder(from)?, folder(to)?);
    let (start, end): (Vec<_>, Vec<_>) = (start.components().collect(), end.components().collect());
    let shared = start.iter().zip(&end).take_while(|(a, b)| a == b).count();
    // Two drives of Windows share nothing.
    if shared == 0 {
        return None;
    }
    let up = start[shared..].iter().map(|_| Some(".."));
    let down = end[shared..].iter().map(|part| part.as_os_str().to_str());
    let name = to.file_name()?.to_str();
    let parts: Option<Vec<&str>> = up.chain(down).chain([name]).collect();
    Some(parts?.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_goes_up_and_down() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let at = |path: &str| folder.path().join(path);
        std::fs::create_dir_all(at("a/b")).expect("made");
        std::fs::create_dir_all(at("c")).expect("made");
        for (bake, scene, expected) in [
            ("a/b/x", "a/b/y.obj", "y.obj"),
            ("a/x", "a/b/y.obj", "b/y.obj"),
            ("a/b/x", "c/y.obj", "../../c/y.obj"),
            ("a/b/x", "a/b/../../c/y.obj", "../../c/y.obj"),
        ] {
            let found = way(&at(bake), &at(scene));
            assert_eq!(found.as_deref(), Some(expected), "{bake} {scene}");
        }
        assert_eq!(way(&at("nowhere/x"), &at("a/y.obj")), None);
    }
}
