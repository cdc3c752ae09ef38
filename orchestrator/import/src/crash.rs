//! Names the instance and the call, or the FMUs that were loaded, when an FMU ends the process of
//! the program.

#![allow(unsafe_code)]

use crate::isolation::page;
use crate::log::Log;
use parking_lot::Mutex;
use std::cell::Cell;
use std::marker::PhantomData;
use std::path::Path;
use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

thread_local! {
    /// Log of the instance that this thread calls, and name of the call; `None` between calls. A
    /// constant initialiser keeps the access free of locks and allocation, which a signal handler
    /// must not use.
    static CURRENT: Cell<Option<(*const Log, &'static str)>> = const { Cell::new(None) };
}

/// A call that is being made, until this value is dropped.
pub(crate) struct Calling<'a>(PhantomData<&'a Log>);

impl<'a> Calling<'a> {
    /// Records that this thread makes this call of the instance with this log.
    #[inline]
    pub(crate) fn new(log: &'a Log, call: &'static str) -> Self {
        CURRENT.set(Some((log, call)));
        page::begin(&log.component, call);
        Self(PhantomData)
    }
}

impl Drop for Calling<'_> {
    #[inline]
    fn drop(&mut self) {
        CURRENT.set(None);
        page::end();
    }
}

/// Hands the log of the instance that this thread calls to a function. Returns `None` if this
/// thread calls none.
pub(crate) fn with_called<T>(function: impl FnOnce(&Log) -> T) -> Option<T> {
    // SAFETY: `Calling` borrows the log as long as the call lasts, which has not returned.
    CURRENT.get().map(|(log, _)| function(unsafe { &*log }))
}

/// Names of the FMUs whose libraries were loaded into this process, newest first. A library that
/// is unloaded may leave threads behind, so that no name is ever removed. A signal handler reads
/// the list, which therefore needs no lock.
static LOADED: AtomicPtr<Loaded> = AtomicPtr::new(std::ptr::null_mut());

struct Loaded {
    name: String,
    next: Option<&'static Loaded>,
}

/// Returns the FMUs whose libraries were loaded into this process.
fn loaded() -> impl Iterator<Item = &'static Loaded> {
    // SAFETY: the pointer is null or one that `is_loaded` has leaked.
    let newest = unsafe { LOADED.load(Ordering::Acquire).as_ref() };
    std::iter::successors(newest, |fmu| fmu.next)
}

/// Records that the library of this FMU is about to be loaded into this process.
pub(crate) fn is_loaded(fmu: &Path) {
    static WRITES: Mutex<()> = Mutex::new(());
    let _only = WRITES.lock();
    let name = fmu.display().to_string();
    if loaded().all(|other| other.name != name) {
        let fmu = Box::leak(Box::new(Loaded { name, next: loaded().next() }));
        LOADED.store(fmu, Ordering::Release);
    }
}

/// Process that is watched, or 0. A process that an FMU has forked is not watched.
static WATCHED: AtomicU32 = AtomicU32::new(0);

/// A guard: this process is watched as long as the value lives.
#[must_use]
pub struct Watch(());

impl Drop for Watch {
    fn drop(&mut self) {
        let Self(()) = self;
        unwatch();
    }
}

/// Ends the watch, before the program itself ends this process.
pub fn unwatch() {
    WATCHED.store(0, Ordering::SeqCst);
}

/// Watches from now on for signals that end this process, and for calls of `exit`. One line on
/// standard error names the instance that was being called, or the FMUs that were loaded. An exit
/// is then a failure, with code 1. A file that grows beyond the limit of the user (`ulimit -f`) ends nothing:
/// whoever writes it gets an error.
pub fn watch() -> Watch {
    WATCHED.store(std::process::id(), Ordering::SeqCst);
    listen();
    Watch(())
}

#[cfg(unix)]
fn listen() {
    for (place, (signal, _)) in SIGNALS.iter().enumerate() {
        // SAFETY: all zeros is a valid `sigaction`, the pointers are valid for the calls, and the
        // handler does only what a handler may do. PREVIOUS is written here alone, before any
        // signal that its handler reads it for.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = on_signal as Handler as usize;
            action.sa_flags = libc::SA_ONSTACK | libc::SA_SIGINFO;
            libc::sigaction(*signal, &raw const action, (&raw mut PREVIOUS[place]).cast());
        }
    }
    // SAFETY: the functions have the type that C wants and stay where they are.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
        libc::atexit(on_exit);
    }
}

