//! Steps FMI instances as an experiment file describes. Only the experiment knows the meaning
//! of their variables.
//!
//! An [`experiment`] is read ([`document`]) and [checked](mod@check) once, from the top down, into
//! a [`system::System`] (`wiring`, `settings`). After this no name is looked up. A [`run`] steps
//! the instances by the [master](fmi_master::master), paced by the wall clock if requested
//! ([`pacing`]), and observers such as the [`recorder`] see the values. [`metadata`] describes a
//! finished run, and [`ssp`] reads and writes systems as SSP archives.

pub mod check;
mod closing;
pub mod document;
pub mod error;
pub mod experiment;
pub mod files;
pub mod interrupt;
pub mod metadata;
pub mod pacing;
pub mod recorder;
pub mod run;
pub mod search;
mod settings;
pub mod signal;
pub mod ssp;
mod stopwatch;
pub mod system;
pub mod timer;
mod topology;
pub mod variation;
mod watch;
mod wiring;
