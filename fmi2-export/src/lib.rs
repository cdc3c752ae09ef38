//! The FMI 2.0 C interface, written once: a unit implements [`Model`], and [`export_fmus!`] makes a library of it.

pub mod model;
pub mod table;

pub use model::{Context, EventInfo, Failure, Inputs, Model};
pub use table::{Description, Table};
