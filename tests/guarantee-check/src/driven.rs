//! Causes of the deviation from the nominal trajectory, computed anew from the bounds and rounded
//! outwards.

use crate::interval::{Interval, number};
use control::crmpc::{Domain, Lemmas, Settings, TURN};
use control::error_dynamics::InitialTicks;

/// Causes that drive the vehicle off its prediction, apart from the mismatch.
pub(crate) struct Drive {
    pub of_three: Interval,
    pub of_two: Interval,
    pub of_inertia: Interval,
    /// Difference of the derivative of the navigated angles from the navigated rates, and the
    /// acceleration that it amounts to.
    pub angle_drift: Interval,
    pub of_angle_drift: Interval,
    /// Errors of all rates, of two of them, and of two angles.
    pub errors: [Interval; 3],
    /// Moments that the inertia error amounts to: along the acting one, and in any direction.
    pub inertia: [Interval; 2],
}

/// How F differs from the acceleration that the law intended.
pub(crate) struct Mismatch {
    pub mean: Interval,
    pub peak: Interval,
    pub unseen_rate: Interval,
    pub mispredicted: Interval,
    /// Bound on ‖dF/dt‖, and the shift of the angle by it over a period.
    pub slope: Interval,
    pub angle_shift: Interval,
    /// Largest ‖ω‖ and |β| of predictions.
    pub domain: [Interval; 2],
}

/// Quantities that drive the deviation from the nominal trajectory.
pub(crate) struct Driven {
    pub drive: Drive,
    pub mismatch: Mismatch,
    pub initial: [InitialTicks; 3],
    /// Largest angle drift at any time.
    pub angle_drift: Interval,
    /// Deviation of the rates between two ticks.
    pub between: Interval,
    pub turning: Interval,
    pub turned: [Interval; 2],
    pub initial_moment: Interval,
    /// Largest ‖I^½ D I^−½‖ of a symmetric D with ‖D‖ ≤ 1.
    pub root_condition: Interval,
    /// Largest ‖ω‖ and |β| of the vehicle before the nominal trajectory began.
    pub vehicle_before: [Interval; 2],
    pub domain_before: [Interval; 2],
}

fn drive(s: &Settings, lemmas: &Lemmas) -> Drive {
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let [limit, smallest, largest, disturbance] =
        [s.limit_total(), lemmas.dynamics.smallest, lemmas.dynamics.largest, s.disturbance_bound]
            .map(number);
    let (common, tensor) = (number(s.inertia_error), number(s.tensor_error));
    let Domain { rate, sideslip } = lemmas.dynamics.vehicle;
    let square = number(rate).square();
    let of_tensor = tensor / (Interval::ONE - tensor);
    let spin = number(0.5) * (largest - smallest) * square;
    let inertia = [
        common * limit / (Interval::ONE - common),
        of_tensor * (limit / (Interval::ONE - common) + spin + largest * square),
    ];
    let cosine = number(sideslip).sin_cos().1;
    let of_inertia = (inertia[0] + inertia[1]) / (cosine * smallest);
    // By the slow errors W differs by this from W at the navigated angles.
    let slow = number(s.slow_angle_error);
    let turned = number(TURN) * root2 * slow;
    let r = Interval::ONE / cosine;
    let navigated_rate = r * number(rate);
    let at_true_angles = Interval::ONE / (number(sideslip) + slow).sin_cos().1;
    let angle_drift = root3 * number(s.slow_angle_rate) + at_true_angles * turned * navigated_rate;
    let of_angle_drift =
        r * number(TURN) * angle_drift * navigated_rate + r * turned * root3 * disturbance;
    Drive {
        of_three: root3 * disturbance + of_inertia + of_angle_drift,
        of_two: root2 * disturbance + of_inertia + of_angle_drift,
        of_inertia,
        angle_drift,
        of_angle_drift,
        errors: [
            root3 * number(s.rate_error),
            root2 * number(s.rate_error),
            root2 * number(s.angle_error),
        ],
        inertia,
    }
}

