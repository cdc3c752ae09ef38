//! Folders in which experiments, studies and FMUs are found from any folder: those of the project,
//! those of an environment variable, and those beside this program.

use crate::error::Error;
use fmu_import::names;
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

/// Lists the files with this extension below a folder. Hidden folders and build folders are
/// skipped.
pub fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    WalkDir::new(folder)
        .sort_by_file_name()
        .into_iter()
        .filter_entry(|entry| {
            entry.depth() == 0 || !is_passed_over(&entry.file_name().to_string_lossy())
        })
        .flatten()
        .map(walkdir::DirEntry::into_path)
        .filter(|path| path.is_file() && path.extension().is_some_and(|e| e == extension))
        .collect()
}

/// Returns whether a folder or file is skipped. Hidden folders and build folders are large and hold
/// nothing to run, except `target/fmu`, which is searched separately.
fn is_passed_over(name: &str) -> bool {
    name.starts_with('.') || name == "target"
}

/// Returns whether the text of a TOML file is that of an experiment, with or without faults. A file
/// without a title only serves to be extended, a file that names a paper is a study, and one in
/// which something varies is a campaign.
pub fn is_experiment(text: &str) -> bool {
    let has_components = text.lines().any(|line| line.trim_start().starts_with("[components."));
    sets(text.lines(), "title")
        && !sets(text.lines(), "paper")
        && !is_campaign(text)
        && (has_components || sets(text.lines(), "extends"))
}

/// Returns whether the text of a TOML file is that of a campaign: something varies in it, or its
/// first keys give it a title and name the experiment that is varied.
pub fn is_campaign(text: &str) -> bool {
    let starts = |line: &str, with: &str| line.trim_start().starts_with(with);
    text.lines().any(|line| starts(line, "[[vary]]"))
        || ["title", "experiment"]
            .iter()
            .all(|key| sets(text.lines().take_while(|line| !starts(line, "[")), key))
}

/// Returns whether one of these lines sets a key.
fn sets<'a>(mut lines: impl Iterator<Item = &'a str>, key: &str) -> bool {
    lines.any(|line| {
        line.trim_start().strip_prefix(key).is_some_and(|rest| rest.trim_start().starts_with('='))
    })
}

/// Finds the experiments below a folder.
fn experiments_below(folder: &Path) -> Vec<PathBuf> {
    let mut paths = files(folder, "toml");
    paths.retain(|path| fs::read_to_string(path).is_ok_and(|text| is_experiment(&text)));
    paths
}

/// Finds the experiment with this name: a file, or an experiment that `list` shows, by its name or
/// the end of its path.
///
/// # Errors
/// Returns an error if there is no such experiment, if there are several, or if the name is that of
/// something else.
pub fn experiment(name: &Path) -> Result<PathBuf, Error> {
    let shown = name.display();
    let extension = name.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    if extension == "fmu" {
        return Err(Error::experiment(format!(
            "{shown} is an FMU, and FMUs are run by an experiment: a file that names it, as in [components.plant] \
             fmu = \"{}\". --fmu COMPONENT={shown} puts it into an existing experiment, \
             and `orchestrator inspect {shown}` shows its variables",
            name.file_name().unwrap_or_default().to_string_lossy()
        )));
    }
    if name.is_file() {
        return Ok(name.to_path_buf());
    }
    if extension == "ssp" || name.is_absolute() {
        let is_what = if name.is_dir() { "this is a folder" } else { "there is no such file" };
        return Err(Error::experiment(format!("{shown}: {is_what}")));
    }
    let file = with_toml(name);
    if file.is_file() {
        return Ok(file);
    }
    let mut others = Vec::new();
    for folder in experiments().into_iter().chain([PathBuf::from(".")]) {
        let below = experiments_below(&folder);
        let fitting: Vec<&PathBuf> = below.iter().filter(|path| path.ends_with(&file)).collect();
        match fitting[..] {
            [] => others.extend(below),
            [path] => return Ok(path.clone()),
            [..] => {
                let paths: Vec<String> =
                    fitting.iter().map(|path| path.display().to_string()).collect();
                return Err(Error::experiment(format!(
                    "several experiments are called {shown}: {}",
                    paths.join(", ")
                )));
            }
        }
    }
    let stems: BTreeSet<String> = others
        .iter()
        .filter_map(|path| path.file_stem())
        .map(|stem| stem.to_string_lossy().into_owned())
        .collect();
    let hint = names::hint(
        &with_toml(name).file_stem().unwrap_or_default().to_string_lossy(),
        stems.iter().map(String::as_str),
    );
    Err(Error::experiment(format!(
        "there is no experiment \"{shown}\", neither as a file nor among those that `orchestrator list` shows{hint}"
    )))
}

/// Returns the file name of an experiment, a study or a campaign that is called by its name.
pub fn with_toml(name: &Path) -> PathBuf {
    if name.extension().is_some_and(|extension| extension == "toml") {
        return name.to_path_buf();
    }
    let mut text = name.as_os_str().to_owned();
    text.push(".toml");
    PathBuf::from(text)
}
