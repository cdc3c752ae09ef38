//! Room that the tightening leaves within the limits at rest and beyond the horizon.

use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::geometry::BRAKING;
use super::losses::RateLoss;
use super::tightening::Tightening;
use crate::crmpc::settings::Settings;
use crate::linearise::TURN_BY_ANGLES as TURN_OF_RATES;
use nalgebra::Vector3;

/// Remainder of the limits at rest and beyond the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assessment {
    /// Share of the rate limit that is left for the motion beyond the horizon.
    pub rate_left: f64,
    /// Share of the moment limit that is left after a constant corner of Δ̄, the errors and the
    /// delay, at the attitude that needs most.
    pub moment_left: f64,
    /// Largest ‖x̃_ω‖ at the end of the horizon, rad/s. From there the motion brakes and keeps
    /// every limit for ever.
    pub terminal_rate: f64,
}

impl Assessment {
    /// Returns whether the guarantee can be given.
    pub fn holds(&self) -> bool {
        self.terminal_rate >= SMALLEST_TERMINAL_RATE
    }
}

/// Smallest acceptable bound on ‖x̃_ω‖ at the end of the horizon, 0.2°/s in rad/s; below it there
/// is no room to move at all.
pub(super) const SMALLEST_TERMINAL_RATE: f64 = 3.5e-3;

/// Returns the remainder of the limits (rad/s, N m) beyond a motion with ‖x̃_ω‖ ≤ `x` and ‖a‖ ≤
/// `a`, with the deviation that is never exceeded, at any attitude.
pub(super) fn left(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    (x, a): (f64, f64),
) -> (f64, f64) {
    let Deviation { angle, rate, .. } = *tightening.forever();
    let moment_loss = tightening.tick(usize::MAX).moment_loss;
    let of_rates = s.limit_rate - RateLoss::new(angle, rate, 0.0, 0.0).at(TURN_OF_RATES * x, x);
    let loss = moment_loss.at(tightening.induced_norm, dynamics.slopes(x, a), (x, a));
    let of_moment = s.limit_moment - s.needed_by_known();
    (of_rates - x, of_moment - loss - dynamics.nominal_moment(x, a))
}

/// The end of a plan, from which the motion brakes.
pub(in crate::crmpc) struct HorizonEnd {
    /// Sideslip β̃, rad.
    pub sideslip: f64,
    /// Rates x̃_ω, rad/s.
    pub rates: Vector3<f64>,
    /// Part of the rate limit that the turn of the trajectory needs, rad/s.
    pub turn: f64,
}

impl HorizonEnd {
    /// Returns the acceleration, except for its sign, of a motion that begins to brake.
    fn braked(&self, braking: f64) -> Vector3<f64> {
        self.rates.component_mul(&Vector3::new(BRAKING, braking, BRAKING))
    }
}

/// Returns the braking, the rate κ_β (1/s) at which the sideslip has to brake beyond the horizon:
/// the least one with which β, which travels by |β̇|/κ_β, keeps its bound. All limits must hold
/// meanwhile (docs/proof.md, step 6). The result is `None` if that is impossible.
pub(in crate::crmpc) fn braking(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    end: &HorizonEnd,
) -> Option<f64> {
    let rate_of_sideslip = end.rates.y.abs();
    let room = s.sideslip_domain - tightening.forever().angle - end.sideslip.abs();
    let by_room = if rate_of_sideslip == 0.0 { 0.0 } else { rate_of_sideslip / room };
    // A κ beyond 1/h would reverse the motion.
    let is_possible = room >= 0.0 && by_room * s.period_optimisation <= 1.0;
    let braking = is_possible.then_some(by_room.max(BRAKING))?;
    let sizes = (end.rates.norm(), end.braked(braking).norm());
    let (rate, moment) = left(s, dynamics, tightening, sizes);
    (rate >= end.turn && moment >= 0.0).then_some(braking)
}

/// Returns the largest ‖x̃_ω‖ at the end of the horizon from which the motion can brake while the
/// trajectory's turn needs `turn` of the rate limit, rad/s.
pub(in crate::crmpc) fn terminal_rate(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    turn: f64,
) -> f64 {
    let is_left = |x: f64| {
        let (rate, moment) = left(s, dynamics, tightening, (x, BRAKING * x));
        rate - turn > 0.0 && moment > 0.0
    };
    let (mut low, mut high) = (0.0, s.limit_rate);
    if is_left(0.0) {
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if is_left(middle) { low = middle } else { high = middle }
        }
    }
    low
}

/// Computes the remainder of the limits at rest and for the motion beyond the horizon, at any
/// attitude.
pub(super) fn assess(s: &Settings, dynamics: &Dynamics, tightening: &Tightening) -> Assessment {
    let (rate, moment) = left(s, dynamics, tightening, (0.0, 0.0));
    Assessment {
        rate_left: rate / s.limit_rate,
        moment_left: moment / s.limit_moment,
        terminal_rate: terminal_rate(s, dynamics, tightening, 0.0),
    }
}
