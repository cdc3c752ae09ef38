//! The floating-point environment at the border between this code and third-party code.
//!
//! Rust assumes the default environment of IEEE 754: rounding to nearest, no traps, subnormal
//! numbers kept. Hosts of an FMU may have another one: those in Fortran and Delphi trap invalid
//! operations, others round upward or flush subnormal numbers to zero. And a library that is called
//! may leave another one behind.
//!
//! x86-64 has two sets of registers, those of SSE (MXCSR) and of the x87 unit; aarch64 has FPCR and
//! FPSR. WebAssembly has the default environment only. On other processors nothing is done.
#![allow(unsafe_code)]

#[cfg_attr(target_arch = "x86_64", path = "x86_64.rs")]
#[cfg_attr(target_arch = "aarch64", path = "aarch64.rs")]
#[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), path = "other.rs")]
mod processor;

/// Runs `body` in the default floating-point environment. Afterwards the environment of the caller
/// is in force again, with the exception flags that it had before, also after a panic.
///
/// It costs some nanoseconds, and some tens if the caller traps exceptions of the x87 unit.
#[inline]
pub fn in_default<R>(body: impl FnOnce() -> R) -> R {
    let _environment = processor::Environment::leave();
    apart(body)
}

/// Calls `body`. It is not inlined, so that no arithmetic moves out of the environment, on which
/// arithmetic does not depend for the compiler.
#[inline(never)]
fn apart<R>(body: impl FnOnce() -> R) -> R {
    body()
}
