//! The system calls that a sandboxed instance may make: those for the C library, memory, threads,
//! timers and files of its folder. All others fail with EPERM.

use libc::{c_int, c_long};
use seccompiler::{
    BpfProgram, Error, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition,
    SeccompFilter, SeccompRule, apply_filter,
};
use std::collections::BTreeMap;

/// Calls that are allowed with any arguments. Paths are guarded by Landlock.
const ALLOWED: &[c_long] = &[
    // Files that are open, and files of the folder.
    libc::SYS_read,
    libc::SYS_readv,
    libc::SYS_pread64,
    libc::SYS_preadv,
    libc::SYS_write,
    libc::SYS_writev,
    libc::SYS_pwrite64,
    libc::SYS_pwritev,
    libc::SYS_openat,
    libc::SYS_close,
    libc::SYS_close_range,
    libc::SYS_lseek,
    libc::SYS_fstat,
    libc::SYS_newfstatat,
    libc::SYS_statx,
    libc::SYS_statfs,
    libc::SYS_fstatfs,
    libc::SYS_faccessat,
    libc::SYS_faccessat2,
    libc::SYS_readlinkat,
    libc::SYS_getdents64,
    libc::SYS_ftruncate,
    libc::SYS_fallocate,
    libc::SYS_fadvise64,
    libc::SYS_fsync,
    libc::SYS_fdatasync,
    libc::SYS_mkdirat,
    libc::SYS_unlinkat,
    libc::SYS_renameat,
    libc::SYS_renameat2,
    libc::SYS_getcwd,
    libc::SYS_chdir,
    libc::SYS_fchdir,
    libc::SYS_umask,
    libc::SYS_dup,
    libc::SYS_dup3,
    libc::SYS_pipe2,
    libc::SYS_eventfd2,
    libc::SYS_ppoll,
    libc::SYS_pselect6,
    libc::SYS_epoll_create1,
    libc::SYS_epoll_ctl,
    libc::SYS_epoll_pwait,
    // Memory. Mappings have conditions, see below.
    libc::SYS_brk,
    libc::SYS_munmap,
    libc::SYS_mprotect,
    libc::SYS_mremap,
    libc::SYS_madvise,
    libc::SYS_mincore,
    libc::SYS_msync,
    libc::SYS_membarrier,
    // Threads of this process, and how they wait.
    libc::SYS_futex,
    libc::SYS_set_robust_list,
    libc::SYS_get_robust_list,
    libc::SYS_set_tid_address,
    libc::SYS_rseq,
    libc::SYS_sched_yield,
    libc::SYS_sched_getaffinity,
    libc::SYS_getcpu,
    libc::SYS_exit,
    libc::SYS_exit_group,
    libc::SYS_restart_syscall,
    // Signals that it catches, which only this process can send.
    libc::SYS_rt_sigaction,
    libc::SYS_rt_sigprocmask,
    libc::SYS_rt_sigreturn,
    libc::SYS_rt_sigpending,
    libc::SYS_rt_sigsuspend,
    libc::SYS_rt_sigtimedwait,
    libc::SYS_sigaltstack,
    // Time.
    libc::SYS_clock_gettime,
    libc::SYS_clock_getres,
    libc::SYS_clock_nanosleep,
    libc::SYS_nanosleep,
    libc::SYS_gettimeofday,
    libc::SYS_times,
    libc::SYS_timerfd_create,
    libc::SYS_timerfd_settime,
    libc::SYS_timerfd_gettime,
    // Identity of the process and of the system.
    libc::SYS_getpid,
    libc::SYS_getppid,
    libc::SYS_gettid,
    libc::SYS_getuid,
    libc::SYS_geteuid,
    libc::SYS_getgid,
    libc::SYS_getegid,
    libc::SYS_getgroups,
    libc::SYS_getrusage,
    libc::SYS_uname,
    libc::SYS_sysinfo,
    libc::SYS_getrandom,
    // The filter below answers this one, so that the C library uses `clone`.
    libc::SYS_clone3,
];

/// Older forms of these calls, which newer architectures do not have.
#[cfg(target_arch = "x86_64")]
const OLDER: &[c_long] = &[
    libc::SYS_open,
    libc::SYS_creat,
    libc::SYS_stat,
    libc::SYS_lstat,
    libc::SYS_access,
    libc::SYS_readlink,
    libc::SYS_getdents,
    libc::SYS_mkdir,
    libc::SYS_rmdir,
    libc::SYS_unlink,
    libc::SYS_rename,
    libc::SYS_dup2,
    libc::SYS_pipe,
    libc::SYS_eventfd,
    libc::SYS_poll,
    libc::SYS_select,
    libc::SYS_epoll_create,
    libc::SYS_epoll_wait,
    libc::SYS_time,
    libc::SYS_pause,
    libc::SYS_getrlimit,
];
#[cfg(not(target_arch = "x86_64"))]
const OLDER: &[c_long] = &[];

