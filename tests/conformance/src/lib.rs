//! An importer for testing. It opens the FMU libraries that cargo has built at run time and calls
//! them through the C interface of FMI 2.0.
//!
//! It uses only the description of an FMU and nothing of the crates that make the FMUs.
#![allow(unsafe_code)]
#![allow(clippy::borrow_as_ptr, reason = "calls read better as in C")]
#![allow(clippy::missing_panics_doc, reason = "a test fails by panicking")]
#![allow(
    clippy::not_unsafe_ptr_arg_deref,
    reason = "handles belong to the library and are not followed by the tests"
)]

mod fmu;
mod instance;
pub mod interface;
mod log;
mod runs;
pub mod table;
mod values;

pub use fmu::{Fmu, fmu, fmus, fmus_and_interfaces, is_continuous_real, library};
pub use instance::Instance;
pub use log::{Log, Message, callbacks};
pub use runs::driver;
pub use values::Bits;

/// Calls a function of the library to which an instance or FMU belongs:
/// `c!(instance, fmi2Reset(component))`.
#[macro_export]
macro_rules! c {
    ($on:expr, $function:ident($($argument:expr),* $(,)?)) => {{
        let function = $on.interface.$function;
        // SAFETY: every pointer that a test passes is null or valid for the duration of the call,
        // as the standard demands.
        #[allow(unsafe_code, clippy::macro_metavars_in_unsafe)]
        let result = unsafe { function($($argument),*) };
        result
    }};
}

/// Calls a function for an instance, which must succeed: `ok!(instance, fmi2SetTime(0.0))`.
#[macro_export]
macro_rules! ok {
    ($instance:expr, $function:ident($($argument:expr),* $(,)?)) => {
        $instance.ok($crate::c!($instance, $function($instance.component $(, $argument)*)))
    };
}
