//! Turns GLSL into what the crate includes as `passes::shaders` and `structs`: SPIR-V,
//! and the bindings, push constants and structs of buffers, with the names of the GLSL.

mod emit;
mod glsl;
mod interface;
mod preprocess;
mod spirv;
mod structs;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use interface::Program;

#[path = "../src/constants.rs"]
#[allow(dead_code)]
mod constants;

/// File name → text.
type Files = BTreeMap<String, String>;

fn main() {
    for path in ["build", "src", "shaders"] {
        println!("cargo::rerun-if-changed={path}");
    }
    println!("cargo::rerun-if-env-changed=MESOLUX_KEEP_SPIRV");
    commit();
    if let Err(message) = shaders() {
        // One readable line a sentence, and no backtrace of the build script.
        println!("cargo::error={}", message.replace('\n', " "));
        std::process::exit(1);
    }
}

/// Passes the commit of the sources on, for reports, and whether they differ from it; `unknown`
/// outside a checkout.
fn commit() {
    let git = |arguments: &[&str]| {
        let run = std::process::Command::new("git").args(arguments).output();
        let text = run.ok().filter(|run| run.status.success())?.stdout;
        String::from_utf8(text)
            .ok()
            .map(|text| text.trim().to_owned())
    };
    // A package inside somebody else's checkout is none of it.
    let is_ours = git(&["rev-parse", "--show-prefix"]).is_some_and(|prefix| prefix.is_empty());
    if !is_ours {
        println!("cargo::rustc-env=MESOLUX_COMMIT=unknown");
        return;
    }
    // Each commit adds a line to it.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"]);
    if let Some(log) = log.filter(|log| Path::new(log).is_file()) {
        println!("cargo::rerun-if-changed={log}");
    }
    let commit = git(&["rev-parse", "--short=10", "HEAD"]);
    let commit = commit.unwrap_or_else(|| "unknown".into());
    let sources = ["build", "src", "shaders", "Cargo.toml", "Cargo.lock"];
    let changed = git(&[&["status", "--porcelain", "--"][..], &sources].concat());
    let commit = match changed.is_some_and(|changed| !changed.is_empty()) {
        true => format!("{commit} with changes"),
        false => commit,
    };
    println!("cargo::rustc-env=MESOLUX_COMMIT={commit}");
}

fn shaders() -> Result<(), String> {
    let sources = read_all("shaders", &["comp", "vert", "frag"])?;
    let shared = read_all("shaders/shared", &["glsl"])?;
    let mut programs: BTreeMap<String, Program> = BTreeMap::new();
    for (file, source) in &sources {
        let words = spirv::words(file, source, &shared)?;
        let text = preprocess::preprocess(file, source, &shared)?;
        let declared = glsl::declarations(&text).map_err(|e| format!("shaders/{file}: {e}"))?;
        let stem = file.split('.').next().unwrap_or(file);
        let program = programs.entry(stem.to_owned()).or_default();
        program
            .add(file, words, declared)
            .map_err(|e| format!("shaders/{file}: {e}"))?;
    }
    let out = std::env::var("OUT_DIR").map_err(|e| e.to_string())?;
    let module = emit::module(&programs)?;
    fs::write(Path::new(&out).join("shaders.rs"), module).map_err(|e| e.to_string())?;
    let types = shared
        .get("types.glsl")
        .ok_or("no shaders/shared/types.glsl")?;
    let module = structs::module(types).map_err(|e| format!("shaders/shared/types.glsl: {e}"))?;
    fs::write(Path::new(&out).join("structs.rs"), module).map_err(|e| e.to_string())
}

fn read_all(dir: &str, endings: &[&str]) -> Result<Files, String> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(dir).map_err(|e| format!("{dir}: {e}"))? {
        let path = entry.map_err(|e| e.to_string())?.path();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        if endings.contains(&ending) {
            let name = path
                .file_name()
                .and_then(|n| n.to_str())
                .unwrap_or("")
                .to_owned();
            let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            files.insert(name, text);
        }
    }
    Ok(files)
}
