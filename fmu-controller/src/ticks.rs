//! The ticks within a communication step, for every sampled unit alike.

use fmi2_export::{Failure, Inputs, Model};

/// Refuses an experiment that starts where ticks cannot be told apart.
pub(crate) fn check_resolution(start: f64, period: f64) -> Result<(), Failure> {
    vehicle::time::check_resolution(start, period).map_err(|error| Failure::Error(error.to_string()))
}

/// Refuses a saved state that no unit can have been in.
pub(crate) fn misfit(problem: &str) -> Result<(), Failure> {
    Err(Failure::Error(format!("the saved state does not fit: {problem}")))
}

/// A unit that works at ticks.
pub(crate) trait Ticked: Model {
    /// When the first uncommitted tick is (s), if it comes before `to`.
    fn tick_before(&mut self, to: f64) -> Result<Option<f64>, Failure>;

    /// Brings the first uncommitted tick up to date with the inputs.
    fn evaluate(&mut self) -> Result<(), Failure>;

    /// Commits that tick; what it must say to the importer.
    fn commit(&mut self) -> Result<Option<&'static str>, Failure>;
}

/// `doStep`: evaluates every tick from `from` up to, but not at, `to` with the inputs as they are then, and commits it.
pub(crate) fn step<U: Ticked>(
    unit: &mut U,
    from: f64,
    to: f64,
    inputs: &dyn Inputs<U>,
    log: &mut dyn FnMut(&str),
) -> Result<(), Failure> {
    while let Some(tick) = unit.tick_before(to)? {
        inputs.advance(unit, tick.max(from));
        unit.evaluate()?;
        if let Some(text) = unit.commit()? {
            log(text);
        }
    }
    Ok(())
}
