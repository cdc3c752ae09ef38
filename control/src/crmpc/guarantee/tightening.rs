//! The tightening of the robust set, tick by tick, and how it is computed.

use super::deviation::Deviation;
use super::dynamics::Dynamics;
use super::losses::{MomentLoss, RateLoss, induced_norm};
use super::mismatch::relative;
use super::observable::Observable;
use super::parts::Parts;
use super::sequence::Sequence;
use crate::controller::Explained;
use crate::crmpc::set::ROUNDING;
use crate::crmpc::settings::Settings;
use crate::error::DesignError;
use crate::error_dynamics::SampledError;
use crate::linearise;
use vehicle::math::powi;

/// Largest difference of a delay from whole periods that is due to rounding, in periods.
const WHOLE: f64 = 1e-6;

/// Tightening of the robust set, by feedback ticks since the nominal trajectory began at the
/// measured state.
#[derive(Clone, Debug, PartialEq)]
pub struct Tightening {
    /// Reserves at each tick; the last ones apply to all later ticks.
    pub(super) ticks: Vec<AtTick>,
    /// Largest ‖I W s‖ over the corners s of the unit box at any attitude of the domain, kg m².
    pub induced_norm: f64,
    /// Largest observed disturbance that the assumptions explain.
    pub(in crate::crmpc) observable: Observable,
    /// Largest mean acceleration over a period, and differences of measurements, that the
    /// assumptions explain.
    pub explained: Explained,
}

/// Parts of the limits that are reserved for the deviation at a feedback tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::crmpc) struct AtTick {
    /// Deviation at the tick.
    pub deviation: Deviation,
    /// Bulge of the angles' deviation: the largest amount by which it exceeds the straight line
    /// between its values at both ends of the optimisation period that begins at the tick, rad.
    pub bulge: f64,
    /// Loss of moment by the largest deviation at the ticks of that optimisation period.
    pub moment_loss: MomentLoss,
    /// Loss of rate by the deviation at the tick, and in the intervals of the plan before and after
    /// it.
    pub rate_loss: RateLoss,
}

impl Tightening {
    /// Returns the reserves `tick` feedback ticks after the nominal trajectory began.
    pub(in crate::crmpc) fn tick(&self, tick: usize) -> &AtTick {
        &self.ticks[tick.min(self.ticks.len() - 1)]
    }

    /// Returns the deviation `tick` feedback ticks after the nominal trajectory began.
    pub fn at(&self, tick: usize) -> &Deviation {
        &self.tick(tick).deviation
    }

    /// Returns the deviation that is never exceeded.
    pub fn forever(&self) -> &Deviation {
        self.at(usize::MAX)
    }
}

/// Computes the tightening of `settings`, and returns it with the dynamics that it holds for.
///
/// # Errors
/// Returns an error that names the gain that does not stabilise, with its spectral radius.
pub(super) fn tighten(s: &Settings) -> Result<(Tightening, Dynamics), DesignError> {
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
    let induced_norm = induced_norm(s, dynamics.domain.sideslip);
    let h = s.period_optimisation;
    let at = |(n, deviation): (usize, &Deviation)| AtTick {
        deviation: *deviation,
        bulge: sequence.bulge(n, |d| d.angle),
        moment_loss: MomentLoss::new(&dynamics, &sequence.within(n), induced_norm, h),
        rate_loss: sequence.rate_loss(n, h),
    };
    let tightening = Tightening {
        ticks: sequence.ticks.iter().enumerate().map(at).collect(),
        explained: explained(s, &dynamics, &parts),
        induced_norm,
        observable: Observable::new(s, &dynamics, &parts),
    };
    Ok((tightening, dynamics))
}

/// Returns what the assumptions explain of measurements from one tick to the next.
///
/// The largest mean acceleration over a period is Δ̄, the tensor's error in any direction, the effect
/// of the angle drift, and both errors of the rates at the period's ends. The measured rates become
/// x_ω at an attitude that is wrong, with ‖∂R[o]‖ ≤ √2 sec²β ‖o‖.
///
/// An angle differs from the sum of its rates by the trapezoidal rule by −∫ (t − τ/2) ẋ dt, to which
/// the mean of ẋ adds nothing: Δ, the inertia error and the slow errors count with τ²/4, F with τ³/12
/// times its slope, and a command that takes over within the period with τ²/8 times its jump. The
/// slow errors add their own rates, and turn x_ω.
fn explained(s: &Settings, dynamics: &Dynamics, parts: &Parts) -> Explained {
    let Dynamics { domain, geometry, smallest, acceleration, by_rates, by_angles, .. } = dynamics;
    let (tau, drive) = (s.period_feedback, &parts.drive);
    let of_angles = 2.0 * powi(geometry.r, 2) * domain.rate * s.angle_error;
    let late = s.delay / tau;
    let jump = if (late - late.round()).abs() > WHOLE { *acceleration } else { 0.0 };
    let slope =
        by_rates * (acceleration + drive.all) + by_angles * (dynamics.rate + drive.angle_drift);
    // The measured rates at both ends of a period differ from those in between by no more.
    let beside = drive.rate_error + tau * (acceleration + drive.all);
    let unsteady = s.disturbance_bound + drive.of_inertia + drive.of_angle_drift + jump;
    Explained {
        disturbance: s.disturbance_bound
            + parts.inertia.moments.any * geometry.r / smallest
            + 2.0 * (s.rate_error + of_angles) / tau
            + drive.of_angle_drift,
        share: relative(s.inertia_error),
        angle: 2.0 * s.angle_error,
        motion: [
            tau * (s.rate_error + s.slow_angle_rate + drive.angle_drift_by_rates * beside)
                + tau * tau * (unsteady / 4.0 + slope * tau / 12.0),
            tau * drive.angle_drift_by_rates,
        ],
        rate: (s.limit_rate
            + 3.0_f64.sqrt() * s.rate_error
            + linearise::TURN_BY_ANGLES * 1.5 * s.limit_rate * s.angle_error)
            * (1.0 + ROUNDING),
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
