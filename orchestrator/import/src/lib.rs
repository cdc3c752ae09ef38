//! Imports FMI 2.0 units: an [`fmu::Fmu`] is unpacked ([`archive`]), its description read
//! ([`description`], [`xml`], [`quantity`]) and looked through for [`faults`]. Units that are
//! instantiated from it are called through the trait [`unit::CoSimulationUnit`].

pub mod archive;
pub mod description;
pub mod error;
pub mod faults;
mod fmi;
pub mod fmu;
mod instance;
pub mod names;
pub mod quantity;
pub mod unit;
pub mod warnings;
pub mod xml;
