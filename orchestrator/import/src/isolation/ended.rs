//! Description of the end of a process.

use std::process::ExitStatus;

/// Describes how a process has ended.
pub(super) fn ended(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
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
    let Some(code) = status.code() else { return "its process has ended".into() };
    // Windows ends a process that crashes with the number of the exception.
    #[cfg(windows)]
    if let Some(name) = exception(code) {
        return format!(
            "its process was ended by exception {:#010x} ({name})",
            code.cast_unsigned()
        );
    }
    format!("it ended its process with exit code {code}")
}

/// Returns the meaning of an exception of Windows.
#[cfg(windows)]
fn exception(code: i32) -> Option<&'static str> {
    match code.cast_unsigned() {
        0xc000_0005 => Some("access to memory that is not its own"),
        0xc000_001d => Some("an illegal instruction"),
        0xc000_008e | 0xc000_0094 => Some("a division by zero"),
        0xc000_00fd => Some("its stack is used up"),
        0xc000_0374 => Some("memory that it has overwritten"),
        0xc000_0409 => Some("an abort"),
        _ => None,
    }
}
