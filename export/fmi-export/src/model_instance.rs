//! A model bound to its variable table behind a trait that hides the model's type, for the shell.

use crate::call::State;
use crate::model::{Context, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
use crate::numbers::are_numbers;
use crate::progress::{Extrapolation, Progress};
use crate::table::{Description, VariableTable, number, resolved};
use crate::types::Interface;
use model_description::ModelDescription;
use model_description::structure::states;
use model_description::variable::{Variable, VariableKind};
use settings::Field;
use std::cell::RefCell;
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
    /// Performs a step after this event, and leaves the inputs at their values at `to`.
    fn step(
        &mut self,
        begin: (f64, LastEvent),
        to: f64,
        inputs: &[Extrapolation],
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure>;

    fn save(&self, progress: &Progress) -> Result<Vec<u8>, Failure>;
    /// Restores a saved state for an instance of this interface, with or without event mode. On an
    /// error the model is unchanged.
    fn restore(&mut self, payload: &[u8], usage: (Interface, bool)) -> Result<Progress, Failure>;

    fn continuous_states(&mut self, states: &mut [f64]);
    fn set_continuous_states(&mut self, states: &[f64]);
    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure>;
    fn event_indicators(&self, indicators: &mut [f64]);
}

struct Bound<M> {
    model: M,
    table: VariableTable<M>,
    /// Value references of each state and its derivative.
    states: Vec<(usize, usize)>,
    /// Longest step with which the shell integrates the states, s.
    longest: f64,
    scratch: Scratch,
}

/// Room for the integration: states, derivatives, and their weighted sum.
type Scratch = [Vec<f64>; 3];

impl<M> Bound<M> {
    fn field(&mut self, reference: usize) -> Option<Field<'_>> {
        Some(self.table.entries.get(reference)?.field(&mut self.model))
    }
}

/// Inputs of one step, for the model with its type.
struct Extrapolated<'a, M> {
    table: &'a VariableTable<M>,
    states: &'a [(usize, usize)],
    longest: f64,
    scratch: RefCell<&'a mut Scratch>,
    from: f64,
    /// Event before the step.
    last: LastEvent,
    inputs: &'a [Extrapolation],
}

impl<M: Model> Extrapolated<'_, M> {
    fn real<'m>(&self, model: &'m mut M, reference: usize) -> Option<&'m mut f64> {
        match self.table.entries[reference].field(model) {
            Field::Real(field) => Some(field),
            _ => None,
        }
    }

    /// Makes a step of length `h` (s) of the Runge–Kutta method of fourth order.
    fn runge_kutta(&self, model: &mut M, time: f64, h: f64) -> Result<(), Failure> {
        let value = |model: &mut M, reference| self.real(model, reference).map_or(0.0, |x| *x);
        let move_by = |model: &mut M, start: &[f64], h: f64, slopes: &[f64]| {
            for ((&(state, _), start), slope) in self.states.iter().zip(start).zip(slopes) {
                if let Some(state) = self.real(model, state) {
                    *state = start + h * slope;
                }
            }
        };
        let mut scratch = self.scratch.borrow_mut();
        let [start, slopes, sum] = &mut **scratch;
        for (start, &(state, _)) in start.iter_mut().zip(self.states) {
            *start = value(model, state);
        }
        slopes.fill(0.0);
        sum.fill(0.0);
        for (part, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            move_by(model, start, part * h, slopes);
            self.advance(model, time + part * h);
            model.calculate(time + part * h, LastEvent::InputSet)?;
            for (i, &(_, derivative)) in self.states.iter().enumerate() {
                slopes[i] = value(model, derivative);
                sum[i] += weight * slopes[i];
            }
        }
        move_by(model, start, h / 6.0, sum);
        Ok(())
    }
}

