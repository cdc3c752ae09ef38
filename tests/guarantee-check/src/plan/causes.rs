//! What drives the vehicle off a nominal trajectory: Δ, the inertia error, the errors of
//! measurement, and the change of F between where the law evaluates it and where the vehicle is.

use super::body::{Body, sin_cos};
use super::smoothness::Smoothness;
use crate::interval::Interval;
use crate::sums::Pair;
use control::crmpc::Settings;

/// Parts of the mismatch of one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mismatch {
    /// ∫ ‖F(x, m) − F(predicted, m)‖ over the period, rad/s.
    pub(super) drifted: Interval,
    /// Parts of φ: angle (rad) and rate (rad/s).
    pub(super) unseen: Pair,
    /// ∫ ‖F‖ of the differences between one prediction, the truth and the next prediction, rad/s.
    pub(super) revised: Interval,
    /// Largest distance of the rates (rad/s) and of the angles α, β (rad) from their prediction.
    pub(super) apart: [Interval; 2],
}

/// Everything that drives the deviation.
pub(super) struct Causes {
    pub(super) disturbance: Interval,
    /// Bounds on the error of each measured angle and rate.
    pub(super) errors: Pair,
    /// Bound on ‖ν‖, rad/s².
    pub(super) inertia: Interval,
    pub(super) later: Mismatch,
    /// Mismatch while a part of the prediction lies before the nominal trajectory, where the rates
    /// may exceed their limit, and the number of such ticks.
    pub(super) first: (Mismatch, usize),
    pub(super) smoothness: Smoothness,
    /// Difference of F at the predicted middle of the period from the intended acceleration,
    /// rad/s².
    pub(super) middle: Interval,
    /// Largest sideslip of the vehicle and of all predictions, rad.
    pub(super) sideslip: f64,
}

fn number(value: f64) -> Interval {
    Interval::from(value)
}

/// Keeps the upper end of a bound.
fn upper(value: Interval) -> Interval {
    Interval::point(value.high)
}

/// Bounds how F differs along the true and the predicted trajectory. The distance z of the rates
/// grows by what drives them apart and by the difference f of F itself, for which the function
/// finds an upper bound.
fn mismatch(s: &Settings, bounds: &Smoothness, inertia: Interval) -> Option<Mismatch> {
    let (d, tau, half) = (number(s.delay), number(s.period_feedback), number(0.5));
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let (delta, eta, e) =
        (number(s.disturbance_bound), number(s.angle_error), number(s.rate_error));
    let Smoothness { by_rates, by_angles, .. } = *bounds;
    let end = d + tau;
    let (drive, drive_of_two) = (root3 * delta + inertia, root2 * delta + inertia);
    let rates = |drive: Interval, t: Interval| root3 * e + drive * t;
    let angles = |drive: Interval, t: Interval| root2 * (eta + e * t) + half * drive * t.square();
    let slack = Interval::ONE - by_rates * end - half * by_angles * end.square();
    if slack.low <= 0.1 {
        return None;
    }
    let f = (by_rates * rates(drive, end) + by_angles * angles(drive_of_two, end)) / slack;
    let (drive, drive_of_two) = (drive + f, drive_of_two + f);
    // Integrals over [0, t] of the two distances.
    let sixth = Interval::ONE / number(6.0);
    let sum = |t: Interval| {
        let rates = root3 * e * t + half * drive * t.square();
        let angles =
            root2 * (eta * t + half * e * t.square()) + sixth * drive_of_two * t.square() * t;
        by_rates * rates + by_angles * angles
    };
    let unseen = sum(d);
    // Two predictions differ by what has happened within a period, and by both errors.
    let apart = [root3 * e + rates(drive, tau), root2 * eta + angles(drive_of_two, tau)];
    let grown = (by_rates * apart[0] + by_angles * (apart[1] + apart[0] * d)) / slack;
    let rate = apart[0] + grown * d;
    let since = by_rates * rate * d + by_angles * (apart[1] * d + half * rate * d.square());
    Some(Mismatch {
        drifted: upper(sum(end)) - unseen,
        unseen: [d * unseen, unseen],
        revised: upper(sum(tau) + since),
        apart: [rates(drive, end), angles(drive_of_two, end)],
    })
}

impl Causes {
    /// Finds bounds that hold in a domain which contains the predicted trajectories, too.
    pub(super) fn new(s: &Settings) -> Option<Self> {
        let (d, tau) = (number(s.delay), number(s.period_feedback));
        let body = Body::new(s)?;
        let [x, z, y] = body.principal();
        let smallest = x.min(y).min(z);
        let mut margin = [0.01 * s.limit_rate + 1.5 * s.rate_error, 1e-3 + 1.5 * s.angle_error];
        for _ in 0..12 {
            let sideslip = s.sideslip_domain + margin[1];
            let early = sideslip + (d * number(2.0 * s.limit_rate)).high;
            if early > 0.95 {
                return None;
            }
            let secant = Interval::ONE / sin_cos(number(early)).1;
            let iota = number(s.inertia_error) / (Interval::ONE - number(s.inertia_error));
            let inertia = iota * number(s.limit_moment) * secant / smallest;
            let bounds = Smoothness::new(s, s.limit_rate + margin[0], sideslip)?;
            let later = mismatch(s, &bounds, inertia)?;
            let [rate, angle] = later.apart;
            let swing = bounds.slope * tau.square();
            let outside = [rate + angle * bounds.angle_rate + swing, angle + swing * tau];
            if outside[0].high <= margin[0] && outside[1].high <= margin[1] {
                let before = margin[0] + (bounds.turning * d).high;
                let wider = Smoothness::new(s, s.limit_rate + before, early)?;
                let first = mismatch(s, &wider, inertia)?;
                let ticks = (s.delay / s.period_feedback).ceil() as usize;
                let middle = middle(&bounds, tau);
                return Some(Self {
                    disturbance: number(s.disturbance_bound),
                    errors: [number(s.angle_error), number(s.rate_error)],
                    inertia,
                    later,
                    first: (first, ticks),
                    smoothness: bounds,
                    middle,
                    sideslip: early,
                });
            }
            margin = [0, 1].map(|i| (1.2 * outside[i].high).max(margin[i]));
        }
        None
    }
}

/// The law evaluates F at the middle of a parabola, from which the predicted trajectory differs by
/// the effect of the change of F within half a period, and by the difference at the middle itself.
fn middle(bounds: &Smoothness, tau: Interval) -> Interval {
    let Smoothness { by_rates, by_angles, slope, .. } = *bounds;
    let (eighth, square) = (number(0.125), tau.square());
    let change = by_rates * eighth * square + by_angles * square * tau / number(24.0);
    let at_middle = number(0.5) * by_rates * tau + eighth * by_angles * square;
    slope * change / (Interval::ONE - at_middle)
}
