//! The terminal law (14), ũ^f = −f + K̃ Ẽ + Θ̈_r, hence a = K̃ Ẽ + Θ̈_r.

use super::settings::Settings;
use super::state::split;
use crate::linearise;
use nalgebra::{Vector3, Vector6};
use vehicle::reference::Reference;

/// Largest share of the rate limit to which the terminal law steers if there is no optimum.
const SHARE_OF_RATE: f64 = 0.8;

/// Returns the acceleration under the terminal law, rad/s².
pub(super) fn acceleration(
    settings: &Settings,
    state: &Vector6<f64>,
    reference: &Reference,
) -> Vector3<f64> {
    let gain = settings.terminal;
    let angles = state.fixed_rows::<3>(0) - reference.angles;
    let rates = state.fixed_rows::<3>(3) - reference.rates;
    angles * gain.k1 + rates * gain.k2 + reference.accelerations
}

/// Returns the acceleration under the terminal law with limited rates and moment, rad/s². The
/// limited rates are those to which the law steers, Θ̇_r − (k̃₁/k̃₂) E_θ.
pub(super) fn acceleration_within_limits(
    settings: &Settings,
    state: &Vector6<f64>,
    reference: &Reference,
) -> Vector3<f64> {
    let Settings { terminal: gain, limit_rate, .. } = settings;
    let (angles, rates) = split(state);
    let target_rates = reference.rates - (angles - reference.angles) * (gain.k1 / gain.k2);
    let excess = target_rates.norm() / (SHARE_OF_RATE * limit_rate);
    let (target_rates, target_acceleration) = if excess > 1.0 {
        (target_rates / excess, Vector3::zeros())
    } else {
        (target_rates, reference.accelerations)
    };
    within_the_moment(settings, state, (rates - target_rates) * gain.k2 + target_acceleration)
}

/// Returns the largest share of `acceleration` whose moment is within the limit. The share is zero
/// if even zero acceleration exceeds the limit.
fn within_the_moment(
    settings: &Settings,
    state: &Vector6<f64>,
    acceleration: Vector3<f64>,
) -> Vector3<f64> {
    let (angles, rates) = split(state);
    let Settings { body, limit_moment, .. } = settings;
    let motion = linearise::InverseKinematics::at(&angles).motion(body, &rates);
    if motion.moment(&acceleration).norm() <= *limit_moment {
        return acceleration;
    }
    // ‖m‖² is a parabola in the share; its larger root is the result.
    let (slope, rest) = (motion.moment_by_acceleration * acceleration, motion.moment_at_rest);
    let (square, mixed) = (slope.norm_squared(), slope.dot(&rest));
    let discriminant = mixed * mixed - square * (rest.norm_squared() - limit_moment * limit_moment);
    acceleration * ((discriminant.max(0.0).sqrt() - mixed) / square).max(0.0)
}
