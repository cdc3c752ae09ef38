//! Model exchange: instances whose continuous states this program integrates.
//!
//! A [`ContinuousModel`](model::ContinuousModel) computes derivatives, event indicators and discrete
//! states. With an integrator it becomes an [`Exchange`](instance::Exchange), which the master steps
//! like any other instance: its inputs are held over a step. The calls follow FMI 2.0.5, section
//! 3.2.3.
//!
//! | module | content |
//! |---|---|
//! | `model` | what a model offers, whatever the version of FMI |
//! | `fmi2` | the functions of FMI 2.0 |
//! | `radau` | the integrator |
//! | `equations` | the equations of a model as the integrator sees them, and finding state events |
//! | `events` | what is known of events |
//! | `instance` | the model with its integrator, as the master sees it |

mod equations;
mod events;
pub(crate) mod fmi2;
mod instance;
mod model;
mod radau;

pub(crate) use model::Layout;
