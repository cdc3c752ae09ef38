//! States to which a run goes back, and inputs at which its loop is opened.

use super::{Failed, Master, OpenedInput};
use crate::wiring::Port;

impl Master {
    /// Opens the loop at a connected real input.
    ///
    /// # Panics
    /// Panics if the input is not connected.
    pub fn opened(&mut self, input: Port) -> &mut OpenedInput {
        self.inputs[input.component].opened(input.reference)
    }

    /// Keeps the state between two ticks under a number, counted from 0 without gaps. `time` (s) is
    /// named with a failure.
    ///
    /// # Errors
    /// Returns an error if an instance keeps no states.
    pub fn keep(&mut self, number: usize, time: f64) -> Result<(), Failed> {
        self.each(time, |_, member| member.instance.save(number))?;
        self.kept.truncate(number);
        self.kept.push(self.values.readings.clone());
        Ok(())
    }

    /// Goes back to the state that was kept under a number. `time` (s) is named with a failure.
    ///
    /// # Errors
    /// Returns an error if an instance fails.
    ///
    /// # Panics
    /// Panics if no state was kept under this number.
    pub fn go_back(&mut self, number: usize, time: f64) -> Result<(), Failed> {
        self.each(time, |_, member| member.instance.restore(number))?;
        self.values.readings.clone_from(&self.kept[number]);
        Ok(())
    }
}
