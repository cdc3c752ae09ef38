//! Requests from outside to end the work. The results so far are kept, and temporary files are
//! removed.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A flag that is shared by those who request an end and by the work that is to end. The master
/// checks it at every communication point.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    /// Number of the signal that arrived, or 0.
    signal: Arc<AtomicUsize>,
    /// Whether a signal has arrived already, so that a second one ends the process at once.
    again: Arc<AtomicBool>,
    quit: Arc<AtomicBool>,
}

/// Origin of a request to end the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// The user pressed a key of the live view.
    Quit,
    /// The system sent the signal with this number.
    Signal(i32),
}

impl Request {
    /// Request that Ctrl-C makes, which is the signal SIGINT.
    pub const INTERRUPT: Self = Self::Signal(signal_hook::consts::SIGINT);

    /// Returns the exit code of a process that this request ended: 128 plus the signal's number, as
    /// shells count, or 0 for the user.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Quit => 0,
            Self::Signal(number) => u8::try_from(128 + number).unwrap_or(1),
        }
    }
}

impl std::fmt::Display for Request {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Quit => write!(out, "the user"),
            Self::Signal(signal_hook::consts::SIGINT) => write!(out, "a signal (SIGINT)"),
            Self::Signal(signal_hook::consts::SIGTERM) => write!(out, "a signal (SIGTERM)"),
            Self::Signal(number) => write!(out, "a signal ({number})"),
        }
    }
}

impl Interrupt {
    /// Treats SIGINT and SIGTERM as requests from now on. A second signal ends the process at once.
    ///
    /// # Errors
    /// Returns an error if the system does not accept the signal handlers.
    pub fn listen(&self) -> io::Result<()> {
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register_conditional_shutdown(
                signal,
                128 + signal,
                Arc::clone(&self.again),
            )?;
            signal_hook::flag::register(signal, Arc::clone(&self.again))?;
            let number = usize::try_from(signal).unwrap_or_default();
            signal_hook::flag::register_usize(signal, Arc::clone(&self.signal), number)?;
        }
        Ok(())
    }

    /// Records a request to end the work.
    pub fn ask(&self, request: Request) {
        match request {
            Request::Quit => self.quit.store(true, Ordering::Relaxed),
            Request::Signal(number) => {
                self.signal.store(usize::try_from(number).unwrap_or_default(), Ordering::Relaxed);
            }
        }
    }

    /// Returns the request that was made, if any.
    pub fn asked(&self) -> Option<Request> {
        match self.signal.load(Ordering::Relaxed) {
            0 => self.quit.load(Ordering::Relaxed).then_some(Request::Quit),
            number => Some(Request::Signal(i32::try_from(number).unwrap_or_default())),
        }
    }
}
