//! The C interfaces of FMI 2.0 and 3.0, written once: the model of an FMU implements [`Model`], and
//! [`export_fmus!`] makes a library of it.
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
pub mod table;
#[doc(hidden)]
pub mod types;

#[doc(hidden)]
pub use export::sources;
pub use model::{Context, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
pub use model_instance::{Export, describe};
pub use progress::MAX_INPUT_DERIVATIVE_ORDER;
pub use table::{Description, VariableTable};
