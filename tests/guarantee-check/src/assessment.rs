//! The sums and the inequality that decides whether the guarantee can be given, computed anew from
//! the bounds and rounded outwards.

use crate::interval::Interval;
use crate::lemmas::{Finding, ROUNDING};
use crate::sums::{Axis, Bounds};
use control::crmpc::{
    BRAKING, CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, Deviation, Domain, InitialState,
    Lemmas, Settings, TURN, Tightening,
};
use control::error_dynamics::{Early, SampledError};
use control::linearise::TURN_BY_ANGLES;

/// Causes that drive the vehicle off its prediction, apart from the mismatch.
struct Drive {
    of_three: Interval,
    of_two: Interval,
    of_inertia: Interval,
    /// Errors of all rates, of two of them, and of two angles.
    errors: [Interval; 3],
    /// Moments that the inertia error amounts to: along the acting one, and in any direction.
    inertia: [Interval; 2],
}

/// How F differs from the acceleration that the law intended.
struct Mismatch {
    mean: Interval,
    peak: Interval,
    unseen_rate: Interval,
    mispredicted: Interval,
    /// Bound on ‖dF/dt‖, and the shift of the angle by it over a period.
    slope: Interval,
    swing: Interval,
    /// Largest ‖ω‖ and |β| of predictions.
    domain: [Interval; 2],
}

/// Quantities that drive the deviation from the nominal trajectory.
struct Driven {
    drive: Drive,
    mismatch: Mismatch,
    early: [Early; 3],
    /// Deviation of the rates between two ticks.
    between: Interval,
    turning: Interval,
    turned: [Interval; 2],
    early_moment: Interval,
    /// Largest ‖I^½ D I^−½‖ of a symmetric D with ‖D‖ ≤ 1.
    root_condition: Interval,
    /// Largest ‖ω‖ and |β| of the vehicle before the nominal trajectory began.
    vehicle_before: [Interval; 2],
    domain_before: [Interval; 2],
}

fn drive(s: &Settings, lemmas: &Lemmas) -> Drive {
    let number = Interval::from;
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
    Drive {
        of_three: root3 * disturbance + of_inertia,
        of_two: root2 * disturbance + of_inertia,
        of_inertia,
        errors: [
            root3 * number(s.rate_error),
            root2 * number(s.rate_error),
            root2 * number(s.angle_error),
        ],
        inertia,
    }
}

fn mismatch(s: &Settings, lemmas: &Lemmas, drive: &Drive) -> Mismatch {
    let number = Interval::from;
    let (half, sixth) = (number(0.5), Interval::ONE / number(6.0));
    let [tau, d] = [s.period_feedback, s.delay].map(number);
    let [by_rates, by_angles, jerk] =
        [lemmas.dynamics.by_rates, lemmas.dynamics.by_angles, lemmas.dynamics.jerk].map(number);
    let Drive { of_three, of_two, errors: [rates, rates_of_two, angles], .. } = *drive;
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
    let of_angles = of_two * (sixth * square * tau + half * square * d + half * tau * d.square());
    let [inner, outer] = [lemmas.dynamics.vehicle.rate, lemmas.dynamics.domain.rate];
    let halfway = half * (number(inner) + number(outer)) / number(outer);
    let revised = halfway * by_rates * of_rates + by_angles * of_angles;
    let erred =
        by_rates * rates * tau + by_angles * (angles * tau + rates_of_two * tau * (d + half * tau));
    let apart = by_rates * (of_three * end + rates)
        + by_angles * (half * of_two * end.square() + angles + rates_of_two * end);
    let f = apart * growth;
    let off = number(0.25) * slope * square;
    let far = [
        rates + (of_three + f) * end + off,
        angles + rates_of_two * end + half * (of_two + f) * end.square() + off * tau,
    ];
    let Domain { rate: vehicle_rate, sideslip: vehicle_sideslip } = lemmas.dynamics.vehicle;
    let turned = number(TURN) * far[1] * number(lemmas.dynamics.geometry.r) * number(vehicle_rate);
    Mismatch {
        mean: (revised + erred) * growth / tau + jerk * square / number(24.0) + beside,
        peak: f + beside + jerk * square / number(8.0) + half * slope * tau,
        unseen_rate: (half * by_rates * of_three * d.square()
            + sixth * by_angles * of_two * d.square() * d)
            * growth,
        mispredicted: (by_rates * rates * d
            + by_angles * (angles * d + half * rates_of_two * d.square()))
            * growth,
        slope,
        swing: slope * square / number(12.0),
        domain: [number(vehicle_rate) + far[0] + turned, number(vehicle_sideslip) + far[1]],
    }
}

