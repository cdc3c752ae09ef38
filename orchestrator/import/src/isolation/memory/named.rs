//! The memory elsewhere, which is a temporary file.

use crate::isolation::channel::Channel;
use std::ffi::OsString;
use std::fs::OpenOptions;
use std::io;
use std::process::Command;
use tempfile::NamedTempFile;

/// The memory, which is a file whose path is an argument of the process.
pub(crate) struct Memory(NamedTempFile);

impl Memory {
    pub(crate) fn new() -> io::Result<(Self, Channel)> {
        let file = NamedTempFile::with_prefix(format!("fmu-{}-", std::process::id()))?;
        let channel = Channel::create(file.as_file())?;
        Ok((Self(file), channel))
    }

    /// Lets the process of a command find the memory.
    pub(crate) fn pass(&self, command: &mut Command) -> io::Result<()> {
        command.arg(self.0.path());
        Ok(())
    }
}

/// Opens the memory that the arguments name.
pub(crate) fn inherited(mut arguments: impl Iterator<Item = OsString>) -> io::Result<Channel> {
    let path = arguments.next().unwrap_or_default();
    let file = OpenOptions::new().read(true).write(true).open(path)?;
    // The file is closed, so that an instance does not find it open.
    Channel::open(&file)
}
