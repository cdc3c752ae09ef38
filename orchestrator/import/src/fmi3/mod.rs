//! Instances of FMI 3.0 for co-simulation.
//!
//! | module | content |
//! |---|---|
//! | `functions` | the functions of a library |
//! | `layout` | the master's value references, and what FMI 3.0 calls their variables |
//! | `values` | values on their way between the types of the master and those of FMI 3.0 |
//! | `instance` | an instance, with its modes |

mod functions;
mod instance;
mod layout;
mod values;

pub(crate) use functions::Functions;
pub(crate) use instance::Fmi3Instance;
pub(crate) use layout::Layout;