fn driven(s: &Settings, lemmas: &Lemmas, before: &Lemmas) -> Driven {
    let number = Interval::from;
    let (half, tau, d) = (number(0.5), number(s.period_feedback), number(s.delay));
    let [smallest, largest] = [lemmas.dynamics.smallest, lemmas.dynamics.largest].map(number);
    let (drive, larger) = (self::drive(s, lemmas), self::drive(s, before));
    let mut mismatch = self::mismatch(s, lemmas, &drive);
    let first = self::mismatch(s, before, &larger);
    let more = (larger.of_inertia - drive.of_inertia).max(Interval::ZERO);
    let ticks = (s.delay / s.period_feedback).ceil() as usize;
    let early = |first: Interval, later: Interval| Early {
        ticks,
        excess: if later.low > 0.0 { (first / later - Interval::ONE).high.max(0.0) } else { 0.0 },
    };
    let early = [
        early(first.mean + more, mismatch.mean),
        early(first.mispredicted, mismatch.mispredicted),
        early(first.swing, mismatch.swing),
    ];
    (mismatch.peak, mismatch.unseen_rate) = (first.peak + more, first.unseen_rate + more * d);
    let by_turn = largest / smallest * number(TURN) * number(before.dynamics.geometry.r);
    let rate = before.dynamics.vehicle.rate;
    let spin =
        (number(s.limit_total()) + half * (largest - smallest) * number(rate).square()) / smallest;
    Driven {
        early,
        between: first.slope * tau.square() / number(8.0)
            + number(before.dynamics.jerk) * tau.square() * tau
                / (number(36.0) * number(12.0).sqrt()),
        turning: by_turn * number(lemmas.dynamics.rate),
        turned: [
            by_turn * drive.errors[2],
            by_turn * (number(before.dynamics.rate) - number(lemmas.dynamics.rate)) * d,
        ],
        early_moment: (larger.inertia[1] - drive.inertia[1]) * largest / smallest
            * number(before.dynamics.geometry.r),
        root_condition: (largest / smallest).sqrt(),
        vehicle_before: [
            number(s.limit_rate) + (spin + larger.of_three) * d,
            number(s.sideslip_domain) + number(rate) * d,
        ],
        domain_before: first.domain,
        drive,
        mismatch,
    }
}

/// Fields of a [`Deviation`] in their order.
type Deviations = [Interval; 9];

fn values(deviation: &Deviation) -> [f64; 9] {
    let Deviation {
        angle,
        rate,
        seen_angle,
        seen_rate,
        middle_angle,
        middle_rate,
        feedback,
        feedback_norm,
        feedback_moment,
    } = *deviation;
    [
        angle,
        rate,
        seen_angle,
        seen_rate,
        middle_angle,
        middle_rate,
        feedback,
        feedback_norm,
        feedback_moment,
    ]
}

/// Bounds at one tick on the effects of Δ, of the errors of angle and rate, and of the others.
struct Effects<'a> {
    reach: &'a Bounds,
    /// Part of the feedback by what happened before the nominal trajectory began.
    early_feedback: Interval,
    errors: [&'a Bounds; 2],
    changes: &'a Bounds,
    mispredictions: &'a Bounds,
    shifts: &'a Bounds,
}

