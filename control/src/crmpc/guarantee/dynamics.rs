//! Bounds on the dynamics in the part of the state space that the vehicle does not leave.

use super::derivatives::{Acceleration, Curvatures};
use super::geometry::{DOMAINS, Domain, Geometry, LARGEST_IN_TURN, TURN, WIDEST};
use super::mismatch::{Drive, Mismatch, gyroscopic};
use crate::crmpc::settings::Settings;
use vehicle::math::{exp, powi};

/// Bounds on the dynamics ẋ_ω = F(Θ, x_ω, m) = R (I⁻¹ (m − ω × I ω) − Ẇ x_ω) in the domain, with
/// ‖m‖ ≤ M̄ plus the bound of the known moment. The domain contains the vehicle's states, and their
/// predictions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// States of the vehicle itself.
    pub vehicle: Domain,
    /// States of the vehicle and their predictions.
    pub domain: Domain,
    /// Bounds on the kinematics in the domain.
    pub geometry: Geometry,
    /// Largest moment of inertia, kg m².
    pub largest: f64,
    /// Smallest moment of inertia, kg m².
    pub smallest: f64,
    /// Factor in the bound ‖∂(ω × I ω)/∂ω‖ ≤ `gyroscopic` ‖ω‖ (Frobenius), kg m².
    pub gyroscopic: f64,
    /// Bound on ‖x_ω‖ in the domain, rad/s.
    pub rate: f64,
    /// Bound on ‖F‖ in the domain, rad/s².
    pub acceleration: f64,
    /// Bound on ‖∂F/∂x_ω‖ in the domain, 1/s.
    pub by_rates: f64,
    /// Bound on ‖∂F/∂(α, β)‖ in the domain, 1/s².
    pub by_angles: f64,
    /// Bound on ‖dF/dt‖ along the predicted motion with m held, rad/s³.
    pub slope: f64,
    /// Bound on ‖d²F/dt²‖ along the predicted motion with m held, rad/s⁴.
    pub jerk: f64,
    /// Coefficients of ‖a‖², ‖x_ω‖² ‖a‖ and ‖x_ω‖⁴ in the bound on ‖d²m/dt²‖ of a nominal
    /// trajectory with a held.
    pub curvature: [f64; 3],
    /// Coefficients of the same powers in the bound on ‖d²/dt² ∂m/∂(α, β)‖ (Frobenius).
    pub curvature_by_angles: [f64; 3],
    /// Coefficients of ‖x_ω‖ ‖a‖ and ‖x_ω‖³ in the bound on ‖d²/dt² ∂m/∂x_ω‖ (Frobenius).
    pub curvature_by_rates: [f64; 2],
    /// Coefficients of ‖a‖ and ‖x_ω‖² in the second derivative of the largest ‖I W s‖
    /// over the corners s of the unit box.
    pub curvature_of_induced_norm: [f64; 2],
}

impl Dynamics {
    /// Returns all causes that drive the trajectory off its prediction, except the mismatch.
    pub(super) fn drive(&self, s: &Settings) -> Drive {
        Drive::new(s, &self.vehicle, (self.smallest, self.largest))
    }

    /// Computes the bounds for all states within the limits.
    pub(in crate::crmpc) fn new(s: &Settings) -> Self {
        Self::around(s, Domain { rate: s.limit_rate, sideslip: s.sideslip_domain })
    }

    /// Returns the bounds for the delay before the nominal trajectory began. From then on the
    /// limits hold; before, rates and sideslip exceeded them by no more than their change over it.
    pub(super) fn before(&self, s: &Settings) -> Self {
        let Self { smallest, largest, .. } = *self;
        let mut vehicle = Domain { rate: s.limit_rate, sideslip: s.sideslip_domain };
        for _ in 0..DOMAINS {
            let dynamics = Self::around(s, vehicle);
            let spin = s.limit_total() / smallest
                + 0.5 * (largest - smallest) / smallest * powi(vehicle.rate, 2);
            let rate = s.limit_rate + (spin + dynamics.drive(s).all) * s.delay;
            let sideslip =
                s.sideslip_domain + (vehicle.rate + dynamics.drive(s).angle_drift) * s.delay;
            if rate <= vehicle.rate && sideslip <= vehicle.sideslip || !dynamics.is_bounded() {
                return dynamics;
            }
            vehicle = Domain { rate: rate * (1.0 + 1e-4), sideslip: sideslip * (1.0 + 1e-4) };
        }
        self.unbounded()
    }

