//! Interface that a model must implement to become an FMU.

use crate::table::Description;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// Reason why a call failed. Its text reaches the user through the FMI logger.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Failure {
    /// The call was refused, but the instance is unchanged and can continue (`fmi2Discard`).
    #[error("{0}")]
    Discard(String),
    /// The simulation cannot continue, but the process and other instances can (`fmi2Error`).
    #[error("{0}")]
    Error(String),
    /// A step came to the end of the simulated range before its own end. The outputs are those at
    /// this time. The importer gets `fmi2Discard` and learns the rest from `fmi2GetBooleanStatus`
    /// and `fmi2GetRealStatus` (2.0.5, section 4.2.3).
    #[error("{reason}")]
    Ended {
        /// Time at which the simulation ends, s.
        time: f64,
        /// Reason of the end.
        reason: String,
    },
}

/// Data about the experiment that a model may use while it initializes.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Start time of the experiment, s.
    pub start_time: f64,
    /// Stop time in s, if the importer defined one.
    pub stop_time: Option<f64>,
    /// Path of the unpacked `resources` folder, if the importer gave one.
    pub resources: Option<&'a Path>,
}

impl Context<'_> {
    /// Returns the path of a file that a parameter names: as given, or in the FMU's resources.
    pub fn file(&self, name: &str) -> PathBuf {
        let path = PathBuf::from(name);
        let inside = self.resources.map(|folder| folder.join(name));
        if path.is_file() { path } else { inside.filter(|file| file.is_file()).unwrap_or(path) }
    }
}

/// Inputs during a step: constant, or extrapolated with the derivatives that the importer gave.
pub trait Inputs<M> {
    /// Sets the model's real inputs to their values at `time` (s). It returns at once if no
    /// derivatives were given.
    fn advance(&self, model: &mut M, time: f64);

    /// Returns whether the importer gave derivatives, so that the inputs move during the step.
    fn are_extrapolated(&self) -> bool;

    /// Returns whether the inputs are those of the beginning of the step. A step that an event of
    /// FMI 3.0 has cut begins with those of an earlier instant.
    fn are_current(&self) -> bool {
        true
    }

    /// Integrates the states of the model from `from` to `to` (both s) by the Runge–Kutta method of
    /// fourth order, in equal steps no longer than that of the default experiment.
    ///
    /// # Errors
    /// Returns that of [`Model::calculate`].
    fn integrate(&self, model: &mut M, from: f64, to: f64) -> Result<(), Failure>;
}

/// Last event before outputs are read. In co-simulation it determines the meaning of the outputs of
/// a sampled model: FMI 2.0 forbids reading them after an input was set, until a step has been made
/// (2.0.5, section 4.2.1), so that a master which keeps to the standard reads them after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LastEvent {
    /// No step has been made, and no input was set since initialization mode. The outputs are
    /// those of the start time.
    #[default]
    Initialization,
    /// A step has been made, and no input was set since. The outputs are those that held over this
    /// step.
    Step,
    /// An event of FMI 3.0 was handled within a step of the importer, which has set no input since
    /// its beginning. The outputs respond to inputs of an earlier instant.
    Event,
    /// An input was set by a call, whatever its value, an event of FMI 3.0 was handled by an
    /// importer that sets no inputs at all, or the instance runs in model exchange. The outputs
    /// respond to the inputs.
    InputSet,
}

/// Outcome of an event iteration in model exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventInfo {
    /// Next time at which an event is due, s.
    pub next_event_time: Option<f64>,
    /// Whether the event changed continuous states.
    pub states_changed: bool,
    /// Whether the simulation ends here.
    pub terminates: bool,
}

/// Data about a saved state from which a model was restored.
#[derive(Debug)]
pub struct Restoration<'a, M> {
    /// Model that the restored one replaces.
    pub before: &'a mut M,
    /// Time of the saved state, s.
    pub time: f64,
    /// Start time of its experiment, s.
    pub start_time: f64,
    /// Whether the model was initialized with its present parameters; otherwise it will be before
    /// it is used.
    pub initialized: bool,
    /// Whether the saved state may come from a step that failed half-way.
    pub failed: bool,
}

