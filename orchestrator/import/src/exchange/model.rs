//! What the integration needs to know of a model.

use crate::functions::Table;
use crate::library::FmuInstance;
use fmi_master::description::ModelDescription;
use fmi_master::instance::{CallFailure, Instance};

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

/// An instance for model exchange, whatever the version of FMI.
pub(crate) trait ContinuousModel: Instance {
    type Functions: Table;

    /// Returns the instance itself, by which the calls of model exchange are made.
    fn unit(&mut self) -> &mut FmuInstance<Self::Functions>;
}

/// What the integration of a unit needs to know of its description.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// Value references of the continuous states.
    pub(super) states: Vec<u32>,
    /// Their names.
    pub(super) names: Vec<String>,
    /// Value references of their derivatives.
    pub(super) derivatives: Vec<u32>,
    /// Number of event indicators.
    pub(super) indicators: usize,
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
        let needs_completed_step = if description.is_fmi3() {
            interface.has("needsCompletedIntegratorStep")
        } else {
            !interface.has("completedIntegratorStepNotNeeded")
        };
        let mut layout = Self {
            indicators: description.event_indicators,
            needs_completed_step,
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
            layout.names.push(state.name.clone());
            layout.derivatives.push(derivative.reference);
        }
        Ok(layout)
    }
}
