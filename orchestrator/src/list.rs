//! Lists the experiments, studies, campaigns and FMUs that the program finds.

use crate::failure::Failure;
use campaign::definition::Campaign;
use cosim::error::Error;
use cosim::experiment::Experiment;
use cosim::search::named::Kind;
use fmu_import::fmu::Fmu;
use serde::Serialize;
use std::fs;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};
use study::definition::Study;
use terminal_size::Width;

/// Form in which the list is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Names and titles, which are wrapped and shortened.
    Short,
    /// Names and whole titles, and the file of each.
    Long,
    /// JSON, for other programs.
    Json,
}

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
/// folder, or without a folder of those that are installed.
///
/// # Errors
/// Returns an error if the folder does not exist, or if the text cannot be written.
pub(crate) fn list(folder: Option<&Path>, form: Form, out: &mut impl Write) -> Result<(), Failure> {
    if let Some(folder) = folder
        && !folder.is_dir()
    {
        return Err(Error::experiment(format!("{} is not a folder", folder.display())).into());
    }
    let sections = Kind::ALL.map(|kind| rows(kind, folder));
    if form == Form::Json {
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
        print(rows, form, width, out)?;
    }
    Ok(())
}

/// Width of printed texts where there is no terminal.
const WIDTH: usize = 80;

/// Returns the width to which texts are wrapped.
pub(crate) fn width() -> usize {
    let columns = terminal_size::terminal_size_of(stdout());
    columns.map_or(WIDTH, |(Width(columns), _)| usize::from(columns).clamp(40, 120))
}

/// Largest width of the column of names. A longer name gets a line of its own.
const NAMES: usize = 32;
/// Number of lines to which a title is shortened.
const LINES: usize = 2;

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

fn print(rows: &[Row], form: Form, width: usize, out: &mut impl Write) -> Result<(), Failure> {
    let names = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).min(NAMES);
    if !rows.is_empty() {
        writeln!(out, "  {:<names$}  TITLE", "NAME")?;
    }
    for Row { name, path, title, fault, .. } in rows {
        let text = match (title, fault) {
            (Some(title), _) => title.clone(),
            (None, fault) => format!("FAULT {}", fault.as_deref().unwrap_or_default()),
        };
        // The widths of the margin and of the space between the columns are 2.
        let room = width - names - 4;
        let mut lines: Vec<String> =
            textwrap::wrap(&text, room).into_iter().map(String::from).collect();
        if form == Form::Short && fault.is_none() && lines.len() > LINES {
            lines.truncate(LINES);
            shorten(&mut lines[LINES - 1], room);
        }
        if form == Form::Long {
            lines.push(path.display().to_string());
        }
        let mut lines = lines.iter();
        if name.chars().count() > names {
            writeln!(out, "  {name}")?;
        } else {
            let first = lines.next().map_or("", String::as_str);
            writeln!(out, "{}", format!("  {name:<names$}  {first}").trim_end())?;
        }
        for line in lines {
            writeln!(out, "  {:<names$}  {line}", "")?;
        }
    }
    Ok(())
}

/// Ends a line with an ellipsis, after the last whole word that leaves room for it.
fn shorten(line: &mut String, room: usize) {
    while line.chars().count() + 2 > room {
        let Some(end) = line.rfind(' ') else { break };
        line.truncate(end);
    }
    line.push_str(" …");
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

    #[test]
    fn long_titles_are_wrapped_and_shortened() {
        let row = |name: &str, title: &str| Row {
            kind: "experiment",
            name: name.into(),
            path: PathBuf::from("a.toml"),
            title: Some(title.into()),
            fault: None,
        };
        let rows = [row("a", &"word ".repeat(40)), row(&"n".repeat(40), "title")];
        let printed = |form| {
            let mut out = Vec::new();
            print(&rows, form, 60, &mut out).unwrap();
            String::from_utf8(out).unwrap()
        };
        let short = printed(Form::Short);
        assert!(short.lines().all(|line| line.chars().count() <= 60), "{short}");
        assert_eq!((short.lines().count(), short.matches(" …").count()), (5, 1), "{short}");
        let long = printed(Form::Long);
        assert!(long.matches("word").count() == 40 && long.contains("a.toml"), "{long}");
    }
}
