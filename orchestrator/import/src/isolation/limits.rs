//! Limits that the process of an instance sets itself before it loads the library.

use super::protocol::Limits;
#[cfg(not(target_os = "linux"))]
use std::path::Path;

/// Sets the limits. Returns those that the system does not support, as a text.
///
/// # Errors
/// Returns why the process cannot be closed, if it is to be. Then it must not load the library.
pub(super) fn apply(limits: &Limits) -> Result<Option<String>, String> {
    let mut without: Vec<&str> = Vec::new();
    set(limits, &mut without);
    if let Some(folder) = &limits.folder {
        close(folder)
            .map_err(|reason| format!("has no sandbox: this system cannot close {reason}"))?;
    }
    Ok((!without.is_empty()).then(|| without.join(", ")))
}

#[cfg(unix)]
fn set(limits: &Limits, without: &mut Vec<&str>) {
    use rustix::process::{Resource, Rlimit, setrlimit};
    // The reason of a crash is reported; an image of the memory would be of little more use.
    let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
    let mut limit = |resource, most: u64, name: &'static str| {
        let both = Rlimit { current: Some(most), maximum: Some(most) };
        if setrlimit(resource, both).is_err() {
            without.push(name);
        }
    };
    if let Some(bytes) = limits.memory {
        limit(Resource::Data, bytes, "memory");
    }
    if let Some(seconds) = limits.cpu {
        limit(Resource::Cpu, seconds, "processor time");
    }
}

#[cfg(not(unix))]
fn set(limits: &Limits, without: &mut Vec<&str>) {
    without.extend(limits.memory.map(|_| "memory"));
    without.extend(limits.cpu.map(|_| "processor time"));
}

#[cfg(target_os = "linux")]
use super::sandbox::close;

#[cfg(not(target_os = "linux"))]
fn close(_folder: &Path) -> Result<(), String> {
    Err("files and network".into())
}
