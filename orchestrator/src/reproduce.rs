//! The command `reproduce`, which repeats a paper's comparison.

use crate::arguments::Many;
use crate::failure::Failure;
use clap::Args;
use cosim::experiment::{Overrides, Process};
use cosim::interrupt::Interrupt;
use cosim::search::named::{Kind, find};
use std::io::{self, Write};
use std::path::PathBuf;
use study::definition::Study;
use study::reproduce::{self, StudyReport};

/// Options of `reproduce`.
#[derive(Args)]
pub(crate) struct Reproduce {
    /// Study to run: the name of one that `list` shows, a folder with a study.toml, or such a
    /// file.
    study: PathBuf,
    /// Run at most N cases of each run, for a quick look.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    members: Option<u64>,
    #[command(flatten)]
    many: Many,
    #[command(flatten)]
    process: Process,
}

/// Runs a study.
///
/// # Errors
/// Returns an error if the study is faulty, if cases fail, or if a file cannot be written.
pub(crate) fn reproduce(
    asked: Reproduce,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    let Reproduce { study, members, many, process } = asked;
    let study = Study::load_with(&find(&study, Kind::Study)?, members)?;
    let overrides = Overrides { process, ..Default::default() };
    let options = many.options(interrupt);
    let report = reproduce::reproduce(&study, &many.fmu_dir, &overrides, &options)?;
    if !many.quiet {
        summary(&report, out)?;
    }
    report.failures.map_or(Ok(()), |told| Err(sweep::error::Error::Failed(told).into()))
}

/// Prints the outcome of a reproduction.
///
/// # Errors
/// Returns an error if the text cannot be written.
fn summary(report: &StudyReport, out: &mut impl Write) -> io::Result<()> {
    let (run, stored) = report.parts;
    writeln!(out, "{}", report.title)?;
    writeln!(
        out,
        "  {} runs in {} parts: {run} run now, {stored} kept from before; {:.1} s elapsed",
        report.runs,
        run + stored,
        report.elapsed
    )?;
    for note in &report.notes {
        writeln!(out, "  note: {note}")?;
    }
    for (claim, verdict) in &report.verdicts {
        writeln!(out, "  {:<14} {claim}", verdict.text())?;
    }
    writeln!(out, "  report: {}", report.page.display())?;
    writeln!(out, "  in the same folder: results.json, and the figures in figures")
}
