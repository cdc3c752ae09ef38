//! Requests from outside to end the work. The results so far are kept, and temporary files are
//! removed.

use serde::{Deserialize, Serialize};
#[cfg(unix)]
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Numbers of the signals that end a run. On Windows, Ctrl-C counts as the first.
const SIGHUP: i32 = 1;
const SIGINT: i32 = 2;
const SIGTERM: i32 = 15;

/// A flag that is shared by those who request an end and by the work that is to end. The master
/// checks it at every communication point.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    /// Number of the signal that arrived, or 0.
    signal: Arc<AtomicUsize>,
    /// Whether a signal has arrived already, so that a second one ends the process at once.
    again: Arc<AtomicBool>,
}

/// A request to end the work: the signal with this number has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request(i32);

impl Request {
    /// Request that Ctrl-C makes, which is the signal SIGINT.
    pub const INTERRUPT: Self = Self(SIGINT);

    /// Returns the exit code of a process that this request ended: 128 plus the signal's number, as
    /// shells count.
    pub fn exit_code(self) -> u8 {
        u8::try_from(128 + self.0).unwrap_or(1)
    }
}

impl std::fmt::Display for Request {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.0 {
            SIGHUP => write!(out, "a signal (SIGHUP)"),
            SIGINT => write!(out, "a signal (SIGINT)"),
            SIGTERM => write!(out, "a signal (SIGTERM)"),
            number => write!(out, "a signal ({number})"),
        }
    }
}

/// Returns whether this process ignores SIGHUP, or whether this is unknown.
#[cfg(unix)]
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|set| u64::from_str_radix(set.trim(), 16).ok());
    // Signal n is bit n - 1.
    ignored.is_none_or(|set| set & 1 << (SIGHUP - 1) != 0)
}

impl Interrupt {
    /// Treats SIGINT, SIGTERM and, under Linux, SIGHUP as requests from now on. A second signal
    /// ends the process at once. SIGHUP, which comes when a connection drops, stays ignored if it
    /// is, as `nohup` asks.
    ///
    /// # Errors
    /// Returns an error if the system does not accept the signal handlers.
    #[cfg(unix)]
    pub fn listen(&self) -> io::Result<()> {
        let hangup = (!ignores_hangup()).then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
            let again = || Arc::clone(&self.again);
            flag::register_conditional_shutdown(signal, 128 + signal, again())?;
            flag::register(signal, again())?;
            let number = usize::try_from(signal).unwrap_or_default();
            flag::register_usize(signal, Arc::clone(&self.signal), number)?;
        }
        #[cfg(target_os = "linux")]
        self.end_with_parent()?;
        Ok(())
    }

    /// Treats the end of the process named by the environment, which must have started this one, as
    /// the signal SIGTERM.
    #[cfg(target_os = "linux")]
    fn end_with_parent(&self) -> io::Result<()> {
        use rustix::process::{Signal, getppid, set_parent_process_death_signal};
        let parent: Option<i32> =
            std::env::var("ORCHESTRATOR_PARENT").ok().and_then(|text| text.parse().ok());
        let Some(parent) = parent else { return Ok(()) };
        set_parent_process_death_signal(Some(Signal::TERM))?;
        // It may have ended before.
        if getppid().is_none_or(|present| present.as_raw_nonzero().get() != parent) {
            self.ask(Request(SIGTERM));
        }
        Ok(())
    }

    /// Treats Ctrl-C as a request from now on. The second time it ends the process at once.
    ///
    /// # Errors
    /// Returns an error if the system does not accept the handler.
    #[cfg(not(unix))]
    pub fn listen(&self) -> io::Result<()> {
        let interrupt = self.clone();
        let handler = move || {
            if interrupt.again.swap(true, Ordering::Relaxed) {
                std::process::exit(128 + SIGINT);
            }
            interrupt.ask(Request::INTERRUPT);
        };
        ctrlc::set_handler(handler).map_err(io::Error::other)
    }

    /// Lets requests end steps of this thread's instances, too.
    pub(crate) fn watch(&self) {
        fmu_import::halt::watch(&self.signal);
    }

    /// Records a request to end the work.
    pub fn ask(&self, request: Request) {
        self.signal.store(usize::try_from(request.0).unwrap_or_default(), Ordering::Relaxed);
    }

    /// Returns the number of the signal that made the request, if any.
    pub fn signal(&self) -> Option<i32> {
        self.asked().map(|request| request.0)
    }

    /// Returns the request that was made, if any.
    pub fn asked(&self) -> Option<Request> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            number => Some(Request(i32::try_from(number).unwrap_or_default())),
        }
    }
}
