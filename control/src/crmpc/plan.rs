//! The plan: a nominal trajectory over the horizon.

use super::stages::Stages;
use super::state;
use crate::clone_in_place::clone_in_place;
use crate::mpc::ErrorTrajectory;
use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};
use vehicle::reference::Reference;

/// Terms under which a plan was certified; they bound its inputs while it is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Terms {
    /// Known moment at its optimisation, N m.
    pub known: Vector3<f64>,
    /// Rates that the turn of the trajectory added at its optimisation, rad/s.
    pub turn: Vector3<f64>,
    /// Least limit on ‖m‖ while it is followed, N m.
    pub limit_moment: f64,
    /// Bound on the disturbance while it is followed, as the number of the design's
    /// [tightening](super::Design::tightening).
    pub level: usize,
}

/// Nominal trajectory: states x̃_0 … x̃_N and the accelerations a_0 … a_{N−1} held between them.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Nominal states (Θ̃, x̃_ω), N + 1 of them.
    pub states: Vec<Vector6<f64>>,
    /// Nominal accelerations a = ẋ̃_ω, N of them, rad/s².
    pub accelerations: Vec<Vector3<f64>>,
    /// Multipliers of the norm constraints on the state at each interval's end and on its input,
    /// from which the next optimisation starts.
    pub multipliers: Vec<[f64; 2]>,
    /// Braking rate κ of β̈ = −κ β̇ beyond the horizon, 1/s; used with the robust set.
    pub braking: f64,
    /// Shift of the reference's angles by the observer when the plan was made, rad.
    pub shift: Vector3<f64>,
    /// Terms under which the plan was certified.
    pub terms: Terms,
}

clone_in_place!([] Plan { states, accelerations, multipliers });

impl Plan {
    /// Returns a plan of `horizon` intervals at rest at the origin.
    pub fn new(horizon: usize) -> Self {
        let mut plan = Self::default();
        plan.resize(horizon);
        plan
    }

    pub(super) fn resize(&mut self, horizon: usize) {
        self.states.resize(horizon + 1, Vector6::zeros());
        self.accelerations.resize(horizon, Vector3::zeros());
        self.multipliers.resize(horizon, [0.0; 2]);
    }

    /// Shifts the plan as in (31): drops the first interval and appends one of `h` (s) with the
    /// acceleration `a` (rad/s²).
    pub(super) fn shift(&mut self, a: &Vector3<f64>, h: f64) {
        let n = self.accelerations.len();
        let last = self.states[n];
        self.states.rotate_left(1);
        self.accelerations.rotate_left(1);
        self.multipliers.rotate_left(1);
        self.multipliers[n - 1] = [0.0; 2];
        self.accelerations[n - 1] = *a;
        self.states[n] = advance(&last, a, h);
    }

    /// Fills the plan with the trajectory from `start` under an acceleration that depends on state
    /// and reference.
    pub(super) fn roll_out(
        &mut self,
        start: Vector6<f64>,
        stages: &Stages,
        law: impl Fn(&Vector6<f64>, &Reference) -> Vector3<f64>,
    ) {
        self.states[0] = start;
        for (k, reference) in stages.references.iter().take(self.accelerations.len()).enumerate() {
            self.accelerations[k] = law(&self.states[k], reference);
            self.states[k + 1] = advance(&self.states[k], &self.accelerations[k], stages.step);
        }
    }

    /// Computes the errors E = x̃ − x_r and v = a − Θ̈_r of the plan.
    pub(super) fn errors(&self, references: &[Reference], motion: &mut ErrorTrajectory<2>) {
        for ((error, state), reference) in
            motion.states.iter_mut().zip(&self.states).zip(references)
        {
            *error = state::error(state, reference);
        }
        for ((v, a), reference) in motion.inputs.iter_mut().zip(&self.accelerations).zip(references)
        {
            *v = a - reference.accelerations;
        }
    }

    /// Sets the plan from the inputs v = a − Θ̈_r of a trajectory, rolled out from `start` so that
    /// it is an exact trajectory of the nominal model.
    pub(super) fn follow(
        &mut self,
        inputs: &[Vector3<f64>],
        start: &Vector6<f64>,
        references: &[Reference],
        h: f64,
    ) {
        self.states[0] = *start;
        for (k, (v, reference)) in inputs.iter().zip(references).enumerate() {
            self.accelerations[k] = v + reference.accelerations;
            self.states[k + 1] = advance(&self.states[k], &self.accelerations[k], h);
        }
    }
}

/// Returns the exact motion of the double integrator over `h` with `a` held.
pub(super) fn advance(state: &Vector6<f64>, a: &Vector3<f64>, h: f64) -> Vector6<f64> {
    let mut next = *state;
    for i in 0..3 {
        next[i] += h * (state[3 + i] + 0.5 * h * a[i]);
        next[3 + i] += h * a[i];
    }
    next
}
