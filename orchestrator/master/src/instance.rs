//! The interface between the master and an instance, which may be that of an FMU, a lookup table,
//! or a mock in a test.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A call to an instance that did not succeed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CallFailure {
    /// Time (s) at which the instance ended the simulation by this call, which is not a fault; not
    /// a number if it does not say when.
    pub ends: Option<f64>,
    /// Name of the call, for example `doStep`.
    pub call: Cow<'static, str>,
    /// Message of the instance, or its status if there is none.
    pub message: String,
    /// Whether this is an answer of the instance, such as a status of FMI. Otherwise the call could
    /// not be made or was not answered, for example because the process was killed, which says
    /// nothing about the model.
    pub is_answer: bool,
}

impl CallFailure {
    /// Creates a failure of this call that does not end the simulation and is no answer of the
    /// instance.
    pub fn new(call: &'static str, message: impl Into<String>) -> Self {
        Self { ends: None, call: call.into(), message: message.into(), is_answer: false }
    }

    /// Creates a failure that is an answer of the instance, and does not end the simulation.
    pub fn answer(call: &'static str, message: impl Into<String>) -> Self {
        Self { is_answer: true, ..Self::new(call, message) }
    }
}

/// Outcome of a call to an instance.
pub type Outcome = Result<(), CallFailure>;

/// A running copy of an FMU. It is set, stepped and read by value references, in the order that FMI
/// 2.0 prescribes; one of FMI 3.0 changes its modes itself. Booleans are transferred as 0 and 1,
/// and enumerations as the values of their items. All slices of one call have the same length.
pub trait Instance {
    /// Reads real variables.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure, as for every call of this trait.
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome;
    /// Reads integer and enumeration variables.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome;
    /// Reads boolean variables.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome;
    /// Sets real variables.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome;
    /// Sets integer and enumeration variables.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome;
    /// Sets boolean variables.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome;
    /// Sets a text variable.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn set_string(&mut self, reference: u32, value: &str) -> Outcome;
    /// Announces the start and stop time of the experiment, s, and enters initialization mode.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome;
    /// Leaves initialization mode, after which the instance can be stepped.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn exit_initialization(&mut self) -> Outcome;
    /// Steps the instance from the communication point `time` by `step`, both in s.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn do_step(&mut self, time: f64, step: f64) -> Outcome;
    /// Ends the simulation.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure.
    fn terminate(&mut self) -> Outcome {
        Ok(())
    }
    /// Sets all variables back to their start values, so that the instance is as if it were new.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure or cannot be reset.
    fn reset(&mut self) -> Outcome {
        Err(CallFailure::new("reset", "the instance cannot be reset"))
    }
    /// Keeps the present state under a number, counted from 0 without gaps. A state that was kept
    /// under this number before is lost.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure or keeps no states.
    fn save(&mut self, _number: usize) -> Outcome {
        Err(CallFailure::new("getFMUstate", "the instance keeps no states"))
    }
    /// Goes back to the state that was kept under a number.
    ///
    /// # Errors
    /// Returns an error if the instance reports a failure, or if there is no such state.
    fn restore(&mut self, _number: usize) -> Outcome {
        Err(CallFailure::new("setFMUstate", "the instance keeps no states"))
    }
}

/// Makes calls of [`Instance`] those of another instance, which the method `through` hands to a
/// closure: `forward! { through: set_real, do_step }`.
#[macro_export]
macro_rules! forward {
    ($through:ident: $($call:ident),* $(,)?) => {
        $($crate::forward!(@signature $through $call);)*
    };
    (@signature $through:ident get_real) => {
        $crate::forward!(@call $through get_real(references: &[u32], values: &mut [f64]));
    };
    (@signature $through:ident get_integer) => {
        $crate::forward!(@call $through get_integer(references: &[u32], values: &mut [i32]));
    };
    (@signature $through:ident get_boolean) => {
        $crate::forward!(@call $through get_boolean(references: &[u32], values: &mut [i32]));
    };
    (@signature $through:ident set_real) => {
        $crate::forward!(@call $through set_real(references: &[u32], values: &[f64]));
    };
    (@signature $through:ident set_integer) => {
        $crate::forward!(@call $through set_integer(references: &[u32], values: &[i32]));
    };
    (@signature $through:ident set_boolean) => {
        $crate::forward!(@call $through set_boolean(references: &[u32], values: &[i32]));
    };
    (@signature $through:ident set_string) => {
        $crate::forward!(@call $through set_string(reference: u32, value: &str));
    };
    (@signature $through:ident enter_initialization) => {
        $crate::forward!(@call $through enter_initialization(start: f64, stop: f64));
    };
    (@signature $through:ident do_step) => {
        $crate::forward!(@call $through do_step(time: f64, step: f64));
    };
    (@signature $through:ident save) => {
        $crate::forward!(@call $through save(number: usize));
    };
    (@signature $through:ident restore) => {
        $crate::forward!(@call $through restore(number: usize));
    };
    // All others have no arguments.
    (@signature $through:ident $call:ident) => { $crate::forward!(@call $through $call()); };
    (@call $through:ident $call:ident($($argument:ident: $type:ty),*)) => {
        fn $call(&mut self, $($argument: $type),*) -> $crate::instance::Outcome {
            self.$through(|instance| instance.$call($($argument),*))
        }
    };
}