/// The C library passes crashes on as signals.
#[cfg(windows)]
fn listen() {
    for (signal, _) in SIGNALS {
        // SAFETY: the handler has the type that C wants and stays where it is.
        unsafe { libc::signal(*signal, on_signal as extern "C" fn(libc::c_int) as usize) };
    }
    // SAFETY: the function has the type that C wants and stays where it is.
    unsafe { libc::atexit(on_exit) };
}

/// Does nothing, because such signals are not supported on this system.
#[cfg(not(any(unix, windows)))]
fn listen() {}

#[cfg(any(unix, windows))]
const SIGNALS: &[(libc::c_int, &str)] = &[
    (libc::SIGSEGV, "SIGSEGV"),
    #[cfg(unix)]
    (libc::SIGBUS, "SIGBUS"),
    (libc::SIGILL, "SIGILL"),
    (libc::SIGFPE, "SIGFPE"),
    (libc::SIGABRT, "SIGABRT"),
];

/// Ends the process. The code of `abort` would be that of a run in which the attitude is lost.
#[cfg(windows)]
extern "C" fn on_signal(signal: libc::c_int) {
    let entry = SIGNALS.iter().find(|(number, _)| *number == signal);
    tell(entry.map_or("a signal", |(_, name)| name));
    // SAFETY: this ends the process at once.
    unsafe { libc::_exit(1) };
}

/// The previous handlers. That of Rust reports a stack overflow.
#[cfg(unix)]
static mut PREVIOUS: [std::mem::MaybeUninit<libc::sigaction>; SIGNALS.len()] =
    [const { std::mem::MaybeUninit::zeroed() }; SIGNALS.len()];

#[cfg(unix)]
type Handler = extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void);

#[cfg(unix)]
extern "C" fn on_signal(
    signal: libc::c_int,
    information: *mut libc::siginfo_t,
    _context: *mut libc::c_void,
) {
    page::ends();
    for (place, (number, name)) in SIGNALS.iter().enumerate() {
        if *number == signal {
            tell(name);
            // SAFETY: the handler was stored by `watch`, and the system passes the information.
            let code = unsafe {
                libc::sigaction(signal, (&raw const PREVIOUS[place]).cast(), std::ptr::null_mut());
                (*information).si_code
            };
            // A faulty instruction is run again and meets the former handler. A signal that was
            // sent by a process comes only once, and must be sent again. (Only Linux tells them
            // apart.)
            if code <= 0 || !cfg!(target_os = "linux") {
                // SAFETY: the number is that of a signal. It is delivered when this returns.
                unsafe { libc::raise(signal) };
            }
        }
    }
}

#[cfg(any(unix, windows))]
extern "C" fn on_exit() {
    page::ends();
    refuse_exit("exit");
}

/// Ends the process with code 1 if it is not the program that ends it: an FMU that ends the process
/// must not pass for success.
#[cfg(any(unix, windows))]
fn refuse_exit(what: &str) {
    if tell(what) {
        unwatch();
        // SAFETY: this ends the process at once.
        unsafe { libc::_exit(1) };
    }
}

/// Writes who ended the process, with system calls only. Returns whether it was an FMU, as far as
/// this can be known.
#[cfg(any(unix, windows))]
fn tell(what: &str) -> bool {
    if WATCHED.load(Ordering::SeqCst) != std::process::id() {
        return false;
    }
    let write = |parts: &[&str]| {
        for part in parts {
            // SAFETY: pointer and length are those of the text. There is nobody left to tell of a
            // failure.
            unsafe { libc::write(2, part.as_ptr().cast(), part.len() as _) };
        }
    };
    let called = with_called(|log| write(&["error: ", &log.component]));
    if let (Some(()), Some((_, call))) = (called, CURRENT.get()) {
        write(&[" ended this process in ", call, " (", what, ")"]);
        with_called(|log| log.with_problem(|problem| write(&["; it said: ", problem])));
    } else {
        let mut names = loaded().map(|fmu| fmu.name.as_str());
        let Some(newest) = names.next() else { return false };
        write(&["error: this process ended outside the calls of instances (", what, ")"]);
        write(&[", perhaps by a thread of an FMU that was loaded: ", newest]);
        names.for_each(|name| write(&[", ", name]));
    }
    let remedy = "; with --isolate the run would end in order and keep its results";
    write(&[if cfg!(target_os = "linux") { remedy } else { "" }, "\n"]);
    true
}
