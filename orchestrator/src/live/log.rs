//! Messages while the view has the terminal: they are kept, and written when it is gone.

use std::io::{self, IsTerminal, Write, stderr};
use std::sync::{Mutex, PoisonError};

static KEPT: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// Standard error, or what is kept for it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Messages;

impl Write for Messages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(kept) = KEPT.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            return kept.write(bytes);
        }
        // A message that cannot be written is lost; the run is not.
        let _ = stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = stderr().flush();
        Ok(())
    }
}

/// Keeps messages from now on, if they would disturb the view.
pub(super) fn hold() {
    if stderr().is_terminal() {
        KEPT.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
    }
}

/// Writes what was kept, and keeps no more.
pub(super) fn release() {
    if let Some(kept) = KEPT.lock().unwrap_or_else(PoisonError::into_inner).take() {
        // There is no one left to tell.
        let _ = stderr().write_all(&kept);
    }
}
