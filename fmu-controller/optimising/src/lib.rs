//! The library of the FMUs that optimise while they run. Only it holds the solvers: they are a
//! fifth of its size.
#![deny(clippy::disallowed_methods)]

use fmu_controller::{ControlAllocator, Crmpc, Dlmpc};

fmi_export::export_fmus!(Crmpc, Dlmpc, ControlAllocator);
