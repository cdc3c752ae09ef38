//! Causes that drive the vehicle off a nominal trajectory: Δ, the inertia error, the errors of
//! measurement, and the change of F between where the law evaluates it and where the vehicle is.

use super::smoothness::{Smoothness, turns};
use crate::body::Body;
use crate::interval::{Interval, number};
use crate::sums::Pair;
use control::crmpc::Settings;

/// Braking rate of angle of attack and bank, 1/s, by step 6 of docs/proof.md.
pub(super) const BRAKING: f64 = 0.01;

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
    pub(super) inertia: InertiaError,
    pub(super) slow: SlowErrors,
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

/// Effect ν of the inertia error. With I_v = (1 + c) S, S = I^½ (1 + E) I^½ and M = S⁻¹ − I⁻¹,
///
/// ν = R [−c/(1 + c) I⁻¹ m + M (m/(1 + c) − ω × S ω) − I⁻¹ (ω × (S − I) ω)].
///
/// ‖ω × X ω‖ is at most half the range of the eigenvalues of X times ‖ω‖². Those of S lie between
/// (1 − ε) I_min and (1 + ε) I_max, those of S − I between −ε I_max and ε I_max.
#[derive(Clone, Copy, Debug)]
pub(super) struct InertiaError {
    /// Bound on ‖ν‖, rad/s².
    pub(super) acceleration: Interval,
    /// Moment that has the effect of the parts with I⁻¹, N m.
    pub(super) direct: Interval,
    /// Moment on which M acts, times ‖I^½ M I^½‖, N m.
    pub(super) turned: Interval,
    /// √(I_max/I_min), by which the latter grows if it is expressed as a moment: I M = I^½ D I^−½
    /// with ‖D‖ ≤ ε/(1 − ε).
    pub(super) root_condition: Interval,
}

impl InertiaError {
    /// Bounds the effect for ‖ω‖ ≤ `rate` and |β| ≤ `sideslip`.
    fn new(s: &Settings, body: &Body, rate: f64, sideslip: f64) -> Self {
        let [x, z, y] = body.principal();
        let (smallest, largest) = (x.min(y).min(z), x.max(y).max(z));
        let (one, half, square) = (Interval::ONE, number(0.5), number(rate).square());
        let [common, tensor, limit] =
            [s.inertia_error, s.tensor_error, s.limit_total()].map(number);
        let range = (one + tensor) * largest - (one - tensor) * smallest;
        let direct = common / (one - common) * limit + tensor * largest * square;
        let turned = tensor / (one - tensor) * (limit / (one - common) + half * range * square);
        let secant = one / number(sideslip).sin_cos().1;
        Self {
            acceleration: (direct + turned) * secant / smallest,
            direct,
            turned,
            root_condition: (largest / smallest).sqrt(),
        }
    }
}

/// Effect of the slow errors e. The navigated angles Θ′ = Θ + e and rates x′ = R(Θ′) ω obey Θ̇′ =
/// x′ + ζ and ẋ′ = F(Θ′, x′, m) + ν + R(Θ′) R(Θ)⁻¹ Δ + ∂R[ζ] ω, with ζ = ė + (R(Θ) − R(Θ′)) ω.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlowErrors {
    /// Bound on ‖ζ‖, rad/s.
    pub(super) angle_drift: Interval,
    /// Bound on the norm of the acceleration besides F and Δ, rad/s².
    pub(super) acceleration: Interval,
}

impl SlowErrors {
    /// Bounds the effect for ‖ω‖ ≤ `rate` and |β′| ≤ `sideslip`.
    fn new(s: &Settings, rate: f64, sideslip: f64) -> Self {
        let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
        let [_, first, ..] = turns(sideslip + s.slow_angle_error);
        // The difference of R at both attitudes, as R⁻¹ has the norm 1.
        let turned = first * root2 * number(s.slow_angle_error);
        let angle_drift = root3 * number(s.slow_angle_rate) + turned * number(rate);
        let disturbance = root3 * number(s.disturbance_bound);
        let acceleration = first * angle_drift * number(rate) + turned * disturbance;
        Self { angle_drift, acceleration }
    }
}

