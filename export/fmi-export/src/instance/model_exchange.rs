//! Events, and model exchange: time and the continuous states that the importer integrates.

use super::Instance;
use crate::call::{Outcome, State, error};
use crate::model::{EventInfo, Failure, LastEvent};
use crate::pointer::Room;
use crate::types::Interface;

impl Instance {
    pub(crate) fn set_time(&mut self, time: f64) -> Outcome {
        if !time.is_finite() {
            return error(format!("time {time} is not finite"));
        }
        self.stale |= time != self.progress.time;
        self.progress.time = time;
        Ok(())
    }

    pub(crate) fn enter_event_mode(&mut self) -> Outcome {
        if self.interface == Interface::CoSimulation && !self.stops.event_mode {
            return error("not available, because this instance was made without event mode");
        }
        self.progress.state = State::EventMode;
        Ok(())
    }

    pub(crate) fn enter_step_mode(&mut self) {
        self.progress.state = State::StepComplete;
    }

    pub(crate) fn enter_continuous_time_mode(&mut self) {
        self.progress.state = State::ContinuousTimeMode;
    }

    /// Handles the event. In co-simulation, a due tick is evaluated with the present inputs.
    pub(crate) fn new_discrete_states(&mut self) -> Result<EventInfo, Failure> {
        if self.interface == Interface::CoSimulation {
            if self.progress.last_event == LastEvent::Step {
                let sets_inputs = self.progress.sets_inputs;
                self.stale = true;
                self.progress.last_event =
                    if sets_inputs { LastEvent::Event } else { LastEvent::InputSet };
            }
            self.refresh()?;
            let next_event_time = self.next_event()?;
            return Ok(EventInfo { next_event_time, ..EventInfo::default() });
        }
        let info = self.model.new_discrete_states(self.progress.time)?;
        self.stale = true;
        Ok(info)
    }

    /// Returns the numbers of continuous states and event indicators.
    pub(crate) fn sizes(&self) -> (usize, usize) {
        (self.states.len(), self.description.event_indicators)
    }

    fn expect_length(what: &str, given: usize, expected: usize) -> Outcome {
        if given == expected {
            return Ok(());
        }
        error(format!("room for {given} {what}, but the FMU has {expected}"))
    }

    pub(crate) fn set_continuous_states(&mut self, states: &[f64]) -> Outcome {
        Self::expect_length("continuous states", states.len(), self.states.len())?;
        if let Some(i) = states.iter().position(|x| !x.is_finite()) {
            let name = &self.description.variables[self.states[i].0].name;
            // This is no error: an integrator that went too far tries a smaller step.
            return Err(Failure::Discard(format!(
                "state '{name}' = {} is not finite; it keeps its value",
                states[i]
            )));
        }
        self.model.set_continuous_states(states);
        self.stale = true;
        Ok(())
    }

    pub(crate) fn continuous_states(&mut self, states: Room<f64>) -> Outcome {
        Self::expect_length("continuous states", states.len(), self.states.len())?;
        if self.progress.state == State::InitializationMode {
            self.initialize()?;
        }
        self.model.continuous_states(states.zeroed());
        Ok(())
    }

    pub(crate) fn derivatives(&mut self, mut derivatives: Room<f64>) -> Outcome {
        Self::expect_length("derivatives", derivatives.len(), self.states.len())?;
        self.refresh()?;
        derivatives.fill(self.states.iter().map(|&(_, reference)| {
            *self.model.real(reference).expect("only a Real is a derivative")
        }));
        Ok(())
    }

    pub(crate) fn event_indicators(&mut self, indicators: Room<f64>) -> Outcome {
        Self::expect_length(
            "event indicators",
            indicators.len(),
            self.description.event_indicators,
        )?;
        self.refresh()?;
        self.model.event_indicators(indicators.zeroed());
        Ok(())
    }

    pub(crate) fn nominals(&self, mut nominals: Room<f64>) -> Outcome {
        Self::expect_length("nominal values", nominals.len(), self.states.len())?;
        let variables = &self.description.variables;
        nominals.fill(self.states.iter().map(|&(state, _)| variables[state].nominal()));
        Ok(())
    }
}
