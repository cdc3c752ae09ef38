//! Log messages while the live view occupies the terminal: they are kept in memory, and written to
//! standard error when the view has closed.

use std::io::{self, IsTerminal, Write, stderr};
use std::sync::{Mutex, PoisonError};

static KEPT: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// A writer to standard error that keeps messages in memory while the view is shown.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Messages;

impl Write for Messages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(messages) = KEPT.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            return messages.write(bytes);
        }
        // A message that cannot be written is lost, but the run continues.
        let _ = stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = stderr().flush();
        Ok(())
    }
}

/// Keeps messages from now on, if standard error is a terminal, where they would disturb the view.
pub(super) fn hold() {
    if stderr().is_terminal() {
        KEPT.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
    }
}

/// Writes the messages that were kept, and keeps no further ones.
pub(super) fn release() {
    if let Some(messages) = KEPT.lock().unwrap_or_else(PoisonError::into_inner).take() {
        // If standard error cannot be written, there is nobody left to tell.
        let _ = stderr().write_all(&messages);
    }
}
