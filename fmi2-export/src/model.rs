//! What a unit must offer to become an FMU.

use crate::table::Description;
use serde::{Serialize, de::DeserializeOwned};
use std::path::Path;

/// Why a call could not be done. The text reaches the user through the FMI logger.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The call was refused but the unit is unchanged and can go on (`fmi2Discard`).
    #[error("{0}")]
    Discard(String),
    /// The simulation cannot go on, the process and other units can (`fmi2Error`).
    #[error("{0}")]
    Error(String),
}

/// What surrounds a unit while it initializes.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Start time of the experiment, s.
    pub start_time: f64,
    /// Stop time, if the importer defined one, s.
    pub stop_time: Option<f64>,
    /// The unpacked `resources` folder, if the importer gave one.
    pub resources: Option<&'a Path>,
}

/// Inputs during a step: constant, or extrapolated with the derivatives that the importer gave.
pub trait Inputs<M> {
    /// Sets the model's real inputs to their values at `time` (s). Returns at once if no derivatives were given.
    fn advance(&self, model: &mut M, time: f64);
}

/// Outcome of an event iteration in model exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventInfo {
    /// The next time at which an event is due, s.
    pub next_event_time: Option<f64>,
    /// Whether continuous states were changed by the event.
    pub states_changed: bool,
}

/// What surrounds a model that was restored from a saved state.
#[derive(Debug)]
pub struct Restoration<'a, M> {
    /// The model whose place it takes.
    pub before: &'a mut M,
    /// Time of the saved state, s.
    pub time: f64,
    /// Start time of its experiment, s.
    pub start_time: f64,
    /// Whether the model was initialized with the parameters that it has; else it will be before anything is asked of it.
    pub initialized: bool,
    /// Whether the state is one of a step that may have failed in the middle.
    pub failed: bool,
}

/// A unit: parameters, inputs, state and outputs in one value, whose fields the [`Description`]'s table points at.
///
/// The shell owns call order, value checks, logging and memory; a model only computes. Everything that determines the
/// future is serialised: a model that is restored in another process goes on bit for bit. Scratch space is
/// `#[serde(skip)]` and made again in [`Model::restored`].
pub trait Model: Serialize + DeserializeOwned + Send + Sized + 'static {
    /// Name, documentation, experiment and the one table of variables.
    fn description() -> Description<Self>;

    /// A model with every parameter and input at its start value. Start values in the XML are read from here.
    fn new() -> Self;

    /// Checks the parameters, loads files, computes what they determine and sets the initial state. Called on leaving
    /// and, if an output is asked for earlier, during initialization mode; again whenever a parameter changed meanwhile.
    ///
    /// # Errors
    /// Names the parameter at fault.
    fn initialize(&mut self, context: &Context) -> Result<(), Failure>;

    /// Brings all outputs and local variables up to date with state, inputs and `time`. Must not change anything that a
    /// later call depends on. The shell calls it before a read, and only if something changed since.
    ///
    /// # Errors
    /// Says what could not be computed.
    fn calculate(&mut self, time: f64) -> Result<(), Failure>;

    /// Co-simulation: from communication point `from` to `to` (both s). Never called with `to < from`; `to == from` is
    /// a step of zero length. Outputs are not read from here but from [`Model::calculate`] afterwards. `log` takes warnings.
    ///
    /// # Errors
    /// Says what went wrong.
    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure>;

    /// Called after the model was restored from a saved state, before it takes the place of another one: makes scratch space
    /// again, or takes over that of the other, which is not used any more if this succeeds.
    ///
    /// # Errors
    /// If the state cannot be used. The other model is then as it was.
    fn restored(&mut self, _from: Restoration<'_, Self>) -> Result<(), Failure> {
        Ok(())
    }

    /// Model exchange: copies the continuous states out, in the order of the state variables in the table.
    fn continuous_states(&self, _states: &mut [f64]) {}

    /// Model exchange: sets the continuous states.
    fn set_continuous_states(&mut self, _states: &[f64]) {}

    /// Model exchange: the event at `time`: takes discrete inputs and what else changes there, and tells when the next one is
    /// due. Importers may call it where no event is, and more than once.
    ///
    /// # Errors
    /// Says what went wrong.
    fn new_discrete_states(&mut self, _time: f64) -> Result<EventInfo, Failure> {
        Ok(EventInfo::default())
    }

    /// Model exchange: event indicators as of the last [`Model::calculate`], which the shell calls before if something changed.
    fn event_indicators(&self, _indicators: &mut [f64]) {}

    /// Partial derivative of the variable with value reference `unknown` by the one with value reference `known`, at
    /// the current `time`, state and inputs. Only offered if the description says so.
    ///
    /// # Errors
    /// Names a pair for which there is none.
    fn partial_derivative(&mut self, _time: f64, _unknown: usize, _known: usize) -> Result<f64, Failure> {
        Err(Failure::Error("this unit offers no directional derivatives".into()))
    }
}
