//! The memory under Unix, which has no name.

use crate::isolation::channel::Channel;
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, RawFd};
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

/// Opens the memory that this process has inherited, and closes all else that it has, beside the
/// standard streams: files that the program's own parent left open are not for instances.
pub(crate) fn inherited(_arguments: impl Iterator<Item = OsString>) -> io::Result<Channel> {
    close_from(3)?;
    let file = File::from(rustix::stdio::stdout().try_clone_to_owned()?);
    let channel = Channel::open(&file)?;
    rustix::stdio::dup2_stdout(rustix::stdio::stderr().as_fd())?;
    Ok(channel)
}

/// Closes all descriptors from this one on. They must belong to nothing in this process.
#[allow(unsafe_code)]
fn close_from(first: RawFd) -> io::Result<()> {
    // SAFETY: the call takes numbers only, and nothing here owns these descriptors.
    #[cfg(target_os = "linux")]
    if unsafe { libc::syscall(libc::SYS_close_range, first, RawFd::MAX, 0) } == 0 {
        return Ok(());
    }
    // Before Linux 5.9, and elsewhere. The list is complete before the first one is closed.
    let numbers: Vec<RawFd> = std::fs::read_dir("/dev/fd")?
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
        .collect();
    for number in numbers.into_iter().filter(|number| *number >= first) {
        // SAFETY: as above. The descriptor by which the list was read is closed already.
        unsafe { libc::close(number) };
    }
    Ok(())
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
