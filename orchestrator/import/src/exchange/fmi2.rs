//! Model exchange by FMI 2.0.

#![allow(unsafe_code)]

use super::instance::Exchange;
use super::model::{Completed, ContinuousModel, EventInfo, Layout, Refusal};
use crate::fmi;
use crate::folder::TemporaryFolder;
use crate::functions::{ExchangeFunctions, Functions};
use crate::library::FmuInstance;
use crate::log::Log;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use std::rc::Rc;

/// Makes an instance with the name in its log: for model exchange if there is a `layout`, otherwise
/// for co-simulation, for which the functions must have been loaded. `folder` holds the unpacked
/// archive, if it would vanish otherwise.
pub(crate) fn instantiate(
    functions: Functions,
    log: Rc<Log>,
    (guid, resources): (&str, &str),
    folder: Option<Rc<TemporaryFolder>>,
    layout: Option<Layout>,
) -> Result<Box<dyn Instance>, String> {
    let mut instance = FmuInstance::new(functions, log, guid, resources, folder)?;
    let Some(layout) = layout else { return Ok(Box::new(instance)) };
    instance.tolerance = Some(layout.tolerance);
    Ok(Box::new(Exchange::new(instance, layout)))
}

impl FmuInstance {
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

    fn call_mode(
        &mut self,
        call: &'static str,
        function: fn(&ExchangeFunctions) -> fmi::Plain,
    ) -> Outcome {
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.call_exchange(call, |functions, handle| unsafe { function(functions)(handle) })
    }

    fn refusal(&self, outcome: Outcome) -> Result<(), Refusal> {
        let refusal = if self.is_discarded { Refusal::Discarded } else { Refusal::Failed };
        outcome.map_err(refusal)
    }
}

impl ContinuousModel for FmuInstance {
    fn set_time(&mut self, time: f64) -> Outcome {
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.call_exchange("setTime", |functions, handle| unsafe {
            (functions.set_time)(handle, time)
        })
    }

    fn set_states(&mut self, states: &[f64]) -> Result<(), Refusal> {
        // SAFETY: the instance is alive, and the array has the length that is passed.
        let outcome = self.call_exchange("setContinuousStates", |functions, handle| unsafe {
            (functions.set_states)(handle, states.as_ptr(), states.len())
        });
        self.refusal(outcome)
    }

    fn states(&mut self, states: &mut [f64]) -> Outcome {
        self.get_vector("getContinuousStates", |functions| functions.get_states, states)
    }

    fn nominals(&mut self, nominals: &mut [f64]) -> Outcome {
        let call = "getNominalsOfContinuousStates";
        self.get_vector(call, |functions| functions.get_nominals, nominals)
    }

    fn derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Refusal> {
        let get = |functions: &ExchangeFunctions| functions.get_derivatives;
        let outcome = self.get_vector("getDerivatives", get, derivatives);
        self.refusal(outcome)
    }

    fn indicators(&mut self, indicators: &mut [f64]) -> Result<(), Refusal> {
        let get = |functions: &ExchangeFunctions| functions.get_indicators;
        let outcome = self.get_vector("getEventIndicators", get, indicators);
        self.refusal(outcome)
    }

    fn enter_event_mode(&mut self) -> Outcome {
        self.call_mode("enterEventMode", |functions| functions.enter_event_mode)
    }

    fn new_discrete_states(&mut self) -> Result<EventInfo, CallFailure> {
        let mut info = fmi::EventInfo::default();
        // SAFETY: the instance is alive, and the structure is valid for the call.
        self.call_exchange("newDiscreteStates", |functions, handle| unsafe {
            (functions.new_discrete_states)(handle, &raw mut info)
        })?;
        let is_true = |value| value != fmi::FALSE;
        Ok(EventInfo {
            needs_another: is_true(info.new_discrete_states_needed),
            terminates: is_true(info.terminate_simulation),
            changes_nominals: is_true(info.nominals_of_states_changed),
            changes_states: is_true(info.values_of_states_changed),
            next_event: is_true(info.next_event_time_defined).then_some(info.next_event_time),
        })
    }

    fn enter_continuous_time_mode(&mut self) -> Outcome {
        let get = |functions: &ExchangeFunctions| functions.enter_continuous_time_mode;
        self.call_mode("enterContinuousTimeMode", get)
    }

    fn completed_step(&mut self) -> Result<Completed, CallFailure> {
        let (mut event, mut terminate) = (fmi::FALSE, fmi::FALSE);
        // SAFETY: the instance is alive, and both pointers are valid for the call.
        self.call_exchange("completedIntegratorStep", |functions, handle| unsafe {
            let call = functions.completed_integrator_step;
            call(handle, fmi::TRUE, &raw mut event, &raw mut terminate)
        })?;
        Ok(Completed {
            enters_event_mode: event != fmi::FALSE,
            terminates: terminate != fmi::FALSE,
        })
    }

    fn message(&mut self) -> Option<String> {
        Self::message(self)
    }
}
