//! Instances in processes of their own, on the side of the command line.

use crate::plain::plain;
use fmu_import::isolation;
use std::io::{Write, stderr};
use std::process::ExitCode;

/// Serves an instance if another process of this program has started this one for it, and returns
/// the exit code then. In any other process it prepares to report instances that crash.
pub(crate) fn serve() -> Option<ExitCode> {
    let mut words = std::env::args_os().skip(1);
    if words.next().is_none_or(|word| word != isolation::COMMAND) {
        isolation::enable();
        return None;
    }
    Some(match isolation::serve(words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(stderr(), "error: {}: {error}", isolation::COMMAND);
            ExitCode::FAILURE
        }
    })
}

/// Prints which instances could not be freed, and removes what killed processes have left. Returns
/// whether all were freed.
pub(crate) fn all_freed() -> bool {
    fmu_import::folder::remove_left();
    let late = isolation::late_failures();
    for failure in &late {
        let _ = writeln!(stderr(), "error: {}", plain(failure));
    }
    late.is_empty()
}
