//! Folders in which experiments, studies and FMUs are found from any folder: those of the project,
//! those of an environment variable, and those beside this program. [`named`] finds them by name.

pub mod named;

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Environment variable that names further folders, separated as in PATH.
pub const VARIABLE: &str = "ORCHESTRATOR_PATH";

/// Folder in which the project keeps its experiments.
const EXPERIMENTS: &str = "orchestrator/experiments";

fn by_variable() -> Vec<PathBuf> {
    env::var_os(VARIABLE).map(|paths| env::split_paths(&paths).collect()).unwrap_or_default()
}

fn beside_program(places: &[&str]) -> Vec<PathBuf> {
    let program = env::current_exe().and_then(fs::canonicalize).ok();
    let folder = program.as_deref().and_then(Path::parent);
    folder.into_iter().flat_map(|folder| places.iter().map(|place| folder.join(place))).collect()
}

/// Keeps the folders that exist, each once, with absolute paths made canonical.
fn existing(folders: Vec<PathBuf>) -> Vec<PathBuf> {
    let mut seen = BTreeSet::new();
    let is_new = |folder: &PathBuf| fs::canonicalize(folder).is_ok_and(|path| seen.insert(path));
    let straight = |folder: PathBuf| {
        if folder.is_absolute() { fs::canonicalize(&folder).unwrap_or(folder) } else { folder }
    };
    folders.into_iter().filter(|folder| folder.is_dir()).filter(is_new).map(straight).collect()
}

/// Returns the folders that hold experiments and studies.
pub fn experiments() -> Vec<PathBuf> {
    let mut folders = vec![PathBuf::from(EXPERIMENTS)];
    folders.extend(by_variable());
    folders.extend(beside_program(&["experiments", "../../orchestrator/experiments"]));
    existing(folders)
}

/// Returns the folders that hold FMUs.
pub fn fmu_folders() -> Vec<PathBuf> {
    let mut folders = vec![PathBuf::from("target/fmu")];
    folders.extend(by_variable());
    folders.extend(beside_program(&["fmu", "../fmu"]));
    existing(folders)
}

/// Returns whether an archive lies in one of these folders, or in one that belongs to this program:
/// beside it, or named by the environment variable. Whoever can write there can also replace the
/// program, or be trusted by the user.
pub fn is_installed(archive: &Path, folders: &[PathBuf]) -> bool {
    let canonical = |path: &Path| fs::canonicalize(path).ok();
    let Some(folder) = canonical(archive).and_then(|path| path.parent().map(Path::to_path_buf))
    else {
        return false;
    };
    let own = by_variable().into_iter().chain(beside_program(&["fmu", "../fmu"]));
    own.chain(folders.iter().cloned()).any(|other| canonical(&other).as_ref() == Some(&folder))
}

/// Returns the folders in which the file of a name is searched: those that hold experiments and
/// FMUs, and the current one.
pub fn folders() -> Vec<PathBuf> {
    let mut folders = experiments();
    folders.extend(fmu_folders());
    folders.push(PathBuf::from("."));
    existing(folders)
}

/// Lists the files with this extension below a folder. Hidden folders, build folders and
/// those of fuzzers are skipped.
pub fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    WalkDir::new(folder)
        .sort_by_file_name()
        .into_iter()
        .filter_entry(|entry| {
            entry.depth() == 0 || !is_passed_over(&entry.file_name().to_string_lossy())
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

/// Returns whether a folder or file is skipped. Hidden folders and build folders are large and hold
/// nothing to run, except `target/fmu`, which is searched separately. A folder `fuzz` holds the
/// inputs of a fuzzer, such as faulty experiments.
fn is_passed_over(name: &str) -> bool {
    name.starts_with('.') || name == "target" || name == "fuzz"
}
