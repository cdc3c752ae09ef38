//! Steps FMI 2.0 instances as an experiment file describes. What their variables stand for is known
//! to the experiment alone.
//!
//! An [`experiment`] is read ([`document`]) and [checked](mod@check) once, from the top down, into
//! a [`system::System`] (`wiring`, `settings`, [`delay`]). After this no name is looked up. The
//! [`master`] steps the instances on integer ticks ([`clock`]), paced by the wall clock if
//! requested ([`pacing`]), and observers such as the [`recorder`] see the values. [`metadata`]
//! describes a finished run, and [`ssp`] reads and writes systems as SSP archives.

pub mod check;
pub mod clock;
pub mod delay;
pub mod document;
pub mod error;
pub mod experiment;
pub mod files;
pub mod interrupt;
pub mod master;
pub mod metadata;
pub mod pacing;
pub mod recorder;
pub mod search;
mod settings;
pub mod signal;
pub mod ssp;
mod stopwatch;
pub mod system;
mod topology;
pub mod variation;
mod watch;
pub mod wiring;
