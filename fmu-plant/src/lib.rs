//! The FMI 2.0 unit `ReentryPlant`, for co-simulation and model exchange: the crate `vehicle` behind a table of variables.

mod parameters;
mod plant;
mod table;

pub use plant::ReentryPlant;