fn deviation(s: &Settings, driven: &Driven, effects: &Effects) -> Deviations {
    let number = Interval::from;
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let [rate_error, angle_error, tau, delay] =
        [s.rate_error, s.angle_error, s.period_feedback, s.delay].map(number);
    let Effects { reach, early_feedback, errors, changes, mispredictions, shifts } = effects;
    let Driven { drive, mismatch, .. } = driven;
    let errors: Bounds =
        std::array::from_fn(|i| errors[0][i] * angle_error + errors[1][i] * rate_error);
    let in_norm: Bounds = std::array::from_fn(|i| {
        changes[i] * mismatch.mean
            + mispredictions[i] * mismatch.mispredicted
            + shifts[i] * mismatch.swing
    });
    let accelerated = drive.of_three * (Interval::ONE + reach[6])
        + root3 * errors[6]
        + in_norm[6]
        + mismatch.peak;
    let of_angles = |i: usize| reach[i] * drive.of_two + root2 * errors[i] + in_norm[i];
    let of_rates = |i: usize| reach[i] * drive.of_three + root3 * errors[i] + in_norm[i];
    let any_and_along = drive.inertia[0] + drive.inertia[1];
    [
        of_angles(0) + mismatch.unseen_rate * delay + tau.square() / number(8.0) * accelerated,
        of_rates(1) + mismatch.unseen_rate + driven.between,
        of_angles(2),
        of_rates(3),
        of_angles(4),
        of_rates(5),
        reach[6] * number(s.disturbance_bound) + errors[6],
        in_norm[6],
        (drive.inertia[0] + driven.root_condition * drive.inertia[1]) * reach[6]
            + any_and_along
                * (driven.turning * (reach[7] + number(0.5) * tau * reach[6])
                    + driven.turned[0] * reach[6]
                    + driven.turned[1] * *early_feedback)
            + driven.early_moment * *early_feedback,
    ]
}

/// Rate (rad/s) and moment (N m) needed for ‖x‖ ≤ `x` beyond the horizon, where the trajectory
/// brakes. Both grow with `x`, so limits that hold for `x` hold for all smaller ones as well.
fn needed(lemmas: &Lemmas, forever: &Deviations, x: f64) -> [Interval; 2] {
    let number = Interval::from;
    let half = number(0.5);
    let [angle, rate, _, _, middle_angle, middle_rate, feedback, feedback_norm, feedback_moment] =
        *forever;
    let [largest, smallest, drift, curvature, mixed, twice, turn_by_angles] = [
        lemmas.dynamics.largest,
        lemmas.dynamics.smallest,
        lemmas.dynamics.geometry.drift,
        CURVATURE,
        DRIFT_MIXED,
        DRIFT_BY_ANGLES_TWICE,
        TURN_BY_ANGLES,
    ]
    .map(number);
    let gyroscopic = number(lemmas.gyroscopic.0);
    let spread = largest - smallest;
    let x = number(x);
    let a = number(BRAKING) * x;
    let rates = rate + turn_by_angles * x * angle + half * curvature * x * angle.square() + x;

    let slope_by_angles = largest * (turn_by_angles * a + curvature * x.square())
        + turn_by_angles * gyroscopic * x.square();
    let slope_by_rates =
        (largest * number(lemmas.dynamics.geometry.drift_by_rates) + gyroscopic) * x;
    let by_feedback = feedback * number(lemmas.bearing) + feedback_norm * largest + feedback_moment;
    let (four, twelve, further) = (number(4.0), number(12.0), x + middle_rate);
    let second = half * largest * curvature * a * middle_angle.square()
        + (largest * drift + half * spread) * middle_rate.square()
        + (largest * mixed + four * spread) * further * middle_angle * middle_rate
        + half * (largest * twice + twelve * spread) * further.square() * middle_angle.square();
    let nominal = largest * (a + drift * x.square()) + half * spread * x.square();
    let moment = by_feedback
        + slope_by_angles * middle_angle
        + slope_by_rates * middle_rate
        + second
        + nominal;
    [rates, moment]
}

