//! One instance of an FMU: the part of the shell that handles no pointers.

use crate::call::{Call, Outcome, State, error};
use crate::logger::{Category, Logger};
use crate::model::{Context, EventInfo, Failure, LastEvent};
use crate::model_instance::{
    Export, Extrapolation, MAX_INPUT_DERIVATIVE_ORDER, ModelInstance, Progress,
};
use crate::pointer::Room;
use crate::saved;
use crate::scalar::Scalar;
use crate::types::{FmiStatus, Interface};
use model_description::ModelDescription;
use model_description::variable::{Causality, Variability, Variable, VariableKind};
use std::any::Any;
use std::ffi::CString;
use std::mem;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

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

/// One instance of an FMU with everything that the shell keeps for it.
pub(crate) struct Instance {
    model: Box<dyn ModelInstance>,
    description: Arc<ModelDescription>,
    /// Value references of each state and its derivative.
    states: Vec<(usize, usize)>,
    guid: String,
    interface: Interface,
    logger: Logger,
    resources: Option<PathBuf>,
    /// Progress of the simulation. Its list of extrapolations has room for every variable, so
    /// nothing is allocated between steps.
    progress: Progress,
    /// Whether calculated variables are older than the state, the inputs or the time.
    stale: bool,
    last_step: FmiStatus,
    /// Saved states handed out by fmi2GetFMUstate; the importer holds their addresses.
    #[expect(clippy::vec_box, reason = "the address is the importer's handle and must not move")]
    saved: Vec<Box<Saved>>,
    /// Texts handed out by the last fmi2GetString.
    strings: Vec<CString>,
}

/// A saved state. It is never empty, so every saved state has its own address.
pub(crate) struct Saved(Box<[u8]>);

/// Arguments of fmi2Instantiate, apart from the choice of the FMU.
pub(crate) struct Setting {
    pub(crate) guid: String,
    pub(crate) interface: Interface,
    pub(crate) logger: Logger,
    pub(crate) resources: Option<PathBuf>,
}

/// Access to the variables of an instance by the type of their value.
pub(crate) trait Typed: Scalar {
    /// Returns the result of `look` for the variable's value, or `None` if the variable has another
    /// type.
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R>;
    /// Sets the variable, which must have this type.
    fn put(self, model: &mut dyn ModelInstance, reference: usize);
}

impl Typed for f64 {
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R> {
        model.real(reference).map(|value| look(value))
    }
    fn put(self, model: &mut dyn ModelInstance, reference: usize) {
        if let Some(field) = model.real(reference) {
            *field = self;
        }
    }
}

impl Typed for i32 {
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R> {
        model.integer(reference).map(|value| look(&value))
    }
    fn put(self, model: &mut dyn ModelInstance, reference: usize) {
        model.set_integer(reference, self);
    }
}

impl Typed for bool {
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R> {
        model.boolean(reference).map(|value| look(value))
    }
    fn put(self, model: &mut dyn ModelInstance, reference: usize) {
        if let Some(field) = model.boolean(reference) {
            *field = self;
        }
    }
}

impl Typed for String {
    fn look<R>(
        model: &mut dyn ModelInstance,
        reference: usize,
        look: impl FnOnce(&Self) -> R,
    ) -> Option<R> {
        model.string(reference).map(|value| look(value))
    }
    fn put(self, model: &mut dyn ModelInstance, reference: usize) {
        if let Some(field) = model.string(reference) {
            *field = self;
        }
    }
}

