//! The calls of model exchange.

#![allow(unsafe_code)]

use super::model::{ContinuousModel, Refusal};
use crate::fmi;
use crate::functions::{Completed, EventInfo, ExchangeFunctions, Functions, NOT_OFFERED, Table};
use crate::library::FmuInstance;
use fmi_master::instance::{CallFailure, Outcome};
use std::ffi::c_int;

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

    /// Computes the event indicators.
    pub(super) fn indicators(&mut self, indicators: &mut [f64]) -> Result<(), Refusal> {
        let outcome = self.get_vector("getEventIndicators", |f| f.get_indicators, indicators);
        self.refusal(outcome)
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

    /// Updates the discrete states in event mode.
    pub(crate) fn update(&mut self) -> Result<EventInfo, CallFailure> {
        let mut info = EventInfo::default();
        // SAFETY: the instance is alive.
        self.call(F::UPDATE, |functions, handle| unsafe {
            let status;
            (info, status) = functions.update(handle);
            status
        })?;
        Ok(info)
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
