//! Description of the end of a process.

use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;

/// Describes how a process has ended.
pub(super) fn ended(status: ExitStatus) -> String {
    if let Some(signal) = status.signal() {
        let name = match signal {
            4 => " (SIGILL, an illegal instruction)",
            6 => " (SIGABRT, an abort)",
            7 => " (SIGBUS, access to memory that is not there)",
            8 => " (SIGFPE, a division by zero or the like)",
            9 => " (SIGKILL)",
            11 => " (SIGSEGV, access to memory that is not its own)",
            15 => " (SIGTERM)",
            24 => " (SIGXCPU, its processor time is used up)",
            25 => " (SIGXFSZ, a file that is larger than allowed)",
            31 => " (SIGSYS, a call of the system that is not allowed)",
            _ => "",
        };
        return format!("its process was killed by signal {signal}{name}");
    }
    match status.code() {
        Some(code) => format!("it ended its process with exit code {code}"),
        None => "its process has ended".into(),
    }
}
