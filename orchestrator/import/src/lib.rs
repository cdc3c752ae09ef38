//! Imports FMI 2.0 FMUs. An [`fmu::Fmu`] is unpacked ([`archive`]), its description is read
//! ([`description`], [`xml`], [`quantity`]), and the description is searched for [`faults`]. Its
//! instances are called through the trait [`instance::Instance`]. A [`lookup_table`] is opened and
//! called in the same way.

pub mod archive;
pub mod crash;
pub mod description;
pub mod error;
pub mod faults;
mod fmi;
pub mod fmu;
pub mod folder;
mod functions;
pub mod instance;
pub mod isolation;
mod library;
mod log;
mod logs;
pub mod lookup_table;
pub mod names;
pub mod quantity;
pub mod warnings;
pub mod xml;
