//! Lists the experiments, studies, campaigns and FMUs that the program finds.

use crate::failure::Failure;
use crate::inspect::{width, wrapped};
use campaign::definition::Campaign;
use cosim::error::Error;
use cosim::experiment::Experiment;
use cosim::search::named::Kind;
use fmu_import::fmu::Fmu;
use serde::Serialize;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use study::definition::Study;

/// An entry of the list.
#[derive(Debug, Serialize)]
struct Row {
    kind: &'static str,
    name: String,
    path: PathBuf,
    /// Title, or the description of an FMU; `None` if the file is faulty.
    title: Option<String>,
    fault: Option<String>,
}

/// Prints the names and titles of all experiments, studies, campaigns and FMUs: of those below a
/// folder, or without a folder of those that are installed. With `json` the list is for other
/// programs.
///
/// # Errors
/// Returns an error if the folder does not exist, or if the text cannot be written.
pub(crate) fn list(folder: Option<&Path>, json: bool, out: &mut impl Write) -> Result<(), Failure> {
    if let Some(folder) = folder
        && !folder.is_dir()
    {
        return Err(Error::experiment(format!("{} is not a folder", folder.display())).into());
    }
    let sections = Kind::ALL.map(|kind| rows(kind, folder));
    if json {
        let rows: Vec<&Row> = sections.iter().flatten().collect();
        serde_json::to_writer_pretty(&mut *out, &rows).map_err(std::io::Error::from)?;
        return Ok(writeln!(out)?);
    }
    let width = width();
    for (index, (kind, rows)) in Kind::ALL.iter().zip(&sections).enumerate() {
        if index > 0 {
            writeln!(out)?;
        }
        let (many, command) = (kind.plural(), kind.command());
        writeln!(out, "{many} ({}): orchestrator {command} NAME", rows.len())?;
        print(rows, width, out)?;
    }
    Ok(())
}

/// Largest width of the column of names.
const NAMES: usize = 32;

/// Lists what is installed of a kind, or what is below a folder. A file that is not installed is
/// named by its path.
fn rows(kind: Kind, folder: Option<&Path>) -> Vec<Row> {
    let installed = kind.installed();
    let paths = folder.map_or_else(|| installed.clone(), |folder| kind.below(folder, |_| true));
    let name = |path: &Path| match fs::canonicalize(path) {
        Ok(path) if installed.contains(&path) => kind.shortest(&path, &installed),
        _ => {
            let name = kind.name(path);
            name.strip_prefix(".").unwrap_or(&name).display().to_string()
        }
    };
    paths.into_iter().map(|path| row(kind, name(&path), path)).collect()
}

fn row(kind: Kind, name: String, path: PathBuf) -> Row {
    let title = match kind {
        Kind::Experiment => Experiment::load(&path).map(|found| found.title).map_err(text),
        Kind::Study => Study::load(&path).map(|found| found.title).map_err(text),
        Kind::Campaign => Campaign::load(&path).map(|found| found.title).map_err(text),
        Kind::Fmu => Fmu::open(&path).map(|found| found.description.description).map_err(text),
    };
    let (title, fault) = match title {
        Ok(title) => (Some(title), None),
        Err(fault) => (None, Some(fault)),
    };
    Row { kind: kind.word(), name, path, title, fault }
}

#[expect(clippy::needless_pass_by_value, reason = "used as a function of errors")]
fn text(error: impl ToString) -> String {
    error.to_string()
}

fn print(rows: &[Row], width: usize, out: &mut impl Write) -> Result<(), Failure> {
    let names = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).min(NAMES);
    if !rows.is_empty() {
        writeln!(out, "  {:<names$}  TITLE", "NAME")?;
    }
    for Row { name, title, fault, .. } in rows {
        let text = match title {
            Some(title) if title.is_empty() => "–".into(),
            Some(title) => title.clone(),
            None => format!("FAULT {}", fault.as_deref().unwrap_or_default()),
        };
        let margins = [&*format!("  {name:<names$}  "), &*" ".repeat(names + 4)];
        wrapped(&text, margins, width, out)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_short_as_they_can_be() {
        let paths =
            ["a/lqr.toml", "a/x/same.toml", "b/x/same.toml", "./lonely.toml", "/c/lonely.toml"];
        let paths = paths.map(PathBuf::from);
        let names = paths.each_ref().map(|path| Kind::Experiment.shortest(path, &paths));
        assert_eq!(names, ["lqr", "a/x/same", "b/x/same", "./lonely", "c/lonely"]);
        let studies = [PathBuf::from("a/exchange/study.toml"), PathBuf::from("a/entry/study.toml")];
        assert_eq!(Kind::Study.shortest(&studies[1], &studies), "entry");
    }
}
