//! The tightening of the robust set, and the share of the disturbance that it can bear.

use super::assessment::{Assessment, assess};
use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::losses::{MomentLoss, RateLoss, bearing};
use super::observable::Observable;
use super::parts::{Parts, Pulse, Reaches};
use super::switching::Switching;
use super::tightening::Tightening;
use crate::controller::Explained;
use crate::crmpc::settings::{InitialState, Settings};
use crate::error::DesignError;
use crate::error_dynamics::SampledError;
use vehicle::math::powi;

/// Computes tightening and assessment of `settings`.
///
/// # Errors
/// Returns an error that names the gain that does not stabilise, with its spectral radius, or the
/// gain for which no invariant set can be computed.
pub(in crate::crmpc) fn tighten(s: &Settings) -> Result<(Tightening, Assessment), DesignError> {
    let error = SampledError::delayed(s.feedback, s.period_feedback, s.delay);
    let unstable = || DesignError::Unstable {
        k1: s.feedback.k1,
        k2: s.feedback.k2,
        period: s.period_feedback,
        radius: error.spectral_radius(),
    };
    let steps = error.settling().ok_or_else(unstable)?;
    let ratio = (s.period_optimisation / s.period_feedback).round().max(1.0) as usize;
    let dynamics = Dynamics::new(s);
    let parts = Parts::new(s, &dynamics);
    let switching = Switching::new(s, &error, &parts)?.map(Box::new);
    let (mut at, pulse) = deviations(s, &error, &parts, steps)?;
    let last = at.len() - 1;
    // Errors of the measurement may drive the vehicle further at first than later on.
    at[last] = at.iter().fold(Deviation::default(), |largest, at| largest.or(at));
    let bearing = bearing(s, dynamics.domain.sideslip);
    let moment = (0..at.len()).map(|n| {
        let within =
            (n..n + ratio).fold(Deviation::default(), |largest, n| largest.or(&at[n.min(last)]));
        MomentLoss::new(&dynamics, &within, bearing, s.period_optimisation)
    });
    // Between the ends of an optimisation period the deviation can exceed the straight line between
    // its end values by this amount.
    let bulge = |n: usize, value: fn(&Deviation) -> f64| {
        let tick = |i: usize| value(&at[(n + i).min(last)]);
        let (from, to) = (tick(0), tick(ratio));
        let above = |i: usize| tick(i) - (from + (to - from) * i as f64 / ratio as f64);
        (1..ratio).map(above).fold(0.0, f64::max)
    };
    let rate = (0..at.len()).map(|n| {
        let before = n.checked_sub(ratio);
        let with_bulge = |value: fn(&Deviation) -> f64| {
            let before = before.map_or(0.0, |before| bulge(before, value));
            value(&at[n]) + before.max(bulge(n, value))
        };
        let angle = |n: usize| at[n.min(last)].angle;
        let change = before.map_or(0.0, |before| (angle(n) - angle(before)).abs());
        let change = change.max((angle(n + ratio) - angle(n)).abs());
        RateLoss::new(
            with_bulge(|d| d.angle),
            with_bulge(|d| d.rate),
            change,
            s.period_optimisation,
        )
    });
    let angle_bulge = (0..at.len()).map(|n| bulge(n, |d| d.angle)).collect();
    let (moment, rate) = (moment.collect(), rate.collect());
    // The measured rates become x_ω at an attitude that is wrong: ‖∂R[o]‖ ≤ √2 sec²β ‖o‖.
    let Dynamics { domain, geometry, .. } = &dynamics;
    let of_angles = 2.0 * powi(geometry.r, 2) * domain.rate * s.angle_error;
    let tightening = Tightening {
        switching,
        pulse,
        explained: Explained {
            disturbance: s.disturbance_bound
                + parts.any_moment * dynamics.geometry.r / dynamics.smallest
                + 2.0 * (s.rate_error + of_angles) / s.period_feedback,
            share: s.inertia_error / (1.0 - s.inertia_error),
            delay_error: s.delay_error,
        },
        angle_bulge,
        moment,
        rate,
        bearing,
        norm: parts.norm,
        mismatch: parts.mismatch.mean,
        observable: Observable::all(s, &dynamics, &parts),
        at,
    };
    let assessment = assess(s, &dynamics, &tightening);
    Ok((tightening, assessment))
}

/// Returns the deviation at each tick, and the jump of the rates by a change of K ô there, see
/// [`Tightening::pulse`].
pub(super) fn deviations(
    s: &Settings,
    error: &SampledError,
    parts: &Parts,
    steps: usize,
) -> Result<(Vec<Deviation>, Vec<f64>), DesignError> {
    let disturbance = error.reach(steps);
    let [of_angles, of_rates] = error.errors(steps);
    let changes = parts.early[0].count(&error.changes(steps));
    let mispredictions = error.mispredictions(steps, parts.early[1]);
    let shifts = parts.early[2].count(&error.shifts(steps));
    let reaches = |n: usize| Reaches {
        disturbance: disturbance[n],
        early_feedback: disturbance[n].feedback
            - disturbance[n - n.min(parts.early[0].ticks)].feedback,
        errors: [of_angles[n], of_rates[n]],
        changes: changes[n],
        mispredictions: mispredictions[n],
        shifts: shifts[n],
    };
    Ok(match s.initial_state {
        InitialState::Measured | InitialState::Nominal => {
            let pulses = error.pulses(steps);
            let jumps: Vec<Pulse> =
                (0..=steps).map(|n| parts.pulse(s, &reaches(n), &pulses[n])).collect();
            let norms: Vec<f64> = jumps.iter().map(Pulse::norm).collect();
            // Between two ticks the pulse of the next one may show already; pulses only grow.
            let largest = norms.last().copied().unwrap_or_default();
            let deviation = |n: usize| {
                parts.deviation(s, &reaches(n)).plus(&jumps[n].deviation(s, &pulses[n], largest))
            };
            ((0..=steps).map(deviation).collect(), norms)
        }
        InitialState::Tube => {
            // The deviation is fully grown from the start, because the plan may begin anywhere in
            // the set that Δ cannot drive the deviation out of.
            let set = error
                .invariant_set(lateral(s))
                .ok_or(DesignError::NotReal { name: "feedback" })?
                .reach();
            // The first ticks of a motion count at any time.
            let grown = (0..=steps).map(|n| {
                let all = reaches(n);
                parts.deviation(s, &Reaches { disturbance: disturbance[steps].or(&set), ..all })
            });
            (vec![grown.fold(Deviation::default(), |largest, at| largest.or(&at))], vec![0.0])
        }
    })
}

/// Returns the largest shift of the angle by a disturbance that changes within a period, beyond the
/// effect of its mean, relative to the disturbance bound, s².
pub(in crate::crmpc) fn lateral(s: &Settings) -> f64 {
    0.25 * s.period_feedback * s.period_feedback
}

/// Returns these settings with the given share of the disturbance bound and the errors.
pub(in crate::crmpc) fn with_share(s: &Settings, share: f64) -> Settings {
    Settings {
        disturbance_bound: share * s.disturbance_bound,
        angle_error: share * s.angle_error,
        rate_error: share * s.rate_error,
        delay_error: share * s.delay_error,
        known_bound: share * s.known_bound,
        known_change: share * s.known_change,
        ..*s
    }
}
