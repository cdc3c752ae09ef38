//! Closes a process before it loads libraries: it can read the system's libraries, write in the
//! folders of its archives, and reach nothing else.
//!
//! Landlock guards the paths, a filter of system calls ([`calls`]) everything that has no path.
//! SECURITY.md lists the restrictions of each version of the kernel.

mod calls;

use super::Closing;
use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, PathBeneath, PathFd,
    Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, Scope,
};
use rustix::process::{Resource, Rlimit, setrlimit};
use std::env;
use std::path::{Path, PathBuf};

/// Newest version of Landlock that is used. The kernel may have an older one.
const NEWEST: ABI = ABI::V6;
/// Largest size of a file that the instance may write, in bytes.
const LARGEST_FILE: u64 = 64 << 20;
/// Folders and files that libraries and the C library read.
const READABLE: [&str; 18] = [
    "/usr",
    "/lib",
    "/lib32",
    "/lib64",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/dev/null",
    "/dev/zero",
    "/dev/random",
    "/dev/urandom",
    // Of its own process, without its mounts and the network of the machine.
    "/proc/self/maps",
    "/proc/self/stat",
    "/proc/self/statm",
    "/proc/self/status",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/proc/sys/vm/overcommit_memory",
    "/sys/devices/system/cpu",
];

/// Closes everything but `home` and what `closing` names to this thread and to those that it
/// starts.
///
/// # Errors
/// Returns what the system cannot close. Then nothing may be run here.
pub(super) fn close(home: &Path, closing: &Closing) -> Result<(), String> {
    let largest = Rlimit { current: Some(LARGEST_FILE), maximum: Some(LARGEST_FILE) };
    setrlimit(Resource::Fsize, largest).map_err(|error| format!("the size of files: {error}"))?;
    close_files(home, closing).map_err(|error| format!("files, by Landlock: {error}"))?;
    calls::close().map_err(|error| format!("system calls: {error}"))
}

/// Without the first version of Landlock nothing can be closed; additions of later ones are used
/// where the kernel has them.
fn rules() -> Result<Ruleset, RulesetError> {
    Ruleset::default()
        .set_compatibility(CompatLevel::HardRequirement)
        .handle_access(AccessFs::from_all(ABI::V1))?
        .set_compatibility(CompatLevel::BestEffort)
        .handle_access(AccessFs::from_all(NEWEST))?
        .handle_access(AccessNet::from_all(NEWEST))?
        .scope(Scope::from_all(NEWEST))
}

fn close_files(home: &Path, closing: &Closing) -> Result<(), RulesetError> {
    let reads = AccessFs::from_read(NEWEST) & !BitFlags::from(AccessFs::Execute);
    let unused = AccessFs::Execute | AccessFs::MakeSock | AccessFs::MakeFifo | AccessFs::MakeSym;
    let devices = AccessFs::MakeChar | AccessFs::MakeBlock | AccessFs::IoctlDev;
    let all = AccessFs::from_all(NEWEST) & !(unused | devices);
    let libraries = env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    let readable = READABLE.iter().map(PathBuf::from).chain(env::split_paths(&libraries));
    let readable = readable.filter(|path| path.is_absolute()).chain(closing.files.iter().cloned());
    let writable = closing.folders.iter().cloned().chain([home.to_path_buf()]);
    let paths = readable.map(|path| (path, reads)).chain(writable.map(|path| (path, all)));
    let null = (PathBuf::from("/dev/null"), BitFlags::from(AccessFs::WriteFile));
    let mut rules = rules()?.create()?;
    for (path, access) in paths.chain([null]) {
        // Missing paths cannot be used.
        if let Ok(path) = PathFd::new(path) {
            rules = rules.add_rule(PathBeneath::new(path, access))?;
        }
    }
    rules.restrict_self().map(drop)
}
