//! The life cycle of an instance from its initialization to its end, and its calculated variables.

use super::Instance;
use crate::call::{Outcome, State, error};
use crate::logger::Category;
use crate::model::{Context, LastEvent};
use crate::progress::Progress;
use crate::types::{FmiStatus, Interface};
use std::mem;

impl Instance {
    pub(crate) fn setup_experiment(
        &mut self,
        start: f64,
        stop: Option<f64>,
        tolerance: Option<f64>,
    ) -> Outcome {
        if !start.is_finite() {
            return error(format!("start time {start} is not finite"));
        }
        if let Some(stop) = stop
            && (stop.is_nan() || stop < start)
        {
            return error(format!("stop time {stop} is not after the start time {start}"));
        }
        if let Some(tolerance) = tolerance
            && !(tolerance.is_finite() && tolerance >= 0.0)
        {
            return error(format!("tolerance {tolerance} is not a positive number"));
        }
        let progress = &mut self.progress;
        (progress.time, progress.start_time, progress.stop_time) = (start, start, stop);
        Ok(())
    }

    pub(crate) fn enter_initialization_mode(&mut self) {
        self.progress.state = State::InitializationMode;
        self.progress.initialized = false;
        self.note_set_inputs();
    }

    pub(crate) fn exit_initialization_mode(&mut self) -> Outcome {
        self.initialize()?;
        self.warn_of_unused();
        self.progress.state = match self.interface {
            Interface::CoSimulation if !self.stops.event_mode => State::StepComplete,
            _ => State::EventMode,
        };
        self.logger.log(Category::Events, "initialized");
        Ok(())
    }

    pub(crate) fn terminate(&mut self) {
        self.progress.state = State::Terminated;
        self.logger.log(Category::Events, "terminated");
    }

    /// Brings the instance back to its state after fmi2Instantiate, apart from the logging and the
    /// saved states.
    pub(crate) fn reset(&mut self) {
        self.model.reset(self.progress.state == State::Error);
        let extrapolations = mem::take(&mut self.progress.extrapolations);
        self.progress = Progress { extrapolations, ..Progress::default() };
        self.progress.extrapolations.clear();
        self.stale = true;
        self.last_step = FmiStatus::Ok;
        self.has_ended = false;
        self.logger.log(Category::Events, "reset");
    }

    /// Initializes the model with the parameters, unless this was done since the last of them was
    /// set.
    pub(super) fn initialize(&mut self) -> Outcome {
        if !self.progress.initialized {
            let context = Context {
                start_time: self.progress.start_time,
                stop_time: self.progress.stop_time,
                resources: self.resources.as_deref(),
            };
            self.model.initialize(&context)?;
            self.progress.initialized = true;
            self.stale = true;
        }
        Ok(())
    }

    /// Updates the calculated variables. Before initialization and after an error they keep their
    /// values, so that they can be read all the same.
    pub(super) fn refresh(&mut self) -> Outcome {
        if matches!(self.progress.state, State::Instantiated | State::Error) {
            return Ok(());
        }
        if self.progress.state == State::InitializationMode {
            self.initialize()?;
        }
        if self.stale {
            let last = match self.interface {
                Interface::ModelExchange => LastEvent::InputSet,
                Interface::CoSimulation => self.progress.last_event,
            };
            self.model.calculate(self.progress.time, last)?;
            self.stale = false;
        }
        Ok(())
    }
}
