//! The command `pack`, which writes an experiment as an SSP archive.

use crate::arguments::Subject;
use crate::failure::Failure;
use clap::Args;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::ssp;
use cosim::system::System;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Options of `pack`.
#[derive(Args)]
pub(crate) struct Pack {
    /// Path of the archive [default: EXPERIMENT.ssp].
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    out: Option<PathBuf>,
    /// Replace the archive if it exists.
    #[arg(long, help_heading = "Results")]
    force: bool,
    #[command(flatten)]
    pub(crate) subject: Subject,
}

/// Writes an experiment as an SSP archive.
///
/// # Errors
/// Returns an error if the experiment is faulty, or if the archive exists or cannot be written.
pub(crate) fn pack(
    asked: &Pack,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    if asked.subject.overrides.law.is_some() {
        return Err(Error::experiment("an archive cannot hold a law in another program").into());
    }
    let path = asked.subject.path()?;
    let archive = asked.out.clone().unwrap_or_else(|| {
        PathBuf::from(path.file_stem().unwrap_or_default()).with_extension("ssp")
    });
    if archive.exists() && !asked.force {
        let path = archive.display();
        return Err(Error::experiment(format!(
            "{path} already exists: --force replaces it, --out chooses another name"
        ))
        .into());
    }
    let (system, _entries) = asked.subject.system(&path)?;
    ssp::pack(&system, &archive, interrupt)?;
    let lost = ssp::lost(&system).join(", ");
    if !lost.is_empty() {
        tracing::warn!("SSP has no place for these settings, which the archive lacks: {lost}");
    }
    Ok(packed(&system, &archive, out)?)
}

/// Prints the components in a packed archive, and which setting the standard cannot store.
fn packed(system: &System, archive: &Path, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "{}: {}", archive.display(), system.names().join(", "))?;
    let step = system.experiment.simulation.step;
    writeln!(
        out,
        "  SSP has no place for the communication step: run the archive with --step {step}"
    )
}
