//! The closed process: what it gives up before it loads a library, and the messages that it sends.

#![allow(unsafe_code)]

use super::Closing;
use super::seal::{HEADER, Seal};
use super::{page, sandbox};
use crate::{law, warnings};
use parking_lot::Mutex;
use rustix::process::{Resource, Rlimit, Signal, setrlimit};
use serde::Serialize;
use std::ffi::{OsStr, c_char};
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsFd, AsRawFd, RawFd};
use std::path::Path;

unsafe extern "C" {
    /// The environment, as the C library defines it.
    static environ: *mut *mut c_char;
}

/// Kind of what a process sends.
#[derive(Clone, Copy)]
#[repr(u8)]
pub(super) enum Kind {
    /// A message of its work.
    Message = b'm',
    /// Text for the log.
    Log = b'l',
    /// A warning that it prints when its run is over.
    Warning = b'w',
    /// Why it could not be closed.
    Refusal = b'r',
    /// The work is done.
    Done = b'd',
}

/// Ends of pipes that a process holds.
pub(super) struct Pipes {
    pub(super) messages: File,
    pub(super) seal: Seal,
    pub(super) prints: File,
}

/// Where this process sends its messages, if it is closed, how they are sealed, and room for one.
static OUTLET: Mutex<Option<(File, Seal, Vec<u8>)>> = Mutex::new(None);

/// Sends a message, unless this process is not closed. Returns whether it is.
fn send(kind: Kind, write: impl FnOnce(Vec<u8>) -> postcard::Result<Vec<u8>>) -> io::Result<bool> {
    let mut outlet = OUTLET.lock();
    let Some((file, seal, room)) = outlet.as_mut() else { return Ok(false) };
    let mut bytes = std::mem::take(room);
    bytes.clear();
    bytes.extend([0; HEADER]);
    let mut bytes = write(bytes).map_err(io::Error::other)?;
    let header = seal.header(kind as u8, bytes.len() - HEADER)?;
    bytes[..HEADER].copy_from_slice(&header);
    seal.number += 1;
    file.write_all(&bytes)?;
    *room = bytes;
    Ok(true)
}

/// Sends bytes as a message, as [`send`] does.
pub(super) fn send_bytes(kind: Kind, bytes: &[u8]) -> io::Result<bool> {
    send(kind, |mut sent| {
        sent.extend_from_slice(bytes);
        Ok(sent)
    })
}

/// A closed process's way to its supervisor, which its threads share.
pub struct Link(());

impl Link {
    /// Sends a message to the supervisor.
    ///
    /// # Errors
    /// Returns an error if the supervisor no longer listens.
    pub fn send(&self, message: &impl Serialize) -> io::Result<()> {
        send(Kind::Message, |bytes| postcard::to_extend(message, bytes)).map(drop)
    }

    /// Records the part of the work that this thread begins, by its place.
    pub fn begin_part(&self, place: usize) {
        page::in_part(place);
    }
}

/// Tells the supervisor of a warning, which this process prints only when its run is over.
pub(crate) fn tell_warning(text: &str) {
    let _ = send_bytes(Kind::Warning, text.as_bytes());
}

/// A writer of log messages: to the supervisor from a closed process, and else to standard error.
pub struct Messages;

impl Write for Messages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if send_bytes(Kind::Log, bytes)? || warnings::is_repeated(&String::from_utf8_lossy(bytes)) {
            Ok(bytes.len())
        } else {
            io::stderr().write(bytes)
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Closes this process, which was just forked. Returns its connection with the supervisor.
///
/// # Errors
/// Returns what cannot be closed. Then nothing may be run here.
pub(super) fn enter(
    Pipes { messages, seal, prints }: Pipes,
    closing: &Closing,
    home: &Path,
    supervisor: u32,
) -> Result<Link, String> {
    apart(supervisor, &messages, prints).map_err(|error| error.to_string())?;
    *OUTLET.lock() = Some((messages, seal, Vec::new()));
    // SAFETY: this process has one thread.
    unsafe { clear_environment(home) };
    limit(closing).map_err(|error| format!("the process's resources: {error}"))?;
    sandbox::close(home, closing)?;
    Ok(Link(()))
}

/// Gives the process a session of its own, so that it has no controlling terminal, into which it
/// could write commands, and Ctrl-C does not reach it. What it prints goes to the supervisor, and
/// nothing else of what the program has open stays open.
fn apart(supervisor: u32, messages: &File, prints: File) -> io::Result<()> {
    rustix::process::setsid()?;
    rustix::process::set_parent_process_death_signal(Some(Signal::KILL))?;
    // The supervisor may have ended before.
    if std::os::unix::process::parent_id() != supervisor {
        std::process::abort();
    }
    let channel = law::descriptor();
    if channel.is_none() {
        rustix::stdio::dup2_stdin(File::open("/dev/null")?)?;
    }
    rustix::stdio::dup2_stdout(prints.as_fd())?;
    rustix::stdio::dup2_stderr(prints.as_fd())?;
    drop(prints);
    let kept = [Some(messages.as_raw_fd()), channel];
    close_others(kept.into_iter().flatten().collect())
}

/// Closes all descriptors but the standard streams and these.
fn close_others(mut kept: Vec<RawFd>) -> io::Result<()> {
    kept.sort_unstable();
    let mut first = 3;
    for last in kept.iter().map(|kept| kept - 1).chain([RawFd::MAX]) {
        // SAFETY: the call takes numbers only. What owns the descriptors is never dropped here.
        if first <= last && unsafe { libc::syscall(libc::SYS_close_range, first, last, 0) } != 0 {
            return Err(io::Error::last_os_error());
        }
        first = last.saturating_add(2);
    }
    Ok(())
}

/// Leaves only language, time zone and library paths in the environment. The home and the place of
/// temporary files become `home`. The texts of the others are overwritten, as they would stay in
/// memory.
///
/// # Safety
/// There must be no other thread.
unsafe fn clear_environment(home: &Path) {
    let passes = |name: &OsStr| {
        let name = name.to_string_lossy();
        name.starts_with("LC_") || ["LANG", "LANGUAGE", "TZ", "LD_LIBRARY_PATH"].contains(&&*name)
    };
    let kept: Vec<_> = std::env::vars_os().filter(|(name, _)| passes(name)).collect();
    // SAFETY: the environment ends with a null pointer, and each entry with a zero.
    unsafe {
        let mut entry = environ;
        while !entry.is_null() && !(*entry).is_null() {
            (*entry).write_bytes(0, libc::strlen(*entry));
            entry = entry.add(1);
        }
        libc::clearenv();
        let own = ["HOME", "TMPDIR", "TMP", "TEMP"].map(|name| (name.into(), home.into()));
        for (name, value) in kept.into_iter().chain(own) {
            std::env::set_var(name, value);
        }
    }
}

fn limit(closing: &Closing) -> io::Result<()> {
    let both = |most| Rlimit { current: Some(most), maximum: Some(most) };
    // The reason of a crash is reported; an image of the memory would be of little more use.
    setrlimit(Resource::Core, both(0))?;
    if let Some(bytes) = closing.memory {
        setrlimit(Resource::Data, both(bytes))?;
    }
    if let Some(seconds) = closing.cpu {
        // The signal of the first limit tells why, which that of the second does not.
        let limit = Rlimit { current: Some(seconds), maximum: Some(seconds.saturating_add(1)) };
        setrlimit(Resource::Cpu, limit)?;
    }
    Ok(())
}
