//! Instances of FMI 3.0.
//!
//! | module | content |
//! |---|---|
//! | `functions` | the functions of a library |
//! | `layout` | the master's value references, and what FMI 3.0 calls their variables |
//! | `values` | values on their way between the types of the master and those of FMI 3.0 |
//! | `unit` | an instance for either interface |
//! | `step` | an instance for co-simulation, with its modes |

mod functions;
mod layout;
mod step;
mod unit;
mod values;

pub(crate) use functions::Functions;
pub(crate) use layout::Layout;
pub(crate) use step::StepInstance;
pub(crate) use unit::Fmi3Unit;
