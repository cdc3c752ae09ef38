//! Closes the process of an instance, under Linux, before it loads the library: it can read the
//! system's libraries and its own folder, write in its own folder, and reach nothing else.
//!
//! Landlock guards the paths, a filter of system calls ([`calls`]) everything that has no path.
//! SECURITY.md lists the restrictions of each version of the kernel.

mod calls;

use landlock::{
    ABI, Access, AccessFs, AccessNet, BitFlags, CompatLevel, Compatible, PathBeneath, PathFd,
    Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, Scope,
};
use rustix::process::{Resource, Rlimit, Signal, setrlimit};
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

/// Closes everything but this folder to this thread and to those that it starts.
///
/// # Errors
/// Returns what the system cannot close. Then nothing may be run here.
pub(super) fn close(folder: &Path) -> Result<(), String> {
    let largest = Rlimit { current: Some(LARGEST_FILE), maximum: Some(LARGEST_FILE) };
    setrlimit(Resource::Fsize, largest).map_err(|error| format!("the size of files: {error}"))?;
    // It ends with the process that asked for it, whatever it does to the thread that looks.
    rustix::process::set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(|error| format!("its end with this process: {error}"))?;
    close_files(folder).map_err(|error| format!("files, by Landlock: {error}"))?;
    calls::close().map_err(|error| format!("system calls: {error}"))
}

fn close_files(folder: &Path) -> Result<(), RulesetError> {
    let reads = AccessFs::from_read(NEWEST) & !BitFlags::from(AccessFs::Execute);
    // Without the first version of Landlock there is no sandbox; additions of later ones are used
    // where the kernel has them.
    let rules = Ruleset::default()
        .set_compatibility(CompatLevel::HardRequirement)
        .handle_access(AccessFs::from_all(ABI::V1))?
        .set_compatibility(CompatLevel::BestEffort)
        .handle_access(AccessFs::from_all(NEWEST))?
        .handle_access(AccessNet::from_all(NEWEST))?
        .scope(Scope::from_all(NEWEST))?;
    let mut rules = rules.create()?;
    let libraries = env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    let readable = READABLE.iter().map(PathBuf::from).chain(env::split_paths(&libraries));
    // Missing paths cannot be read.
    for path in readable.filter(|path| path.is_absolute()).filter_map(|path| PathFd::new(path).ok())
    {
        rules = rules.add_rule(PathBeneath::new(path, reads))?;
    }
    if let Ok(null) = PathFd::new("/dev/null") {
        rules = rules.add_rule(PathBeneath::new(null, AccessFs::WriteFile))?;
    }
    if let Ok(folder) = PathFd::new(folder) {
        let unused =
            AccessFs::Execute | AccessFs::MakeSock | AccessFs::MakeFifo | AccessFs::MakeSym;
        let devices = AccessFs::MakeChar | AccessFs::MakeBlock | AccessFs::IoctlDev;
        let access = AccessFs::from_all(NEWEST) & !(unused | devices);
        rules = rules.add_rule(PathBeneath::new(folder, access))?;
    }
    rules.restrict_self().map(drop)
}
