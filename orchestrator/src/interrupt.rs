//! A request from outside to end a run.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Shared by whoever asks and by the master, which looks at every communication point.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    signal: Arc<AtomicBool>,
    quit: Arc<AtomicBool>,
}

/// Who asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// The user, by a key of the live view.
    Quit,
    /// The system, by SIGINT (Ctrl-C) or SIGTERM.
    Signal,
}

impl Interrupt {
    /// From now on SIGINT and SIGTERM end the run and keep its results; the second one ends the process.
    ///
    /// # Errors
    /// If the system does not let itself be told so.
    pub fn listen(&self) -> io::Result<()> {
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&self.signal))?;
            signal_hook::flag::register(signal, Arc::clone(&self.signal))?;
        }
        Ok(())
    }

    /// Asks.
    pub fn ask(&self, request: Request) {
        let flag = match request {
            Request::Quit => &self.quit,
            Request::Signal => &self.signal,
        };
        flag.store(true, Ordering::Relaxed);
    }

    /// What was asked for, if anything was.
    pub fn asked(&self) -> Option<Request> {
        let is_set = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        if is_set(&self.signal) { Some(Request::Signal) } else { is_set(&self.quit).then_some(Request::Quit) }
    }
}
