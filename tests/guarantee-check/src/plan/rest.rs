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
use control::crmpc::{Plan, Settings};

/// Width of the boxes of angles with which the search begins, rad.
const WIDTH: f64 = 0.1;
/// Number of times that a box is halved before the moment counts as too large.
const HALVINGS: u32 = 12;

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
        let off = forever.angle.component() + forever.bulge;
        let (size, sizes) = (angles[1].abs(), rates.map(|rate| Interval::from(rate.abs())));
        let rate = self.body_rates(size - off, sizes, forever);
        let Settings { sideslip_domain, limit_rate, .. } = self.settings;
        Left {
            sideslip: (sideslip_domain - (size + off).high) / sideslip_domain,
            rate: (limit_rate - rate.high) / limit_rate,
            moment: self.moment_at_rest(angles, &rates, &braking, forever),
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
        let off = forever.law_angle.component().to_both_sides();
        let [alpha, beta] = angles.map(|angle| angle + off);
        // The moment has the period 2π in α.
        let turn = 2.0 * std::f64::consts::PI.next_up();
        let alpha = Interval::new(alpha.low, alpha.high.min(alpha.low + turn));
        let boxes =
            |angle: Interval| angle.parts((angle.width() / WIDTH).ceil().clamp(1.0, 1e4) as u32);
        let added = self.added(forever);
        let limit = self.settings.limit_moment - self.settings.needed_by_known();
        let (rest, mut most) = ((Interval::from(limit) - added).low, 0.0_f64);
        for angles in boxes(alpha).flat_map(|alpha| boxes(beta).map(move |beta| [alpha, beta])) {
            let range = at_rest(angles, rates, braking, forever);
            most = most.max(law::divided(&self.body, &range, rest, HALVINGS));
            if most > rest {
                break;
            }
        }
        (limit - (Interval::from(most) + added).high) / self.settings.limit_moment
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
