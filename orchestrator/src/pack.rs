//! The command `pack`, which writes an experiment as an SSP archive.

use crate::failure::Failure;
use crate::run::system;
use cosim::error::Error;
use cosim::experiment::Overrides;
use cosim::interrupt::Interrupt;
use cosim::search::named::{Kind, find};
use cosim::ssp;
use cosim::system::System;
use std::io::Write;
use std::path::{Path, PathBuf};

/// An SSP archive that is to be written.
pub(crate) struct Archive {
    /// Path of the archive; that of the experiment if it is not given.
    pub(crate) path: Option<PathBuf>,
    /// Whether an existing archive may be replaced.
    pub(crate) force: bool,
}

/// Writes an experiment as an SSP archive.
///
/// # Errors
/// Returns an error if the experiment is faulty, or if the archive exists or cannot be written.
pub(crate) fn pack(
    experiment: &Path,
    overrides: &Overrides,
    fmu_dirs: &[PathBuf],
    archive: Archive,
    out: &mut impl Write,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    if overrides.law.is_some() {
        return Err(Error::experiment("an archive cannot hold a law in another program").into());
    }
    let path = find(experiment, Kind::Experiment)?;
    let Archive { path: archive, force } = archive;
    let archive = archive.unwrap_or_else(|| {
        PathBuf::from(path.file_stem().unwrap_or_default()).with_extension("ssp")
    });
    if archive.exists() && !force {
        let path = archive.display();
        return Err(Error::experiment(format!(
            "{path} already exists: --force replaces it, --out chooses another name"
        ))
        .into());
    }
    let (system, _entries) = system(&path, overrides, fmu_dirs)?;
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
