//! The sums and the inequality that decides whether the guarantee can be given, computed anew from
//! the bounds and rounded outwards.

use crate::driven::{Driven, driven};
use crate::interval::{Interval, number};
use crate::lemmas::{Finding, ROUNDING};
use crate::sums::{Axis, Bounds};
use control::crmpc::{
    BRAKING, CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, Deviation, Domain, Lemmas, Settings,
    Tightening,
};
use control::error_dynamics::SampledError;
use control::linearise::TURN_BY_ANGLES;

/// Fields of a [`Deviation`] in their order.
type Deviations = [Interval; 9];

fn values(deviation: &Deviation) -> [f64; 9] {
    [
        deviation.angle,
        deviation.rate,
        deviation.seen_angle,
        deviation.seen_rate,
        deviation.middle_angle,
        deviation.middle_rate,
        deviation.feedback,
        deviation.feedback_norm,
        deviation.feedback_moment,
    ]
}

/// Bounds at one tick on the effects of Δ, of the errors of angle and rate, and of the others.
struct Effects<'a> {
    reach: &'a Bounds,
    /// Part of the feedback by causes before the nominal trajectory began.
    initial_feedback: Interval,
    errors: [&'a Bounds; 2],
    changes: &'a Bounds,
    mispredictions: &'a Bounds,
    shifts: &'a Bounds,
}

fn deviation(s: &Settings, driven: &Driven, effects: &Effects) -> Deviations {
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let [rate_error, angle_error, tau, delay] =
        [s.rate_error, s.angle_error, s.period_feedback, s.delay].map(number);
    let Effects { reach, initial_feedback, errors, changes, mispredictions, shifts } = effects;
    let Driven { drive, mismatch, .. } = driven;
    let errors: Bounds =
        std::array::from_fn(|i| errors[0][i] * angle_error + errors[1][i] * rate_error);
    let in_norm: Bounds = std::array::from_fn(|i| {
        changes[i] * mismatch.mean
            + mispredictions[i] * mismatch.mispredicted
            + shifts[i] * (mismatch.angle_shift + driven.angle_drift)
    });
    let accelerated = drive.of_three * (Interval::ONE + reach[6])
        + root3 * errors[6]
        + in_norm[6]
        + mismatch.peak;
    let of_angles = |i: usize| reach[i] * drive.of_two + root2 * errors[i] + in_norm[i];
    let of_rates = |i: usize| reach[i] * drive.of_three + root3 * errors[i] + in_norm[i];
    let any_and_along = drive.inertia[0] + drive.inertia[1];
    [
        of_angles(0)
            + (mismatch.unseen_rate + driven.angle_drift) * delay
            + tau.square() / number(8.0) * accelerated,
        of_rates(1) + mismatch.unseen_rate + driven.between,
        of_angles(2),
        of_rates(3),
        of_angles(4),
        of_rates(5),
        reach[6] * number(s.disturbance_bound) + errors[6],
        in_norm[6] + reach[6] * drive.of_angle_drift,
        (drive.inertia[0] + driven.root_condition * drive.inertia[1]) * reach[6]
            + any_and_along
                * (driven.turning * (reach[7] + number(0.5) * tau * reach[6])
                    + driven.turned[0] * reach[6]
                    + driven.turned[1] * *initial_feedback)
            + driven.initial_moment * *initial_feedback,
    ]
}

/// Rate (rad/s) and moment (N m) needed for ‖x‖ ≤ `x` beyond the horizon, where the trajectory
/// brakes. Both grow with `x`, so limits that hold for `x` hold for all smaller ones as well.
fn needed(lemmas: &Lemmas, forever: &Deviations, x: f64) -> [Interval; 2] {
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
    let by_feedback =
        feedback * number(lemmas.induced_norm) + feedback_norm * largest + feedback_moment;
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
/// `None` if the dynamics are not certain to be stable.
pub fn check(
    s: &Settings,
    lemmas: &Lemmas,
    tightening: &Tightening,
    terminal_rate: f64,
) -> Option<Vec<Finding>> {
    let error = SampledError::delayed(s.feedback, s.period_feedback, s.delay);
    let steps = error.settling()?;
    let axis = Axis::new(s.feedback, s.period_feedback, s.delay)?;
    let before = Lemmas::before(s);
    let driven = driven(s, lemmas, &before);
    let (reach, errors) = (axis.reach(steps), axis.errors(steps));
    let changes = axis.changes(steps, driven.initial[0]);
    let mispredictions = axis.mispredictions(steps, driven.initial[1]);
    let shifts = axis.shifts(steps, driven.initial[2]);
    let effects = |n: usize| Effects {
        reach: &reach[n],
        initial_feedback: reach[n][6] - reach[n - n.min(driven.initial[0].ticks)][6],
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
    let (Driven { mismatch, .. }, bound) = (&driven, &lemmas.parts.mismatch);
    note("mismatch of the cancellation, mean of a period", bound.mean, mismatch.mean);
    note("mismatch at any time", bound.peak, mismatch.peak);
    note("mismatch since a measurement", bound.unseen_rate, mismatch.unseen_rate);
    note("mismatch of a prediction by errors", bound.mispredicted, mismatch.mispredicted);
    note(
        "shift of the angle by the cancelled drift",
        lemmas.parts.angle_shift,
        mismatch.angle_shift,
    );
    note("angle drift", lemmas.parts.angle_drift, driven.angle_drift);
    note("‖drive‖", lemmas.parts.norm, driven.drive.of_three + mismatch.mean);
    let mut domains = vec![("of predictions", lemmas.dynamics.domain, mismatch.domain)];
    if s.delay > 0.0 {
        let (vehicle, domain) = (before.dynamics.vehicle, before.dynamics.domain);
        domains.push(("before the trajectory began", vehicle, driven.vehicle_before));
        domains.push(("of predictions before", domain, driven.domain_before));
    }
    for (whose, Domain { rate, sideslip }, truth) in domains {
        note(&format!("‖ω‖ {whose}"), rate, truth[0]);
        note(&format!("|β| {whose}"), sideslip, truth[1]);
    }
    let (limit, last) = (error.reach(steps).pop()?, reach.last()?);
    note("Σ angle of a disturbance, for ever", limit.angle, last[0]);
    note("Σ rate of a disturbance, for ever", limit.rate, last[1]);
    note("Σ feedback of a disturbance, for ever", limit.feedback, last[6]);
    note("Σ feedback times age of a disturbance, for ever", limit.feedback_age, last[7]);
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
