//! The state of the vehicle: attitude angles and body rates.

use nalgebra::{Vector3, Vector6};

/// State vector `[alpha, beta, sigma, p, q, r]` in rad and rad/s.
pub type State = Vector6<f64>;

/// Largest |β| (rad) at which the attitude angles are used, because R is singular at π/2.
pub const BETA_LIMIT: f64 = std::f64::consts::FRAC_PI_2 - 1e-6;

/// Returns the attitude angles Θ of a state, rad.
pub fn angles(state: &State) -> Vector3<f64> {
    state.fixed_rows::<3>(0).into()
}

/// Returns the body rates ω of a state, rad/s.
pub fn rates(state: &State) -> Vector3<f64> {
    state.fixed_rows::<3>(3).into()
}

/// Returns the state with the given angles (rad) and rates (rad/s).
pub fn state(angles: &Vector3<f64>, rates: &Vector3<f64>) -> State {
    Vector6::new(angles.x, angles.y, angles.z, rates.x, rates.y, rates.z)
}
