//! The command `show`, which prints a file with all that it extends.

use crate::failure::Failure;
use campaign::definition::Campaign;
use cosim::experiment::Experiment;
use cosim::search::named::{Kind, find_any};
use std::io::Write;
use std::path::Path;
use study::definition::Study;

/// Prints an experiment, a study or a campaign with everything that it extends. The files that an
/// experiment or a campaign names have their absolute paths.
///
/// # Errors
/// Returns an error if there is no such file, if it is faulty, or if the text cannot be written.
pub(crate) fn show(name: &Path, out: &mut impl Write) -> Result<(), Failure> {
    let path = find_any(name, &[Kind::Study, Kind::Experiment, Kind::Campaign])?;
    let text = match Kind::of(&path) {
        Some(Kind::Study) => Study::spelled_out(&path)?,
        Some(Kind::Campaign) => Campaign::load(&path)?.source.movable(),
        _ => Experiment::load(&path)?.source.movable(),
    };
    Ok(out.write_all(text.as_bytes())?)
}
