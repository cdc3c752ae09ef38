//! The memory that the master and the process of an instance share. It has no name under Unix, so
//! that nobody finds it and nothing of it is left behind: the process inherits it in place of its
//! standard output, which then becomes the same as its standard error.

use super::channel::Channel;
use std::ffi::OsString;
use std::io;
use std::process::Command;

#[cfg(unix)]
pub(super) use unix::{Memory, inherited};

#[cfg(unix)]
mod unix {
    use super::{Channel, Command, OsString, io};
    use std::fs::File;
    use std::os::fd::AsFd;
    use std::process::Stdio;

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
}

#[cfg(not(unix))]
pub(super) use named::{Memory, inherited};

#[cfg(not(unix))]
mod named {
    use super::{Channel, Command, OsString, io};
    use std::fs::OpenOptions;
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
}