/// Bounds how F differs along the true and the predicted trajectory. The distance z of the rates
/// grows by what drives them apart and by the difference f of F itself, for which the function
/// finds an upper bound.
fn mismatch(
    s: &Settings,
    bounds: &Smoothness,
    inertia: &InertiaError,
    slow: SlowErrors,
) -> Option<Mismatch> {
    let (d, tau, half) = (number(s.delay), number(s.period_feedback), number(0.5));
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let (delta, eta, e) =
        (number(s.disturbance_bound), number(s.angle_error), number(s.rate_error));
    let Smoothness { by_rates, by_angles, .. } = *bounds;
    let end = d + tau;
    let lasting = inertia.acceleration + slow.acceleration;
    let (drive, drive_of_two) = (root3 * delta + lasting, root2 * delta + lasting);
    let rates = |drive: Interval, t: Interval| root3 * e + drive * t;
    let angles = |drive: Interval, t: Interval| {
        root2 * (eta + e * t) + slow.angle_drift * t + half * drive * t.square()
    };
    // Part of one that remains when F drives two motions further apart in turn.
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
        let angles = root2 * (eta * t + half * e * t.square())
            + half * slow.angle_drift * t.square()
            + sixth * drive_of_two * t.square() * t;
        by_rates * rates + by_angles * angles
    };
    let unseen = sum(d);
    // Two predictions differ by the effects within a period, and by both errors.
    let apart = [root3 * e + rates(drive, tau), root2 * eta + angles(drive_of_two, tau)];
    let grown = (by_rates * apart[0] + by_angles * (apart[1] + apart[0] * d)) / slack;
    let rate = apart[0] + grown * d;
    let since = by_rates * rate * d + by_angles * (apart[1] * d + half * rate * d.square());
    Some(Mismatch {
        drifted: sum(end).upper() - unseen,
        unseen: [d * unseen, unseen],
        revised: (sum(tau) + since).upper(),
        apart: [rates(drive, end), angles(drive_of_two, end)],
    })
}

impl Causes {
    /// Finds bounds that hold in a domain which contains the predicted trajectories, too.
    pub(super) fn new(s: &Settings) -> Option<Self> {
        let (d, tau) = (number(s.delay), number(s.period_feedback));
        let body = Body::new(s)?;
        let mut margin = [0.01 * s.limit_rate + 1.5 * s.rate_error, 1e-3 + 1.5 * s.angle_error];
        for _ in 0..12 {
            let sideslip = s.sideslip_domain + margin[1];
            let most = 2.0 * s.limit_rate;
            let sideslip_before = sideslip + (d * number(most)).high;
            let angle_drift = SlowErrors::new(s, most, sideslip_before).angle_drift.high;
            let sideslip_before = sideslip_before + (d * number(angle_drift)).high;
            if sideslip_before > 0.95 {
                return None;
            }
            let bounds = Smoothness::new(s, s.limit_rate + margin[0], sideslip)?;
            let before = margin[0] + (bounds.turning * d).high;
            let inertia = InertiaError::new(s, &body, s.limit_rate + before, sideslip_before);
            let slow = SlowErrors::new(s, s.limit_rate + before, sideslip_before);
            if slow.angle_drift.high > angle_drift {
                return None;
            }
            let later = mismatch(s, &bounds, &inertia, slow)?;
            let [rate, angle] = later.apart;
            let ripple = bounds.slope * tau.square();
            let outside = [rate + angle * bounds.angle_rate + ripple, angle + ripple * tau];
            if outside[0].high <= margin[0] && outside[1].high <= margin[1] {
                let wider = Smoothness::new(s, s.limit_rate + before, sideslip_before)?;
                let first = mismatch(s, &wider, &inertia, slow)?;
                let ticks = (s.delay / s.period_feedback).ceil() as usize;
                let middle = middle(&bounds, tau);
                return Some(Self {
                    disturbance: number(s.disturbance_bound),
                    errors: [number(s.angle_error), number(s.rate_error)],
                    inertia,
                    slow,
                    later,
                    first: (first, ticks),
                    smoothness: bounds,
                    middle,
                    sideslip: sideslip_before,
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
