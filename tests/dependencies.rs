//! What this project depends on: licences and sources as deny.toml allows them, which `cargo deny`
//! reads as well, and no crate that needs a newer Rust than Cargo.toml names.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// The crates of a package for this system, as cargo knows them.
fn crates(folder: &str) -> Vec<Value> {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let version = Command::new(std::env::var_os("RUSTC").unwrap_or("rustc".into()))
        .arg("-vV")
        .output()
        .expect("rustc");
    let version = String::from_utf8(version.stdout).expect("UTF-8");
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    let done = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked"])
        .args(["--all-features", "--filter-platform", host.expect("a host")])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder))
        .output()
        .expect("cargo");
    let told = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{told}");
    let read: Value = serde_json::from_slice(&done.stdout).expect("JSON");
    let crates = read["packages"].as_array().expect("packages");
    assert!(crates.len() > 20, "{folder}: {}", crates.len());
    crates.clone()
}

/// Of Cargo.toml and deny.toml.
fn read(file: &str) -> toml::Table {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let text = std::fs::read_to_string(path).expect("text");
    text.parse().expect("TOML")
}

fn allowed(list: &toml::Value) -> Vec<&str> {
    let names = list["allow"].as_array().expect("a list").iter();
    names.map(|name| name.as_str().expect("a name")).collect()
}

/// "1.88" or "1.88.0" as numbers.
fn numbers(version: &str) -> [u32; 3] {
    let mut parts = version
        .split('.')
        .map(|part| part.parse().expect("a number"));
    std::array::from_fn(|_| parts.next().unwrap_or(0))
}

/// How the address of crates.io ends, as cargo names it.
const REGISTRY: &str = "crates.io-index";

/// What of a package is not as it should be.
fn faults(of: &Value, deny: &toml::Table, rust: [u32; 3]) -> Vec<String> {
    let name = of["name"].as_str().expect("a name");
    let licenses = &deny["licenses"];
    let mut names = allowed(licenses);
    for exception in licenses["exceptions"].as_array().expect("a list") {
        if exception["name"].as_str() == Some(name) {
            names.extend(allowed(exception));
        }
    }
    let mut faults = Vec::new();
    let text = of["license"].as_str().unwrap_or("none");
    let is_allowed = |of: &spdx::LicenseReq| names.contains(&&*of.to_string());
    match spdx::Expression::parse_mode(text, spdx::ParseMode::LAX) {
        Ok(expression) if expression.evaluate(is_allowed) => {}
        Ok(_) => faults.push(format!("{name}: licence {text}")),
        Err(e) => faults.push(format!("{name}: licence {text}: {}", e.reason)),
    }
    // Those of this repository have none.
    let is_foreign = |from: &str| !from.starts_with("registry+") || !from.ends_with(REGISTRY);
    if of["source"].as_str().is_some_and(is_foreign) {
        faults.push(format!("{name}: from {}", of["source"]));
    }
    let needs = of["rust_version"].as_str().map_or([0; 3], numbers);
    if needs > rust {
        faults.push(format!("{name}: needs Rust {needs:?}"));
    }
    faults
}

#[test]
fn licences_sources_and_rust_are_as_allowed() {
    let (deny, ours) = (read("deny.toml"), read("Cargo.toml"));
    let rust = numbers(ours["package"]["rust-version"].as_str().expect("a version"));
    for folder in ["", "python", "fuzz"] {
        let crates = crates(folder);
        let found: Vec<String> = crates
            .iter()
            .flat_map(|of| faults(of, &deny, rust))
            .collect();
        println!("{folder}: {} crates", crates.len());
        assert!(found.is_empty(), "{}", found.join("\n"));
    }
}

#[test]
fn what_is_not_allowed_is_found() {
    let deny = read("deny.toml");
    let of = |license: &str, source: &str, rust: &str| {
        let package = serde_json::json!({
            "name": "a", "license": license, "source": source, "rust_version": rust
        });
        faults(&package, &deny, [1, 88, 0]).len()
    };
    let ours = format!("registry+https://example.org/{REGISTRY}");
    let ours = ours.as_str();
    assert_eq!(of("MIT/Apache-2.0", ours, "1.88"), 0);
    assert_eq!(of("GPL-3.0 OR MIT", ours, "1.88.0"), 0);
    assert_eq!(of("GPL-3.0-only", ours, "1.56"), 1);
    assert_eq!(of("MIT AND OFL-1.1", ours, "1.56"), 1);
    assert_eq!(of("MIT", "git+https://example.org/a", "1.56"), 1);
    assert_eq!(of("MIT", ours, "1.89"), 1);
}
