//! Equations of motion: Θ̇ = R ω, plus the effect of a turning trajectory, and
//! ω̇ = I⁻¹(m − ω × I ω) + R⁻¹ Δ.

use crate::dynamics::RigidBody;
use crate::error::Error;
use crate::kinematics::{Kinematics, Sines, sines};
use crate::state::{BETA_LIMIT, State, angles, rates, state};
use nalgebra::{Matrix3, Vector3};

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
