//! Co-simulation: steps, and the derivatives of inputs over a step.

use super::{Instance, Stops};
use crate::call::{Outcome, State, error};
use crate::logger::Category;
use crate::model::{Failure, LastEvent};
use crate::progress::{Extrapolation, MAX_INPUT_DERIVATIVE_ORDER};
use crate::types::FmiStatus;
use model_description::variable::{Causality, Variability};

/// Largest distance of the communication point from the instance's time, relative to both and to
/// the step. It allows for importers that accumulate time.
const TIME_TOLERANCE: f64 = 1e-9;
/// Upper bound of that distance (s), unless rounding is larger.
const LONGEST_TOLERANCE: f64 = 1e-4;
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Largest amount by which a step may reach beyond the stop time, relative to that time, but never
/// more than a step. The standard demands an error for computing past a defined stop time;
/// importers that accumulate time overshoot it by about 1e-9.
const STOP_TOLERANCE: f64 = 1e-6;

/// Outcome of a step of FMI 3.0.
pub(crate) struct Stepped {
    /// Whether an event is to be handled where the step has ended.
    pub(crate) event: bool,
    /// Whether the simulation ends here.
    pub(crate) ended: bool,
    /// Whether the step ended before its end.
    pub(crate) early: bool,
    /// Time that was reached, s.
    pub(crate) time: f64,
}

impl Instance {
    pub(crate) fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Outcome {
        for ((&reference, &order), value) in references.iter().zip(orders).zip(values) {
            self.expect_type::<f64>(reference)?;
            let variable = self.variable(reference)?;
            let name = &variable.name;
            if variable.causality != Causality::Input
                || variable.variability != Variability::Continuous
            {
                return error(format!("'{name}' is not a continuous input"));
            }
            if order < 1 || order as usize > MAX_INPUT_DERIVATIVE_ORDER {
                return error(format!(
                    "'{name}': order {order} is not between 1 and {MAX_INPUT_DERIVATIVE_ORDER}"
                ));
            }
            if !value.is_finite() {
                return error(format!("'{name}': derivative {value} is not finite"));
            }
        }
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(values) {
            let reference = reference as usize;
            let extrapolations = &mut self.progress.extrapolations;
            let position = extrapolations
                .iter()
                .position(|input| input.reference == reference)
                .unwrap_or_else(|| {
                    let derivatives = [0.0; MAX_INPUT_DERIVATIVE_ORDER];
                    extrapolations.push(Extrapolation { reference, base: 0.0, derivatives });
                    extrapolations.len() - 1
                });
            extrapolations[position].derivatives[order as usize - 1] = value;
        }
        Ok(())
    }

    /// Largest difference of times that importers compute in other ways, for this step.
    fn tolerance(&self, point: f64, size: f64) -> f64 {
        let largest = self.progress.time.abs().max(point.abs()).max(size);
        (TIME_TOLERANCE * largest).min(LONGEST_TOLERANCE).max(ROUNDING * largest)
    }

    /// Returns the time of the next event that the importer has to know of, s. An FMU for model
    /// exchange has none: in co-simulation it handles its events itself.
    pub(super) fn next_event(&mut self) -> Result<Option<f64>, Failure> {
        if self.description.model_exchange {
            return Ok(None);
        }
        Ok(self.model.new_discrete_states(self.progress.time)?.next_event_time)
    }

    /// Performs a step of FMI 3.0, which ends at the next event if the importer allows it.
    pub(crate) fn step_to_event(&mut self, point: f64, size: f64) -> Result<Stepped, Failure> {
        let (end, tolerance) = (point + size, self.tolerance(point, size));
        let Stops { event_mode, early_return } = self.stops;
        let next = if event_mode { self.next_event()? } else { None };
        let early = next.filter(|next| early_return && *next < end - tolerance);
        let step = self.step_until(point, size, early);
        let ended = match step {
            Ok(()) => false,
            Err(Failure::Ended { reason, .. }) => {
                self.logger.log(Category::Events, &reason);
                true
            }
            Err(failure) => return Err(failure),
        };
        let time = self.progress.time;
        Ok(Stepped {
            event: !ended && next.is_some_and(|next| next <= time + tolerance),
            ended,
            early: early_return && time < end - tolerance,
            time,
        })
    }

    /// Performs a step. The derivatives of inputs hold for one step. The step begins exactly where
    /// the last one ended, however the importer accumulates its time.
    pub(crate) fn do_step(&mut self, point: f64, size: f64) -> Outcome {
        self.step_until(point, size, None)
    }

    /// Performs a step that ends at the time `limit` (s) if this comes first.
    fn step_until(&mut self, point: f64, size: f64, limit: Option<f64>) -> Outcome {
        if !point.is_finite() || !size.is_finite() || size < 0.0 {
            return error(format!("cannot step from {point} s by {size} s"));
        }
        let from = self.progress.time;
        let tolerance = self.tolerance(point, size);
        if (point - from).abs() > tolerance {
            return error(format!(
                "communication point {point} s, but the instance is at {from} s"
            ));
        }
        let to = (point + size).max(from);
        if let Some(stop) = self.progress.stop_time
            && to - stop > (STOP_TOLERANCE * stop.abs().max(size)).min(size.max(tolerance))
        {
            return error(format!(
                "a step to {to} s goes beyond the stop time {stop} s of the experiment"
            ));
        }
        let to = limit.map_or(to, |limit| to.min(limit));
        for input in &mut self.progress.extrapolations {
            input.base = *self.model.real(input.reference).expect("checked when it was set");
        }
        let logger = &mut self.logger;
        let mut log = |text: &str| logger.log(Category::Warning, text);
        let begin = (from, self.progress.last_event);
        match self.model.step(begin, to, &self.progress.extrapolations, &mut log) {
            Ok(()) => {
                if to > from {
                    self.progress.last_event = LastEvent::Step;
                }
                self.progress.time = to;
                self.progress.extrapolations.clear();
                self.stale = true;
                self.last_step = FmiStatus::Ok;
                self.has_ended = false;
                Ok(())
            }
            Err(failure) => {
                self.last_step = match failure {
                    Failure::Discard(_) | Failure::Ended { .. } => FmiStatus::Discard,
                    Failure::Error(_) => FmiStatus::Error,
                };
                self.has_ended = matches!(failure, Failure::Ended { .. });
                if let Failure::Ended { time, .. } = failure {
                    self.progress.last_event = LastEvent::Step;
                    self.progress.time = time;
                    self.progress.extrapolations.clear();
                }
                self.progress.state = State::StepFailed;
                self.stale = true;
                Err(failure)
            }
        }
    }

    pub(crate) fn last_step(&self) -> FmiStatus {
        self.last_step
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.has_ended
    }

    pub(crate) fn time(&self) -> f64 {
        self.progress.time
    }
}