impl<M: Model> Inputs<M> for Extrapolated<'_, M> {
    fn advance(&self, model: &mut M, time: f64) {
        for input in self.inputs {
            if let Some(field) = self.real(model, input.reference) {
                *field = input.at(time - self.from);
            }
        }
    }

    fn are_extrapolated(&self) -> bool {
        !self.inputs.is_empty()
    }

    fn are_current(&self) -> bool {
        self.last != LastEvent::Event
    }

    fn integrate(&self, model: &mut M, from: f64, to: f64) -> Result<(), Failure> {
        let count = ((to - from) / self.longest).ceil().max(1.0);
        let h = (to - from) / count;
        (0..count as u64).try_for_each(|k| self.runge_kutta(model, from + k as f64 * h, h))
    }
}

impl<M: Model> ModelInstance for Bound<M> {
    fn real(&mut self, reference: usize) -> Option<&mut f64> {
        match self.field(reference)? {
            Field::Real(field) => Some(field),
            _ => None,
        }
    }

    fn integer(&mut self, reference: usize) -> Option<i32> {
        number(&self.field(reference)?)
    }

    fn set_integer(&mut self, reference: usize, value: i32) {
        match self.field(reference) {
            Some(Field::Integer(field)) => field.set_number(value.into()),
            Some(Field::Choice(field)) => field.set_number(i64::from(value) - 1),
            _ => false,
        };
    }

    fn boolean(&mut self, reference: usize) -> Option<&mut bool> {
        match self.field(reference)? {
            Field::Boolean(field) => Some(field),
            _ => None,
        }
    }

    fn string(&mut self, reference: usize) -> Option<&mut String> {
        match self.field(reference)? {
            Field::Text(field) => Some(field),
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
        (from, last): (f64, LastEvent),
        to: f64,
        inputs: &[Extrapolation],
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        let Self { model, table, states, longest, scratch } = self;
        let (longest, scratch) = (*longest, RefCell::new(scratch));
        let inputs = Extrapolated { table, states, longest, scratch, from, last, inputs };
        model.step(from, to, &inputs, log)?;
        inputs.advance(model, to);
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

    fn continuous_states(&mut self, states: &mut [f64]) {
        for (i, value) in states.iter_mut().enumerate() {
            *value = self.real(self.states[i].0).map_or(0.0, |state| *state);
        }
        self.model.continuous_states(states);
    }

    fn set_continuous_states(&mut self, states: &[f64]) {
        for (i, value) in states.iter().enumerate() {
            if let Some(state) = self.real(self.states[i].0) {
                *state = *value;
            }
        }
        self.model.set_continuous_states(states);
    }

    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure> {
        self.model.new_discrete_states(time)
    }

    fn event_indicators(&self, indicators: &mut [f64]) {
        self.model.event_indicators(indicators);
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
    let Description { table, default_experiment, .. } = M::description();
    let variables: Vec<&Variable> = table.variables().collect();
    let states = states(&variables);
    let scratch = [(); 3].map(|()| vec![0.0; states.len()]);
    let longest = default_experiment.step;
    Box::new(Bound { model: M::new(), table, states, longest, scratch })
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
        mut table,
    } = M::description();
    let documentation = documentation + &table.settings_of_the_file();
    let mut model = M::new();
    for entry in &mut table.entries {
        if entry.variable.is_calculated() {
            continue;
        }
        let field = entry.field(&mut model);
        let item = number(&field);
        match (&mut entry.variable.kind, field) {
            (VariableKind::Real { start, .. }, Field::Real(value)) => *start = Some(*value),
            (VariableKind::Boolean { start }, Field::Boolean(value)) => *start = Some(*value),
            (VariableKind::String { start }, Field::Text(value)) => *start = Some(value.clone()),
            (VariableKind::Integer { start, .. } | VariableKind::Enumeration { start, .. }, _) => {
                *start = item;
            }
            _ => unreachable!("kind and field come from one declaration"),
        }
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
        variables: resolved(table.entries.into_iter().map(|entry| entry.variable).collect()),
    }
}
