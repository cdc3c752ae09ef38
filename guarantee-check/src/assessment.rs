//! The sums and the inequality that decides whether the guarantee can be given, computed anew from
//! the bounds and rounded outwards.

use crate::interval::Interval;
use crate::lemmas::{Finding, ROUNDING};
use crate::sums::{Axis, Bounds};
use control::crmpc::{Deviation, InitialState, Lemmas, Settings, Tightening};
use control::error_dynamics::SampledError;

/// Quantities that drive the deviation from the nominal motion.
struct Drive {
    mismatch: Interval,
    varying: Interval,
    swing: Interval,
    /// Deviation of the rates between two ticks.
    between: Interval,
    /// Largest difference of the mismatch from its mean.
    variation: Interval,
    norm: Interval,
    norm_of_two: Interval,
    turning: Interval,
    /// Moments that the inertia error amounts to: along the acting one, and in any direction.
    inertia: [Interval; 2],
    /// Largest ‖I^½ D I^−½‖ of a symmetric D with ‖D‖ ≤ 1.
    root_condition: Interval,
}

fn drive(s: &Settings, lemmas: &Lemmas) -> Drive {
    let number = Interval::from;
    let [tau, delay, disturbance] = [s.period_feedback, s.delay, s.disturbance_bound].map(number);
    let [by_rates, by_angles, jerk] = [lemmas.by_rates, lemmas.by_angles, lemmas.jerk].map(number);
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let [limit, smallest, largest, r] =
        [s.limit_moment, lemmas.smallest, lemmas.largest, lemmas.r].map(number);
    let (common, tensor) = (number(s.inertia_error), number(s.tensor_error));
    let of_tensor = tensor / (Interval::ONE - tensor);
    let spin = number(0.5) * (largest - smallest) * number(s.limit_rate).square();
    let spin_of_error = largest * number(s.limit_rate).square();
    let inertia = [
        common * limit / (Interval::ONE - common),
        of_tensor * limit / (Interval::ONE - common) + of_tensor * spin + of_tensor * spin_of_error,
    ];
    let of_inertia = (inertia[0] + inertia[1]) * r / smallest;
    let all = root3 * disturbance + of_inertia;
    let elapsed = delay + tau;
    let growth = ((by_rates + by_angles * elapsed) * elapsed).exp();
    let (angle_error, rate_error) = (root2 * number(s.angle_error), root3 * number(s.rate_error));
    let half = number(0.5);
    let off_rate = (all * (elapsed - half * tau) + rate_error) * growth;
    let off_angle = (half * all * elapsed.square() + angle_error + rate_error * elapsed) * growth;
    let square = tau.square();
    let varying = by_rates * all * tau * growth + jerk * square / number(8.0);
    let slope = by_rates * number(lemmas.acceleration) + by_angles * number(lemmas.rate);
    // Where the motion is in the middle of the period, beside its prediction with a constant
    // acceleration: F there drives it off in turn, which sums up to a geometric series.
    let in_turn = by_rates * half * tau + by_angles * square / number(8.0);
    let beside = slope
        * (by_rates * square / number(8.0) + by_angles * square * tau / number(24.0))
        / (Interval::ONE - in_turn);
    let mismatch =
        by_rates * off_rate + by_angles * off_angle + jerk * square / number(24.0) + beside;
    let swing = slope * square / number(12.0) + number(0.125) * tau * varying;
    Drive {
        mismatch,
        varying,
        swing,
        between: slope * square / number(8.0)
            + jerk * square * tau / (number(36.0) * number(12.0).sqrt()),
        variation: varying + half * tau * slope,
        norm: all + mismatch,
        norm_of_two: root2 * disturbance + of_inertia + mismatch,
        turning: largest / smallest * number(lemmas.turn) * r * number(lemmas.rate),
        inertia,
        root_condition: (largest / smallest).sqrt(),
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

fn deviation(
    s: &Settings,
    drive: &Drive,
    reach: &Bounds,
    errors: [&Bounds; 2],
    shifts: &Bounds,
) -> Deviations {
    let number = Interval::from;
    let (root2, root3) = (number(2.0).sqrt(), number(3.0).sqrt());
    let [rate_error, angle_error, tau, delay] =
        [s.rate_error, s.angle_error, s.period_feedback, s.delay].map(number);
    let errors: Bounds =
        std::array::from_fn(|i| errors[0][i] * angle_error + errors[1][i] * rate_error);
    let swing = shifts.map(|shift| shift * drive.swing);
    let between = tau.square() / number(8.0)
        * (drive.norm * (Interval::ONE + reach[6])
            + root3 * errors[6]
            + swing[6]
            + drive.variation);
    let of_angles = |i: usize| reach[i] * drive.norm_of_two + root2 * errors[i] + swing[i];
    let of_rates = |i: usize| reach[i] * drive.norm + root3 * errors[i] + swing[i];
    [
        of_angles(0) + between,
        of_rates(1) + drive.between,
        of_angles(2),
        of_rates(3),
        of_angles(4),
        of_rates(5),
        reach[6] * number(s.disturbance_bound) + errors[6],
        reach[6] * drive.mismatch + swing[6],
        (drive.inertia[0] + drive.root_condition * drive.inertia[1]) * reach[6]
            + (drive.inertia[0] + drive.inertia[1]) * drive.turning * (reach[7] + delay * reach[6]),
    ]
}

/// Rate (rad/s) and moment (N m) needed for ‖x‖ ≤ `x` beyond the horizon, where the motion brakes.
/// Both grow with `x`, so limits that hold for `x` hold for all smaller ones as well.
fn needed(lemmas: &Lemmas, forever: &Deviations, x: f64) -> [Interval; 2] {
    let number = Interval::from;
    let half = number(0.5);
    let [angle, rate, _, _, middle_angle, middle_rate, feedback, feedback_norm, feedback_moment] =
        *forever;
    let [largest, smallest, drift, curvature, mixed, twice, turn_by_angles] = [
        lemmas.largest,
        lemmas.smallest,
        lemmas.drift,
        lemmas.curvature,
        lemmas.drift_mixed,
        lemmas.drift_by_angles_twice,
        lemmas.turn_by_angles,
    ]
    .map(number);
    let gyroscopic = number(lemmas.gyroscopic.0);
    let spread = largest - smallest;
    let x = number(x);
    let a = number(lemmas.braking) * x;
    let rates = rate + turn_by_angles * x * angle + half * curvature * x * angle.square() + x;

    let slope_by_angles = largest * (turn_by_angles * a + curvature * x.square())
        + turn_by_angles * gyroscopic * x.square();
    let slope_by_rates = (largest * number(lemmas.drift_by_rates) + gyroscopic) * x;
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
    let drive = drive(s, lemmas);
    let (reach, errors, shifts) = (axis.reach(steps), axis.errors(steps), axis.shifts(steps));
    let all: Vec<Deviations> = (0..reach.len())
        .map(|n| deviation(s, &drive, &reach[n], [&errors[0][n], &errors[1][n]], &shifts[n]))
        .collect();
    let forever = all.last()?;

    let mut findings = Vec::new();
    let mut note = |statement: &str, bound: f64, truth: Interval| {
        findings.push(Finding { statement: statement.into(), bound, truth });
    };
    note("mismatch of the cancellation, mean of a period", lemmas.mismatch, drive.mismatch);
    note("variation of the mismatch within a period", lemmas.varying, drive.varying);
    note("swing of the cancelled drift", lemmas.swing, drive.swing);
    note("‖drive‖", lemmas.norm, drive.norm);
    note("‖drive‖ of two axes", lemmas.norm_of_two, drive.norm_of_two);
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
        "feedback, box",
        "feedback, ball",
        "feedback, moment of the inertia error",
    ];
    for ((name, bound), truth) in names.into_iter().zip(values(tightening.forever())).zip(forever) {
        note(&format!("{name}, for ever"), bound, *truth);
    }
    // The largest share of its bound that any field needs at any tick.
    let mut share = Interval::ZERO;
    for (n, truths) in all.iter().enumerate() {
        for (bound, truth) in values(tightening.at(n)).into_iter().zip(truths) {
            if truth.high > 0.0 {
                share = share.max(*truth / Interval::from(bound));
            }
        }
    }
    note("deviation at every tick, share of its bound", 1.0, share);
    let [rates, moment] = needed(lemmas, forever, terminal_rate);
    note("rate needed beyond the horizon", s.limit_rate, rates);
    note("moment needed beyond the horizon", s.limit_moment, moment);
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
