//! Functions of FMI 2.0 and 3.0 with their C signatures.
//!
//! [`export_fmus!`](crate::export_fmus) makes an exported function of the same name from each of
//! them. They are `unsafe` like any C function, because a pointer that is neither null nor as the
//! standard demands cannot be recognized.
#![allow(
    unsafe_code,
    non_snake_case,
    clippy::missing_safety_doc,
    clippy::too_many_arguments,
    missing_docs
)]
#![allow(clippy::not_unsafe_ptr_arg_deref)]

mod co_simulation;
mod component;
mod fmi3;
mod library;
mod life_cycle;
mod model_exchange;
mod saved_states;
mod variables;

pub use co_simulation::*;
pub use component::{fmi2FreeInstance, fmi2Instantiate};
pub use fmi3::*;
pub use library::*;
pub use life_cycle::*;
pub use model_exchange::*;
pub use saved_states::*;
pub use variables::*;
