//! Archives of the standard System Structure and Parameterization 1.0 (SSP). Such an archive holds
//! a system of FMUs, its connections and its parameter values for any importer that reads the
//! format.

mod binding;
mod flow;
mod read;
mod structure;
mod value;
mod write;

pub use read::{Entries, Loaded, load};
pub use write::{lost, pack};

/// Path of the system structure in an archive.
const STRUCTURE: &str = "SystemStructure.ssd";
/// Type of a component that is an FMU, which is also the type of a component that states none.
const FMU: &str = "application/x-fmu-sharedlibrary";
