//! Evaluates co-simulated runs: the [`metrics`] and the [`plot`] of each run that its experiment
//! asks for, recorded runs as pictures and pages, and the figures and pages that studies and
//! campaigns are made of.

pub mod figure;
pub mod folder;
pub mod guarantee;
mod measure;
pub mod metrics;
pub mod pacing;
pub mod page;
pub mod panels;
pub mod plot;
pub mod progress;
pub mod recording;
pub mod run_page;
