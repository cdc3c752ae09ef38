//! This crate makes an FMI 2.0 FMU of a sampled attitude controller.
//!
//! A control law implements [`control::Controller`] and [`Law`]. [`ControllerFmu`] adds the inputs,
//! outputs, reference profiles, limits and delays that all controllers share, so that one FMU can
//! replace another without rewiring:
//!
//! ```
//! use control::lqr::{Lqr, LqrSettings};
//! use controller_export::prelude::*;
//!
//! /// A regulator with one weight.
//! #[derive(Clone, Default, PartialEq, Serialize, Deserialize, Declared)]
//! struct Weight {
//!     /// Weight on the tracking error.
//!     #[setting(above = 0.0, start = 10.0)]
//!     weight: f64,
//! }
//!
//! /// The regulator has no outputs of its own.
//! #[derive(Default, Serialize, Deserialize, Declared)]
//! struct Soft;
//!
//! impl Law for Soft {
//!     type Controller = Lqr;
//!     type Settings = Weight;
//!     const NAME: &'static str = "Soft";
//!     const DESCRIPTION: &'static str = "Linear-quadratic regulator with one weight";
//!
//!     fn design(settings: Weight, vehicle: &Vehicle) -> Result<Lqr, DesignError> {
//!         let p = [settings.weight; 6];
//!         Lqr::new(LqrSettings { body: vehicle.body, p, q: [10.0; 3], period: 0.04 })
//!     }
//! }
//!
//! // In the crate of the FMU: fmi_export::export_fmus!(ControllerFmu<Soft>);
//! let description = fmi_export::describe::<ControllerFmu<Soft>>();
//! assert!(description.variables.iter().any(|variable| variable.name == "moment.x"));
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`law`] | the part that a control law adds, and the data that all controllers share |
//! | `instance` | operation of a controller's instance at its ticks |
//! | [`sampled`] | any instance that works at ticks: steps, saved states |
//! | [`table`] | the variables that all controllers have, and declarations that laws share |
//! | [`own_vehicle`] | the vehicle that a file gives |
//! | [`mod@reference`] | the source of the reference |
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod instance;
pub mod law;
pub mod own_vehicle;
pub mod reference;
pub mod sampled;
pub mod table;

pub use law::{ControllerFmu, ControllerInstance, Law, Vehicle};
pub use sampled::{SampledFmu, SampledInstance};

/// Items that the crate of a law needs, besides dependencies on `serde` and `settings`.
pub mod prelude {
    pub use crate::{ControllerFmu, Law, Vehicle};
    pub use control::controller::{Controller, Measurement, ReferenceAt};
    pub use control::error::DesignError;
    pub use nalgebra::Vector3;
    pub use serde::{Deserialize, Serialize};
    pub use settings::{Choice, Declared};
    pub use vehicle::dynamics::RigidBody;
}