    /// Computes the bounds in the smallest domain that contains `vehicle` and the predictions of
    /// its states.
    pub(super) fn around(s: &Settings, vehicle: Domain) -> Self {
        let mut domain = vehicle;
        for _ in 0..DOMAINS {
            let dynamics = Self { vehicle, ..Self::within(s, domain) };
            let needed = dynamics.predicted(s);
            if needed.rate <= domain.rate && needed.sideslip <= domain.sideslip {
                return dynamics;
            }
            // A slightly larger domain is found sooner.
            let more = |value: f64, least: f64| least + (1.0 + 1e-3) * (value - least);
            domain = Domain {
                rate: more(needed.rate, vehicle.rate),
                sideslip: more(needed.sideslip, vehicle.sideslip),
            };
            if domain.sideslip.is_nan() || domain.sideslip > WIDEST {
                break;
            }
        }
        Self::within(s, vehicle).unbounded()
    }

    pub(super) fn unbounded(self) -> Self {
        Self { by_rates: f64::INFINITY, ..self }
    }

    pub(super) fn is_bounded(&self) -> bool {
        self.by_rates.is_finite()
    }

    /// Returns the domain of the states of `vehicle`, of their predictions, and of the states that
    /// the law computes for the middle of the period.
    pub(super) fn predicted(&self, s: &Settings) -> Domain {
        let vehicle = self.vehicle;
        let end = s.delay + s.period_feedback;
        let drive = self.drive(s);
        let f = self.apart(&drive, end) * self.growth(end);
        let beside = 0.25 * self.slope * powi(s.period_feedback, 2);
        let rates = drive.rate_error + (drive.all + f) * end + beside;
        let angles = drive.angle_error
            + (drive.rate_error_of_two + drive.angle_drift + (0.5 * drive.of_two + 0.5 * f) * end)
                * end
            + beside * s.period_feedback;
        Domain {
            rate: vehicle.rate + rates + TURN * angles * self.geometry.r * vehicle.rate,
            sideslip: vehicle.sideslip + angles,
        }
    }

    pub(super) fn within(s: &Settings, domain: Domain) -> Self {
        let eigenvalues = s.body.inertia.symmetric_eigenvalues();
        let (smallest, largest) = (eigenvalues.min(), eigenvalues.max());
        let geometry = Geometry::new(domain.sideslip);
        let spread = (largest - smallest) / smallest;
        let rate = geometry.r * domain.rate;
        let (gyroscopic, spinning) = gyroscopic(s);
        // Gyroscopic term: ‖ω × I ω‖ ≤ ½ (I_max − I_min) ‖ω‖².
        let driven = s.limit_total() / smallest + 0.5 * spread * powi(domain.rate, 2);
        let f = Acceleration { geometry, omega: domain.rate, rate, driven, spread, spinning };
        let (acceleration, by_rates, by_angles) = (f.size(), f.by_rates(), f.by_angles());
        let curvatures = Curvatures { largest, spread: largest - smallest };
        Self {
            vehicle: domain,
            domain,
            geometry,
            largest,
            smallest,
            gyroscopic,
            rate,
            acceleration,
            by_rates,
            by_angles,
            slope: by_rates * acceleration + by_angles * rate,
            jerk: f.jerk(),
            curvature: curvatures.of_moment(geometry.drift),
            curvature_by_angles: curvatures.by_angles(),
            curvature_by_rates: curvatures.by_rates(),
            curvature_of_induced_norm: curvatures.of_box(),
        }
    }

    /// Returns the largest difference of F along a motion and its prediction a time t (s) after the
    /// measurement, relative to [`Self::growth`], rad/s².
    pub(super) fn apart(&self, drive: &Drive, t: f64) -> f64 {
        self.by_rates * (drive.all * t + drive.rate_error)
            + self.by_angles
                * (0.5 * drive.of_two * t * t
                    + drive.angle_error
                    + (drive.rate_error_of_two + drive.angle_drift) * t)
    }

