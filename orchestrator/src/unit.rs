//! What the master needs of a co-simulation unit, whether it is an FMU or a mock in a test.

use crate::error::UnitFailure;

/// Outcome of a call to a unit.
pub type Outcome = Result<(), UnitFailure>;

/// A unit that is set, stepped and read by value references, in the order FMI 2.0 prescribes. Booleans travel as 0 and 1,
/// enumerations as the value of their item. All slices of one call have the same length.
pub trait CoSimulationUnit {
    /// Reads real variables.
    ///
    /// # Errors
    /// As every call here: what the unit said.
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome;
    /// Reads integer and enumeration variables.
    ///
    /// # Errors
    /// What the unit said.
    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome;
    /// Reads boolean variables.
    ///
    /// # Errors
    /// What the unit said.
    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome;
    /// Sets real variables.
    ///
    /// # Errors
    /// What the unit said.
    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome;
    /// Sets integer and enumeration variables.
    ///
    /// # Errors
    /// What the unit said.
    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome;
    /// Sets boolean variables.
    ///
    /// # Errors
    /// What the unit said.
    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome;
    /// Sets a text variable.
    ///
    /// # Errors
    /// What the unit said.
    fn set_string(&mut self, reference: u32, value: &str) -> Outcome;
    /// Announces the experiment (times in s) and enters initialization mode.
    ///
    /// # Errors
    /// What the unit said.
    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome;
    /// Leaves initialization mode: the unit can be stepped.
    ///
    /// # Errors
    /// What the unit said.
    fn exit_initialization(&mut self) -> Outcome;
    /// Steps from communication point `time` by `step` (both s).
    ///
    /// # Errors
    /// What the unit said.
    fn do_step(&mut self, time: f64, step: f64) -> Outcome;
    /// Ends the simulation.
    ///
    /// # Errors
    /// What the unit said.
    fn terminate(&mut self) -> Outcome;
}
