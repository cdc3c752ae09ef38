//! Causes that drive the trajectory off its prediction.

use super::geometry::{Domain, TURN};
use crate::crmpc::settings::Settings;
use std::f64::consts::{FRAC_PI_2, SQRT_2};
use vehicle::math::{cos, powi};

/// All causes that drive the vehicle off its prediction, except the mismatch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Bound on the norm of Δ and the effects of the inertia error and the angle drift, rad/s².
    pub all: f64,
    /// The same bound for two axes, rad/s².
    pub of_two: f64,
    /// Bound on the norm of the effect of the inertia error, rad/s².
    pub of_inertia: f64,
    /// Bound on the angle drift: the norm of the difference between the derivative of the navigated
    /// angles and the navigated rates, rad/s.
    pub angle_drift: f64,
    /// Part of it relative to the rates.
    pub angle_drift_by_rates: f64,
    /// Bound on the norm of the acceleration that the slow errors amount to, rad/s².
    pub of_angle_drift: f64,
    /// Bound on the norm of the error of the measured rates, rad/s.
    pub rate_error: f64,
    /// The same bound for two rates, rad/s.
    pub rate_error_of_two: f64,
    /// Bound on the norm of the error of two measured angles, rad.
    pub angle_error: f64,
}

impl Drive {
    /// `principal` are the smallest and the largest moment of inertia, kg m².
    pub(super) fn new(s: &Settings, vehicle: &Domain, principal: (f64, f64)) -> Self {
        let root3 = 3.0_f64.sqrt();
        let InertiaMoments { along, any } = InertiaMoments::new(s, vehicle, principal);
        let of_inertia = (along + any) / smallest_in_rates(vehicle, principal.0);
        // The angles are navigated ones, from which the true ones differ by the slow errors. With
        // ‖W(Θ) − W(Θ′)‖ ≤ `turned` and ‖R‖ = sec β, the rates R ω differ by ‖R′‖ `turned` ‖R‖ ‖ω‖.
        let turned = TURN * SQRT_2 * s.slow_angle_error;
        let secant = |more: f64| 1.0 / cos((vehicle.sideslip + more).min(FRAC_PI_2));
        let (r, x) = (secant(0.0), secant(0.0) * vehicle.rate);
        let angle_drift_by_rates = secant(s.slow_angle_error) * turned;
        let angle_drift = root3 * s.slow_angle_rate + angle_drift_by_rates * x;
        let of_angle_drift = r * (TURN * angle_drift * x + turned * root3 * s.disturbance_bound);
        Self {
            of_inertia,
            all: root3 * s.disturbance_bound + of_inertia + of_angle_drift,
            of_two: SQRT_2 * s.disturbance_bound + of_inertia + of_angle_drift,
            angle_drift,
            angle_drift_by_rates,
            of_angle_drift,
            rate_error: root3 * s.rate_error,
            rate_error_of_two: SQRT_2 * s.rate_error,
            angle_error: SQRT_2 * s.angle_error,
        }
    }
}

/// Returns the smallest ratio of ‖m‖ to ‖R I⁻¹ m‖, with ‖R‖ = sec β at the vehicle's own attitude
/// and the `smallest` moment of inertia, kg m².
pub(super) fn smallest_in_rates(vehicle: &Domain, smallest: f64) -> f64 {
    cos(vehicle.sideslip) * smallest
}

/// How F differs from the acceleration that the law intended, besides
/// [`super::dynamics::Dynamics::angle_shift`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mismatch {
    /// Sum of all differences that belong to one tick, per period, rad/s².
    pub mean: f64,
    /// Largest difference at any time, rad/s².
    pub peak: f64,
    /// Change of the vehicle's rates by it during d, from a measurement until its command acts,
    /// rad/s.
    pub unseen_rate: f64,
    /// Error of the predicted rates because errors of the measurement change F, rad/s.
    pub mispredicted: f64,
}

impl Mismatch {
    pub(super) const UNBOUNDED: Self = Self {
        mean: f64::INFINITY,
        peak: f64::INFINITY,
        unseen_rate: f64::INFINITY,
        mispredicted: f64::INFINITY,
    };
}

/// Moments that the inertia error amounts to while the largest moment acts, N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertiaMoments {
    /// Along the moment that acts.
    pub along: f64,
    /// In any direction.
    pub any: f64,
}

impl InertiaMoments {
    /// `smallest` and `largest` are moments of inertia, kg m².
    ///
    /// The inertia is I_v = (1 + c) I^½ (1 + E) I^½. With D = 1 − (1 + E)⁻¹, I_v⁻¹ (m − ω × I_v ω)
    /// differs from I⁻¹ (m − ω × I ω) by −c/(1 + c) I⁻¹ m, by I^−½ D I^−½ (ω × I ω − m/(1 + c)),
    /// and by I^−½ (1 + E)⁻¹ I^−½ (ω × I^½ E I^½ ω). For the last one, ‖ω × S ω‖ is at most half
    /// the range of the eigenvalues of S.
    pub(super) fn new(s: &Settings, vehicle: &Domain, (smallest, largest): (f64, f64)) -> Self {
        let gyroscopic = (0.5 * (largest - smallest) + largest) * powi(vehicle.rate, 2);
        let moment = s.limit_total();
        Self {
            along: relative(s.inertia_error) * moment,
            any: relative(s.tensor_error) * (moment / (1.0 - s.inertia_error) + gyroscopic),
        }
    }
}

/// Returns the largest ‖1 − (1 + e)⁻¹‖ for relative errors of the inertia up to e, e/(1 − e).
pub(super) fn relative(error: f64) -> f64 {
    error / (1.0 - error)
}

/// Returns bounds on ‖∂(ω × I ω)/∂ω‖ / ‖ω‖ and on the same ratio for I⁻¹ (ω × I ω). In principal
/// axes the rows hold a_i ω_j and a_i ω_k with a = [I₃ − I₂, I₁ − I₃, I₂ − I₁], so that each ω²
/// meets two of the squares a_i².
pub(super) fn gyroscopic(s: &Settings) -> (f64, f64) {
    let mut inertia: [f64; 3] = s.body.inertia.symmetric_eigenvalues().into();
    inertia.sort_by(f64::total_cmp);
    let [first, second, third] = inertia;
    let rows = [third - second, third - first, second - first];
    let of_two = |values: [f64; 3]| {
        let squares = values.map(|value| value * value);
        let smallest = squares.into_iter().fold(f64::INFINITY, f64::min);
        (squares.iter().sum::<f64>() - smallest).sqrt()
    };
    (of_two(rows), of_two([rows[0] / first, rows[1] / second, rows[2] / third]))
}
