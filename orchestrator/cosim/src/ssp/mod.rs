//! Archives of the standard System Structure and Parameterization 1.0 (SSP): a system of FMUs, its wiring and its parameter
//! values, for any tool that reads them.

mod read;
mod structure;
mod write;

pub use read::{Entries, Loaded, load};
pub use write::pack;

/// Where the structure stands in an archive.
const STRUCTURE: &str = "SystemStructure.ssd";
/// The type of the annotation that holds what the standard has no place for, in our words.
const OWN: &str = "orchestrator";
/// The type of a widely read annotation that holds the step.
const OPEN_MODELICA: &str = "org.openmodelica";
/// Type of a component that is an FMU, which is also the type of a component that states none.
const FMU: &str = "application/x-fmu-sharedlibrary";
