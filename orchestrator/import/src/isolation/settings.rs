//! Settings of the process of an instance.

use std::time::Duration;

/// Name of the program's command that [`serve`](super::serve)s an instance.
pub const COMMAND: &str = "serve-instance";

/// Limits that keep an instance from doing harm.
#[derive(Clone, Debug, PartialEq)]
pub struct Isolation {
    /// Time within which a call must be answered.
    pub call_timeout: Duration,
    /// Number of bytes of memory that the process may write; `None` if it has no limit.
    pub memory: Option<u64>,
    /// Processor time that the process may take, s; `None` if it has no limit.
    pub cpu: Option<u64>,
    /// Whether the process is closed: it may read the system's libraries and write in the folder of
    /// its archive, and reach nothing else. Where the system cannot do it, nothing is run.
    pub sandbox: bool,
}

impl Default for Isolation {
    fn default() -> Self {
        Self {
            call_timeout: Duration::from_secs(60),
            memory: cfg!(unix).then_some(4 << 30),
            cpu: None,
            sandbox: false,
        }
    }
}
