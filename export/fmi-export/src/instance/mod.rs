//! One instance of an FMU: the part of the shell that handles no pointers.
//!
//! This file makes the instance and runs its calls: the states of the standard, failures, panics.
//! Its children do the work of the calls, each for one part of the standard.

mod co_simulation;
mod life_cycle;
mod model_exchange;
mod saved_states;
mod unused;
mod variables;

use crate::call::{Call, Outcome, State, error};
use crate::logger::{Category, Logger};
use crate::model::Failure;
use crate::model_instance::{Export, ModelInstance};
use crate::progress::Progress;
use crate::types::{FmiStatus, Interface};
use model_description::{ModelDescription, Version};
use std::any::Any;
use std::ffi::CString;
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) use saved_states::Saved;
pub(crate) use variables::Typed;

/// One instance of an FMU with everything that the shell keeps for it.
pub(crate) struct Instance {
    model: Box<dyn ModelInstance>,
    description: Arc<ModelDescription>,
    /// Value references of each state and its derivative.
    states: Vec<(usize, usize)>,
    /// Room for the values of the states.
    trial: Vec<f64>,
    guid: String,
    version: Version,
    interface: Interface,
    stops: Stops,
    logger: Logger,
    resources: Option<PathBuf>,
    /// Progress of the simulation. Its list of extrapolations has room for every variable, so
    /// nothing is allocated between steps.
    progress: Progress,
    /// Whether calculated variables are older than the state, the inputs or the time.
    stale: bool,
    last_step: FmiStatus,
    /// Whether the last step ended the simulation.
    has_ended: bool,
    /// Saved states handed out by fmi2GetFMUstate; the importer holds their addresses.
    #[expect(clippy::vec_box, reason = "the address is the importer's handle and must not move")]
    saved: Vec<Box<Saved>>,
    /// Inputs that were set before initialization mode.
    set_inputs: Vec<usize>,
    /// Texts handed out by the last call for texts.
    strings: Vec<CString>,
    /// Room for the event indicators, which are variables in FMI 3.0 alone.
    indicators: Vec<f64>,
}

/// What the importer of a co-simulation instance of FMI 3.0 can do at events.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stops {
    /// Whether the importer uses event mode.
    pub(crate) event_mode: bool,
    /// Whether a step may end before its end.
    pub(crate) early_return: bool,
}

/// Arguments of the instantiation, apart from the choice of the FMU.
pub(crate) struct Setting {
    pub(crate) guid: String,
    pub(crate) version: Version,
    pub(crate) interface: Interface,
    pub(crate) stops: Stops,
    pub(crate) logger: Logger,
    pub(crate) resources: Option<PathBuf>,
}

impl Instance {
    pub(crate) fn new(
        export: &Export,
        description: Arc<ModelDescription>,
        setting: Setting,
    ) -> Self {
        let Setting { guid, version, interface, stops, logger, resources } = setting;
        let states = description.states();
        let indicators = if version == Version::Fmi3 { description.event_indicators } else { 0 };
        let mut progress = Progress::default();
        progress.extrapolations.reserve(description.variables.len());
        Self {
            model: (export.create)(),
            indicators: vec![0.0; indicators],
            trial: vec![0.0; states.len()],
            states,
            description,
            guid,
            version,
            interface,
            stops,
            logger,
            resources,
            progress,
            stale: true,
            last_step: FmiStatus::Ok,
            has_ended: false,
            saved: Vec::new(),
            set_inputs: Vec::new(),
            strings: Vec::new(),
        }
    }

    /// Runs the body of a call: it refuses a call in a wrong state, reports failures, and stops
    /// every panic here.
    pub(crate) fn run(
        &mut self,
        call: &Call,
        body: impl FnOnce(&mut Self) -> Outcome,
    ) -> FmiStatus {
        if self.progress.state == State::Fatal {
            return FmiStatus::Fatal;
        }
        let name = call.row(self.version).name;
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            self.permit(call)?;
            body(self)
        }));
        match outcome {
            Ok(Ok(())) => FmiStatus::Ok,
            Ok(Err(Failure::Discard(problem))) => {
                self.logger.log(Category::Discard, &format!("{name}: {problem}"));
                FmiStatus::Discard
            }
            Ok(Err(Failure::Ended { reason, .. })) => {
                self.logger.log(Category::Discard, &reason);
                FmiStatus::Discard
            }
            Ok(Err(Failure::Error(problem))) => {
                if !call.leaves_state {
                    self.progress.state = State::Error;
                }
                self.logger.log(Category::Error, &format!("{name}: {problem}"));
                FmiStatus::Error
            }
            Err(panic) => {
                self.progress.state = State::Fatal;
                let text = format!("{}: defect in the FMU: {}", name, panic_text(panic.as_ref()));
                self.logger.log(Category::Fatal, &text);
                // Dropping the panic's payload could run code of the model again.
                mem::forget(panic);
                FmiStatus::Fatal
            }
        }
    }

    pub(crate) fn permit(&self, call: &Call) -> Outcome {
        let row = call.row(self.version);
        if row.interface.is_some_and(|interface| interface != self.interface) {
            let interface = match self.interface {
                Interface::ModelExchange => "model exchange",
                Interface::CoSimulation => "co-simulation",
            };
            return error(format!("not available, because this instance was made for {interface}"));
        }
        if row.allowed_in(self.progress.state) {
            return Ok(());
        }
        error(format!("not allowed in state {}", self.progress.state.name()))
    }

    pub(crate) fn logger(&mut self) -> &mut Logger {
        &mut self.logger
    }

    pub(crate) fn warn(&mut self, text: &str) {
        self.logger.log(Category::Warning, text);
    }
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
