//! Model exchange: instances whose continuous states this program integrates.
//!
//! A [`ContinuousModel`] computes derivatives, event indicators and discrete states. With an
//! integrator it becomes an [`Exchange`], which the master steps like any other instance: its
//! inputs are held over a step. The calls follow FMI 2.0.5, section 3.2.3, and FMI 3.0.2, section
//! 3.2.
//!
//! | module | content |
//! |---|---|
//! | `model` | what the integration needs to know of a model |
//! | `calls` | the calls, whatever the version of FMI |
//! | `rodas` | the integrator |
//! | `equations` | the equations of a model as the integrator sees them, and finding state events |
//! | `events` | what is known of events |
//! | `instance` | the model with its integrator, as the master sees it |

mod calls;
mod equations;
mod events;
mod instance;
mod model;
mod rodas;

pub(crate) use instance::Exchange;
pub(crate) use model::{ContinuousModel, Layout};
