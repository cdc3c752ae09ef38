//! The numbers on which the guarantee rests, for its machine check.

use super::dynamics::Dynamics;
use super::geometry::{BRAKING, CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, FOURTH, TURN};
use super::losses::bearing;
use super::mismatch::gyroscopic;
use super::parts::Parts;
use crate::crmpc::settings::Settings;
use crate::error_dynamics::Early;
use crate::linearise::TURN_BY_ANGLES as TURN_OF_RATES;

/// Every bound that the proof uses, as this crate computes it. The lines that compute the bounds
/// explain them.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Lemmas {
    /// Largest ‖ω‖ (rad/s) and |β| (rad) of the vehicle, and of the domain of the bounds.
    pub vehicle: (f64, f64),
    pub domain: (f64, f64),
    pub drift: f64,
    pub drift_by_rates: f64,
    pub r: f64,
    pub curvature: f64,
    pub turn: f64,
    pub turn_by_angles: f64,
    pub drift_mixed: f64,
    pub drift_by_angles_twice: f64,
    pub fourth: f64,
    /// Bounds of ∂(ω × I ω)/∂ω, and of I⁻¹ times that derivative.
    pub gyroscopic: (f64, f64),
    pub largest: f64,
    pub smallest: f64,
    pub rate: f64,
    pub acceleration: f64,
    pub by_rates: f64,
    pub by_angles: f64,
    pub jerk: f64,
    pub mismatch: f64,
    pub peak: f64,
    pub unseen_rate: f64,
    pub mispredicted: f64,
    pub early: [Early; 3],
    pub swing: f64,
    pub bearing: f64,
    pub norm: f64,
    pub turning: f64,
    pub turned: f64,
    pub turned_early: f64,
    pub early_moment: f64,
    pub braking: f64,
    dynamics: Dynamics,
}

impl Lemmas {
    /// Computes the bounds for the settings `s`.
    pub fn new(s: &Settings) -> Self {
        Self::of(s, Dynamics::new(s))
    }

    /// Computes the bounds for the time before the nominal motion began.
    pub fn before(s: &Settings) -> Self {
        Self::of(s, Dynamics::new(s).before(s))
    }

    fn of(s: &Settings, dynamics: Dynamics) -> Self {
        let parts = Parts::new(s, &dynamics);
        let Dynamics {
            geometry,
            largest,
            smallest,
            rate,
            acceleration,
            by_rates,
            by_angles,
            jerk,
            ..
        } = dynamics;
        Self {
            vehicle: (dynamics.vehicle.rate, dynamics.vehicle.sideslip),
            domain: (dynamics.domain.rate, dynamics.domain.sideslip),
            drift: geometry.drift,
            drift_by_rates: geometry.drift_by_rates,
            r: geometry.r,
            curvature: CURVATURE,
            turn: TURN,
            turn_by_angles: TURN_OF_RATES,
            drift_mixed: DRIFT_MIXED,
            drift_by_angles_twice: DRIFT_BY_ANGLES_TWICE,
            fourth: FOURTH,
            gyroscopic: gyroscopic(s),
            largest,
            smallest,
            rate,
            acceleration,
            by_rates,
            by_angles,
            jerk,
            mismatch: parts.mismatch.mean,
            peak: parts.mismatch.peak,
            unseen_rate: parts.mismatch.unseen_rate,
            mispredicted: parts.mismatch.mispredicted,
            early: parts.early,
            swing: parts.swing,
            bearing: bearing(s, dynamics.domain.sideslip),
            norm: parts.norm,
            turning: parts.turning,
            turned: parts.turned,
            turned_early: parts.turned_early,
            early_moment: parts.early_moment,
            braking: BRAKING,
            dynamics,
        }
    }

    /// Returns bounds on ‖∂m/∂(α, β)‖, ‖∂m/∂x_ω‖ and ‖m‖ for ‖x_ω‖ ≤ x and ‖a‖ ≤ a.
    pub fn moment(&self, x: f64, a: f64) -> [f64; 3] {
        let (by_angles, by_rates) = self.dynamics.slopes(x, a);
        [by_angles, by_rates, self.dynamics.nominal_moment(x, a)]
    }

    /// Returns bounds on ‖d²m/dt²‖ and ‖d²ω/dt²‖ of a nominal motion with a held.
    pub fn curvatures(&self, x: f64, a: f64) -> [f64; 2] {
        [self.dynamics.moment_curvature(x, a), Dynamics::rate_curvature(x, a)]
    }

    /// Returns bounds on the norms (Frobenius) of d²/dt² ∂m/∂(α, β) and d²/dt² ∂m/∂x_ω, and on
    /// the second derivative of the largest ‖I W s‖, of a nominal motion with a held.
    pub fn slope_curvatures(&self, x: f64, a: f64) -> [f64; 3] {
        self.dynamics.slope_curvatures(x, a)
    }
}
