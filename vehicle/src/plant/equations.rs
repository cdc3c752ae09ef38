//! Equations of motion: Θ̇ = R ω, plus the effect of a turning trajectory, and
//! ω̇ = I⁻¹(m − ω × I ω) + R⁻¹ Δ, with their partial derivatives.

use crate::dynamics::RigidBody;
use crate::error::Error;
use crate::kinematics::{Kinematics, Sines, sines};
use crate::state::{BETA_LIMIT, State, angles, rates, state};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3};

/// Loads at one instant, which the right side needs besides the state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Sum of all moments about the body axes, N m.
    pub moment: Vector3<f64>,
    /// Disturbance Δ that enters ẋ_ω, rad/s².
    pub delta: Vector3<f64>,
    /// Turn rate of the trajectory's axes from [`crate::trajectory::Trajectory::turn_rate`], rad/s.
    pub turn_rate: Vector3<f64>,
}

/// State derivative. The angles follow Wu 2015 (1), and the rates Chai 2022 (1) with Δ = Δ_f-dot +
/// R Δ_m of (4b) put into the rate equation.
pub fn derivative(body: &RigidBody, kinematics: Kinematics, state: &State, load: &Load) -> State {
    derivative_at(body, kinematics, &sines(&angles(state)), &rates(state), load)
}

/// State derivative, given the sines and cosines of the angles and the rates.
pub(super) fn derivative_at(
    body: &RigidBody,
    kinematics: Kinematics,
    sines: &Sines,
    rates: &Vector3<f64>,
    load: &Load,
) -> State {
    let (matrix, inverse) = kinematics.r_and_inverse(sines);
    let acceleration = body.angular_acceleration(rates, &load.moment) + inverse * load.delta;
    let angle_rates = angle_rates(kinematics, &matrix, (sines, rates), &load.turn_rate);
    state(&angle_rates, &acceleration)
}

/// Rates Θ̇ of the attitude angles (rad/s) by Wu 2015 (1), with R at these angles as `matrix`, the
/// sines and cosines of the angles, and the body rates (rad/s).
pub(super) fn angle_rates(
    kinematics: Kinematics,
    matrix: &Matrix3<f64>,
    (sines, rates): (&Sines, &Vector3<f64>),
    turn_rate: &Vector3<f64>,
) -> Vector3<f64> {
    let angle_rates = matrix * rates;
    if *turn_rate == Vector3::zeros() {
        return angle_rates;
    }
    angle_rates + kinematics.turn_at(sines) * turn_rate
}

/// Partial derivatives of the state derivative [`derivative`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Partials {
    /// Derivative with respect to the state (6 × 6).
    pub by_state: Matrix6<f64>,
    /// Derivative with respect to the moment (6 × 3).
    pub by_moment: Matrix6x3<f64>,
    /// Derivative with respect to the trajectory's turn rate (6 × 3).
    pub by_turn_rate: Matrix6x3<f64>,
}

/// Returns the partial derivatives of [`derivative`].
pub fn partial_derivatives(
    body: &RigidBody,
    kinematics: Kinematics,
    state: &State,
    load: &Load,
) -> Partials {
    let (angles, rates) = (angles(state), rates(state));
    let (r, r_inverse) = (kinematics.r(&angles), kinematics.r_inverse(&angles));
    let (r_alpha, r_beta) = (kinematics.r_alpha(&angles), kinematics.r_beta(&angles));
    let gyroscopic: Matrix3<f64> =
        (body.inertia * rates).cross_matrix() - rates.cross_matrix() * body.inertia;
    let turned_by_beta = kinematics.turn_beta(&angles) * load.turn_rate;
    let turned_by_sigma = kinematics.turn_sigma(&angles) * load.turn_rate;
    let delta = r_inverse * load.delta;

    let mut by_state = Matrix6::zeros();
    by_state.fixed_view_mut::<3, 1>(0, 0).copy_from(&(r_alpha * rates));
    by_state.fixed_view_mut::<3, 1>(0, 1).copy_from(&(r_beta * rates + turned_by_beta));
    by_state.fixed_view_mut::<3, 1>(0, 2).copy_from(&turned_by_sigma);
    by_state.fixed_view_mut::<3, 3>(0, 3).copy_from(&r);
    // ∂R⁻¹ = −R⁻¹ ∂R R⁻¹
    by_state.fixed_view_mut::<3, 1>(3, 0).copy_from(&-(r_inverse * (r_alpha * delta)));
    by_state.fixed_view_mut::<3, 1>(3, 1).copy_from(&-(r_inverse * (r_beta * delta)));
    by_state.fixed_view_mut::<3, 3>(3, 3).copy_from(&(body.inverse * gyroscopic));

    let mut by_moment = Matrix6x3::zeros();
    by_moment.fixed_view_mut::<3, 3>(3, 0).copy_from(&body.inverse);
    let mut by_turn_rate = Matrix6x3::zeros();
    by_turn_rate.fixed_view_mut::<3, 3>(0, 0).copy_from(&kinematics.turn(&angles));
    Partials { by_state, by_moment, by_turn_rate }
}

/// Checks that the equations hold at a state.
///
/// # Errors
/// Reports a state that is not finite or has a sideslip angle of ±90°.
pub fn check(state: &State, time: f64) -> Result<(), Error> {
    if !state.iter().all(|value| value.is_finite()) {
        return Err(Error::NotFinite { time, what: "attitude or rate" });
    }
    if state[1].abs() >= BETA_LIMIT {
        return Err(Error::Singular { time, beta_deg: state[1].to_degrees() });
    }
    Ok(())
}
