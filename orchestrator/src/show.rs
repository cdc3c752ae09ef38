//! The command `show`, which prints a file with all that it extends.

use crate::failure::Failure;
use campaign::definition::Campaign;
use campaign::prepare;
use cosim::document::Source;
use cosim::experiment::Experiment;
use cosim::search;
use std::io::Write;
use std::path::Path;
use study::definition::Study;
use study::reproduce;

/// Prints an experiment, a study or a campaign with everything that it extends.
///
/// # Errors
/// Returns an error if there is no such file, if it is faulty, or if the text cannot be written.
pub(crate) fn show(name: &Path, out: &mut impl Write) -> Result<(), Failure> {
    if let Ok(path) = reproduce::find(name)
        && path.ends_with("study.toml")
    {
        return Ok(out.write_all(Study::spelled_out(&path)?.as_bytes())?);
    }
    let path = search::experiment(name).or_else(|e| prepare::find(name).map_err(|_| e))?;
    let source = if search::is_campaign(Source::load(&path)?.whole()) {
        Campaign::load(&path)?.source
    } else {
        Experiment::load(&path)?.source
    };
    Ok(out.write_all(source.whole().as_bytes())?)
}
