//! The FMI 2.0 FMU `ReentryPlant` for co-simulation and model exchange: the crate `vehicle` behind
//! a variable table.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod entry;
mod instance;
mod own_vehicle;
mod parameters;
mod plant;
mod sensing;
mod table;
#[cfg(test)]
mod tests;

pub use plant::ReentryPlant;