fn mismatch(s: &Settings, lemmas: &Lemmas, drive: &Drive) -> Mismatch {
    let (half, sixth) = (number(0.5), Interval::ONE / number(6.0));
    let [tau, d] = [s.period_feedback, s.delay].map(number);
    let [by_rates, by_angles, jerk] =
        [lemmas.dynamics.by_rates, lemmas.dynamics.by_angles, lemmas.dynamics.jerk].map(number);
    let Drive { of_three, of_two, angle_drift, errors: [rates, rates_of_two, angles], .. } = *drive;
    let end = d + tau;
    let growth = ((by_rates + by_angles * end) * end).exp();
    let square = tau.square();
    let slope =
        by_rates * number(lemmas.dynamics.acceleration) + by_angles * number(lemmas.dynamics.rate);
    // Distance of the vehicle, in the middle of the period, from its prediction with a constant
    // acceleration. F there drives it further off, which sums up to a geometric series.
    let in_turn = by_rates * half * tau + by_angles * square / number(8.0);
    let beside = slope
        * (by_rates * square / number(8.0) + by_angles * square * tau / number(24.0))
        / (Interval::ONE - in_turn);
    // Integrals over [0, τ], and over [τ, d + τ], of the distances of rates and angles that the
    // drive causes. Up to τ it acts, and from then on both are predictions.
    let of_rates = half * of_three * square + of_three * tau * d;
    let of_angles = of_two * (sixth * square * tau + half * square * d + half * tau * d.square())
        + angle_drift * (half * square + tau * d);
    let [inner, outer] = [lemmas.dynamics.vehicle.rate, lemmas.dynamics.domain.rate];
    let halfway = half * (number(inner) + number(outer)) / number(outer);
    let revised = halfway * by_rates * of_rates + by_angles * of_angles;
    let erred =
        by_rates * rates * tau + by_angles * (angles * tau + rates_of_two * tau * (d + half * tau));
    let apart = by_rates * (of_three * end + rates)
        + by_angles * (half * of_two * end.square() + angles + (rates_of_two + angle_drift) * end);
    let f = apart * growth;
    let off = number(0.25) * slope * square;
    let far = [
        rates + (of_three + f) * end + off,
        angles
            + (rates_of_two + angle_drift) * end
            + half * (of_two + f) * end.square()
            + off * tau,
    ];
    let Domain { rate: vehicle_rate, sideslip: vehicle_sideslip } = lemmas.dynamics.vehicle;
    let turned = number(TURN) * far[1] * number(lemmas.dynamics.geometry.r) * number(vehicle_rate);
    Mismatch {
        mean: (revised + erred) * growth / tau + jerk * square / number(24.0) + beside,
        peak: f + beside + jerk * square / number(8.0) + half * slope * tau,
        unseen_rate: (half * by_rates * of_three * d.square()
            + sixth * by_angles * of_two * d.square() * d
            + half * by_angles * angle_drift * d.square())
            * growth,
        mispredicted: (by_rates * rates * d
            + by_angles * (angles * d + half * rates_of_two * d.square()))
            * growth,
        slope,
        angle_shift: slope * square / number(12.0),
        domain: [number(vehicle_rate) + far[0] + turned, number(vehicle_sideslip) + far[1]],
    }
}

pub(crate) fn driven(s: &Settings, lemmas: &Lemmas, before: &Lemmas) -> Driven {
    let (half, tau, d) = (number(0.5), number(s.period_feedback), number(s.delay));
    let [smallest, largest] = [lemmas.dynamics.smallest, lemmas.dynamics.largest].map(number);
    let (drive, larger) = (self::drive(s, lemmas), self::drive(s, before));
    let mut mismatch = self::mismatch(s, lemmas, &drive);
    let first = self::mismatch(s, before, &larger);
    let lasting = |drive: &Drive| drive.of_inertia + drive.of_angle_drift;
    let more = (lasting(&larger) - lasting(&drive)).max(Interval::ZERO);
    let ticks = (s.delay / s.period_feedback).ceil() as usize;
    let initial = |first: Interval, later: Interval| InitialTicks {
        ticks,
        excess: if later.low > 0.0 { (first / later - Interval::ONE).high.max(0.0) } else { 0.0 },
    };
    let initial = [
        initial(first.mean + more, mismatch.mean),
        initial(first.mispredicted, mismatch.mispredicted),
        initial(first.angle_shift, mismatch.angle_shift),
    ];
    (mismatch.peak, mismatch.unseen_rate) = (first.peak + more, first.unseen_rate + more * d);
    let by_turn = largest / smallest * number(TURN) * number(before.dynamics.geometry.r);
    let rate = before.dynamics.vehicle.rate;
    let spin =
        (number(s.limit_total()) + half * (largest - smallest) * number(rate).square()) / smallest;
    Driven {
        initial,
        angle_drift: larger.angle_drift,
        between: first.slope * tau.square() / number(8.0)
            + number(before.dynamics.jerk) * tau.square() * tau
                / (number(36.0) * number(12.0).sqrt()),
        turning: by_turn * (number(lemmas.dynamics.rate) + larger.angle_drift),
        turned: [
            by_turn * drive.errors[2],
            by_turn * (number(before.dynamics.rate) - number(lemmas.dynamics.rate)) * d,
        ],
        initial_moment: (larger.inertia[1] - drive.inertia[1]) * largest / smallest
            * number(before.dynamics.geometry.r),
        root_condition: (largest / smallest).sqrt(),
        vehicle_before: [
            number(s.limit_rate) + (spin + larger.of_three) * d,
            number(s.sideslip_domain) + (number(rate) + larger.angle_drift) * d,
        ],
        domain_before: first.domain,
        drive,
        mismatch,
    }
}
