//! The memory under Unix, which has no name.

use crate::isolation::channel::Channel;
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::process::{Command, Stdio};

/// The memory, as long as the process has not opened it.
pub(crate) struct Memory(File);

impl Memory {
    pub(crate) fn new() -> io::Result<(Self, Channel)> {
        let file = file()?;
        let channel = Channel::create(&file)?;
        seal(&file)?;
        Ok((Self(file), channel))
    }

    /// Lets the process of a command inherit the memory.
    pub(crate) fn pass(&self, command: &mut Command) -> io::Result<()> {
        command.stdout(Stdio::from(self.0.try_clone()?));
        Ok(())
    }
}

/// Opens the memory that this process has inherited.
pub(crate) fn inherited(_arguments: impl Iterator<Item = OsString>) -> io::Result<Channel> {
    let file = File::from(rustix::stdio::stdout().try_clone_to_owned()?);
    let channel = Channel::open(&file)?;
    rustix::stdio::dup2_stdout(rustix::stdio::stderr().as_fd())?;
    Ok(channel)
}

#[cfg(target_os = "linux")]
fn file() -> io::Result<File> {
    use rustix::fs::{MemfdFlags, memfd_create};
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    Ok(File::from(memfd_create("fmu", flags)?))
}

#[cfg(not(target_os = "linux"))]
fn file() -> io::Result<File> {
    tempfile::tempfile()
}

/// Keeps the size of the memory for ever: an instance that cuts it would crash the master.
#[cfg(target_os = "linux")]
fn seal(file: &File) -> io::Result<()> {
    use rustix::fs::{SealFlags, fcntl_add_seals};
    Ok(fcntl_add_seals(file, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL)?)
}

/// The file is closed and has no name: an instance cannot cut it.
#[cfg(not(target_os = "linux"))]
fn seal(_file: &File) -> io::Result<()> {
    Ok(())
}
