//! What a model for model exchange offers, whatever the version of FMI.

use fmi_master::description::ModelDescription;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use serde::{Deserialize, Serialize};

/// Reason why a model has not computed what was asked for.
#[derive(Debug)]
pub(crate) enum Refusal {
    /// The values are outside of the model's domain: a shorter step may avoid them.
    Discarded(CallFailure),
    /// The call failed.
    Failed(CallFailure),
}

impl Refusal {
    /// Returns the failure of the call, where it does not matter which one it is.
    pub(super) fn failure(self) -> CallFailure {
        match self {
            Self::Discarded(failure) | Self::Failed(failure) => failure,
        }
    }
}

/// Result of an evaluation of the discrete states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "FMI defines these flags")]
pub(crate) struct EventInfo {
    /// Whether the discrete states must be evaluated again.
    pub(crate) needs_another: bool,
    /// Whether the simulation has to end.
    pub(crate) terminates: bool,
    /// Whether the nominal values of the continuous states have changed.
    pub(crate) changes_nominals: bool,
    /// Whether the continuous states have changed.
    pub(crate) changes_states: bool,
    /// Time of the next time event, s.
    pub(crate) next_event: Option<f64>,
}

/// Answer to a completed step of the integrator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Completed {
    /// Whether there is an event at the end of the step.
    pub(crate) enters_event_mode: bool,
    /// Whether the simulation has to end.
    pub(crate) terminates: bool,
}

/// An instance for model exchange. All slices have the lengths that the description gives.
pub(crate) trait ContinuousModel: Instance {
    /// Sets the time, s.
    fn set_time(&mut self, time: f64) -> Outcome;
    /// Sets the continuous states.
    fn set_states(&mut self, states: &[f64]) -> Result<(), Refusal>;
    /// Reads the continuous states.
    fn states(&mut self, states: &mut [f64]) -> Outcome;
    /// Reads the typical magnitudes of the continuous states.
    fn nominals(&mut self, nominals: &mut [f64]) -> Outcome;
    /// Computes the derivatives of the continuous states by time.
    fn derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Refusal>;
    /// Computes the event indicators.
    fn indicators(&mut self, indicators: &mut [f64]) -> Result<(), Refusal>;
    /// Enters event mode from continuous-time mode.
    fn enter_event_mode(&mut self) -> Outcome;
    /// Evaluates the discrete states in event mode.
    fn new_discrete_states(&mut self) -> Result<EventInfo, CallFailure>;
    /// Enters continuous-time mode from event mode.
    fn enter_continuous_time_mode(&mut self) -> Outcome;
    /// Tells the model that a step of the integrator is complete.
    fn completed_step(&mut self) -> Result<Completed, CallFailure>;
    /// Takes the last message of the model that reports no problem.
    fn message(&mut self) -> Option<String>;
}

/// What the integration of a unit needs to know of its description.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Layout {
    /// Value references of the continuous states.
    pub(super) states: Vec<u32>,
    /// Value references of their derivatives.
    pub(super) derivatives: Vec<u32>,
    /// Number of event indicators.
    pub(super) indicators: usize,
    pub(super) has_directional_derivatives: bool,
    pub(super) needs_completed_step: bool,
    /// Relative tolerance of the integration.
    pub(super) tolerance: f64,
}

impl Layout {
    /// Reads the layout of a unit that offers model exchange.
    ///
    /// # Errors
    /// Returns a line about an entry of the model structure that is no derivative of a state.
    pub(crate) fn new(description: &ModelDescription, tolerance: f64) -> Result<Self, String> {
        let interface = description.model_exchange.as_ref().ok_or("offers no model exchange")?;
        let mut layout = Self {
            indicators: description.event_indicators,
            has_directional_derivatives: interface.has("providesDirectionalDerivative"),
            needs_completed_step: !interface.has("completedIntegratorStepNotNeeded"),
            tolerance,
            ..Self::default()
        };
        for position in &description.derivatives {
            let derivative = &description.variables[*position];
            let state = derivative.derivative_of.and_then(|s| description.variables.get(s));
            let state = state.ok_or_else(|| {
                format!("lists \"{}\" among the derivatives of its model structure, which is the derivative of no variable", derivative.name)
            })?;
            layout.states.push(state.reference);
            layout.derivatives.push(derivative.reference);
        }
        Ok(layout)
    }
}
