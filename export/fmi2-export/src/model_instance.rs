//! A model bound to its variable table behind a trait that hides the model's type, for the shell.

use crate::call::State;
use crate::model::{Context, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
use crate::numbers::are_numbers;
use crate::table::{Access, Description, VariableTable};
use crate::types::Interface;
use model_description::ModelDescription;
use model_description::variable::{Causality, Variability, Variable, VariableKind};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Highest order of derivatives that fmi2SetRealInputDerivatives accepts.
pub const MAX_INPUT_DERIVATIVE_ORDER: usize = 3;

/// An input that is extrapolated during the next step: u(t) = u₀ + Σ u⁽ᵏ⁾ (t − t₀)ᵏ / k!.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Extrapolation {
    pub(crate) reference: usize,
    /// Value u₀ at the start of the step.
    pub(crate) base: f64,
    /// Derivatives u⁽ᵏ⁾ of order 1, 2, ….
    pub(crate) derivatives: [f64; MAX_INPUT_DERIVATIVE_ORDER],
}

impl Extrapolation {
    /// Value of the input at the time `dt` after the start of the step, by Horner's rule.
    pub(crate) fn at(&self, dt: f64) -> f64 {
        let mut sum = 0.0;
        for (i, derivative) in self.derivatives.iter().enumerate().rev() {
            sum = (derivative + sum) * dt / (i as f64 + 1.0);
        }
        self.base + sum
    }
}

/// The shell's part of the state that determines the future.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Progress {
    pub(crate) state: State,
    pub(crate) time: f64,
    pub(crate) start_time: f64,
    pub(crate) stop_time: Option<f64>,
    /// Whether the model was initialized with its present parameters.
    pub(crate) initialized: bool,
    /// Last step of co-simulation, or input that was set after it.
    pub(crate) last_event: LastEvent,
    pub(crate) extrapolations: Vec<Extrapolation>,
}

impl Default for Progress {
    fn default() -> Self {
        Self {
            state: State::Instantiated,
            time: 0.0,
            start_time: 0.0,
            stop_time: None,
            initialized: false,
            last_event: LastEvent::default(),
            extrapolations: Vec::new(),
        }
    }
}

impl Progress {
    /// Says why no instance can have this progress, or `None` if one can.
    fn problem<M>(
        &self,
        table: &VariableTable<M>,
        (interface, event_mode): (Interface, bool),
    ) -> Option<String> {
        let Self { state, time, start_time, stop_time, initialized, extrapolations, .. } = self;
        if !(time.is_finite() && start_time.is_finite() && !stop_time.is_some_and(f64::is_nan)) {
            return Some("it holds a time that is not a finite number".into());
        }
        let possible = match interface {
            Interface::ModelExchange => !matches!(state, State::StepComplete | State::StepFailed),
            Interface::CoSimulation => match state {
                State::EventMode => event_mode,
                _ => *state != State::ContinuousTimeMode,
            },
        };
        if *state == State::Fatal || !possible {
            return Some(format!("an instance cannot go on in state {}", state.name()));
        }
        let running =
            matches!(state, State::EventMode | State::ContinuousTimeMode | State::StepComplete);
        if running && !initialized {
            return Some("it is running but was not initialized".into());
        }
        let continuous = |input: &Extrapolation| {
            let entry = table.entries.get(input.reference);
            let right = entry.is_some_and(|entry| {
                let Variable { causality, variability, .. } = &entry.variable;
                matches!(entry.access, Access::Real(_))
                    && *causality == Causality::Input
                    && *variability == Variability::Continuous
            });
            right
                && input.base.is_finite()
                && input.derivatives.iter().all(|value| value.is_finite())
        };
        if extrapolations.len() > table.entries.len() || !extrapolations.iter().all(continuous) {
            return Some(
                "it holds derivatives of a variable that is not a continuous input".into(),
            );
        }
        None
    }
}

/// A model together with its variable table, seen without the model's type.
pub(crate) trait ModelInstance: Send {
    fn real(&mut self, reference: usize) -> Option<&mut f64>;
    /// Returns the value of an integer or enumeration variable.
    fn integer(&mut self, reference: usize) -> Option<i32>;
    /// Sets an integer or enumeration variable to a value that its declaration allows.
    fn set_integer(&mut self, reference: usize, value: i32);
    fn boolean(&mut self, reference: usize) -> Option<&mut bool>;
    fn string(&mut self, reference: usize) -> Option<&mut String>;