/// Model of an FMU: one value that holds the parameters, inputs, state and outputs. The variable
/// table of the [`Description`] points at its fields.
///
/// The shell takes care of call order, value checks, logging and memory; a model only computes.
/// Everything that determines the future is serialised: a model that is restored in another process
/// continues bit for bit. Scratch space is `#[serde(skip)]` and made again in [`Model::restored`].
pub trait Model: Serialize + DeserializeOwned + Send + Sized + 'static {
    /// Returns name, documentation, default experiment and the variable table.
    fn description() -> Description<Self>;

    /// Makes a model with every parameter and input at its start value. The start values in the XML
    /// are read from here.
    fn new() -> Self;

    /// Brings the model back to the result of [`Self::new`]. It may keep scratch space that
    /// determines nothing. After a failure the shell makes a new model instead.
    fn reset(&mut self) {
        *self = Self::new();
    }

    /// Checks the parameters, loads files, computes the values that follow from them and sets the
    /// initial state. By default, states begin with their values in [`Self::new`]. The shell calls it on leaving initialization mode, and earlier in that mode
    /// if an output is requested; it calls it again whenever a parameter changed meanwhile.
    ///
    /// # Errors
    /// Names the parameter at fault.
    fn initialize(&mut self, _context: &Context) -> Result<(), Failure> {
        Ok(())
    }

    /// Updates all outputs and local variables to the state, the inputs and `time`, as they are to
    /// be read after `last`. It must not change anything on which a later call depends. The shell
    /// calls it before a read, and only if something changed since.
    ///
    /// # Errors
    /// Says which value could not be computed.
    fn calculate(&mut self, time: f64, last: LastEvent) -> Result<(), Failure>;

    /// Performs a co-simulation step from communication point `from` to `to` (both s). It is never
    /// called with `to < from`; `to == from` is a step of zero length. Outputs are not read here
    /// but after a call of [`Model::calculate`]. `log` takes warnings. By default the states are
    /// integrated by [`Inputs::integrate`].
    ///
    /// # Errors
    /// Says why the step failed, or why the simulation ends within it.
    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        _log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        inputs.integrate(self, from, to)
    }

    /// Prepares a model that was restored from a saved state, before it replaces another one. It
    /// makes scratch space again or takes over that of the other model, which is no longer used if
    /// this succeeds.
    ///
    /// # Errors
    /// Refuses a state that cannot be used. The other model must then be unchanged.
    fn restored(&mut self, _from: Restoration<'_, Self>) -> Result<(), Failure> {
        Ok(())
    }

    /// Copies the continuous states for model exchange, in the order of the state variables in the
    /// variable table, if they are kept elsewhere than in these variables. `states` has the values
    /// of the variables.
    fn continuous_states(&self, _states: &mut [f64]) {}

    /// Sets the continuous states in model exchange, if they are kept elsewhere than in the state
    /// variables, which the shell sets.
    fn set_continuous_states(&mut self, _states: &[f64]) {}

    /// Handles the event at `time`: it takes discrete inputs, makes the changes that are due, and
    /// returns the time of the next event. Importers may call it where no event is, and more than
    /// once. A model with model exchange gets this call there only; another one gets it in the
    /// event mode of FMI 3.0, where it only needs to return the time of its next tick after `time`.
    ///
    /// # Errors
    /// Says why the event could not be handled.
    fn new_discrete_states(&mut self, _time: f64) -> Result<EventInfo, Failure> {
        Ok(EventInfo::default())
    }

    /// Copies the event indicators for model exchange as of the last [`Model::calculate`], which
    /// the shell calls before if something changed.
    fn event_indicators(&self, _indicators: &mut [f64]) {}
}
