//! The C interfaces of FMI 2.0 and 3.0, written once: the model of an FMU implements [`Model`], and
//! [`export_fmus!`] makes a library of it.
//!
//! ```
//! use fmi_export::prelude::*;
//!
//! /// The equation x' = −k x.
//! #[derive(Default, Serialize, Deserialize, Declared)]
//! struct Dahlquist {
//!     /// Rate k at which the state decays.
//!     #[setting(unit = "1/s", start = 1.0)]
//!     k: f64,
//!     /// State x.
//!     #[setting(output, start = 1.0)]
//!     x: f64,
//!     /// Time derivative of x.
//!     #[setting(name = "der(x)", output, unit = "1/s", derivative = "x", depends_on = ["x"])]
//!     derivative: f64,
//! }
//!
//! impl Model for Dahlquist {
//!     fn description() -> Description<Self> {
//!         Description::new("Dahlquist", "Test equation of Dahlquist", VariableTable::new(|m| m))
//!     }
//!     fn new() -> Self {
//!         settings::start()
//!     }
//!     fn calculate(&mut self, _time: f64, _last: LastEvent) -> Result<(), Failure> {
//!         self.derivative = -self.k * self.x;
//!         Ok(())
//!     }
//! }
//!
//! // In the crate of the FMU: fmi_export::export_fmus!(Dahlquist);
//! assert_eq!(fmi_export::describe::<Dahlquist>().states(), [(1, 2)]);
//! ```
//!
//! The keys of `#[setting(…)]` are those of the crate [`settings`]. The shell integrates the states,
//! and takes differences as partial derivatives, unless the model does it itself.
//!
//! | module | content |
//! |---|---|
//! | [`model`], [`table`] | the interface that a model must implement, and its variable table |
//! | `model_instance` | a model bound to its variable table, without its type |
//! | `progress` | the part of an instance's state that the shell keeps |
//! | [`linked`] | an instance in the same program, without the C interface |
//! | `instance` | one instance: checks, laziness, saved states; no pointers |
//! | `call` | the table of calls allowed in each state |
//! | [`interface`], [`types`] | the C signatures |
//! | `pointer` | the checks of the importer's pointers |
//! | `logger`, `resource`, `saved` | messages, the resource URI, the bytes of a saved state |
//!
//! Every entry point works in the default floating-point environment, whatever that of the importer
//! is, so that it gives the same bits in all of them. It stops a panic: it returns `fmi2Fatal`,
//! reports it in the log, and leaves the process and all other instances alone. The process-wide
//! panic hook is not changed, so the standard hook writes one line to stderr, and a panic is always
//! a defect.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod call;
mod export;
mod instance;
#[doc(hidden)]
pub mod interface;
pub mod linked;
mod logger;
pub mod model;
mod model_instance;
mod numbers;
mod pointer;
mod progress;
mod resource;
mod saved;
mod scalar;
mod settings_file;
pub mod table;
#[doc(hidden)]
pub mod types;

#[doc(hidden)]
pub use export::sources;
pub use model::{Context, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
pub use model_instance::{Export, describe};
pub use progress::MAX_INPUT_DERIVATIVE_ORDER;
pub use settings_file::SettingsFile;
pub use table::{Description, VariableTable};

/// Items that the crate of a model needs, besides dependencies on `serde` and `settings`.
pub mod prelude {
    pub use crate::{
        Context, Description, EventInfo, Failure, Inputs, LastEvent, Model, VariableTable,
    };
    pub use serde::{Deserialize, Serialize};
    pub use settings::{Choice, Declared};
}
