//! Steps FMI 2.0 units along an experiment file. It knows units only: what their variables stand
//! for is said by the experiment.
//!
//! An [`experiment`] is read ([`document`]) and [checked](mod@check) once, from the top down, into a
//! [`system::System`] ([`wiring`], [`settings`], [`delay`]): after this no name is looked up. The
//! [`master`] steps the units on integer ticks ([`clock`]), with the wall clock if asked to
//! ([`pacing`]), and observers look on, such as the [`recorder`]. [`metadata`] says what a run was,
//! and [`ssp`] reads and writes systems as SSP archives.

pub mod check;
pub mod clock;
pub mod delay;
pub mod document;
pub mod doubts;
pub mod error;
pub mod experiment;
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
mod watch;
mod wiring;
