//! The stages of the horizon: references, and the nominal states that follow from tracking errors.

use crate::linearise::{BodyMotion, InverseKinematics};
use crate::mpc::{ErrorTrajectory, State};
use nalgebra::Vector3;
use std::cell::OnceCell;
use std::ops::Range;
use vehicle::dynamics::RigidBody;
use vehicle::reference::Reference;

/// Conversion of tracking errors at the prediction times into nominal states.
#[derive(Clone, Debug)]
pub(super) struct Stages {
    /// References at the prediction times 0 … N.
    pub references: Vec<Reference>,
    pub body: RigidBody,
    /// Optimisation period h, s.
    pub step: f64,
}

impl Stages {
    pub(super) fn new(horizon: usize, body: RigidBody, step: f64) -> Self {
        Self { references: vec![Reference::default(); horizon + 1], body, step }
    }

    /// Returns (Θ̃, x̃_ω, a) for an error and its input at stage `k`.
    pub(super) fn nominal(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
    ) -> [Vector3<f64>; 3] {
        let Reference { angles, rates, accelerations } = &self.references[k];
        [angles + state[0], rates + state[1], accelerations + input]
    }

    /// Returns stage `k` of a trajectory of the errors.
    pub(super) fn point(&self, motion: &ErrorTrajectory<2>, k: usize) -> Point {
        let input = motion.inputs.get(k).copied().unwrap_or_default();
        self.point_at(k, &motion.states[k], &input)
    }

    /// Returns stage `k` with this error and its input, which the last stage does not have.
    pub(super) fn point_at(&self, k: usize, state: &State<2>, input: &Vector3<f64>) -> Point {
        let [angles, rates, a] = self.nominal(k, state, input);
        let is_last = k + 1 == self.references.len();
        Point::new(angles, rates, if is_last { Vector3::zeros() } else { a })
    }

    /// Returns the range from the first to the last of these intervals that the trajectory
    /// violates. `violates` judges interval k between two stages. Its last argument keeps what it
    /// has computed for neighbouring intervals.
    pub(super) fn first_and_last<Kept: Default>(
        &self,
        motion: &ErrorTrajectory<2>,
        intervals: Range<usize>,
        mut violates: impl FnMut(usize, &Point, &Point, &mut Kept) -> bool,
    ) -> Option<Range<usize>> {
        let mut kept = Kept::default();
        let mut here = self.point(motion, intervals.start);
        let first = intervals.clone().find(|&k| {
            let next = self.point(motion, k + 1);
            let violates = violates(k, &here, &next, &mut kept);
            here = next;
            violates
        })?;
        // The search runs from the other end, as intervals between two violated ones need no check.
        let mut kept = Kept::default();
        let mut next = self.point(motion, intervals.end);
        let last = (first + 1..intervals.end).rev().find(|&k| {
            let here = self.point(motion, k);
            let violates = violates(k, &here, &next, &mut kept);
            next = here;
            violates
        });
        Some(first..last.unwrap_or(first) + 1)
    }
}

/// One stage of a nominal trajectory, with its kinematics on demand.
pub(super) struct Point {
    pub angles: Vector3<f64>,
    /// Derivative of the angles, x_ω.
    pub rates: Vector3<f64>,
    /// Norm of the rates, ‖x_ω‖.
    pub size: f64,
    /// Acceleration a; zero at the last stage.
    pub acceleration: Vector3<f64>,
    /// Norm of the acceleration, ‖a‖.
    pub pull: f64,
    turned: OnceCell<InverseKinematics>,
}

impl Point {
    pub(super) fn new(
        angles: Vector3<f64>,
        rates: Vector3<f64>,
        acceleration: Vector3<f64>,
    ) -> Self {
        let (size, pull) = (rates.norm(), acceleration.norm());
        Self { angles, rates, size, acceleration, pull, turned: OnceCell::new() }
    }

    /// Returns W = R⁻¹, which is computed at its first use.
    pub(super) fn turned(&self) -> &InverseKinematics {
        self.turned.get_or_init(|| InverseKinematics::at(&self.angles))
    }

    pub(super) fn motion(&self, body: &RigidBody) -> BodyMotion {
        self.turned().motion(body, &self.rates)
    }
}
