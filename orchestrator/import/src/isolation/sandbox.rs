//! Keeps the process of an instance, under Linux, from writing to files outside its folder, from
//! the network, and from other processes.

use landlock::{
    ABI, AccessFs, PathBeneath, PathFd, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError,
    RulesetStatus,
};
use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition,
    SeccompFilter, SeccompRule, apply_filter,
};
use std::collections::BTreeMap;
use std::path::Path;

/// Closes everything but this folder to this thread and to those that it starts. Returns what the
/// system cannot close.
pub(super) fn close(folder: &Path) -> Vec<String> {
    let mut open = Vec::new();
    match close_files(folder) {
        Ok(RulesetStatus::FullyEnforced | RulesetStatus::PartiallyEnforced) => {}
        Ok(RulesetStatus::NotEnforced) => open.push("files (it has no Landlock)".into()),
        Err(error) => open.push(format!("files ({error})")),
    }
    if let Err(error) = close_calls() {
        open.push(format!("network ({error})"));
    }
    open
}

fn close_files(folder: &Path) -> Result<RulesetStatus, RulesetError> {
    let writes = AccessFs::from_write(ABI::V4);
    let mut rules = Ruleset::default().handle_access(writes)?.create()?;
    if let Ok(folder) = PathFd::new(folder) {
        rules = rules.add_rule(PathBeneath::new(folder, writes))?;
    }
    if let Ok(null) = PathFd::new("/dev/null") {
        rules = rules.add_rule(PathBeneath::new(null, AccessFs::WriteFile))?;
    }
    Ok(rules.restrict_self()?.ruleset)
}

fn close_calls() -> Result<(), Error> {
    let process = u64::from(std::process::id());
    let unless_first = |value: u64| -> Result<Vec<SeccompRule>, Error> {
        let other = SeccompCondition::new(0, SeccompCmpArgLen::Dword, SeccompCmpOp::Ne, value);
        Ok(vec![SeccompRule::new(vec![other.map_err(Error::Backend)?]).map_err(Error::Backend)?])
    };
    let refused = BTreeMap::from([
        // Sockets are refused even to programs on this machine, which could do what the instance
        // may not.
        (libc::SYS_socket, Vec::new()),
        // It could open sockets and files past these rules.
        (libc::SYS_io_uring_setup, Vec::new()),
        (libc::SYS_ptrace, Vec::new()),
        (libc::SYS_process_vm_readv, Vec::new()),
        (libc::SYS_process_vm_writev, Vec::new()),
        (libc::SYS_kill, unless_first(process)?),
        (libc::SYS_tgkill, unless_first(process)?),
        (libc::SYS_tkill, Vec::new()),
        (libc::SYS_pidfd_send_signal, Vec::new()),
    ]);
    let architecture = std::env::consts::ARCH.try_into().map_err(Error::Backend)?;
    let (otherwise, then) = (SeccompAction::Allow, SeccompAction::Errno(libc::EPERM as u32));
    let filter = SeccompFilter::new(refused, otherwise, then, architecture);
    let program: BpfProgram = filter.and_then(TryInto::try_into).map_err(Error::Backend)?;
    apply_filter(&program)
}
