//! The limit on the body rates of a plan.

use crate::linearise::{self, InverseKinematics};
use crate::mpc::{self, Bounded, ErrorTrajectory, NormConstraint, StageConstraints, State};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;
use vehicle::math::powi;
use vehicle::reference::Reference;

/// The limit on ‖R⁻¹(Θ) v‖ as a function of the errors from these references.
#[derive(Clone, Debug)]
pub(super) struct RateLimit {
    pub(super) limit: f64,
    pub(super) references: Vec<Reference>,
}

/// Relative tolerance in the check of the exact constraint, for rounding.
const CHECK_SLACK: f64 = 1e-9;

impl RateLimit {
    /// Returns ‖R⁻¹(Θ) v‖², relative to the limit.
    fn square(&self, k: usize, state: &State<1>, input: &Vector3<f64>) -> f64 {
        let reference = &self.references[k];
        let rates =
            linearise::body_rates(&(reference.angles + state[0]), &(reference.rates + input));
        rates.norm_squared() / (self.limit * self.limit)
    }
}

impl Bounded<1> for RateLimit {
    fn constrains_states(&self) -> bool {
        false
    }

    fn norm_constraints(
        &self,
        k: usize,
        state: &State<1>,
        input: &Vector3<f64>,
        _: (f64, f64),
    ) -> StageConstraints<1> {
        let reference = &self.references[k];
        let command = reference.rates + input;
        let kinematics = InverseKinematics::at(&(reference.angles + state[0]));
        let (rates, [by_alpha, by_beta]) = kinematics.body_rates(&command);
        let by_state = Matrix3::from_columns(&[by_alpha, by_beta, Vector3::zeros()]) / self.limit;
        let input = NormConstraint {
            value: rates / self.limit,
            by_state: [by_state],
            by_input: kinematics.matrix() / self.limit,
        };
        StageConstraints { state: NormConstraint::default(), input }
    }

    fn squares(
        &self,
        k: usize,
        state: &State<1>,
        input: &Vector3<f64>,
        _: (f64, f64),
    ) -> (f64, f64) {
        (0.0, self.square(k, state, input))
    }

    fn violated(
        &self,
        trajectory: &ErrorTrajectory<1>,
        mut intervals: Range<usize>,
        _: &mut mpc::Bounds,
    ) -> Option<Range<usize>> {
        let bound = powi(1.0 + CHECK_SLACK, 2);
        let violates =
            |k: usize| self.square(k, &trajectory.states[k], &trajectory.inputs[k]) > bound;
        let first = intervals.find(|&k| violates(k))?;
        let last = intervals.rev().find(|&k| violates(k)).unwrap_or(first);
        Some(first..last + 1)
    }
}
