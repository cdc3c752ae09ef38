//! Norm constraints with the same bounds at all stages, for problems that test the solvers alone.
#![allow(unreachable_pub)]

use control::linearise::{InverseKinematics, Linear};
use control::mpc::{Constraints, NormConstraint, StageConstraints, State};
use nalgebra::{Matrix3, Vector3};
use vehicle::dynamics::RigidBody;

/// Bounds about the origin: on body rates and moment (the limits themselves), or on x_ω and u (the
/// printed sets).
pub struct Sets {
    /// Rigid body of the vehicle.
    pub body: RigidBody,
    /// Whether the bounds are those on x_ω and u.
    pub printed: bool,
    /// Bounds on rates and input.
    pub bounds: (f64, f64),
}

impl Constraints<2> for Sets {
    fn constrains_states(&self) -> bool {
        true
    }

    fn norm_constraints(
        &self,
        _: usize,
        state: &State<2>,
        input: &Vector3<f64>,
    ) -> StageConstraints<2> {
        let kinematics = InverseKinematics::at(&state[0]);
        let at = kinematics.linearise(&self.body, &state[1], input);
        let constraint = |y: &Linear, bound: f64| {
            let mut by_angles = Matrix3::zeros();
            by_angles.fixed_view_mut::<3, 2>(0, 0).copy_from(&y.by_angles);
            NormConstraint {
                value: y.value / bound,
                by_state: [by_angles / bound, y.by_rates / bound],
                by_input: y.by_acceleration / bound,
            }
        };
        if self.printed {
            let rates = NormConstraint {
                value: state[1] / self.bounds.0,
                by_state: [Matrix3::zeros(), Matrix3::identity() / self.bounds.0],
                by_input: Matrix3::zeros(),
            };
            let u = kinematics.input_of_moment(&self.body, &at.moment);
            StageConstraints { state: rates, input: constraint(&u, self.bounds.1) }
        } else {
            StageConstraints {
                state: constraint(&at.rates, self.bounds.0),
                input: constraint(&at.moment, self.bounds.1),
            }
        }
    }
}
