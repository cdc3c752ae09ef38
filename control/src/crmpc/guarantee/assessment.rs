//! Room that the tightening leaves within the limits at rest and beyond the horizon.

use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::geometry::BRAKING;
use super::losses::{MomentLoss, RateLoss};
use super::switching::{Carried, Switching};
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

/// Returns what is left of the limits (rad/s, N m) beyond a motion with ‖x̃_ω‖ ≤ `x` and ‖a‖ ≤ `a`,
/// with the deviation that is never exceeded and `more` of it, at any attitude.
pub(super) fn left(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    more: Option<&Deviation>,
    (x, a): (f64, f64),
) -> (f64, f64) {
    let mut deviation = *tightening.forever();
    let mut moment_loss = tightening.tick(usize::MAX).moment_loss;
    if let Some(more) = more {
        deviation = deviation.plus(more);
        moment_loss =
            MomentLoss::new(dynamics, &deviation, tightening.bearing, s.period_optimisation);
    }
    let Deviation { angle, rate, .. } = deviation;
    let of_rates = s.limit_rate - RateLoss::new(angle, rate, 0.0, 0.0).at(TURN_OF_RATES * x, x);
    let loss = moment_loss.at(tightening.bearing, dynamics.slopes(x, a), (x, a));
    let of_moment = s.limit_moment - s.needed_by_known();
    (of_rates - x, of_moment - loss - dynamics.nominal_moment(x, a))
}

/// Returns the rate κ (1/s) at which the sideslip has to brake beyond a horizon that ends with the
/// angle `sideslip` and the rates `rates`. While braking, β travels by |β̇|/κ, and all limits must
/// hold. `carried` is the deviation that the plan's changes of acceleration leave at the end of the
/// horizon, `last` the size of the acceleration before it, and `turn` (rad/s) what the turn of the
/// trajectory needs. The result is `None` if that is impossible.
pub(in crate::crmpc) fn braking(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    sideslip: f64,
    rates: &Vector3<f64>,
    (carried, last, turn): (&Carried, f64, f64),
) -> Option<f64> {
    let with = |more: Option<&Deviation>| {
        let angle = tightening.forever().angle + more.map_or(0.0, |more| more.angle);
        let room = s.sideslip_domain - angle - sideslip.abs();
        let by_room = if rates.y == 0.0 { 0.0 } else { rates.y.abs() / room };
        // A κ beyond 1/h would reverse the motion.
        (room >= 0.0 && by_room * s.period_optimisation <= 1.0).then_some(by_room.max(BRAKING))
    };
    let mut braking = with(None)?;
    let mut more = None;
    if let Some(switching) = &tightening.switching {
        let most = 2.0 * braking;
        let left = while_braking(s, switching, carried, last, (rates, most));
        braking = with(Some(&left)).filter(|&braking| braking <= most)?;
        more = Some(left);
    }
    let sizes = (rates.norm(), braked(rates, braking).norm());
    let (rate, moment) = left(s, dynamics, tightening, more.as_ref(), sizes);
    (rate >= turn && moment >= 0.0).then_some(braking)
}

/// Returns the acceleration, but for its sign, of a motion that brakes.
pub(super) fn braked(rates: &Vector3<f64>, braking: f64) -> Vector3<f64> {
    rates.component_mul(&Vector3::new(BRAKING, braking, BRAKING))
}

/// Returns what changes of the acceleration add to the deviation while a motion with these `rates`
/// at first brakes by no more than the rate `most` (1/s). The first change is that from the
/// acceleration of size `last`. From step to step the acceleration changes by less than κ h of
/// itself.
pub(super) fn while_braking(
    s: &Settings,
    switching: &Switching,
    carried: &Carried,
    last: f64,
    (rates, most): (&Vector3<f64>, f64),
) -> Deviation {
    let a = braked(rates, most).norm();
    let first = switching.begin(carried, last + a);
    switching.forever(&first, most * s.period_optimisation * a)
}

/// Returns the largest ‖x̃_ω‖ at the end of the horizon from which the motion can brake while the
/// trajectory's turn needs `turn` of the rate limit, rad/s. `switching` holds the other arguments
/// of [`while_braking`] if the delay is not exact.
pub(in crate::crmpc) fn terminal_rate(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    switching: Option<(&Switching, &Carried, f64, &Vector3<f64>)>,
    turn: f64,
) -> f64 {
    let more = switching.map(|(switching, carried, last, rates)| {
        while_braking(s, switching, carried, last, (rates, 2.0 * BRAKING))
    });
    largest_rate(s, |x| {
        let (rate, moment) = left(s, dynamics, tightening, more.as_ref(), (x, BRAKING * x));
        (rate - turn, moment)
    })
}

/// Returns the largest ‖x̃_ω‖ (rad/s) for which something is `left` of both limits.
pub(super) fn largest_rate(s: &Settings, left: impl Fn(f64) -> (f64, f64)) -> f64 {
    let is_left = |x: f64| {
        let (rate, moment) = left(x);
        rate > 0.0 && moment > 0.0
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

/// Computes what is left of the limits at rest and for the motion beyond the horizon, at any
/// attitude.
pub(super) fn assess(s: &Settings, dynamics: &Dynamics, tightening: &Tightening) -> Assessment {
    let left = |x: f64| left(s, dynamics, tightening, None, (x, BRAKING * x));
    let (rate, moment) = left(0.0);
    Assessment {
        rate_left: rate / s.limit_rate,
        moment_left: moment / s.limit_moment,
        terminal_rate: largest_rate(s, left),
    }
}
