//! Names the instance and the call when an instance ends the process that it runs in.

#![allow(unsafe_code)]

use std::cell::Cell;
use std::marker::PhantomData;

thread_local! {
    /// Name of the instance that this thread calls, and name of the call; `None` between calls. A
    /// constant initialiser keeps the access free of locks and allocation, which a signal handler
    /// must not use.
    static CURRENT: Cell<Option<(*const str, &'static str)>> = const { Cell::new(None) };
}

/// A call that is being made, until this value is dropped.
pub(crate) struct Calling<'a>(PhantomData<&'a str>);

impl<'a> Calling<'a> {
    /// Records that this thread makes this call of the instance with this name.
    #[inline]
    pub(crate) fn new(instance: &'a str, call: &'static str) -> Self {
        CURRENT.set(Some((instance, call)));
        Self(PhantomData)
    }
}

impl Drop for Calling<'_> {
    #[inline]
    fn drop(&mut self) {
        CURRENT.set(None);
    }
}

/// Watches for signals that end this process, and for calls of `exit`, from now on. If an instance
/// was being called, one line on standard error names it.
#[cfg(unix)]
pub fn watch() {
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
    // SAFETY: the function has the type that C wants and stays where it is.
    unsafe { libc::atexit(on_exit) };
}

/// Watches for crashes, which the C library passes on as signals, and for calls of `exit`, from now
/// on. If an instance was being called, one line on standard error names it.
#[cfg(windows)]
pub fn watch() {
    for (signal, _) in SIGNALS {
        // SAFETY: the handler has the type that C wants and stays where it is.
        unsafe { libc::signal(*signal, on_signal as extern "C" fn(libc::c_int) as usize) };
    }
    // SAFETY: the function has the type that C wants and stays where it is.
    unsafe { libc::atexit(on_exit) };
}

/// Does nothing, because such signals are not supported on this system.
#[cfg(not(any(unix, windows)))]
pub fn watch() {}

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
    if tell("exit") {
        // SAFETY: this ends the process at once. An instance that ends it must not pass for
        // success.
        unsafe { libc::_exit(1) };
    }
}

/// Writes which instance is being called, with system calls only. Returns whether one is being
/// called.
#[cfg(any(unix, windows))]
fn tell(what: &str) -> bool {
    let Some((instance, call)) = CURRENT.get() else { return false };
    // SAFETY: `Calling` borrows the name as long as the call lasts, which has not returned.
    let instance = unsafe { &*instance };
    let parts = [
        "error: ",
        instance,
        " ended this process in ",
        call,
        " (",
        what,
        "); with --isolate the run would end in order and keep its results\n",
    ];
    for part in parts {
        // SAFETY: pointer and length are those of the text. There is nobody left to tell of a
        // failure.
        unsafe { libc::write(2, part.as_ptr().cast(), part.len() as _) };
    }
    true
}