    /// Returns how F differs from the acceleration that the law intended, see [`Mismatch`].
    pub(super) fn mismatch(&self, s: &Settings, drive: &Drive) -> Mismatch {
        let (d, tau) = (s.delay, s.period_feedback);
        let end = d + tau;
        let growth = self.growth(end);
        if !self.is_bounded() {
            return Mismatch::UNBOUNDED;
        }
        let Drive { all, of_two, angle_drift, rate_error, rate_error_of_two, angle_error, .. } =
            *drive;
        let Self { by_rates, by_angles, .. } = *self;
        // Until the next measurement the drive separates the vehicle from its prediction, and
        // afterwards this prediction from the next one. Both distances grow from zero. On average
        // over time, and over the straight line between two motions, the states therefore exceed
        // the vehicle's domain by half of the largest excess. The bound on ∂F/∂x_ω is proportional
        // to that on ‖ω‖.
        let halfway = 0.5 + 0.5 * self.vehicle.rate / self.domain.rate;
        let revised = halfway * by_rates * all * (d + 0.5 * tau)
            + by_angles * of_two * (tau * tau / 6.0 + 0.5 * d * end)
            + by_angles * angle_drift * (d + 0.5 * tau);
        let erred =
            by_rates * rate_error + by_angles * (angle_error + rate_error_of_two * (d + 0.5 * tau));
        let itself = self.jerk * tau * tau / 24.0 + self.middle(tau) * growth;
        let peak = self.apart(drive, end) * growth
            + self.middle(tau) * growth
            + self.jerk * tau * tau / 8.0
            + 0.5 * self.slope * tau;
        Mismatch {
            mean: (revised + erred) * growth + itself,
            peak,
            unseen_rate: (0.5 * by_rates * all * d * d
                + by_angles * of_two * d * d * d / 6.0
                + 0.5 * by_angles * angle_drift * d * d)
                * growth,
            mispredicted: (by_rates * rate_error
                + by_angles * (angle_error + 0.5 * rate_error_of_two * d))
                * d
                * growth,
        }
    }

    /// The law predicts the middle of the period with a constant acceleration. As F changes until
    /// then, the motion is elsewhere in the middle: its rates by up to τ²/8 ‖dF/dt‖, its angles by
    /// up to τ³/24 ‖dF/dt‖. Returns the part of F there that the law does not cancel, rad/s². It
    /// drives the motion off in turn, by no more than [`Self::growth`] if that is not large.
    pub(super) fn middle(&self, tau: f64) -> f64 {
        let in_turn = (self.by_rates + 0.25 * self.by_angles * tau) * 0.5 * tau;
        if in_turn > LARGEST_IN_TURN {
            return f64::INFINITY;
        }
        let square = tau * tau;
        self.slope * (self.by_rates * square / 8.0 + self.by_angles * square * tau / 24.0)
    }

    /// Returns the ratio of the distance of two motions after a time (s) to the distance that the
    /// drive alone would cause. The mismatch itself also drives them apart (Gronwall's inequality).
    pub(super) fn growth(&self, elapsed: f64) -> f64 {
        exp((self.by_rates + self.by_angles * elapsed) * elapsed)
    }

    /// The law cancels f at the predicted middle of the interval in which its moment acts. The
    /// change of F of first order in time therefore cancels in the rate over the interval, and
    /// shifts the angle by τ³ ‖dF/dt‖/12. Returns this shift over τ, rad/s.
    pub(super) fn angle_shift(&self, s: &Settings) -> f64 {
        self.slope * powi(s.period_feedback, 2) / 12.0
    }

    /// Returns the largest amount by which the mismatch moves the rates, between two ticks, beyond
    /// the straight line of its mean, rad/s: τ²/8 ‖dF/dt‖ by the change of first order in time, and
    /// τ³/(36 √12) ‖d²F/dt²‖ by that of second order, rounded up to τ³/120.
    pub(super) fn between(&self, s: &Settings) -> f64 {
        let tau = s.period_feedback;
        self.slope * tau * tau / 8.0 + self.jerk * powi(tau, 3) / 120.0
    }
}
