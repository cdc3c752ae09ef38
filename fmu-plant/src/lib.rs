//! The FMI 2.0 unit `ReentryPlant` for co-simulation and model exchange: the crate `vehicle` behind
//! a table of variables.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod parameters;
mod plant;
mod roles;
mod table;
#[cfg(test)]
mod tests;
mod unit;

pub use plant::ReentryPlant;

fmi2_export::export_fmus!(ReentryPlant);
