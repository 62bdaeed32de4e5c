//! The same scene solved again, or by other threads, has the same bytes. Other invariances are in
//! `stress.rs`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs a bake with a number of threads of the program and of the software device.
fn bake(folder: &Path, scene: &str, name: &str, threads: &str) -> PathBuf {
    let out = folder.join(name);
    let run = Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args([
            "bake",
            scene,
            "--patches",
            "8000",
            "--shots",
            "150",
            "--no-cache",
            "--validate",
        ])
        .args(["--threads", threads, "-o"])
        .arg(&out)
        .env("LP_NUM_THREADS", threads)
        .output()
        .expect("the program runs");
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    out
}

#[test]
fn runs_and_threads_give_the_same_bytes() {
    // With relief: visibility, moments and light by direction too.
    for (scene, tensor_count) in [("cornell", 11), ("cornell-relief", 17)] {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let files = [("a", "1"), ("b", "2"), ("c", "2")]
            .map(|(name, threads)| bake(folder.path(), scene, name, threads));
        let bytes = files.map(|f| std::fs::read(f).expect("the bake was written"));
        let first = tensors(&bytes[0]);
        assert_eq!(first.len(), tensor_count);
        for other in &bytes[1..] {
            for ((name, a), (_, b)) in first.iter().zip(tensors(other)) {
                assert!(
                    *a == b,
                    "{scene}: {name} differs between runs or numbers of threads"
                );
            }
        }
    }
}

/// The tensors of a bake by name.
fn tensors(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let file = safetensors::SafeTensors::deserialize(bytes).expect("a safetensors file");
    let mut all: Vec<_> = file
        .tensors()
        .into_iter()
        .map(|(n, t)| (n, t.data().to_vec()))
        .collect();
    all.sort();
    all
}
