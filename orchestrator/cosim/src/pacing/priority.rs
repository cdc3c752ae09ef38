//! Real-time scheduling, on systems that allow it.

use serde::{Deserialize, Serialize};

/// Outcome of the request for a real-time priority.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Priority {
    /// No priority was requested.
    #[default]
    Usual,
    /// The thread runs under `SCHED_FIFO` with this priority. If memory could not be locked,
    /// `unlocked` says why.
    Fifo {
        /// Priority of the thread, 1 to 99.
        priority: u8,
        /// Reason why memory could not be locked, if so.
        unlocked: Option<String>,
    },
    /// The system refused the request or has no such scheduling; usual scheduling applies.
    Refused(String),
}

/// The scheduling of this thread, which lasts until this value is dropped.
pub struct Scheduling {
    /// Outcome of the request for the priority.
    pub priority: Priority,
}

impl Scheduling {
    /// Requests `SCHED_FIFO` with the priority, and memory that is locked into RAM. Threads started
    /// later inherit it.
    pub fn request(priority: Option<u8>) -> Self {
        Self { priority: priority.map_or(Priority::Usual, system::request) }
    }
}

impl Drop for Scheduling {
    fn drop(&mut self) {
        if matches!(self.priority, Priority::Fifo { .. }) {
            system::release();
        }
    }
}

#[cfg(target_os = "linux")]
mod system {
    use super::Priority;
    use rustix::mm::{MlockAllFlags, mlockall, munlockall};
    use thread_priority::{
        NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
        ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };

    pub(super) fn request(priority: u8) -> Priority {
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let outcome =
            ThreadPriority::try_from(priority).map_err(ToString::to_string).and_then(|value| {
                set_thread_priority_and_policy(thread_native_id(), value, policy).map_err(reason)
            });
        if let Err(reason) = outcome {
            return Priority::Refused(format!(
                "{reason}; SCHED_FIFO needs the capability CAP_SYS_NICE or a limit (ulimit -r) of at least {priority}"
            ));
        }
        let locked = mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE);
        let unlocked = locked.err().map(|error| {
            format!("{error}; locking memory needs the capability CAP_IPC_LOCK or a higher limit (ulimit -l)")
        });
        Priority::Fifo { priority, unlocked }
    }

    pub(super) fn release() {
        let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
        if let Err(error) =
            set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, policy)
        {
            tracing::debug!("the thread keeps its priority: {error}");
        }
        if let Err(error) = munlockall() {
            tracing::debug!("memory stays locked: {error}");
        }
    }

    fn reason(error: thread_priority::Error) -> String {
        match error {
            thread_priority::Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
            error => error.to_string(),
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use super::Priority;

    pub(super) fn request(_: u8) -> Priority {
        Priority::Refused("real-time scheduling is available on Linux only".into())
    }

    pub(super) fn release() {}
}