    /// Resets all variables to their start values; with `failed` it makes a new model.
    fn reset(&mut self, failed: bool);
    fn initialize(&mut self, context: &Context) -> Result<(), Failure>;
    fn calculate(&mut self, time: f64, last: LastEvent) -> Result<(), Failure>;
    /// Performs a step and leaves the inputs at their values at `to`.
    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &[Extrapolation],
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure>;

    fn save(&self, progress: &Progress) -> Result<Vec<u8>, Failure>;
    /// Restores a saved state for an instance of this interface, with or without event mode. On an
    /// error the model is unchanged.
    fn restore(&mut self, payload: &[u8], usage: (Interface, bool)) -> Result<Progress, Failure>;

    fn continuous_states(&self, states: &mut [f64]);
    fn set_continuous_states(&mut self, states: &[f64]);
    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure>;
    fn event_indicators(&self, indicators: &mut [f64]);
    fn partial_derivative(
        &mut self,
        time: f64,
        unknown_variable: usize,
        known_variable: usize,
    ) -> Result<f64, Failure>;
}

struct Bound<M> {
    model: M,
    table: VariableTable<M>,
}

/// Inputs of one step, for the model with its type.
struct Extrapolated<'a, M> {
    table: &'a VariableTable<M>,
    from: f64,
    inputs: &'a [Extrapolation],
}

impl<M> Inputs<M> for Extrapolated<'_, M> {
    fn advance(&self, model: &mut M, time: f64) {
        for input in self.inputs {
            if let Access::Real(field) = &self.table.entries[input.reference].access {
                *field(model) = input.at(time - self.from);
            }
        }
    }

    fn are_extrapolated(&self) -> bool {
        !self.inputs.is_empty()
    }
}

impl<M: Model> ModelInstance for Bound<M> {
    fn real(&mut self, reference: usize) -> Option<&mut f64> {
        match &self.table.entries.get(reference)?.access {
            Access::Real(field) => Some(field(&mut self.model)),
            _ => None,
        }
    }

    fn integer(&mut self, reference: usize) -> Option<i32> {
        match &self.table.entries.get(reference)?.access {
            Access::Integer(field) => Some((field.get)(&mut self.model)),
            _ => None,
        }
    }

    fn set_integer(&mut self, reference: usize, value: i32) {
        if let Some(Access::Integer(field)) =
            self.table.entries.get(reference).map(|entry| &entry.access)
        {
            (field.set)(&mut self.model, value);
        }
    }

    fn boolean(&mut self, reference: usize) -> Option<&mut bool> {
        match &self.table.entries.get(reference)?.access {
            Access::Boolean(field) => Some(field(&mut self.model)),
            _ => None,
        }
    }

    fn string(&mut self, reference: usize) -> Option<&mut String> {
        match &self.table.entries.get(reference)?.access {
            Access::String(field) => Some(field(&mut self.model)),
            _ => None,
        }
    }

    fn reset(&mut self, failed: bool) {
        if failed {
            self.model = M::new();
        } else {
            self.model.reset();
        }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        self.model.initialize(context)
    }

