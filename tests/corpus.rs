//! What fuzzing starts from, and what it has found, is read or refused, without a panic.

#[path = "../fuzz/src/lib.rs"]
mod fuzz;

use std::fs;
use std::path::Path;

type Read = fn(&[u8]);

/// The kinds of files by their folders in the corpus.
const KINDS: [(&str, Read); 10] = [
    ("bake", fuzz::bake),
    ("checkpoint", fuzz::checkpoint),
    ("gltf", fuzz::gltf),
    ("ies", fuzz::ies),
    ("image", fuzz::image),
    ("mtl", fuzz::mtl),
    ("obj", fuzz::obj),
    ("points", fuzz::points),
    ("scene_toml", fuzz::scene_toml),
    ("visibility", fuzz::visibility),
];

#[test]
fn every_file_is_read_or_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let folders = fs::read_dir(&corpus).expect("the corpus").count();
    assert_eq!(folders, KINDS.len());
    for (kind, read) in KINDS {
        let mut files = 0;
        for entry in fs::read_dir(corpus.join(kind)).expect("a folder of the corpus") {
            let path = entry.expect("an entry").path();
            println!("{}", path.display());
            let bytes = fs::read(&path).expect("a file of the corpus");
            read(&bytes);
            // Cut off and with its bits turned, as well.
            read(&bytes[..bytes.len() / 2]);
            let turned: Vec<u8> = bytes.iter().map(|byte| !byte).collect();
            read(&turned);
            files += 1;
        }
        assert!(files >= 2, "{kind}");
    }
}
