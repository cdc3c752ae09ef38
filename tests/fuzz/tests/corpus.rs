//! Every file of the corpus goes through its target, whole and damaged, without libFuzzer.

use std::fs;
use std::path::{Path, PathBuf};

/// Returns the files of a target.
fn files(name: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    let mut files: Vec<_> =
        fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn every_target_has_a_corpus_and_a_program() {
    let mut folders: Vec<_> = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus"))
        .unwrap()
        .map(|folder| folder.unwrap().file_name().into_string().unwrap())
        .collect();
    folders.sort();
    assert_eq!(folders, fuzz::TARGETS.map(|(name, _)| name));
    for (name, _) in fuzz::TARGETS {
        assert!(!files(name).is_empty(), "{name}");
        let program = format!("fuzz_targets/{name}.rs");
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(&program).is_file(), "{program}");
    }
}

#[test]
fn regress_the_corpus_is_read_without_a_fault() {
    for (name, target) in fuzz::TARGETS {
        for file in files(name) {
            target(&fs::read(&file).unwrap());
        }
    }
}

#[test]
fn damaged_files_are_read_without_a_fault() {
    for (name, target) in fuzz::TARGETS {
        for file in files(name) {
            let bytes = fs::read(&file).unwrap();
            // 60 places all over the file: a bit is turned, a byte is missing, the rest is missing.
            for place in (0..bytes.len()).step_by(bytes.len().div_ceil(20).max(1)) {
                let mut turned = bytes.clone();
                turned[place] ^= 1 << (place % 8);
                target(&turned);
                let mut without = bytes.clone();
                without.remove(place);
                target(&without);
                target(&bytes[..place]);
            }
        }
    }
}
