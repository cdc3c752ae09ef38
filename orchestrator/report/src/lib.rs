//! Evaluates co-simulated runs: the [`metrics`] and the [`plot`] of each run that its experiment
//! asks for, and a [`study`] of many runs with its figures, tables and verdicts on one page.

pub mod error;
pub mod figure;
pub mod folder;
pub mod guarantee;
mod measure;
pub mod metrics;
pub mod pacing;
pub mod panels;
pub mod plot;
pub mod progress;
pub mod study;
pub mod summary;
pub mod work;
