//! Tests of every FMU of the built libraries against FMI 2.0.5. The calls allowed in the state
//! stepFailed are tested with the shell, because no FMU discards a step.
#![allow(clippy::borrow_as_ptr, reason = "calls read better as in C")]

mod arguments;
mod calls;
mod derivatives;
#[cfg(target_arch = "x86_64")]
mod environment;
mod finite;
mod libraries;
#[cfg(target_arch = "x86_64")]
#[path = "../../../../export/float-environment/tests/mxcsr/mod.rs"]
mod mxcsr;
mod platform;
mod prelude;
mod resources;
mod states;
mod steps;
mod threads;
mod values;
