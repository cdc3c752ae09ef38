//! Imports FMI 2.0 units. An [`fmu::Fmu`] is unpacked ([`archive`]), its description is read
//! ([`description`], [`xml`], [`quantity`]), and the description is searched for [`faults`]. Units
//! that are instantiated from it are called through the trait [`unit::Instance`]. A [`table`] is a
//! unit, too.

pub mod archive;
pub mod crash;
pub mod description;
pub mod error;
pub mod faults;
mod fmi;
pub mod fmu;
pub mod folder;
pub mod instance;
pub mod isolation;
mod library;
mod log;
pub mod lookup_table;
pub mod names;
pub mod quantity;
pub mod warnings;
pub mod xml;
