//! The command `man`, which writes the manual pages.

use crate::failure::Failure;
use clap::Command;
use cosim::error::Error;
use std::fs;
use std::path::Path;

/// Writes a manual page of the program and one of each of its commands into a folder.
///
/// # Errors
/// Returns an error if the folder or a page cannot be written.
pub(crate) fn write(command: Command, folder: &Path) -> Result<(), Failure> {
    let written = fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(command.disable_help_subcommand(true), folder));
    Ok(written.map_err(Error::file(folder))?)
}
