//! Every unit of the built libraries against FMI 2.0.4. What the state stepFailed allows is tested with the shell, as no unit
//! discards a step.
#![allow(clippy::borrow_as_ptr, reason = "calls read better as in C")]

mod arguments;
mod calls;
mod derivatives;
mod libraries;
mod resources;
mod states;
mod steps;
mod threads;
mod values;
