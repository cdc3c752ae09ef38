//! What co-simulated runs came to: [`metrics`] and a [`plot`] of each, as its experiment asks for
//! them, and a [`study`] of many runs with its figures, tables and verdicts as one page.

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
