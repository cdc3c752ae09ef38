//! A model bound to its variable table behind a trait that hides the model's type, for the shell.

use crate::call::State;
use crate::model::{Context, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
use crate::numbers::are_numbers;
use crate::progress::{Extrapolation, Progress};
use crate::table::{Access, Description, VariableTable};
use crate::types::Interface;
use model_description::ModelDescription;
use model_description::variable::VariableKind;
use std::sync::{Arc, OnceLock};

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
