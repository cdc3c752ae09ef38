//! A trajectory of the angles over the horizon.

use crate::clone_in_place::clone_in_place;
use crate::mpc::ErrorTrajectory;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::reference::Reference;

/// A trajectory of the angles over the horizon.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Angles Θ_0 … Θ_N, rad.
    pub angles: Vec<Vector3<f64>>,
    /// Commanded rates v_0 … v_{N−1}, each held over one interval, rad/s.
    pub commands: Vec<Vector3<f64>>,
    /// Multipliers of the constraint, from which the next optimisation starts. The first of each
    /// pair is zero, as the angles have no constraint.
    pub multipliers: Vec<[f64; 2]>,
}

clone_in_place!([] Plan { angles, commands, multipliers });

impl Plan {
    /// Returns a plan of `horizon` intervals at rest at the origin.
    pub fn new(horizon: usize) -> Self {
        Self {
            angles: vec![Vector3::zeros(); horizon + 1],
            commands: vec![Vector3::zeros(); horizon],
            multipliers: vec![[0.0; 2]; horizon],
        }
    }

    /// Computes the errors Θ − Θ_r and v − Θ̇_r of the plan.
    pub(super) fn errors(&self, references: &[Reference], trajectory: &mut ErrorTrajectory<1>) {
        for ((error, angles), reference) in
            trajectory.states.iter_mut().zip(&self.angles).zip(references)
        {
            *error = [angles - reference.angles];
        }
        for ((w, v), reference) in trajectory.inputs.iter_mut().zip(&self.commands).zip(references)
        {
            *w = v - reference.rates;
        }
    }

    /// Sets the plan from a trajectory of the errors, rolled out from `start` so that it is an
    /// exact trajectory of the model.
    pub(super) fn follow(
        &mut self,
        trajectory: &ErrorTrajectory<1>,
        start: Vector3<f64>,
        references: &[Reference],
        h: f64,
    ) {
        self.angles[0] = start;
        for (k, (w, reference)) in trajectory.inputs.iter().zip(references).enumerate() {
            self.commands[k] = w + reference.rates;
            self.angles[k + 1] = self.angles[k] + self.commands[k] * h;
        }
    }
}