    fn calculate(&mut self, time: f64, last: LastEvent) -> Result<(), Failure> {
        self.model.calculate(time, last)
    }

    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &[Extrapolation],
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        let inputs = Extrapolated { table: &self.table, from, inputs };
        self.model.step(from, to, &inputs, log)?;
        inputs.advance(&mut self.model, to);
        Ok(())
    }

    fn save(&self, progress: &Progress) -> Result<Vec<u8>, Failure> {
        postcard::to_stdvec(&(progress, &self.model))
            .map_err(|error| Failure::Error(format!("the state cannot be saved: {error}")))
    }

    fn restore(&mut self, payload: &[u8], usage: (Interface, bool)) -> Result<Progress, Failure> {
        let unfit =
            |problem: String| Failure::Error(format!("the saved state does not fit: {problem}"));
        let ((progress, mut model), rest): ((Progress, M), _) =
            postcard::take_from_bytes(payload).map_err(|error| unfit(error.to_string()))?;
        if let Some(problem) = progress.problem(&self.table, usage) {
            return Err(unfit(problem));
        }
        if !rest.is_empty() {
            return Err(unfit(format!("{} bytes are left over", rest.len())));
        }
        if !are_numbers(&model) {
            return Err(unfit("it holds a value that is not a number".into()));
        }
        for entry in &self.table.entries {
            if let Some(problem) = entry.problem(&mut model) {
                return Err(unfit(problem));
            }
        }
        let Progress { time, start_time, state, initialized, .. } = progress;
        let failed = matches!(state, State::StepFailed | State::Error | State::Terminated);
        model.restored(Restoration {
            before: &mut self.model,
            time,
            start_time,
            initialized,
            failed,
        })?;
        self.model = model;
        Ok(progress)
    }

    fn continuous_states(&self, states: &mut [f64]) {
        self.model.continuous_states(states);
    }

    fn set_continuous_states(&mut self, states: &[f64]) {
        self.model.set_continuous_states(states);
    }

    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure> {
        self.model.new_discrete_states(time)
    }

    fn event_indicators(&self, indicators: &mut [f64]) {
        self.model.event_indicators(indicators);
    }

    fn partial_derivative(
        &mut self,
        time: f64,
        unknown_variable: usize,
        known_variable: usize,
    ) -> Result<f64, Failure> {
        self.model.partial_derivative(time, unknown_variable, known_variable)
    }
}

/// An FMU that a library exports.
pub struct Export {
    describe: fn() -> ModelDescription,
    pub(crate) create: fn() -> Box<dyn ModelInstance>,
    described: OnceLock<Described>,
}

/// Description of an FMU as importers see it, with its GUID.
pub(crate) struct Described {
    pub(crate) guid: String,
    pub(crate) description: Arc<ModelDescription>,
}

impl Export {
    /// Makes the export of the FMU whose model is `M`.
    pub const fn new<M: Model>() -> Self {
        Self { describe: describe::<M>, create: create::<M>, described: OnceLock::new() }
    }

    /// Returns the description, which is made once per process.
    pub(crate) fn described(&self) -> &Described {
        self.described.get_or_init(|| {
            let description = (self.describe)();
            Described { guid: description.guid(), description: Arc::new(description) }
        })
    }
}

fn create<M: Model>() -> Box<dyn ModelInstance> {
    Box::new(Bound { model: M::new(), table: M::description().table })
}

/// Returns the description of the FMU whose model is `M`. The start values of parameters and
/// inputs are those of `M::new()`.
pub fn describe<M: Model>() -> ModelDescription {
    let Description {
        name,
        description,
        documentation,
        version,
        model_exchange,
        event_indicators,
        default_experiment,
        table,
    } = M::description();
    let mut model = M::new();
    let mut variables = Vec::with_capacity(table.entries.len());
    for entry in table.entries {
        let mut variable = entry.variable;
        if !variable.is_calculated() {
            match (&mut variable.kind, &entry.access) {
                (VariableKind::Real { start, .. }, Access::Real(field)) => {
                    *start = Some(*field(&mut model));
                }
                (
                    VariableKind::Integer { start, .. } | VariableKind::Enumeration { start, .. },
                    Access::Integer(field),
                ) => {
                    *start = Some((field.get)(&mut model));
                }
                (VariableKind::Boolean { start }, Access::Boolean(field)) => {
                    *start = Some(*field(&mut model));
                }
                (VariableKind::String { start }, Access::String(field)) => {
                    *start = Some(field(&mut model).clone());
                }
                _ => unreachable!(
                    "VariableTable::push is called with a kind and a field of the same type only"
                ),
            }
        }
        variables.push(variable);
    }
    ModelDescription {
        name: name.into(),
        description: description.into(),
        documentation,
        version: version.into(),
        co_simulation: true,
        model_exchange,
        event_indicators,
        default_experiment,
        variables,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_extrapolation_is_the_taylor_polynomial() {
        let input = Extrapolation { reference: 0, base: 1.0, derivatives: [2.0, 6.0, -12.0] };
        let dt = 0.5;
        assert_eq!(input.at(dt), 1.0 + 2.0 * dt + 6.0 * dt * dt / 2.0 - 12.0 * dt * dt * dt / 6.0);
        assert_eq!(input.at(0.0), 1.0);
    }
}
