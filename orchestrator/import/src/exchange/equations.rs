//! The equations of a model between two events, as the integrator sees them.

use super::events::Events;
use super::model::{ContinuousModel, Layout, Refusal};
use super::rodas::{Point, Step, System};
use crate::functions::Table as _;
use nalgebra::DMatrix;

/// Parts of a step at which the indicators are looked at, since one may cross zero and come back. It
/// often comes back soon after an event, for instance that of a ball which bounces.
const LOOKS: [f64; 10] =
    [1.0 / 512.0, 1.0 / 64.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];

/// The equations of a model between two events.
pub(super) struct Equations<'a, M> {
    pub(super) model: &'a mut M,
    pub(super) layout: &'a Layout,
    pub(super) nominals: Vec<f64>,
}

impl<M: ContinuousModel> Equations<'_, M> {
    /// Brings the model to a time (s) and states.
    pub(super) fn place(&mut self, time: f64, states: &[f64]) -> Result<(), Refusal> {
        self.model.unit().set_time(time).map_err(Refusal::Failed)?;
        if states.is_empty() { Ok(()) } else { self.model.unit().set_states(states) }
    }

    /// Finds the first event of a step. Returns the time (s) after it, which differs from one before
    /// it by rounding only, and its indicator. Without an event, the model is at the end of the
    /// step.
    pub(super) fn event(
        &mut self,
        events: &Events,
        step: &Step,
    ) -> Result<Option<(f64, usize)>, Refusal> {
        let count = self.layout.indicators;
        if count == 0 {
            return Ok(None);
        }
        let (begin, end) = (step.begin.time, step.end.time);
        let mut indicators = vec![0.0; count];
        let mut point = step.end.clone();
        let mut crossed = |time: f64, this: &mut Self| {
            step.interpolate(time, &mut point);
            this.place(time, &point.states)?;
            this.model.unit().indicators(&mut indicators)?;
            Ok(events.crossed(&indicators))
        };
        let (mut low, mut found) = (begin, None);
        for part in LOOKS {
            let time = if part < 1.0 { begin + part * (end - begin) } else { end };
            if let Some(indicator) = crossed(time, self)? {
                found = Some((time, indicator));
                break;
            }
            low = time;
        }
        let Some((mut high, mut indicator)) = found else { return Ok(None) };
        while high - low > f64::EPSILON * (end - begin) {
            let middle = f64::midpoint(low, high);
            if middle <= low || middle >= high {
                break;
            }
            match crossed(middle, self)? {
                Some(other) => (high, indicator) = (middle, other),
                None => low = middle,
            }
        }
        Ok(Some((high, indicator)))
    }
}

impl<M: ContinuousModel> System for Equations<'_, M> {
    const CALL: &'static str = M::Functions::DERIVATIVES;

    fn derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<(), Refusal> {
        self.place(time, states)?;
        if states.is_empty() { Ok(()) } else { self.model.unit().derivatives(derivatives) }
    }

    fn jacobian(&mut self, at: &Point, jacobian: &mut DMatrix<f64>) -> Result<(), Refusal> {
        let mut changed = at.states.clone();
        for (place, mut column) in jacobian.column_iter_mut().enumerate() {
            let state = at.states[place];
            let size = f64::EPSILON.sqrt() * state.abs().max(self.nominals[place]);
            // Where the model refuses one side, the other one remains.
            let mut outcome = Ok(());
            for change in [size, -size] {
                changed[place] = state + change;
                outcome = self.derivatives(at.time, &changed, column.as_mut_slice());
                if !matches!(outcome, Err(Refusal::Discarded(_))) {
                    break;
                }
            }
            outcome?;
            let change = changed[place] - state;
            changed[place] = state;
            for (value, before) in column.iter_mut().zip(&at.derivatives) {
                *value = (*value - before) / change;
            }
        }
        Ok(())
    }
}
