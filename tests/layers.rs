//! Imports run one way: a module of `src/` uses what lies below it alone.

use std::fs;
use std::path::{Path, PathBuf};

/// From below. Modules of one line do not use each other; `say` is the macro of `console`.
const LAYERS: [&[&str]; 10] = [
    &["beside", "console", "constants", "error", "say", "structs"],
    &["atomic_file", "input_file", "math", "vk"],
    &["cache_folder", "scene"],
    &["meso", "picture"],
    &["mesh", "path_tracer"],
    &["passes", "reference"],
    &["solver"],
    &["bake"],
    &["export", "render"],
    &["bench", "view"],
];

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|of| of.contains(&module))
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => files(&path, found),
            false => found.push(path),
        }
    }
}

#[test]
fn no_import_runs_up() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&src, &mut all);
    let (mut imports, mut wrong) = (0, Vec::new());
    for path in &all {
        let inside = path.strip_prefix(&src).expect("a file of src");
        let first = inside.components().next().expect("a name").as_os_str();
        let module = first.to_str().expect("ASCII").trim_end_matches(".rs");
        // The program and the command line may use all.
        let Some(own) = layer(module) else {
            assert!(
                ["cli", "lib", "main"].contains(&module),
                "{module} has no layer"
            );
            continue;
        };
        let text = fs::read_to_string(path).expect("a text");
        for line in text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
        {
            for after in line.split("crate::").skip(1) {
                let end = after.find(|c: char| c != '_' && !c.is_ascii_lowercase());
                let used = &after[..end.unwrap_or(after.len())];
                imports += usize::from(used != module);
                if used != module && layer(used).is_none_or(|layer| layer >= own) {
                    wrong.push(format!("{}: {}", inside.display(), line.trim()));
                }
            }
        }
    }
    assert!(imports > 500, "{imports} imports were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
