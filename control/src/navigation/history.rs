//! Past states of the navigation, at which measurements are applied that arrive late.

use super::filter::{ATTITUDE, Error, POSITION, VELOCITY};
use super::strapdown::State;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Number of past states, and the least time between two of them, s: together 1.28 s.
const KEPT: usize = 16;
const SPACING: f64 = 0.08;

/// Past states, of which the newest one replaces the oldest one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct History {
    /// Times (s) and states.
    past: [(f64, State); KEPT],
    /// Number of states that were kept so far.
    count: usize,
}

impl History {
    /// Keeps the state at `time` (s), unless the last one is too near.
    pub(super) fn keep(&mut self, time: f64, state: &State) {
        let last = self.past[self.count.wrapping_sub(1) % KEPT].0;
        if self.count == 0 || time - last > SPACING - 1e-9 {
            self.past[self.count % KEPT] = (time, *state);
            self.count += 1;
        }
    }

    /// Returns the state at `time` (s), given the present one and its time, or `None` if it is older
    /// than all that are kept.
    pub(super) fn at(&self, time: f64, now: (f64, &State)) -> Option<State> {
        let mut after = (now.0, *now.1);
        for age in 1..=self.count.min(KEPT) {
            let before = self.past[(self.count - age) % KEPT];
            if before.0 <= time {
                return Some(between(&before, &after, time));
            }
            after = before;
        }
        (time == now.0).then_some(*now.1)
    }

    /// Corrects all states by the error at a time (s).
    pub(super) fn correct(&mut self, error: &Error, now: f64) {
        for (time, state) in &mut self.past {
            state.correct(error, *time - now);
        }
    }
}

impl State {
    /// Corrects the state by the error at a time that is `later` (s) than the error's.
    pub(super) fn correct(&mut self, error: &Error, later: f64) {
        let part = |from: usize| Vector3::from(error.fixed_rows::<3>(from));
        self.position += part(POSITION) + part(VELOCITY) * later;
        self.velocity += part(VELOCITY);
        self.attitude = UnitQuaternion::from_scaled_axis(part(ATTITUDE)) * self.attitude;
    }
}

/// Returns the state at `time` (s) between two states, with a constant acceleration and rate.
fn between(from: &(f64, State), to: &(f64, State), time: f64) -> State {
    let (a, b) = (&from.1, &to.1);
    let elapsed = time - from.0;
    let share = if to.0 > from.0 { elapsed / (to.0 - from.0) } else { 0.0 };
    let velocity = a.velocity + (b.velocity - a.velocity) * share;
    let turn = (a.attitude.inverse() * b.attitude).scaled_axis();
    State {
        position: a.position + (a.velocity + velocity) * (elapsed / 2.0),
        velocity,
        attitude: a.attitude * UnitQuaternion::from_scaled_axis(turn * share),
    }
}
