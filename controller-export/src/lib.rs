//! This crate makes an FMI 2.0 FMU of a sampled attitude controller.
//!
//! A control law implements [`control::Controller`] and [`Law`]. [`ControllerFmu`] adds the inputs,
//! outputs, reference profiles, limits and delays that all controllers share, so that one FMU can
//! replace another without rewiring:
//!
//! ```
//! use control::lqr::{Lqr, LqrSettings};
//! use controller_export::{ControllerFmu, Law, Vehicle};
//! use fmi2_export::{VariableTable, describe, table::parameter};
//! use serde::{Deserialize, Serialize};
//!
//! /// A regulator with one weight; the value holds the parameters and outputs of the law.
//! #[derive(Serialize, Deserialize)]
//! struct Soft {
//!     weight: f64,
//! }
//!
//! impl Default for Soft {
//!     fn default() -> Self {
//!         Self { weight: 10.0 }
//!     }
//! }
//!
//! impl Law for Soft {
//!     type Controller = Lqr;
//!     type Settings = LqrSettings;
//!     const NAME: &'static str = "Soft";
//!     const DESCRIPTION: &'static str = "Linear-quadratic regulator with one weight";
//!
//!     fn period() -> f64 {
//!         0.04
//!     }
//!
//!     fn declare(
//!         table: VariableTable<ControllerFmu<Self>>,
//!     ) -> VariableTable<ControllerFmu<Self>> {
//!         let weight = parameter("weight", "Weight on the tracking error").real();
//!         table.real(weight.min(0.0), |m| &mut m.law.weight)
//!     }
//!
//!     fn settings(&self, vehicle: &Vehicle) -> LqrSettings {
//!         let Vehicle { body, period, .. } = *vehicle;
//!         LqrSettings { body, p: [self.weight; 6], q: [10.0; 3], period }
//!     }
//!
//!     fn design(settings: LqrSettings) -> Result<Lqr, control::error::DesignError> {
//!         Lqr::new(settings)
//!     }
//! }
//!
//! // In the crate of the FMU: fmi2_export::export_fmus!(ControllerFmu<Soft>);
//! let description = describe::<ControllerFmu<Soft>>();
//! assert!(description.variables.iter().any(|variable| variable.name == "moment.x"));
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`law`] | what a control law adds, and the data that all controllers share |
//! | `instance` | how an instance of a controller works at its ticks |
//! | [`sampled`] | any instance that works at ticks: steps, saved states |
//! | [`table`] | the variables that all controllers have, and declarations that laws share |
//! | [`mod@reference`] | the source of the reference |
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod instance;
pub mod law;
pub mod reference;
pub mod sampled;
pub mod table;

pub use law::{ControllerFmu, ControllerInstance, Law, Vehicle};
pub use sampled::{SampledFmu, SampledInstance};
