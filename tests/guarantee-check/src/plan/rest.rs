//! Beyond the horizon: the plan brakes, with a = −κ ∘ x held over each optimisation period.
//!
//! The rates shrink by 1 − κ h per period and keep their signs, so that every later state has rates
//! between zero and those at the horizon, and angles between those at the horizon and the limit
//! that is x (1/κ − h/2) away. All states of that box are checked at once, with the deviation that
//! is never exceeded. The moment depends on the attitude itself, and not on how far it is from the
//! plan's, so that the box of attitudes is divided as far as necessary.

use super::causes::BRAKING;
use super::deviation::Deviation;
use super::law::{self, Range};
use super::{Left, PlanCheck};
use crate::interval::Interval;
use control::crmpc::Plan;

/// Width of the boxes of angles with which the search begins, rad.
const WIDTH: f64 = 0.1;
/// Smallest width of a box that is halved, rad.
const NARROWEST: f64 = 2e-3;

/// Interval between zero and `value`.
fn down_to_zero(value: f64) -> Interval {
    Interval::new(value.min(0.0), value.max(0.0))
}

impl PlanCheck {
    /// Bounds the motion after the horizon.
    pub(super) fn rest(&self, plan: &Plan, forever: &Deviation) -> Left {
        let nothing = Left { sideslip: f64::NAN, rate: f64::NAN, moment: f64::NAN };
        let Some(last) = plan.states.last() else { return nothing };
        let h = Interval::from(self.settings.period_optimisation);
        let braking = [BRAKING, plan.braking, BRAKING].map(Interval::from);
        let brakes = |kappa: &Interval| kappa.low > 0.0 && (*kappa * h).high <= 1.0 + 1e-12;
        if !braking.iter().all(brakes) {
            return nothing;
        }
        let travelled = |i: usize| {
            let reach = Interval::ONE / braking[i] - Interval::from(0.5) * h;
            let end = Interval::from(last[i]) + Interval::from(last[3 + i]) * reach;
            Interval::from(last[i]).hull(end)
        };
        let angles = [travelled(0), travelled(1)];
        let rates: [f64; 3] = std::array::from_fn(|i| last[3 + i]);
        let left = self.sideslip_and_rates_at_rest(angles[1], &rates, forever);
        Left { moment: self.moment_at_rest(angles, &rates, &braking, forever), ..left }
    }

    fn sideslip_and_rates_at_rest(
        &self,
        sideslip: Interval,
        rates: &[f64; 3],
        forever: &Deviation,
    ) -> Left {
        let off = forever.angle.component() + forever.bulge;
        let near = (sideslip.abs() - off).low.max(0.0);
        let cosine = super::body::sin_cos(Interval::from(near)).1;
        let size = |i: usize| Interval::from(rates[i].abs()) + forever.rate.half;
        let squares = (cosine * size(0)).square() + size(1).square() + size(2).square();
        let rate = squares.sqrt() + forever.rate.norm + self.reach.swing;
        let (domain, limit) = (self.settings.sideslip_domain, self.settings.limit_rate);
        Left {
            sideslip: (domain - (sideslip.abs() + off).high) / domain,
            rate: (limit - rate.high) / limit,
            moment: 1.0,
        }
    }

    /// Smallest unused share of the moment limit at any of the `angles`.
    fn moment_at_rest(
        &self,
        angles: [Interval; 2],
        rates: &[f64; 3],
        braking: &[Interval; 3],
        forever: &Deviation,
    ) -> f64 {
        // The law evaluates the moment at the predicted attitude, which deviates from the plan's.
        let off = forever.law_angle.component().high;
        let mut boxes = divided(angles.map(|angle| angle + Interval::new(-off, off)));
        let mut least = 1.0_f64;
        while let Some(angles) = boxes.pop() {
            let range = at_rest(angles, rates, braking, forever);
            let added = law::remainder(&self.body, &range) + self.added(forever);
            let limit = self.settings.limit_moment;
            let moment = law::largest(&self.body, &range) + added.high;
            let left = (limit - self.settings.needed_by_known() - moment) / limit;
            let wide = usize::from(angles[1].width() > angles[0].width());
            if left < 0.0 && angles[wide].width() > NARROWEST {
                let middle = angles[wide].middle();
                let (mut below, mut above) = (angles, angles);
                (below[wide].high, above[wide].low) = (middle, middle);
                boxes.extend([below, above]);
            } else {
                least = if left.is_nan() { f64::NAN } else { least.min(left) };
                if least.is_nan() || least < 0.0 {
                    return least;
                }
            }
        }
        least
    }
}

fn at_rest(
    angles: [Interval; 2],
    rates: &[f64; 3],
    braking: &[Interval; 3],
    forever: &Deviation,
) -> Range {
    let half = Interval::from(0.5);
    let Deviation { law_rate, feedback, .. } = *forever;
    let middle = |side: Interval| Interval::from(side.middle());
    let radius = |side: Interval| (side - middle(side)).abs();
    let rates = rates.map(down_to_zero);
    let sides = [angles[0], angles[1], rates[0], rates[1], rates[2]];
    let deviation = |i: usize| if i < 2 { Interval::ZERO } else { law_rate.half };
    let largest = |i: usize| half * braking[i] * rates[i].abs();
    Range {
        centre: sides.map(middle),
        radii: std::array::from_fn(|i| Interval::from((radius(sides[i]) + deviation(i)).high)),
        norms: [Interval::ZERO, law_rate.norm],
        acceleration: std::array::from_fn(|i| -(braking[i] * middle(rates[i]))),
        feedback: std::array::from_fn(|i| Interval::from((feedback.half + largest(i)).high)),
    }
}

/// Divides a box of angles into boxes of at most [`WIDTH`]. The moment has the period 2π in α.
fn divided(angles: [Interval; 2]) -> Vec<[Interval; 2]> {
    let turn = 2.0 * std::f64::consts::PI.next_up();
    let once = |angle: Interval| Interval::new(angle.low, angle.high.min(angle.low + turn));
    let parts = |angle: Interval| {
        let count = (angle.width() / WIDTH).ceil().clamp(1.0, 1e4) as usize;
        let at = move |i: usize| angle.low + (angle.high - angle.low) * (i as f64 / count as f64);
        (0..count)
            .map(move |i| Interval::new(at(i), if i + 1 == count { angle.high } else { at(i + 1) }))
    };
    let beside = |alpha: Interval| parts(angles[1]).map(move |beta| [alpha, beta]);
    parts(once(angles[0])).flat_map(beside).collect()
}
