//! Calls of one instance between two ticks, and values added on the way, for the analysis of a run.

use super::{Failed, Master};
use crate::instance::{CallFailure, Instance};
use crate::wiring::Port;

impl Master {
    /// Calls an instance, given its index, between two ticks.
    ///
    /// # Errors
    /// Returns an error that names the instance if the calls fail; `time` (s) is named with it.
    pub fn call<T>(
        &mut self,
        index: usize,
        time: f64,
        calls: impl FnOnce(&mut dyn Instance) -> Result<T, CallFailure>,
    ) -> Result<T, Failed> {
        let instance = self.members[index].instance.as_mut();
        calls(instance).map_err(|failure| self.failed(time, (index, failure)))
    }

    /// Calls two instances, given their indices, between two ticks. A failure comes with the place
    /// of the instance among the two.
    ///
    /// # Errors
    /// Returns an error that names the instance if the calls fail; `time` (s) is named with it.
    ///
    /// # Panics
    /// Panics if the indices are equal, or if there is no such instance.
    pub fn call_both<T>(
        &mut self,
        indices: [usize; 2],
        time: f64,
        calls: impl FnOnce([&mut dyn Instance; 2]) -> Result<T, (usize, CallFailure)>,
    ) -> Result<T, Failed> {
        let members = self.members.get_disjoint_mut(indices);
        let [first, second] = members.expect("two different members");
        let outcome = calls([first.instance.as_mut(), second.instance.as_mut()]);
        outcome.map_err(|(place, failure)| self.failed(time, (indices[place], failure)))
    }

    /// Adds a value to those that a connected real input receives, from now on.
    pub fn add(&mut self, input: Port, value: f64) {
        self.inputs[input.component].add(input.reference, value);
    }
}
