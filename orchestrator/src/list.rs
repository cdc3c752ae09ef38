//! Lists the experiments, studies and FMUs there are.

use crate::error::Error;
use crate::experiment::Experiment;
use crate::fmu::Fmu;
use crate::study::Study;
use std::io::Write;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Prints the experiments and studies below a folder with their titles, and the FMUs below it and in `target/fmu`.
///
/// # Errors
/// If the folder is not there, or the text cannot be written.
pub fn list(folder: &Path, out: &mut impl Write) -> Result<(), Error> {
    if !folder.is_dir() {
        return Err(Error::experiment(format!("{} is not a folder", folder.display())));
    }
    let mut rows: Vec<(PathBuf, String)> = Vec::new();
    for path in files(folder, "toml") {
        // Other TOML files are no experiments; an experiment with a fault is shown with it.
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        if text.lines().any(|line| line.trim_start().starts_with("[components.")) {
            let title =
                Experiment::parse(&path, text).map_or_else(|error| format!("FAULT {error}"), |e| e.title);
            rows.push((path, title));
        }
    }
    print("experiments", &rows, out)?;

    let studies: Vec<(PathBuf, String)> = files(folder, "toml")
        .into_iter()
        .filter(|path| path.file_name().is_some_and(|name| name == "study.toml"))
        .map(|path| {
            let title = Study::load(&path).map_or_else(|error| format!("FAULT {error}"), |study| study.title);
            (path, title)
        })
        .collect();
    print("studies", &studies, out)?;

    let mut fmus = files(folder, "fmu");
    fmus.extend(files(Path::new("target/fmu"), "fmu"));
    let rows: Vec<(PathBuf, String)> = fmus
        .into_iter()
        .map(|path| {
            let text = Fmu::open(&path).map_or_else(
                |error| format!("FAULT {error}"),
                |fmu| format!("{}: {}", fmu.description.model_name, fmu.description.description),
            );
            (path, text)
        })
        .collect();
    print("FMUs", &rows, out)
}

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    WalkDir::new(folder)
        .sort_by_file_name()
        .into_iter()
        .filter_entry(|entry| entry.depth() == 0 || !is_passed_over(&entry.file_name().to_string_lossy()))
        .flatten()
        .map(walkdir::DirEntry::into_path)
        .filter(|path| path.is_file() && path.extension().is_some_and(|e| e == extension))
        .collect()
}

/// Hidden folders and build folders are large and hold nothing to be run, but for `target/fmu`, which is asked for by name.
fn is_passed_over(name: &str) -> bool {
    name.starts_with('.') || name == "target"
}

fn print(what: &str, rows: &[(PathBuf, String)], out: &mut impl Write) -> Result<(), Error> {
    writeln!(out, "{what} ({})", rows.len())?;
    let width = rows.iter().map(|(path, _)| path.display().to_string().chars().count()).max().unwrap_or(0);
    for (path, text) in rows {
        writeln!(out, "  {:<width$}  {text}", path.display().to_string())?;
    }
    Ok(())
}
