//! Limits that the process of an instance sets itself before it loads the library.

use super::protocol::Limits;
#[cfg(unix)]
use std::path::Path;

/// Sets the limits. Returns those that the system does not support, as a text.
#[cfg(unix)]
pub(super) fn apply(limits: &Limits) -> Option<String> {
    use rustix::process::{Resource, Rlimit, setrlimit};
    // The reason of a crash is reported; an image of the memory would be of little more use.
    let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
    let mut without = Vec::new();
    let mut limit = |resource, most: u64, name: &str| {
        let both = Rlimit { current: Some(most), maximum: Some(most) };
        if setrlimit(resource, both).is_err() {
            without.push(name.to_string());
        }
    };
    if let Some(bytes) = limits.memory {
        limit(Resource::Data, bytes, "memory");
    }
    if let Some(seconds) = limits.cpu {
        limit(Resource::Cpu, seconds, "processor time");
    }
    if let Some(folder) = &limits.folder {
        without.extend(closed(folder));
    }
    (!without.is_empty()).then(|| without.join(", "))
}

#[cfg(target_os = "linux")]
fn closed(folder: &Path) -> Vec<String> {
    super::sandbox::close(folder)
}

#[cfg(all(unix, not(target_os = "linux")))]
fn closed(_folder: &Path) -> Vec<String> {
    vec!["files and network".into()]
}

/// Sets the limits. Returns those that the system does not support, as a text.
#[cfg(not(unix))]
pub(super) fn apply(limits: &Limits) -> Option<String> {
    let without = [
        limits.memory.map(|_| "memory"),
        limits.cpu.map(|_| "processor time"),
        limits.folder.as_ref().map(|_| "files and network"),
    ];
    let without: Vec<&str> = without.into_iter().flatten().collect();
    (!without.is_empty()).then(|| without.join(", "))
}
