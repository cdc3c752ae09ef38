//! The calls of model exchange.

#![allow(unsafe_code)]

use super::model::{ContinuousModel, Refusal};
use crate::fmi;
use crate::functions::{Completed, EventInfo, ExchangeFunctions, Functions, NOT_OFFERED, Table};
use crate::library::FmuInstance;
use fmi_master::instance::{CallFailure, Outcome};
use fmi_master::quantity::rounded;
use std::ffi::c_int;

/// Number of updates after which the discrete states must have settled.
const MOST_UPDATES: usize = 1000;

impl ContinuousModel for FmuInstance {
    type Functions = Functions;

    fn unit(&mut self) -> &mut Self {
        self
    }
}

/// All slices have the lengths that the description gives.
impl<F: Table> FmuInstance<F> {
    fn call_exchange(
        &mut self,
        call: &'static str,
        function: impl FnOnce(&ExchangeFunctions, fmi::Handle) -> c_int,
    ) -> Outcome {
        self.call(call, |functions, handle| {
            functions.common().exchange.as_ref().map_or(NOT_OFFERED, |f| function(f, handle))
        })
    }

    fn get_vector(
        &mut self,
        call: &'static str,
        function: fn(&ExchangeFunctions) -> fmi::GetVector,
        values: &mut [f64],
    ) -> Outcome {
        // SAFETY: the instance is alive, and the array has the length that is passed.
        self.call_exchange(call, |functions, handle| unsafe {
            function(functions)(handle, values.as_mut_ptr(), values.len())
        })
    }

    fn refusal(&self, outcome: Outcome) -> Result<(), Refusal> {
        let refusal = if self.is_discarded { Refusal::Discarded } else { Refusal::Failed };
        outcome.map_err(refusal)
    }

    /// Sets the time, s.
    pub(super) fn set_time(&mut self, time: f64) -> Outcome {
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.call_exchange("setTime", |functions, handle| unsafe {
            (functions.set_time)(handle, time)
        })
    }

    /// Sets the continuous states.
    pub(super) fn set_states(&mut self, states: &[f64]) -> Result<(), Refusal> {
        // SAFETY: the instance is alive, and the array has the length that is passed.
        let outcome = self.call_exchange("setContinuousStates", |functions, handle| unsafe {
            (functions.set_states)(handle, states.as_ptr(), states.len())
        });
        self.refusal(outcome)
    }

    /// Reads the continuous states.
    pub(super) fn states(&mut self, states: &mut [f64]) -> Outcome {
        self.get_vector("getContinuousStates", |functions| functions.get_states, states)
    }

    /// Reads the typical magnitudes of the continuous states.
    pub(super) fn nominals(&mut self, nominals: &mut [f64]) -> Outcome {
        let call = "getNominalsOfContinuousStates";
        self.get_vector(call, |functions| functions.get_nominals, nominals)
    }

    /// Computes the derivatives of the continuous states by time.
    pub(super) fn derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Refusal> {
        let outcome = self.get_vector(F::DERIVATIVES, |f| f.get_derivatives, derivatives);
        self.refusal(outcome)
    }

    /// Computes the event indicators. One that is not a number has no sign, as if the model refused
    /// the states.
    pub(super) fn indicators(&mut self, indicators: &mut [f64]) -> Result<(), Refusal> {
        let call = "getEventIndicators";
        let outcome = self.get_vector(call, |f| f.get_indicators, indicators);
        self.refusal(outcome)?;
        indicators.iter().position(|value| value.is_nan()).map_or(Ok(()), |place| {
            let (number, count) = (place + 1, indicators.len());
            let text = format!("event indicator {number} of {count} is not a number");
            Err(Refusal::Discarded(CallFailure::answer(call, text)))
        })
    }

    /// Enters event mode from continuous-time mode.
    pub(super) fn enter_event_mode(&mut self) -> Outcome {
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.call_exchange("enterEventMode", |f, handle| unsafe { (f.enter_event_mode)(handle) })
    }

    /// Enters continuous-time mode from event mode.
    pub(super) fn enter_continuous_time_mode(&mut self) -> Outcome {
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.call_exchange("enterContinuousTimeMode", |functions, handle| unsafe {
            (functions.enter_continuous_time_mode)(handle)
        })
    }

    /// Updates the discrete states in event mode at a time (s), until they settle. Returns the last
    /// result, with all that has changed since the first one.
    pub(crate) fn settle(&mut self, time: f64) -> Result<EventInfo, CallFailure> {
        let (mut info, mut has_states, mut has_nominals) = (EventInfo::default(), false, false);
        for _ in 0..MOST_UPDATES {
            // SAFETY: the instance is alive.
            self.call(F::UPDATE, |functions, handle| unsafe {
                let status;
                (info, status) = functions.update(handle);
                status
            })?;
            if info.terminates {
                return Err(self.ending(time));
            }
            has_states |= info.changes_states;
            has_nominals |= info.changes_nominals;
            if !info.needs_another {
                info.next_event = next_event(info.next_event, time)
                    .map_err(|text| CallFailure::answer(F::UPDATE, text))?;
                info.changes_states = has_states;
                info.changes_nominals = has_nominals;
                return Ok(info);
            }
        }
        let time = rounded(time);
        let text = format!(
            "the discrete states do not settle at t = {time} s: after {MOST_UPDATES} updates they still need another one"
        );
        Err(CallFailure::answer(F::UPDATE, text))
    }

    /// Describes the end of the simulation by the model at a time, s.
    pub(super) fn ending(&mut self, time: f64) -> CallFailure {
        self.stopped(true, Some(time), "terminateSimulation")
    }

    /// Tells the model that a step of the integrator is complete.
    pub(super) fn complete_step(&mut self) -> Result<Completed, CallFailure> {
        let mut answer = Completed::default();
        // SAFETY: the instance is alive.
        self.call("completedIntegratorStep", |functions, handle| unsafe {
            let status;
            (answer, status) = functions.complete_step(handle);
            status
        })?;
        Ok(answer)
    }
}

/// Judges the time (s) of the next event that a unit announces at a time, s. There is no event at
/// infinity.
///
/// # Errors
/// Returns why there cannot be such an event.
fn next_event(next: Option<f64>, time: f64) -> Result<Option<f64>, String> {
    let Some(next) = next.filter(|next| *next != f64::INFINITY) else { return Ok(None) };
    let shown = rounded(time);
    if next.is_nan() {
        Err(format!(
            "it announces its next event (nextEventTime) at t = {shown} s for the time NaN"
        ))
    } else if next < time - 8.0 * f64::EPSILON * time.abs().max(1.0) {
        Err(format!(
            "it announces its next event (nextEventTime) at t = {shown} s for t = {} s, which is past",
            rounded(next)
        ))
    } else {
        Ok(Some(next))
    }
}