impl Instance {
    pub(crate) fn new(
        export: &Export,
        description: Arc<ModelDescription>,
        setting: Setting,
    ) -> Self {
        let Setting { guid, interface, logger, resources } = setting;
        let states = description.states();
        let mut progress = Progress::default();
        progress.extrapolations.reserve(description.variables.len());
        Self {
            model: (export.create)(),
            states,
            description,
            guid,
            interface,
            logger,
            resources,
            progress,
            stale: true,
            last_step: FmiStatus::Ok,
            saved: Vec::new(),
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
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            self.permit(call)?;
            body(self)
        }));
        match outcome {
            Ok(Ok(())) => FmiStatus::Ok,
            Ok(Err(Failure::Discard(problem))) => {
                self.logger.log(Category::Discard, &format!("{}: {problem}", call.name));
                FmiStatus::Discard
            }
            Ok(Err(Failure::Error(problem))) => {
                if !call.leaves_state {
                    self.progress.state = State::Error;
                }
                self.logger.log(Category::Error, &format!("{}: {problem}", call.name));
                FmiStatus::Error
            }
            Err(panic) => {
                self.progress.state = State::Fatal;
                let text =
                    format!("{}: defect in the FMU: {}", call.name, panic_text(panic.as_ref()));
                self.logger.log(Category::Fatal, &text);
                // Dropping the panic's payload could run code of the model again.
                mem::forget(panic);
                FmiStatus::Fatal
            }
        }
    }

    fn permit(&self, call: &Call) -> Outcome {
        if call.interface.is_some_and(|interface| interface != self.interface) {
            let interface = match self.interface {
                Interface::ModelExchange => "model exchange",
                Interface::CoSimulation => "co-simulation",
            };
            return error(format!("not available, because this instance was made for {interface}"));
        }
        if call.allowed_in(self.progress.state) {
            return Ok(());
        }
        error(format!("not allowed in state {}", self.progress.state.name()))
    }

    pub(crate) fn logger(&mut self) -> &mut Logger {
        &mut self.logger
    }

    pub(crate) fn warn(&self, text: &str) {
        self.logger.log(Category::Warning, text);
    }

    // Life cycle

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
    }

    pub(crate) fn exit_initialization_mode(&mut self) -> Outcome {
        self.initialize()?;
        self.progress.state = match self.interface {
            Interface::ModelExchange => State::EventMode,
            Interface::CoSimulation => State::StepComplete,
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
        self.logger.log(Category::Events, "reset");
    }

    /// Initializes the model with the parameters, unless this was done since the last of them was
    /// set.
    fn initialize(&mut self) -> Outcome {
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

    /// Updates the calculated variables. After an error they keep their values, so that they can
    /// still be read.
    fn refresh(&mut self) -> Outcome {
        if self.progress.state == State::Error {
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

    // Variables

    fn variable(&self, reference: u32) -> Result<&Variable, Failure> {
        self.description.variables.get(reference as usize).map_or_else(
            || {
                error(format!(
                    "value reference {reference} does not exist: {} is the last",
                    self.description.variables.len() - 1
                ))
            },
            Ok,
        )
    }

    /// Says why there is no field of type `T` for the value reference.
    fn misfit<T: Typed>(&self, reference: u32) -> Failure {
        match self.variable(reference) {
            Ok(Variable { name, .. }) => Failure::Error(format!(
                "'{name}' (value reference {reference}) is not of type {}",
                T::TYPE
            )),
            Err(failure) => failure,
        }
    }

    fn expect_type<T: Typed>(&mut self, reference: u32) -> Outcome {
        T::look(self.model.as_mut(), reference as usize, |_| ())
            .ok_or_else(|| self.misfit::<T>(reference))
    }

    /// Gives the values of the variables to `sink`, each with its position in `references`.
    pub(crate) fn get<T: Typed>(
        &mut self,
        references: &[u32],
        mut sink: impl FnMut(usize, &T),
    ) -> Outcome {
        let calculated = |&reference: &u32| {
            self.description.variables.get(reference as usize).is_some_and(Variable::is_calculated)
        };
        if references.iter().any(calculated) {
            self.refresh()?;
        }
        for (i, &reference) in references.iter().enumerate() {
            let variable = self.description.variables.get(reference as usize);
            let shown = T::look(self.model.as_mut(), reference as usize, |value| {
                let problem = variable.and_then(|variable| value.unpresentable(&variable.kind));
                if problem.is_none() {
                    sink(i, value);
                }
                problem
            });
            match shown {
                Some(None) => (),
                Some(Some(problem)) => return Err(self.not_presentable(reference, problem)),
                None => return Err(self.misfit::<T>(reference)),
            }
        }
        Ok(())
    }

    /// Reports a calculated value that cannot be given out. In model exchange it is only discarded,
    /// as it may come from an integrator's trial state.
    fn not_presentable(&self, reference: u32, problem: &str) -> Failure {
        let name = self.variable(reference).map_or("", |variable| &variable.name);
        let text = format!("'{name}' {problem}");
        match self.interface {
            Interface::ModelExchange => Failure::Discard(text),
            Interface::CoSimulation => Failure::Error(text),
        }
    }

    /// Sets all variables, or none if one value is refused.
    pub(crate) fn set<T: Typed + std::fmt::Debug>(
        &mut self,
        references: &[u32],
        value: impl Fn(usize) -> Result<T, String>,
    ) -> Outcome {
        for (i, &reference) in references.iter().enumerate() {
            self.expect_type::<T>(reference)?;
            let variable = self.variable(reference)?;
            self.settable(variable)?;
            let name = &variable.name;
            let value =
                value(i).map_err(|problem| Failure::Error(format!("'{name}': {problem}")))?;
            if let Some(problem) = value.problem(&variable.kind) {
                return error(format!("'{name}' = {value:?} {problem}; it keeps its value"));
            }
        }
        if self.progress.state == State::StepComplete && !references.is_empty() {
            // Parameters cannot be set in this state, so these are inputs.
            self.stale |= self.progress.last_event != LastEvent::InputSet;
            self.progress.last_event = LastEvent::InputSet;
        }
        for (i, &reference) in references.iter().enumerate() {
            let value = value(i).map_err(Failure::Error)?;
            let same =
                T::look(self.model.as_mut(), reference as usize, |before| before.same(&value));
            if same != Some(true) {
                value.put(self.model.as_mut(), reference as usize);
                self.stale = true;
                if self.description.variables[reference as usize].causality == Causality::Parameter
                {
                    self.progress.initialized = false;
                }
            }
        }
        Ok(())
    }

    /// Checks that a variable may be set now. A discrete Real input is accepted in continuous-time
    /// mode too, although the standard has it set in event mode, because FMPy sets all inputs
    /// whenever it asks for event indicators. It has no effect until the next event.
    fn settable(&self, variable: &Variable) -> Outcome {
        let name = &variable.name;
        let state = self.progress.state;
        match variable.causality {
            Causality::Parameter
                if !matches!(state, State::Instantiated | State::InitializationMode) =>
            {
                error(format!(
                    "'{name}' is a fixed parameter: it can be set before and in initialization mode only"
                ))
            }
            Causality::Parameter | Causality::Input => Ok(()),
            _ => error(format!("'{name}' is calculated by the FMU and cannot be set")),
        }
    }

    /// Returns texts that stay valid for the importer until the next call of this function.
    pub(crate) fn get_strings(&mut self, references: &[u32]) -> Result<&[CString], Failure> {
        let mut strings = mem::take(&mut self.strings);
        strings.clear();
        self.get::<String>(references, |_, text| {
            strings.push(CString::new(text.replace('\0', " ")).unwrap_or_default());
        })?;
        self.strings = strings;
        Ok(&self.strings)
    }

    // Saved states

    /// Returns a handle of the present state. With `reuse`, the state behind that handle is
    /// overwritten.
    pub(crate) fn save(&mut self, reuse: Option<*const Saved>) -> Result<*const Saved, Failure> {
        let payload = self.model.save(&self.progress)?;
        let bytes = saved::wrap(&self.guid, self.interface, &payload);
        match reuse {
            Some(handle) => {
                let position = self.find(handle)?;
                self.saved[position].0 = bytes;
                Ok(handle)
            }
            None => Ok(self.keep(bytes)),
        }
    }

    fn keep(&mut self, bytes: Box<[u8]>) -> *const Saved {
        let saved = Box::new(Saved(bytes));
        let handle = &raw const *saved;
        self.saved.push(saved);
        handle
    }

    fn find(&self, handle: *const Saved) -> Result<usize, Failure> {
        let position = self.saved.iter().position(|saved| std::ptr::eq(&raw const **saved, handle));
        position.map_or_else(
            || {
                error(
                    "this FMUstate was not made by this instance, or was freed; \
                     carry states between instances with fmi2SerializeFMUstate",
                )
            },
            Ok,
        )
    }

    pub(crate) fn restore(&mut self, handle: *const Saved) -> Outcome {
        let position = self.find(handle)?;
        let payload = saved::unwrap(&self.guid, self.interface, &self.saved[position].0)
            .map_err(Failure::Error)?;
        self.progress = self.model.restore(payload, self.interface)?;
        self.progress.extrapolations.reserve(self.description.variables.len());
        self.stale = true;
        self.last_step = FmiStatus::Ok;
        self.logger.log(Category::Events, "state restored");
        Ok(())
    }

    pub(crate) fn free_saved(&mut self, handle: *const Saved) -> Outcome {
        let position = self.find(handle)?;
        self.saved.swap_remove(position);
        Ok(())
    }

    pub(crate) fn serialized(&self, handle: *const Saved) -> Result<&[u8], Failure> {
        Ok(&self.saved[self.find(handle)?].0)
    }

    pub(crate) fn deserialize(&mut self, bytes: &[u8]) -> Result<*const Saved, Failure> {
        saved::unwrap(&self.guid, self.interface, bytes).map_err(Failure::Error)?;
        Ok(self.keep(bytes.into()))
    }

    // Co-simulation

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

    /// Performs a step. The derivatives of inputs hold for one step. The step begins exactly where
    /// the last one ended, however the importer accumulates its time.
    pub(crate) fn do_step(&mut self, point: f64, size: f64) -> Outcome {
        if !point.is_finite() || !size.is_finite() || size < 0.0 {
            return error(format!("cannot step from {point} s by {size} s"));
        }
        let from = self.progress.time;
        let largest = from.abs().max(point.abs()).max(size);
        let tolerance = (TIME_TOLERANCE * largest).min(LONGEST_TOLERANCE).max(ROUNDING * largest);
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
                "a step to {to} s goes beyond the stop time {stop} s given to fmi2SetupExperiment"
            ));
        }
        for input in &mut self.progress.extrapolations {
            input.base = *self.model.real(input.reference).expect("checked when it was set");
        }
        let logger = &self.logger;
        let mut log = |text: &str| logger.log(Category::Warning, text);
        match self.model.step(from, to, &self.progress.extrapolations, &mut log) {
            Ok(()) => {
                if to > from {
                    self.progress.last_event = LastEvent::Step;
                }
                self.progress.time = to;
                self.progress.extrapolations.clear();
                self.stale = true;
                self.last_step = FmiStatus::Ok;
                Ok(())
            }
            Err(failure) => {
                self.last_step = match failure {
                    Failure::Discard(_) => FmiStatus::Discard,
                    Failure::Error(_) => FmiStatus::Error,
                };
                self.progress.state = State::StepFailed;
                self.stale = true;
                Err(failure)
            }
        }
    }

    pub(crate) fn last_step(&self) -> FmiStatus {
        self.last_step
    }

    pub(crate) fn time(&self) -> f64 {
        self.progress.time
    }

    // Model exchange

    pub(crate) fn set_time(&mut self, time: f64) -> Outcome {
        if !time.is_finite() {
            return error(format!("time {time} is not finite"));
        }
        self.stale |= time != self.progress.time;
        self.progress.time = time;
        Ok(())
    }

    pub(crate) fn enter_event_mode(&mut self) {
        self.progress.state = State::EventMode;
    }

    pub(crate) fn enter_continuous_time_mode(&mut self) {
        self.progress.state = State::ContinuousTimeMode;
    }

    pub(crate) fn new_discrete_states(&mut self) -> Result<EventInfo, Failure> {
        let info = self.model.new_discrete_states(self.progress.time)?;
        self.stale = true;
        Ok(info)
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
        nominals.fill(self.states.iter().map(|&(state, _)| match variables[state].kind {
            VariableKind::Real { nominal: Some(nominal), .. } => nominal,
            _ => 1.0,
        }));
        Ok(())
    }

    pub(crate) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        mut derivative: Room<f64>,
    ) -> Outcome {
        if self.states.is_empty() {
            return error("this FMU provides no directional derivatives");
        }
        for &reference in unknowns {
            self.expect_type::<f64>(reference)?;
            let variable = self.variable(reference)?;
            if !variable.is_calculated() {
                return error(format!(
                    "'{}' is a parameter or an input, so it has no derivative",
                    variable.name
                ));
            }
        }
        for &reference in knowns {
            self.expect_type::<f64>(reference)?;
            let variable = self.variable(reference)?;
            let is_state = self.states.iter().any(|&(state, _)| state == reference as usize);
            if variable.causality != Causality::Input && !is_state {
                return error(format!("'{}' is neither an input nor a state", variable.name));
            }
        }
        self.refresh()?;
        let time = self.progress.time;
        for (i, &unknown) in unknowns.iter().enumerate() {
            let mut sum = 0.0;
            for (&known_variable, seed) in knowns.iter().zip(seed) {
                let (unknown, known_variable) = (unknown as usize, known_variable as usize);
                sum += self.model.partial_derivative(time, unknown, known_variable)? * seed;
            }
            derivative.put(i, sum);
        }
        Ok(())
    }
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
