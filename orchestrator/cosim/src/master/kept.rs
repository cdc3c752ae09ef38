//! Calls of one instance between two ticks, and values added on the way, for those who look into a
//! run.

use super::Master;
use crate::error::Error;
use crate::wiring::Port;
use fmu_import::instance::{CallFailure, Instance};

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
    ) -> Result<T, Error> {
        let instance = self.members[index].instance.as_mut();
        calls(instance).map_err(|failure| self.error(time, (index, failure)))
    }

    /// Adds a value to what a connected real input receives, from now on.
    pub fn add(&mut self, input: Port, value: f64) {
        self.inputs[input.component].add(input.reference, value);
    }
}
