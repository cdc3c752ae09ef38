//! The shell's part of an instance's state: its progress, and the inputs that move during a step.

use crate::call::State;
use crate::model::LastEvent;
use crate::table::VariableTable;
use crate::types::Interface;
use model_description::variable::{Causality, Variability, Variable, VariableKind};
use serde::{Deserialize, Serialize};

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
    /// Whether the importer has set an input since initialization.
    pub(crate) sets_inputs: bool,
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
            sets_inputs: false,
            extrapolations: Vec::new(),
        }
    }
}

impl Progress {
    /// Says why no instance can have this progress, or `None` if one can.
    pub(crate) fn problem<M>(
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
                let Variable { causality, variability, kind, .. } = &entry.variable;
                matches!(kind, VariableKind::Real { .. })
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
