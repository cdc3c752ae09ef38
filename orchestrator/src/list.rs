//! Lists the experiments, studies, campaigns and FMUs that the program finds.

use crate::failure::Failure;
use campaign::definition::Campaign;
use cosim::error::Error;
use cosim::experiment::Experiment;
use cosim::search::{self, files};
use fmu_import::fmu::Fmu;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, iter};
use study::definition::Study;

/// Prints the experiments, studies and campaigns below a folder with their titles, and the FMUs
/// below it. Without a folder it prints those below the current one, and all others that the
/// program finds from any folder.
///
/// # Errors
/// Returns an error if the folder does not exist, or if the text cannot be written.
pub(crate) fn list(folder: Option<&Path>, out: &mut impl Write) -> Result<(), Failure> {
    if let Some(folder) = folder
        && !folder.is_dir()
    {
        return Err(Error::experiment(format!("{} is not a folder", folder.display())).into());
    }
    let searched = folder.unwrap_or(Path::new("."));
    let find = |extension: &str, others: Vec<PathBuf>| {
        let mut seen = BTreeSet::new();
        let paths = iter::once(searched.to_path_buf())
            .chain(others)
            .flat_map(|root| files(&root, extension));
        paths
            .filter(|path| fs::canonicalize(path).is_ok_and(|path| seen.insert(path)))
            .collect::<Vec<_>>()
    };
    let elsewhere = if folder.is_none() { search::experiments() } else { Vec::new() };
    let tables = find("toml", elsewhere);
    let mut rows: Vec<(PathBuf, String)> = Vec::new();
    for path in &tables {
        // Other TOML files are no experiments, and are skipped. A faulty experiment is shown with
        // its fault.
        let Ok(text) = fs::read_to_string(path) else { continue };
        if search::is_experiment(&text) {
            let title = Experiment::parse(path, text)
                .map_or_else(|error| format!("FAULT {error}"), |e| e.title);
            rows.push((path.clone(), title));
        }
    }
    print("experiments", &rows, out)?;

    let studies: Vec<(PathBuf, String)> = tables
        .iter()
        .filter(|path| path.file_name().is_some_and(|name| name == "study.toml"))
        .map(|path| {
            let title = Study::load(path)
                .map_or_else(|error| format!("FAULT {error}"), |study| study.title);
            (path.clone(), title)
        })
        .collect();
    print("studies", &studies, out)?;

    let campaigns: Vec<(PathBuf, String)> = tables
        .into_iter()
        .filter(|path| fs::read_to_string(path).is_ok_and(|text| search::is_campaign(&text)))
        .map(|path| {
            let title = Campaign::load(&path)
                .map_or_else(|error| format!("FAULT {error}"), |campaign| campaign.title);
            (path, title)
        })
        .collect();
    print("campaigns", &campaigns, out)?;

    let others =
        if folder.is_none() { search::fmu_folders() } else { vec![PathBuf::from("target/fmu")] };
    let rows: Vec<(PathBuf, String)> = find("fmu", others)
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

fn print(what: &str, rows: &[(PathBuf, String)], out: &mut impl Write) -> Result<(), Failure> {
    writeln!(out, "{what} ({})", rows.len())?;
    let width =
        rows.iter().map(|(path, _)| path.display().to_string().chars().count()).max().unwrap_or(0);
    for (path, text) in rows {
        writeln!(out, "  {:<width$}  {text}", path.display().to_string())?;
    }
    Ok(())
}