/// Commands of `fcntl`. Those that name a process or a signal are not among them, nor those that lock
/// a file, which others may want to lock too.
const FCNTL: [c_int; 6] = [
    libc::F_DUPFD,
    libc::F_DUPFD_CLOEXEC,
    libc::F_GETFD,
    libc::F_SETFD,
    libc::F_GETFL,
    libc::F_SETFL,
];

/// Requests of `ioctl`: whether it is a terminal, how much there is to read, how it is read.
const IOCTL: [libc::Ioctl; 3] = [libc::TCGETS, libc::FIONREAD, libc::FIONBIO];

/// Options of `prctl`: the name of a thread, and of a mapping.
const PRCTL: [c_int; 3] = [libc::PR_SET_NAME, libc::PR_GET_NAME, libc::PR_SET_VMA];

/// Flags of `clone` that would make a namespace.
const NAMESPACES: c_int = libc::CLONE_NEWNS
    | libc::CLONE_NEWCGROUP
    | libc::CLONE_NEWUTS
    | libc::CLONE_NEWIPC
    | libc::CLONE_NEWUSER
    | libc::CLONE_NEWPID
    | libc::CLONE_NEWNET;

/// Allows only these calls to this thread and to those that it starts.
///
/// # Errors
/// Returns an error if the system has no such filters.
pub(super) fn close() -> Result<(), Error> {
    // If a call does not exist, the C library uses an older one whose arguments can be seen.
    let unknown = BTreeMap::from([(libc::SYS_clone3, Vec::new())]);
    apply(unknown, SeccompAction::Allow, SeccompAction::Errno(libc::ENOSYS as u32))?;
    apply(rules()?, SeccompAction::Errno(libc::EPERM as u32), SeccompAction::Allow)
}

fn apply(
    rules: BTreeMap<c_long, Vec<SeccompRule>>,
    otherwise: SeccompAction,
    then: SeccompAction,
) -> Result<(), Error> {
    let architecture = std::env::consts::ARCH.try_into().map_err(Error::Backend)?;
    let filter = SeccompFilter::new(rules, otherwise, then, architecture);
    let program: BpfProgram = filter.and_then(TryInto::try_into).map_err(Error::Backend)?;
    apply_filter(&program)
}

fn rules() -> Result<BTreeMap<c_long, Vec<SeccompRule>>, Error> {
    use SeccompCmpOp::{Eq, MaskedEq};
    let mut rules: BTreeMap<c_long, Vec<SeccompRule>> =
        ALLOWED.iter().chain(OLDER).map(|call| (*call, Vec::new())).collect();
    let mut add = |call, conditions: Vec<SeccompCondition>| -> Result<(), Error> {
        let rule = SeccompRule::new(conditions).map_err(Error::Backend)?;
        rules.entry(call).or_default().push(rule);
        Ok(())
    };
    let process = u64::from(std::process::id());
    // Signals to itself, as `abort` sends them.
    add(libc::SYS_kill, vec![condition(0, Eq, process)?])?;
    add(libc::SYS_tgkill, vec![condition(0, Eq, process)?])?;
    // Limits of its own are read, not changed.
    for own in [0, process] {
        let none = long_condition(2, Eq, 0)?;
        add(libc::SYS_prlimit64, vec![condition(0, Eq, own)?, none])?;
    }
    for command in FCNTL {
        add(libc::SYS_fcntl, vec![condition(1, Eq, command as u64)?])?;
    }
    for request in IOCTL {
        add(libc::SYS_ioctl, vec![condition(1, Eq, u64::from(request as u32))?])?;
    }
    for option in PRCTL {
        add(libc::SYS_prctl, vec![condition(0, Eq, option as u64)?])?;
    }
    // A thread, but neither a process nor a namespace.
    let thread = (libc::CLONE_THREAD | NAMESPACES) as u64;
    let is_thread = condition(0, MaskedEq(thread), libc::CLONE_THREAD as u64)?;
    add(libc::SYS_clone, vec![is_thread])?;
    // Memory without a file must be private, because shared memory is not counted by its limit.
    let without_file = condition(3, MaskedEq(libc::MAP_ANONYMOUS as u64), 0)?;
    let private = condition(3, MaskedEq(libc::MAP_TYPE as u64), libc::MAP_PRIVATE as u64)?;
    for allowed in [without_file, private] {
        add(libc::SYS_mmap, vec![allowed])?;
    }
    Ok(rules)
}

/// A condition on the lower half of an argument.
fn condition(argument: u8, operator: SeccompCmpOp, value: u64) -> Result<SeccompCondition, Error> {
    SeccompCondition::new(argument, SeccompCmpArgLen::Dword, operator, value)
        .map_err(Error::Backend)
}

/// A condition on a whole argument.
fn long_condition(
    argument: u8,
    operator: SeccompCmpOp,
    value: u64,
) -> Result<SeccompCondition, Error> {
    SeccompCondition::new(argument, SeccompCmpArgLen::Qword, operator, value)
        .map_err(Error::Backend)
}