/// Checks the sums and the inequality for a tightening with its terminal rate (rad/s). Returns
/// `None` if the dynamics are not certain to be stable, if the initial state is `tube`, whose
/// invariant set is not checked, or if the delay is not exact.
pub fn check(
    s: &Settings,
    lemmas: &Lemmas,
    tightening: &Tightening,
    terminal_rate: f64,
) -> Option<Vec<Finding>> {
    if s.initial_state == InitialState::Tube || s.delay_error > 0.0 {
        return None;
    }
    let error = SampledError::delayed(s.feedback, s.period_feedback, s.delay);
    let steps = error.settling()?;
    let axis = Axis::new(s.feedback, s.period_feedback, s.delay)?;
    let before = Lemmas::before(s);
    let driven = driven(s, lemmas, &before);
    let (reach, errors) = (axis.reach(steps), axis.errors(steps));
    let changes = axis.changes(steps, driven.early[0]);
    let mispredictions = axis.mispredictions(steps, driven.early[1]);
    let shifts = axis.shifts(steps, driven.early[2]);
    let effects = |n: usize| Effects {
        reach: &reach[n],
        early_feedback: reach[n][6] - reach[n - n.min(driven.early[0].ticks)][6],
        errors: [&errors[0][n], &errors[1][n]],
        changes: &changes[n],
        mispredictions: &mispredictions[n],
        shifts: &shifts[n],
    };
    let deviations: Vec<Deviations> =
        (0..reach.len()).map(|n| deviation(s, &driven, &effects(n))).collect();
    let forever = deviations.last()?;

    let mut findings = Vec::new();
    let mut note = |statement: &str, bound: f64, truth: Interval| {
        findings.push(Finding { statement: statement.into(), bound, truth });
    };
    let Driven { mismatch, .. } = &driven;
    note(
        "mismatch of the cancellation, mean of a period",
        lemmas.parts.mismatch.mean,
        mismatch.mean,
    );
    note("mismatch at any time", lemmas.parts.mismatch.peak, mismatch.peak);
    note("mismatch since a measurement", lemmas.parts.mismatch.unseen_rate, mismatch.unseen_rate);
    note(
        "mismatch of a prediction by errors",
        lemmas.parts.mismatch.mispredicted,
        mismatch.mispredicted,
    );
    note("swing of the cancelled drift", lemmas.parts.swing, mismatch.swing);
    note("‖drive‖", lemmas.parts.norm, driven.drive.of_three + mismatch.mean);
    let (Domain { rate, sideslip }, [of_rate, of_sideslip]) =
        (lemmas.dynamics.domain, mismatch.domain);
    note("‖ω‖ of predictions", rate, of_rate);
    note("|β| of predictions", sideslip, of_sideslip);
    if s.delay > 0.0 {
        let (Domain { rate, sideslip }, [of_rate, of_sideslip]) =
            (before.dynamics.vehicle, driven.vehicle_before);
        note("‖ω‖ before the trajectory began", rate, of_rate);
        note("|β| before the trajectory began", sideslip, of_sideslip);
        let (Domain { rate, sideslip }, [of_rate, of_sideslip]) =
            (before.dynamics.domain, driven.domain_before);
        note("‖ω‖ of predictions before", rate, of_rate);
        note("|β| of predictions before", sideslip, of_sideslip);
    }
    let limit = error.reach(steps).pop()?;
    let sums = [limit.angle, limit.rate, limit.feedback, limit.feedback_age];
    let last = reach.last()?;
    let names = ["Σ angle", "Σ rate", "Σ feedback", "Σ feedback times age"];
    for ((name, bound), truth) in
        names.into_iter().zip(sums).zip([last[0], last[1], last[6], last[7]])
    {
        note(&format!("{name} of a disturbance, for ever"), bound, truth);
    }
    let names = [
        "deviation of the angles",
        "deviation of the rates",
        "deviation of the angles, seen",
        "deviation of the rates, seen",
        "deviation of the angles, in the middle",
        "deviation of the rates, in the middle",
        "feedback, part bounded per component",
        "feedback, part bounded in norm",
        "feedback, moment of the inertia error",
    ];
    for ((name, bound), truth) in names.into_iter().zip(values(tightening.forever())).zip(forever) {
        note(&format!("{name}, for ever"), bound, *truth);
    }
    // Largest share of its bound that any field needs at any tick.
    let mut share = Interval::ZERO;
    for (n, truths) in deviations.iter().enumerate() {
        for (bound, truth) in values(tightening.at(n)).into_iter().zip(truths) {
            if truth.high > 0.0 {
                share = share.max(*truth / Interval::from(bound));
            }
        }
    }
    note("deviation at every tick, share of its bound", 1.0, share);
    let [rates, moment] = needed(lemmas, forever, terminal_rate);
    note("rate needed beyond the horizon", s.limit_rate, rates);
    note("moment needed beyond the horizon", s.limit_moment - s.needed_by_known(), moment);
    Some(findings)
}

/// Checks that the terminal weight of the robust set satisfies (11c) of Chai 2022 with the sampled
/// law, up to rounding.
pub fn check_terminal_weight(s: &Settings) -> Vec<Finding> {
    let axes = crate::sums::terminal_decrease(s);
    axes.into_iter()
        .enumerate()
        .map(|(axis, [held, _])| Finding {
            statement: format!("λ(ΦᵀGΦ − G + h (P + K̃ᵀQK̃)) ≤ b, axis {}", axis + 1),
            bound: ROUNDING,
            truth: held,
        })
        .collect()
}
