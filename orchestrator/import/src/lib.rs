//! Imports FMUs of FMI 2.0 and 3.0. An [`fmu::Fmu`] is unpacked ([`archive`]), its description is
//! read ([`description`], [`xml`]), and the description is searched for [`faults`]. Its instances
//! are called through the trait [`Instance`](fmi_master::instance::Instance) of the master. A
//! [`lookup_table`] and a [`law`] in another program are opened and called in the same way.

pub mod archive;
pub mod crash;
pub mod description;
pub mod error;
mod exchange;
pub mod faults;
mod fmi;
mod fmi2;
mod fmi3;
pub mod fmu;
pub mod folder;
mod functions;
pub mod halt;
pub mod isolation;
pub mod law;
mod library;
mod loading;
mod log;
mod logs;
pub mod lookup_table;
pub mod warnings;
pub mod xml;
