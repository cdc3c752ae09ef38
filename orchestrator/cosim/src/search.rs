//! Folders in which experiments, studies and FMUs are found from any folder: those of an environment
//! variable, and those beside this program. [`named`] finds them by name.

pub mod named;

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Environment variable that names further folders, separated as in PATH.
pub const VARIABLE: &str = "ORCHESTRATOR_PATH";

/// Places of FMUs beside this program: in a release, and in the folder where it is built.
const FMUS: [&str; 2] = ["fmu", "../fmu"];
/// Places of experiments and studies.
const EXPERIMENTS: [&str; 2] = ["experiments", "../../orchestrator/experiments"];

/// Returns the folders of the environment variable and those at these places beside the program, as
/// far as they exist, each once.
fn installed(places: &[&str]) -> Vec<PathBuf> {
    let given = env::var_os(VARIABLE).unwrap_or_default();
    let program = env::current_exe().and_then(fs::canonicalize).unwrap_or_default();
    let beside = places.iter().filter_map(|place| Some(program.parent()?.join(place)));
    let folders = env::split_paths(&given).chain(beside);
    let mut seen = BTreeSet::new();
    let canonical = folders.filter_map(|folder| fs::canonicalize(folder).ok());
    canonical.filter(|folder| folder.is_dir() && seen.insert(folder.clone())).collect()
}

/// Returns the folders that hold FMUs.
pub fn fmu_folders() -> Vec<PathBuf> {
    installed(&FMUS)
}

/// Returns the folders in which the file of a name is searched.
pub fn folders() -> Vec<PathBuf> {
    installed(&[EXPERIMENTS, FMUS].concat())
}

/// Returns whether an archive lies in one of these folders, or in one that belongs to this program:
/// beside it, or named by the environment variable. Whoever can write there can also replace the
/// program, or be trusted by the user.
pub fn is_installed(archive: &Path, folders: &[PathBuf]) -> bool {
    let canonical = |path: &Path| fs::canonicalize(path).ok();
    let own = canonical(archive).and_then(|path| path.parent().map(Path::to_path_buf));
    let is_own = |folder: &PathBuf| canonical(folder) == own;
    own.is_some() && fmu_folders().iter().chain(folders).any(is_own)
}

/// Lists the files with this extension below a folder. Hidden folders, build folders and
/// those of fuzzers, which hold faulty experiments, are skipped.
pub fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let is_skipped = |name: &str| name.starts_with('.') || name == "target" || name == "fuzz";
    WalkDir::new(folder)
        .sort_by_file_name()
        .into_iter()
        .filter_entry(|entry| {
            entry.depth() == 0 || !is_skipped(&entry.file_name().to_string_lossy())
        })
        .flatten()
        .map(walkdir::DirEntry::into_path)
        .filter(|path| path.is_file() && has_extension(path, extension))
        .collect()
}

/// Returns whether a path ends with a dot and this extension.
fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|other| other == extension)
}
