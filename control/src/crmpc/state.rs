//! The state (Θ, x_ω) as one vector and as two.

use crate::mpc::State;
use nalgebra::{Vector3, Vector6};
use vehicle::reference::Reference;

/// Returns the tracking error E = x̃ − x_r.
pub(super) fn error(state: &Vector6<f64>, reference: &Reference) -> State<2> {
    let (angles, rates) = split(state);
    [angles - reference.angles, rates - reference.rates]
}

pub(super) fn join(angles: &Vector3<f64>, rates: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angles.x, angles.y, angles.z, rates.x, rates.y, rates.z)
}

pub(super) fn split(state: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (state.fixed_rows::<3>(0).into_owned(), state.fixed_rows::<3>(3).into_owned())
}
