//! Imports FMI 2.0 FMUs. An [`fmu::Fmu`] is unpacked ([`archive`]), its description is read
//! ([`description`], [`xml`]), and the description is searched for [`faults`]. Its instances are
//! called through the trait [`Instance`](fmi_master::instance::Instance) of the master. A
//! [`lookup_table`] and a [`law`] in another program are opened and called in the same way.

pub mod archive;
pub mod crash;
pub mod description;
pub mod error;
pub mod faults;
mod fmi;
pub mod fmu;
pub mod folder;
mod functions;
pub mod isolation;
pub mod law;
mod library;
mod log;
mod logs;
pub mod lookup_table;
pub mod warnings;
pub mod xml;
