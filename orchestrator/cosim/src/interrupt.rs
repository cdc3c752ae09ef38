//! A request from outside to end what goes on: the results are kept, and what is temporary goes.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Shared by whoever asks and by whoever is to end: the master looks at every communication point.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    /// Number of the signal that arrived, or 0.
    signal: Arc<AtomicUsize>,
    /// Whether one has come, for the second one.
    again: Arc<AtomicBool>,
    quit: Arc<AtomicBool>,
}

/// Origin of a request to end the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// The user, by a key of the live view.
    Quit,
    /// The system, by the signal with this number.
    Signal(i32),
}

impl Request {
    /// Request that Ctrl-C makes, which is the signal SIGINT.
    pub const INTERRUPT: Self = Self::Signal(signal_hook::consts::SIGINT);

    /// The exit code of a process that was ended so: 128 and the signal's number, as shells count.
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
    /// From now on SIGINT and SIGTERM are requests; the second one ends the process.
    ///
    /// # Errors
    /// If the system does not let itself be told so.
    pub fn listen(&self) -> io::Result<()> {
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&self.again))?;
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

    /// The request that was made, if any.
    pub fn asked(&self) -> Option<Request> {
        match self.signal.load(Ordering::Relaxed) {
            0 => self.quit.load(Ordering::Relaxed).then_some(Request::Quit),
            number => Some(Request::Signal(i32::try_from(number).unwrap_or_default())),
        }
    }
}
