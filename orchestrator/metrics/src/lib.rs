//! Numbers of co-simulated runs: the [`metrics`] that an experiment asks for, with its
//! [`guarantee`], the [`progress`] of the work, and the [`folder`] of its results.

pub mod folder;
pub mod guarantee;
mod measure;
pub mod metrics;
pub mod progress;
