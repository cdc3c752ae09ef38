//! Runs in closed processes. The process forks one for a run, closes it, and lets it make the
//! instances and step them; it sends what it has found through a pipe. Instances that crash, end
//! their process or never answer end the run with an error that names the instance and the call,
//! and everything that was sent before is kept.
//!
//! | module | content |
//! |---|---|
//! | `page` | the calls that are being made, in memory that both processes see |
//! | `closed` | the supervisor's side: the process is forked, heard, watched and ended |
//! | `inside` | the closed process: what it gives up, and the messages that it sends |
//! | `seal` | by which its messages are told from what instances write |
//! | `sandbox` | what it may still reach |
//! | `ended` | how it has ended, in words |
//!
//! Other systems than Linux cannot close a process.

#[cfg(target_os = "linux")]
mod closed;
#[cfg(target_os = "linux")]
mod ended;
#[cfg(target_os = "linux")]
mod inside;
#[cfg(not(target_os = "linux"))]
mod open;
#[cfg(target_os = "linux")]
pub(crate) mod page;
#[cfg(target_os = "linux")]
mod sandbox;
#[cfg(target_os = "linux")]
mod seal;

#[cfg(target_os = "linux")]
pub use closed::Closed;
#[cfg(target_os = "linux")]
pub(crate) use inside::tell_warning;
#[cfg(target_os = "linux")]
pub use inside::{Link, Messages};
#[cfg(not(target_os = "linux"))]
pub use open::{Closed, Link, Messages};
#[cfg(not(target_os = "linux"))]
pub(crate) use open::{page, tell_warning};

use fmi_master::instance::CallFailure;
use std::path::PathBuf;
use std::time::Duration;

/// What a closed process may use.
#[derive(Clone, Debug, PartialEq)]
pub struct Closing {
    /// Time within which an instance must answer a call.
    pub call_timeout: Duration,
    /// Number of bytes of memory that the process may write; `None` if it has no limit.
    pub memory: Option<u64>,
    /// Processor time that the process may take, s; `None` if it has no limit.
    pub cpu: Option<u64>,
    /// Folders of unpacked archives, in which it may write.
    pub folders: Vec<PathBuf>,
    /// Files that it may read.
    pub files: Vec<PathBuf>,
}

impl Default for Closing {
    fn default() -> Self {
        Self {
            call_timeout: Duration::from_secs(60),
            memory: Some(4 << 30),
            cpu: None,
            folders: Vec::new(),
            files: Vec::new(),
        }
    }
}

/// Why a closed process has ended before its work was done.
#[derive(Clone, Debug, PartialEq)]
pub enum Ended {
    /// There is no such process, because the system cannot start or close it.
    Refused(String),
    /// It failed in this call.
    Failed(Box<LastCall>),
}

/// The call in which a closed process has failed.
#[derive(Clone, Debug, PartialEq)]
pub struct LastCall {
    /// Component that was being called; `None` if none was.
    pub component: Option<String>,
    /// Simulated time, s.
    pub time: f64,
    /// Case of a campaign or a study, if it is known.
    pub case: Option<u64>,
    /// Part of the work that the case belongs to, if it is known.
    pub part: Option<usize>,
    /// The call, and how the process has ended.
    pub failure: CallFailure,
}

impl Ended {
    /// A process that has done its work and said nothing.
    pub fn silent() -> Self {
        Self::Refused("the closed process gave no result".into())
    }
}

/// Returns whether this system can close a process.
pub fn can_close() -> bool {
    #[cfg(target_os = "linux")]
    return closed::is_there();
    #[cfg(not(target_os = "linux"))]
    return false;
}
