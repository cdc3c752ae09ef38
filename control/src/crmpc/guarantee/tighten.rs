//! How the tightening of the robust set is computed from the parts of the deviation.

use super::assessment::{Assessment, assess};
use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::losses::{MomentLoss, RateLoss, bearing};
use super::mismatch::relative;
use super::observable::Observable;
use super::parts::{Parts, Reaches};
use super::tightening::{AtTick, Tightening};
use crate::controller::Explained;
use crate::crmpc::settings::Settings;
use crate::error::DesignError;
use crate::error_dynamics::SampledError;
use vehicle::math::powi;

/// Computes tightening and assessment of `settings`.
///
/// # Errors
/// Returns an error that names the gain that does not stabilise, with its spectral radius.
pub(in crate::crmpc) fn tighten(s: &Settings) -> Result<(Tightening, Assessment), DesignError> {
    let error = SampledError::delayed(s.feedback, s.period_feedback, s.delay);
    let steps = error.settling().ok_or_else(|| DesignError::Unstable {
        k1: s.feedback.k1,
        k2: s.feedback.k2,
        period: s.period_feedback,
        radius: error.spectral_radius(),
    })?;
    let dynamics = Dynamics::new(s);
    let parts = Parts::new(s, &dynamics);
    let sequence = Sequence::new(s, &error, &parts, steps);
    let bearing = bearing(s, dynamics.domain.sideslip);
    let h = s.period_optimisation;
    let at = |(n, deviation): (usize, &Deviation)| AtTick {
        deviation: *deviation,
        bulge: sequence.bulge(n, |d| d.angle),
        moment_loss: MomentLoss::new(&dynamics, &sequence.within(n), bearing, h),
        rate_loss: sequence.rate_loss(n, h),
    };
    let tightening = Tightening {
        ticks: sequence.ticks.iter().enumerate().map(at).collect(),
        explained: explained(s, &dynamics, &parts),
        bearing,
        observable: Observable::all(s, &dynamics, &parts),
    };
    let assessment = assess(s, &dynamics, &tightening);
    Ok((tightening, assessment))
}

/// Returns the largest mean acceleration over one period that the assumptions explain, rad/s²: Δ̄,
/// the tensor's error in any direction, the effect of the creep, and both errors of the rates at
/// the period's ends. The measured rates become x_ω at an attitude that is wrong, with ‖∂R[o]‖ ≤
/// √2 sec²β ‖o‖.
fn explained(s: &Settings, dynamics: &Dynamics, parts: &Parts) -> Explained {
    let Dynamics { domain, geometry, smallest, .. } = dynamics;
    let of_angles = 2.0 * powi(geometry.r, 2) * domain.rate * s.angle_error;
    Explained {
        disturbance: s.disturbance_bound
            + parts.inertia.moments.any * geometry.r / smallest
            + 2.0 * (s.rate_error + of_angles) / s.period_feedback
            + parts.drive.of_creep,
        share: relative(s.inertia_error),
    }
}

/// The deviation at each feedback tick since the nominal trajectory began. The last tick represents
/// all later ones.
struct Sequence {
    ticks: Vec<Deviation>,
    /// Feedback ticks per optimisation.
    ratio: usize,
}

impl Sequence {
    fn new(s: &Settings, error: &SampledError, parts: &Parts, steps: usize) -> Self {
        let early = &parts.early;
        let disturbance = error.reach(steps);
        let [of_angles, of_rates] = error.errors(steps);
        let changes = early[0].count(&error.changes(steps));
        let mispredictions = error.mispredictions(steps, early[1]);
        let shifts = early[2].count(&error.shifts(steps));
        let reaches = |n: usize| Reaches {
            disturbance: disturbance[n],
            early_feedback: disturbance[n].feedback
                - disturbance[n - n.min(early[0].ticks)].feedback,
            errors: [of_angles[n], of_rates[n]],
            changes: changes[n],
            mispredictions: mispredictions[n],
            shifts: shifts[n],
        };
        let at = |n: usize| parts.deviation(s, &reaches(n));
        let mut ticks: Vec<Deviation> = (0..=steps).map(at).collect();
        // By errors of the measurement the deviation may be larger at an early tick than at the
        // last. As the last entry represents all later ticks, it takes the largest of all.
        ticks[steps] = ticks.iter().fold(Deviation::default(), |most, at| most.or(at));
        let ratio = (s.period_optimisation / s.period_feedback).round().max(1.0) as usize;
        Self { ticks, ratio }
    }

    fn at(&self, tick: usize) -> &Deviation {
        &self.ticks[tick.min(self.ticks.len() - 1)]
    }

    /// Returns the largest deviation within the optimisation period that begins at a tick.
    fn within(&self, tick: usize) -> Deviation {
        (tick..tick + self.ratio).fold(Deviation::default(), |most, n| most.or(self.at(n)))
    }

    /// Returns the bulge: the largest amount by which a deviation exceeds, within the optimisation
    /// period that begins at a tick, the straight line between its values at both ends.
    fn bulge(&self, tick: usize, of: fn(&Deviation) -> f64) -> f64 {
        let ratio = self.ratio;
        let value = |i: usize| of(self.at(tick + i));
        let (from, to) = (value(0), value(ratio));
        let above = |i: usize| value(i) - (from + (to - from) * i as f64 / ratio as f64);
        (1..ratio).map(above).fold(0.0, f64::max)
    }

    /// Returns the loss of rate at a tick and in the optimisation periods (of `h` s) before and
    /// after it, with the bulges of both.
    fn rate_loss(&self, tick: usize, h: f64) -> RateLoss {
        let before = tick.checked_sub(self.ratio);
        let with_bulge = |of: fn(&Deviation) -> f64| {
            let before = before.map_or(0.0, |before| self.bulge(before, of));
            of(self.at(tick)) + before.max(self.bulge(tick, of))
        };
        let angle = |n: usize| self.at(n).angle;
        let change = before.map_or(0.0, |before| (angle(tick) - angle(before)).abs());
        let change = change.max((angle(tick + self.ratio) - angle(tick)).abs());
        RateLoss::new(with_bulge(|d| d.angle), with_bulge(|d| d.rate), change, h)
    }
}

/// Returns these settings with the given share of the disturbance bound and the errors.
pub(in crate::crmpc) fn with_share(s: &Settings, share: f64) -> Settings {
    Settings {
        disturbance_bound: share * s.disturbance_bound,
        angle_error: share * s.angle_error,
        rate_error: share * s.rate_error,
        slow_angle_error: share * s.slow_angle_error,
        slow_angle_rate: share * s.slow_angle_rate,
        known_bound: share * s.known_bound,
        known_change: share * s.known_change,
        ..*s
    }
}
