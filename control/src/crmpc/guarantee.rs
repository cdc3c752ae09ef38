//! The basis of the robust set's guarantee: how far the vehicle can be from the plan, and whether
//! enough of the limits is then left.
//!
//! The theorem, its assumptions and its proof are in docs/guarantee.md. The comments beside the
//! code explain the numbers of its lemmas.

mod lemmas;
mod switching;

pub use lemmas::Lemmas;
pub(super) use switching::unseen;
pub use switching::{Carried, Onset, Switching};

use super::settings::{InitialState, Settings};
use crate::controller::Explained;
use crate::error::DesignError;
use crate::error_dynamics::{Early, Reach, SampledError};
use nalgebra::Vector3;
use std::f64::consts::SQRT_2;
use vehicle::math::{cos, exp, powi, sin, sin_cos};

/// Largest deviation of the vehicle from the plan at a feedback tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Deviation of angle of attack and sideslip, ‖(α, β) − (α̃, β̃)‖, rad. The bank angle changes
    /// neither ω nor m.
    pub angle: f64,
    /// Deviation of the rates, ‖x_ω − x̃_ω‖, rad/s.
    pub rate: f64,
    /// Deviation of angle of attack and sideslip in the predicted state on which the law acts, rad.
    pub seen_angle: f64,
    /// Deviation of the rates in the predicted state on which the law acts, rad/s.
    pub seen_rate: f64,
    /// Deviation of angle of attack and sideslip in the state that the law predicts for the middle
    /// of the period, where it evaluates f and R, rad.
    pub middle_angle: f64,
    /// Deviation of the rates in that state, rad/s.
    pub middle_rate: f64,
    /// Half width of the box part of K ô, rad/s²; the ball part below is added to it.
    pub feedback: f64,
    /// Radius of the ball part of K ô, rad/s².
    pub feedback_norm: f64,
    /// Moment that K ô requires to compensate for the inertia error, N m.
    pub feedback_moment: f64,
}

impl Deviation {
    /// Returns the larger value of each component.
    fn or(&self, other: &Self) -> Self {
        self.with(other, f64::max)
    }

    /// Returns the sum of each component and its counterpart.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        self.with(other, |own, other| own + other)
    }

    fn with(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            angle: of(self.angle, other.angle),
            rate: of(self.rate, other.rate),
            seen_angle: of(self.seen_angle, other.seen_angle),
            seen_rate: of(self.seen_rate, other.seen_rate),
            middle_angle: of(self.middle_angle, other.middle_angle),
            middle_rate: of(self.middle_rate, other.middle_rate),
            feedback: of(self.feedback, other.feedback),
            feedback_norm: of(self.feedback_norm, other.feedback_norm),
            feedback_moment: of(self.feedback_moment, other.feedback_moment),
        }
    }
}

/// Tightening of the robust set, by feedback ticks since the nominal motion began at the measured
/// state.
#[derive(Clone, Debug, PartialEq)]
pub struct Tightening {
    /// Deviation at each tick; the last one is never exceeded.
    at: Vec<Deviation>,
    /// Largest amount by which the deviation of the angles exceeds the straight line between its
    /// values at both ends of the optimisation period that begins at each tick, rad.
    angle_bulge: Vec<f64>,
    /// Loss of moment by the largest deviation within the optimisation period that begins at each
    /// tick.
    moment: Vec<MomentLoss>,
    /// Loss of rate by the deviation at each tick, and in the intervals of the plan before and
    /// after it.
    rate: Vec<RateLoss>,
    /// Largest ‖I W s‖ over the corners s of the unit box at any attitude of the domain, kg m².
    pub bearing: f64,
    /// Bound on the norm of everything that drives the deviation, rad/s².
    pub norm: f64,
    /// Part of `norm` by which F differs between two ticks from the acceleration that the law
    /// intended, rad/s².
    pub mismatch: f64,
    /// Largest component of an explained disturbance estimate, rad/s²: Δ̄, the part of the inertia
    /// error, the mismatch and the errors of the rates.
    pub observable: f64,
    /// What the assumptions explain of the mean acceleration over a period.
    pub explained: Explained,
    /// What an unknown part of the delay adds; `None` if the delay is exact.
    pub switching: Option<Box<Switching>>,
    /// Largest jump of the rates that a change of K ô causes, rad/s, by feedback ticks.
    pulse: Vec<f64>,
    /// Growth of a disturbance in what is observed of it.
    pub growth: f64,
}

impl Tightening {
    fn place(&self, tick: usize) -> usize {
        tick.min(self.at.len() - 1)
    }

    /// Returns the deviation `tick` feedback ticks after the nominal motion began.
    pub fn at(&self, tick: usize) -> &Deviation {
        &self.at[self.place(tick)]
    }

    /// Returns the loss of moment by the largest deviation at the feedback ticks of the
    /// optimisation period that begins at `tick`.
    pub(super) fn moment_loss(&self, tick: usize) -> &MomentLoss {
        &self.moment[self.place(tick)]
    }

    /// Returns the loss of rate at `tick` and in the intervals of the plan before and after it.
    pub(super) fn rate_loss(&self, tick: usize) -> &RateLoss {
        &self.rate[self.place(tick)]
    }

    /// Returns the largest amount by which the deviation of the angles exceeds the straight line
    /// between its values at both ends of the optimisation period that begins at `tick`, rad.
    pub(super) fn angle_bulge(&self, tick: usize) -> f64 {
        self.angle_bulge[self.place(tick)]
    }

    /// Returns the largest jump of the rates that a change of K ô at `tick` causes if the command
    /// begins to act earlier or later than assumed, rad/s.
    pub(super) fn pulse(&self, tick: usize) -> f64 {
        self.pulse[self.place(tick)]
    }

    /// Returns the largest deviation at the `ratio` ticks from `tick` on.
    pub(super) fn within(&self, tick: usize, ratio: usize) -> Deviation {
        (tick..tick + ratio).fold(Deviation::default(), |largest, n| largest.or(self.at(n)))
    }

    /// Returns the deviation that is never exceeded.
    pub fn forever(&self) -> &Deviation {
        self.at(usize::MAX)
    }
}

/// Bounds that depend on |sin β| ≤ s alone.
///
/// With e₁, e₂, e₃ turned by α, Ẇ x_ω = [s x₂ (2 s x₁ + x₃), −c x₂ (2 s x₁ + x₃),
/// c x₁ (s x₁ + x₃)], where s = sin β, c = cos β, x = x_ω.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Factor in the bound ‖Ẇ x‖ ≤ `drift` ‖x‖².
    pub drift: f64,
    /// Factor in the bound ‖∂(Ẇ x)/∂x‖ ≤ `drift_by_rates` ‖x‖.
    pub drift_by_rates: f64,
    /// Norm ‖R‖ = sec β (Lemma 1).
    pub r: f64,
}

/// Bound on ‖∂²(W y)/∂(α, β)²‖ relative to ‖y‖.
const CURVATURE: f64 = 3.162_277_660_168_379_5;
/// Bound on ‖W(Θ + o) − W(Θ)‖ relative to ‖o‖: ∂W/∂α and ∂W/∂β are orthogonal and no longer than √2
/// (Frobenius).
pub(super) const TURN: f64 = SQRT_2;
/// Bound on the mixed second derivative of Ẇ x by angles and rates, relative to ‖x‖.
/// Ẇ x = ∂W x α̇ + ∂W x β̇ takes one more derivative of W.
const DRIFT_MIXED: f64 = 2.0 * CURVATURE;
/// Bound on the second derivative of Ẇ x by the angles, relative to ‖x‖², from the third
/// derivatives of W.
const DRIFT_BY_ANGLES_TWICE: f64 = 8.0;
/// Bound on ‖∂⁴(W y)/∂(α, β)⁴‖ relative to ‖y‖. Along a line of unit speed in (α, β), W y is a sum
/// of sines whose frequencies are at most |α̇| + 2 |β̇| ≤ √5. As ‖W y‖ ≤ ‖y‖ everywhere, Bernstein's
/// inequality bounds the fourth derivative by √5⁴.
const FOURTH: f64 = 25.0;
/// Largest z for which 1/(1 − z) ≤ exp(2 z) is used; it is true up to 0.79.
const LARGEST_IN_TURN: f64 = 0.75;
/// Number of domains that are tried until one contains its predictions.
const DOMAINS: usize = 50;
/// Widest sideslip angle of a domain, rad.
const WIDEST: f64 = 0.95;
/// Rate at which the nominal motion brakes beyond the horizon, a = −κ x̃_ω, 1/s; for the sideslip
/// it is the smallest rate. See [`braking`].
pub(super) const BRAKING: f64 = 0.01;

impl Geometry {
    /// Computes the bounds for |β| ≤ `sideslip` (rad, below π/2).
    pub fn new(sideslip: f64) -> Self {
        let (s, c) = sin_cos(sideslip);
        let (s2, c2) = (s * s, c * c);
        // ‖Ẇ x‖² = x₂² (2 s x₁ + x₃)² + c² x₁² (s x₁ + x₃)² ≤ A u (1 − u) + E u² with u = x₁² + x₃²
        // for ‖x‖ = 1.
        let a = 1.0 + 4.0 * s2;
        let e = c2 * powi(0.5 * (s + (1.0 + s2).sqrt()), 2);
        let square = if 2.0 * e < a { a * a / (4.0 * (a - e)) } else { e };
        // The rows of its derivative, [2 s x₂, 2 s x₁ + x₃, x₂] and c [2 s x₁ + x₃, 0, x₁], are
        // squared and added up.
        let trace = (1.0 + c2) * a + c2;
        let determinant = c2 * (1.0 + c2);
        let by_rates = (0.5 * (trace + (trace * trace - 4.0 * determinant).sqrt())).max(a);
        Self { drift: square.sqrt(), drift_by_rates: by_rates.sqrt(), r: 1.0 / c }
    }
}

/// Part of the state space in which the dynamics are bounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Domain {
    /// Bound on ‖ω‖, rad/s.
    pub rate: f64,
    /// Bound on |β|, rad.
    pub sideslip: f64,
}

/// Bounds on the dynamics ẋ_ω = F(Θ, x_ω, m) = R (I⁻¹ (m − ω × I ω) − Ẇ x_ω) in the domain, with
/// ‖m‖ ≤ M̄. The domain contains the vehicle's states, and their predictions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dynamics {
    /// States of the vehicle itself.
    vehicle: Domain,
    pub domain: Domain,
    pub geometry: Geometry,
    /// Largest and smallest moment of inertia, kg m².
    pub largest: f64,
    pub smallest: f64,
    /// Factor in the bound ‖∂(ω × I ω)/∂ω‖ ≤ `gyroscopic` ‖ω‖ (Frobenius), kg m².
    pub gyroscopic: f64,
    /// Bound on ‖x_ω‖ in the domain, rad/s.
    pub rate: f64,
    /// Bound on ‖F‖ in the domain, rad/s².
    acceleration: f64,
    /// Bound on ‖∂F/∂x_ω‖ in the domain, 1/s.
    by_rates: f64,
    /// Bound on ‖∂F/∂(α, β)‖ in the domain, 1/s².
    by_angles: f64,
    /// Bound on ‖dF/dt‖ along the predicted motion with m held, rad/s³.
    slope: f64,
    /// Bound on ‖d²F/dt²‖ along the predicted motion with m held, rad/s⁴.
    jerk: f64,
    /// Coefficients of ‖a‖², ‖x_ω‖² ‖a‖ and ‖x_ω‖⁴ in [`Self::moment_curvature`].
    curvature: [f64; 3],
    /// Coefficients of the same powers in the curvature of ∂m/∂(α, β), see
    /// [`Self::slope_curvatures`].
    curvature_by_angles: [f64; 3],
    /// Coefficients of ‖x_ω‖ ‖a‖ and ‖x_ω‖³ in the curvature of ∂m/∂x_ω.
    curvature_by_rates: [f64; 2],
    /// Coefficients of ‖a‖ and ‖x_ω‖² in the curvature of the largest ‖I W s‖.
    curvature_of_bearing: [f64; 2],
}

impl Dynamics {
    /// Computes the bounds for all states within the limits.
    pub(super) fn new(s: &Settings) -> Self {
        Self::around(s, Domain { rate: s.limit_rate, sideslip: s.sideslip_domain })
    }

    /// Returns the bounds for the delay before the nominal motion began. From then on the limits
    /// hold; before, rates and sideslip exceeded them by no more than they change over the delay.
    fn before(&self, s: &Settings) -> Self {
        let Self { smallest, largest, .. } = *self;
        let mut vehicle = Domain { rate: s.limit_rate, sideslip: s.sideslip_domain };
        for _ in 0..DOMAINS {
            let dynamics = Self::around(s, vehicle);
            let spin = s.limit_moment / smallest
                + 0.5 * (largest - smallest) / smallest * powi(vehicle.rate, 2);
            let rate = s.limit_rate + (spin + Drive::new(s, &dynamics).all) * s.delay;
            let sideslip = s.sideslip_domain + vehicle.rate * s.delay;
            if rate <= vehicle.rate && sideslip <= vehicle.sideslip || !dynamics.is_bounded() {
                return dynamics;
            }
            vehicle = Domain { rate: rate * (1.0 + 1e-4), sideslip: sideslip * (1.0 + 1e-4) };
        }
        self.unbounded()
    }

    /// Computes the bounds in the smallest domain that contains `vehicle` and the predictions of
    /// its states.
    fn around(s: &Settings, vehicle: Domain) -> Self {
        let mut domain = vehicle;
        for _ in 0..DOMAINS {
            let dynamics = Self { vehicle, ..Self::within(s, domain) };
            let needed = dynamics.predicted(s);
            if needed.rate <= domain.rate && needed.sideslip <= domain.sideslip {
                return dynamics;
            }
            // A little more than needed is found sooner.
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

    fn unbounded(self) -> Self {
        Self { by_rates: f64::INFINITY, ..self }
    }

    fn is_bounded(&self) -> bool {
        self.by_rates.is_finite()
    }

    /// Returns the domain of the states of `vehicle`, of their predictions, and of the states that
    /// the law computes for the middle of the period.
    fn predicted(&self, s: &Settings) -> Domain {
        let vehicle = self.vehicle;
        let end = s.delay + s.period_feedback;
        let drive = Drive::new(s, self);
        // The moment that acts is the assumed one, shifted by up to the error of the delay. The
        // integrals of both over any time therefore differ by no more than this much at both ends,
        // and R changes little in the meantime.
        let turned = 1.0 + TURN * self.geometry.r * self.rate * end;
        let jumps = 2.0 * s.delay_error * s.limit_moment * self.geometry.r * turned
            / ((1.0 - s.inertia_error) * (1.0 - s.tensor_error) * self.smallest);
        let by_jumps = (self.by_rates + self.by_angles * end) * jumps;
        let f = (self.apart(&drive, end) + by_jumps) * self.growth(end);
        let beside = 0.25 * self.slope * powi(s.period_feedback, 2);
        let rates = drive.rate_error + (drive.all + f) * end + beside + jumps;
        let angles = drive.angle_error
            + (drive.rate_error_of_two + (0.5 * drive.of_two + 0.5 * f) * end) * end
            + beside * s.period_feedback
            + jumps * end;
        Domain {
            rate: vehicle.rate + rates + TURN * angles * self.geometry.r * vehicle.rate,
            sideslip: vehicle.sideslip + angles,
        }
    }

    fn within(s: &Settings, domain: Domain) -> Self {
        let eigenvalues = s.body.inertia.symmetric_eigenvalues();
        let (smallest, largest) = (eigenvalues.min(), eigenvalues.max());
        let geometry = Geometry::new(domain.sideslip);
        let Geometry { drift, drift_by_rates, r } = geometry;
        let spread = (largest - smallest) / smallest;
        let rate = r * domain.rate;
        let (gyroscopic, spinning) = gyroscopic(s);
        // Gyroscopic term: ‖ω × I ω‖ ≤ ½ (I_max − I_min) ‖ω‖².
        let spin = s.limit_moment / smallest + 0.5 * spread * powi(domain.rate, 2);
        let acceleration = r * (spin + drift * rate * rate);
        let by_rates = r * (drift_by_rates * rate + spinning * domain.rate);
        // The derivative of R is ∂R = −R ∂W R; that of Ẇ x by the angles takes second derivatives
        // of W.
        let of_r = TURN * r * r;
        let by_angles = of_r * (spin + drift * rate * rate)
            + r * (CURVATURE * rate * rate + spinning * domain.rate * TURN * rate);
        // F_xx [a, a] + 2 F_xθ [a, x] + F_θθ [x, x] + F_θ a + F_x ȧ with a = F and ȧ = F_x a + F_θ
        // x. The second derivatives follow from the first ones with one more derivative of R or W.
        let second = 2.0 * (by_rates / rate);
        let mixed = of_r * by_rates + r * (DRIFT_MIXED + 4.0 * spread) * rate;
        let angles_twice = 2.0 * of_r * by_angles
            + (CURVATURE * r * r + 2.0 * of_r * of_r) * (spin + drift * rate * rate)
            + r * (DRIFT_BY_ANGLES_TWICE + 12.0 * spread) * rate * rate;
        let jerk = second * acceleration * acceleration
            + 2.0 * mixed * acceleration * rate
            + angles_twice * rate * rate
            + by_angles * acceleration
            + by_rates * (by_rates * acceleration + by_angles * rate);
        let slope = by_rates * acceleration + by_angles * rate;
        // I Ẅ a gives ∂²W [x, x] a + ∂W [a] a. The rest is as in `MomentLoss`, with ẋ_ω = a and
        // Θ̈ = a.
        let twisted = largest - smallest;
        let curvature = [
            largest * TURN + 2.0 * (largest * drift + 0.5 * twisted),
            2.0 * largest * CURVATURE
                + 2.0 * (largest * DRIFT_MIXED + 4.0 * twisted)
                + TURN * SQRT_2 * twisted,
            largest * DRIFT_BY_ANGLES_TWICE + 12.0 * twisted,
        ];
        // With P = ∂W[o] x and the symmetric bilinear form B(ω, ω) = 2 ω × I ω, ∂m/∂(α, β) [o] is
        // I (∂W[o] a + ∂²W[x, o] x) + B(ω, P). Here ‖P‖ ≤ t x, ‖Ṗ‖ ≤ c x² + t a and ‖P̈‖ ≤ d x³ +
        // 3 c x a with the bounds t, c and d on the first three derivatives of W; ‖ω̇‖ ≤ t x² + a,
        // and ω̈ is that of `rate_curvature`. Likewise ∂m/∂x_ω [v] is I (∂W[v] x + ∂W[x] v) +
        // B(ω, W v). Two and three columns make the norm one of Frobenius.
        let root3 = 3.0_f64.sqrt();
        let curvature_by_angles = [
            SQRT_2 * (3.0 * largest * CURVATURE + 2.0 * twisted * TURN),
            SQRT_2
                * (6.0 * largest * DRIFT_BY_ANGLES_TWICE
                    + 5.0 * twisted * (TURN * TURN + CURVATURE)),
            SQRT_2
                * (largest * FOURTH + twisted * (3.0 * TURN * CURVATURE + DRIFT_BY_ANGLES_TWICE)),
        ];
        let curvature_by_rates = [
            root3 * (6.0 * largest * CURVATURE + 6.0 * twisted * TURN),
            root3
                * (2.0 * largest * DRIFT_BY_ANGLES_TWICE
                    + 2.0 * twisted * (CURVATURE + TURN * TURN)),
        ];
        let curvature_of_bearing = [root3 * largest * TURN, root3 * largest * CURVATURE];
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
            slope,
            jerk,
            curvature,
            curvature_by_angles,
            curvature_by_rates,
            curvature_of_bearing,
        }
    }

    /// Returns the largest difference of F along a motion and its prediction a time t (s) after the
    /// measurement, relative to [`Self::growth`], rad/s².
    fn apart(&self, drive: &Drive, t: f64) -> f64 {
        self.by_rates * (drive.all * t + drive.rate_error)
            + self.by_angles
                * (0.5 * drive.of_two * t * t + drive.angle_error + drive.rate_error_of_two * t)
    }

    /// Returns how F differs from the acceleration that the law intended, see [`Mismatch`].
    fn mismatch(&self, s: &Settings, drive: &Drive) -> Mismatch {
        let (d, tau) = (s.delay, s.period_feedback);
        let end = d + tau;
        let growth = self.growth(end);
        if !self.is_bounded() {
            return Mismatch::UNBOUNDED;
        }
        let Drive { all, of_two, rate_error, rate_error_of_two, angle_error, .. } = *drive;
        let Self { by_rates, by_angles, .. } = *self;
        // The drive takes the motion away from its prediction until the next measurement, and from
        // then on that prediction from the next one. The distances grow with time, so that on
        // average over time, and over the straight line between two motions, the domain exceeds
        // that of the vehicle by half as much. The bound on ∂F/∂x_ω is proportional to that on ‖ω‖.
        // The jumps by commands that begin early or late come at any time.
        let halfway = if s.delay_error > 0.0 {
            1.0
        } else {
            0.5 + 0.5 * self.vehicle.rate / self.domain.rate
        };
        let revised = halfway * by_rates * all * (d + 0.5 * tau)
            + by_angles * of_two * (tau * tau / 6.0 + 0.5 * d * end);
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
            unseen_rate: (0.5 * by_rates * all * d * d + by_angles * of_two * d * d * d / 6.0)
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
    fn middle(&self, tau: f64) -> f64 {
        let in_turn = (self.by_rates + 0.25 * self.by_angles * tau) * 0.5 * tau;
        if in_turn > LARGEST_IN_TURN {
            return f64::INFINITY;
        }
        let square = tau * tau;
        self.slope * (self.by_rates * square / 8.0 + self.by_angles * square * tau / 24.0)
    }

    /// Returns by how much the change of acceleration from one command to the next, at any instant
    /// within the error of the delay about the tick, differs from the change that the law intends:
    /// an amount (rad/s²), and a share of the change.
    ///
    /// The law gives the accelerations a′ = F(y, m) at the states y that it predicts for the
    /// middles of two periods. F with the older moment differs between these two states, which lie
    /// one period of the motion apart, and by what the newer measurement adds. The attitude at the
    /// instant differs from the predicted one.
    fn between_commands(&self, s: &Settings, drive: &Drive) -> (f64, f64) {
        let (tau, error) = (s.period_feedback, s.delay_error);
        let end = s.delay + tau + error;
        let growth = self.growth(end);
        let Drive { all, of_two, rate_error, rate_error_of_two, angle_error, .. } = *drive;
        let rates = self.acceleration * tau
            + 0.25 * self.slope * tau * tau
            + (all * tau + 2.0 * rate_error) * growth;
        let angles = self.rate * tau
            + 0.25 * self.acceleration * tau * tau
            + (of_two * tau * end + 2.0 * angle_error + 2.0 * rate_error_of_two * end) * growth;
        let apart = self.rate * (0.5 * tau + error)
            + (angle_error + (rate_error_of_two + 0.5 * of_two * end) * end) * growth;
        (
            self.by_rates * rates + self.by_angles * angles,
            TURN * self.geometry.r * self.geometry.r * apart,
        )
    }

    /// Returns the ratio of the distance of two motions after a time (s) to the distance that the
    /// drive alone would cause. The mismatch itself also drives them apart (Gronwall's inequality).
    fn growth(&self, elapsed: f64) -> f64 {
        exp((self.by_rates + self.by_angles * elapsed) * elapsed)
    }

    /// The law cancels f at the predicted middle of the interval in which its moment acts. The
    /// change of F of first order in time therefore cancels in the rate over the interval, and
    /// shifts the angle by τ³ ‖dF/dt‖/12. Returns this shift over τ, rad/s.
    fn swing(&self, s: &Settings) -> f64 {
        self.slope * powi(s.period_feedback, 2) / 12.0
    }

    /// Returns the largest amount by which the mismatch moves the rates, between two ticks, beyond
    /// the straight line of its mean, rad/s: τ²/8 ‖dF/dt‖ by the change of first order in time, and
    /// τ³/(36 √12) ‖d²F/dt²‖ by that of second order.
    fn between(&self, s: &Settings) -> f64 {
        let tau = s.period_feedback;
        self.slope * tau * tau / 8.0 + self.jerk * powi(tau, 3) / 120.0
    }
}

/// Everything that drives the motion off its prediction but for the mismatch.
#[derive(Clone, Copy, Debug)]
struct Drive {
    /// Bound on the norm of Δ and the effect of the inertia error, rad/s², and on that of two axes.
    all: f64,
    of_two: f64,
    /// Bound on the norm of the effect of the inertia error, rad/s².
    of_inertia: f64,
    /// Bounds on the norm of the error of the measured rates, rad/s, and of two of them.
    rate_error: f64,
    rate_error_of_two: f64,
    /// Bound on the norm of the error of two measured angles, rad.
    angle_error: f64,
}

impl Drive {
    fn new(s: &Settings, dynamics: &Dynamics) -> Self {
        let root3 = 3.0_f64.sqrt();
        let (along, any) = inertia_moments(s, dynamics);
        // ‖R‖ = sec β at the vehicle's own attitude.
        let of_inertia = (along + any) / (cos(dynamics.vehicle.sideslip) * dynamics.smallest);
        Self {
            of_inertia,
            all: root3 * s.disturbance_bound + of_inertia,
            of_two: SQRT_2 * s.disturbance_bound + of_inertia,
            rate_error: root3 * s.rate_error,
            rate_error_of_two: SQRT_2 * s.rate_error,
            angle_error: SQRT_2 * s.angle_error,
        }
    }
}

/// How F differs from the acceleration that the law intended, besides [`Dynamics::swing`].
#[derive(Clone, Copy, Debug)]
struct Mismatch {
    /// Sum of all differences that belong to one tick, per period, rad/s².
    mean: f64,
    /// Largest difference at any time, rad/s².
    peak: f64,
    /// Change of the rates by it between a measurement and its tick, rad/s.
    unseen_rate: f64,
    /// Change of the predicted rates by it because of errors of the measurement, rad/s.
    mispredicted: f64,
}

impl Mismatch {
    const UNBOUNDED: Self = Self {
        mean: f64::INFINITY,
        peak: f64::INFINITY,
        unseen_rate: f64::INFINITY,
        mispredicted: f64::INFINITY,
    };
}

/// Returns the moments that the inertia error amounts to while the largest moment acts, N m: along
/// that moment, and in any direction.
///
/// The inertia is I_v = (1 + c) I^½ (1 + E) I^½. With D = 1 − (1 + E)⁻¹, I_v⁻¹ (m − ω × I_v ω)
/// differs from I⁻¹ (m − ω × I ω) by −c/(1 + c) I⁻¹ m, by I^−½ D I^−½ (ω × I ω − m/(1 + c)), and by
/// I^−½ (1 + E)⁻¹ I^−½ (ω × I^½ E I^½ ω). For the last one, ‖ω × S ω‖ is at most half the range of
/// the eigenvalues of S.
fn inertia_moments(s: &Settings, dynamics: &Dynamics) -> (f64, f64) {
    let Dynamics { smallest, largest, vehicle, .. } = dynamics;
    let common = s.inertia_error / (1.0 - s.inertia_error);
    let tensor = s.tensor_error / (1.0 - s.tensor_error);
    let gyroscopic = (0.5 * (largest - smallest) + largest) * powi(vehicle.rate, 2);
    (common * s.limit_moment, tensor * (s.limit_moment / (1.0 - s.inertia_error) + gyroscopic))
}

/// Returns bounds on ‖∂(ω × I ω)/∂ω‖ / ‖ω‖ and on the same ratio for I⁻¹ (ω × I ω). In principal
/// axes the rows hold a_i ω_j and a_i ω_k with a = [I₃ − I₂, I₁ − I₃, I₂ − I₁], so that each ω²
/// meets two of the squares a_i².
fn gyroscopic(s: &Settings) -> (f64, f64) {
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

/// Remainder of the limits at rest and beyond the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assessment {
    /// Share of the rate limit that is left for the motion beyond the horizon.
    pub rate_left: f64,
    /// Share of the moment limit that is left after a constant corner of Δ̄, the errors and the
    /// delay, at the attitude that needs most.
    pub moment_left: f64,
    /// Largest ‖x̃_ω‖ at the end of the horizon, rad/s. From there the motion brakes and keeps
    /// every limit for ever.
    pub terminal_rate: f64,
}

impl Assessment {
    /// Returns whether the guarantee can be given.
    pub fn holds(&self) -> bool {
        self.terminal_rate >= SMALLEST_TERMINAL_RATE
    }
}

/// Smallest acceptable bound on ‖x̃_ω‖ at the end of the horizon, 0.2°/s in rad/s; below it there
/// is no room to move at all.
const SMALLEST_TERMINAL_RATE: f64 = 3.5e-3;

/// Computes tightening and assessment of `settings`.
///
/// # Errors
/// Returns an error that names the gain that does not stabilise, with its spectral radius, or the
/// gain for which no invariant set can be computed.
pub(super) fn tighten(s: &Settings) -> Result<(Tightening, Assessment), DesignError> {
    let error = SampledError::delayed(s.feedback, s.period_feedback, s.delay);
    let unstable = || DesignError::Unstable {
        name: "period_feedback",
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
    // The observer uses predicted rates, and each prediction has its own error. The first-order
    // filter amplifies the differences of these errors by no more than this.
    let predicted =
        3.0_f64.sqrt() * s.rate_error + parts.mismatch.mispredicted * (1.0 + parts.early[1].excess);
    let observable = s.disturbance_bound + parts.norm - 3.0_f64.sqrt() * s.disturbance_bound
        + parts.mismatch.mean * parts.early[0].excess
        + 2.0 * predicted / s.observer.time_constant;
    let tightening = Tightening {
        switching,
        pulse,
        growth: dynamics.growth(s.delay + s.period_feedback),
        explained: Explained {
            disturbance: s.disturbance_bound
                + parts.any_moment * dynamics.geometry.r / dynamics.smallest
                + 2.0 * s.rate_error / s.period_feedback,
            share: s.inertia_error / (1.0 - s.inertia_error),
            delay_error: s.delay_error,
        },
        angle_bulge,
        moment,
        rate,
        bearing,
        norm: parts.norm,
        mismatch: parts.mismatch.mean,
        observable,
        at,
    };
    let assessment = assess(s, &dynamics, &tightening);
    Ok((tightening, assessment))
}

/// Returns the deviation at each tick, and the jump of the rates by a change of K ô there, see
/// [`Tightening::pulse`].
fn deviations(
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
pub(super) fn lateral(s: &Settings) -> f64 {
    0.25 * s.period_feedback * s.period_feedback
}

/// Returns these settings with the given share of the disturbance bound and the errors.
pub(super) fn counting(s: &Settings, share: f64) -> Settings {
    Settings {
        disturbance_bound: share * s.disturbance_bound,
        angle_error: share * s.angle_error,
        rate_error: share * s.rate_error,
        delay_error: share * s.delay_error,
        ..*s
    }
}

/// The parts that drive the deviation, separated by the way in which they add up.
struct Parts {
    /// Moments of [`inertia_moments`], N m.
    along_moment: f64,
    any_moment: f64,
    /// Square root of the condition number of I, by which the latter grows if it is expressed as a
    /// moment.
    root_condition: f64,
    drive: Drive,
    mismatch: Mismatch,
    /// Effects before the nominal motion began, see [`Early`]: on the mean of the mismatch, on the
    /// predictions, and on the shift of the angle.
    early: [Early; 3],
    /// Shift of the angle per time, see [`Dynamics::swing`].
    swing: f64,
    /// Deviation of the rates between two ticks, see [`Dynamics::between`], rad/s.
    between: f64,
    /// Bound on the norm of all parts together, rad/s².
    norm: f64,
    /// Growth rate of the moment that the inertia error requires while the vehicle turns, 1/s.
    turning: f64,
    /// Share by which it is larger because the attitude is measured with an error.
    turned: f64,
    /// Share by which it is larger because the vehicle was faster before the nominal motion began.
    turned_early: f64,
    /// Moment by which the inertia error amounts to more before the nominal motion began, N m.
    early_moment: f64,
    /// Factors by which the inertia error makes the change of acceleration by a moment larger, if
    /// it is a common factor, and in all.
    pulse_common: f64,
    pulse_inertia: f64,
    /// Jump of the rates at the next command because of a pulse, relative to the pulse; it is
    /// included in `pulse_inertia`.
    pulse_revised: f64,
    /// Jump of the rates by the mismatch that a pulse causes, relative to the pulse.
    pulse_mismatch: f64,
    /// Change of the acceleration from one command to the next while the vehicle turns, rad/s².
    turn: f64,
}

/// Jump of the rates at a tick, rad/s: in each component, and as a norm beyond that.
struct Pulse {
    of_box: f64,
    of_ball: f64,
}

impl Pulse {
    fn norm(&self) -> f64 {
        3.0_f64.sqrt() * self.of_box + self.of_ball
    }
}

impl Parts {
    fn new(s: &Settings, dynamics: &Dynamics) -> Self {
        let Dynamics { smallest, largest, rate, .. } = dynamics;
        let before = dynamics.before(s);
        let (drive, larger) = (Drive::new(s, dynamics), Drive::new(s, &before));
        let first = before.mismatch(s, &larger);
        let mut mismatch = dynamics.mismatch(s, &drive);
        if !first.mean.is_finite() {
            mismatch = Mismatch::UNBOUNDED;
        }
        // The inertia error has a larger effect, too.
        let more = larger.of_inertia - drive.of_inertia;
        mismatch.peak = first.peak + more;
        mismatch.unseen_rate = first.unseen_rate + more * s.delay;
        let ticks = (s.delay / s.period_feedback).ceil() as usize;
        let early = |first: f64, later: f64| Early {
            ticks,
            excess: if first > later { first / later - 1.0 } else { 0.0 },
        };
        let swing = dynamics.swing(s);
        let early = [
            early(first.mean + more, mismatch.mean),
            early(first.mispredicted, mismatch.mispredicted),
            early(before.swing(s), swing),
        ];
        let (along_moment, any_moment) = inertia_moments(s, dynamics);
        let any_before = inertia_moments(s, &before).1;
        // Bound of ‖I (W − W′) R′ I⁻¹‖ per unit of the angle between both attitudes.
        let by_turn = largest / smallest * TURN * before.geometry.r;
        let common = s.inertia_error / (1.0 - s.inertia_error);
        let tensor = s.tensor_error / (1.0 - s.tensor_error);
        let root_condition = (largest / smallest).sqrt();
        // Until a prediction includes a pulse, the motion differs from its prediction.
        let elapsed = s.delay + s.period_feedback;
        let pulse_mismatch =
            (before.by_rates + 0.5 * before.by_angles * elapsed) * elapsed * before.growth(elapsed);
        let (turn, attitude) = before.between_commands(s, &larger);
        let pulse_inertia =
            (1.0 + common) * (1.0 + tensor * root_condition * before.geometry.r) * (1.0 + attitude);
        // The pulse before is a part of the motion between two commands, too.
        let pulse_revised = s.delay_error
            * pulse_inertia
            * (before.by_rates + before.by_angles * elapsed)
            * before.growth(elapsed);
        Self {
            pulse_common: 1.0 + common,
            pulse_inertia: pulse_inertia / (1.0 - pulse_revised),
            pulse_revised,
            pulse_mismatch,
            turn,
            along_moment,
            any_moment,
            root_condition,
            drive,
            mismatch,
            early,
            swing,
            between: before.between(s),
            norm: drive.all + mismatch.mean,
            turning: by_turn * rate,
            turned: by_turn * drive.angle_error,
            turned_early: by_turn * (before.rate - rate) * s.delay,
            // No turn makes a moment larger than ‖I‖ ‖R‖ ‖I⁻¹‖ does.
            early_moment: (any_before - any_moment) * largest / smallest * before.geometry.r,
        }
    }

    /// Returns the effect of what differs in F, which may have any direction.
    fn mismatched(&self, reach: &Reaches) -> Reach {
        let Mismatch { mean, mispredicted, .. } = self.mismatch;
        let Reaches { changes, mispredictions, shifts, .. } = reach;
        let of_errors = mispredictions.times(mispredicted);
        changes.times(mean).plus(&of_errors).plus(&shifts.times(self.swing))
    }

    /// Returns the deviation.
    fn deviation(&self, s: &Settings, reach: &Reaches) -> Deviation {
        let root3 = 3.0_f64.sqrt();
        let errors = reach.of_errors(s);
        let Mismatch { peak, unseen_rate, .. } = self.mismatch;
        let Drive { all, of_two, .. } = self.drive;
        let of_mismatch = self.mismatched(reach);
        let early_feedback = reach.early_feedback;
        let reach = &reach.disturbance;
        let tau = s.period_feedback;
        // Between two ticks an angle departs from the straight line by no more than this.
        let accelerated =
            all * (1.0 + reach.feedback) + root3 * errors.feedback + of_mismatch.feedback + peak;
        Deviation {
            angle: reach.angle * of_two
                + SQRT_2 * errors.angle
                + of_mismatch.angle
                + unseen_rate * s.delay
                + tau * tau / 8.0 * accelerated,
            rate: reach.rate * all
                + root3 * errors.rate
                + of_mismatch.rate
                + unseen_rate
                + self.between,
            seen_angle: reach.seen_angle * of_two
                + SQRT_2 * errors.seen_angle
                + of_mismatch.seen_angle,
            seen_rate: reach.seen_rate * all + root3 * errors.seen_rate + of_mismatch.seen_rate,
            middle_angle: reach.middle_angle * of_two
                + SQRT_2 * errors.middle_angle
                + of_mismatch.middle_angle,
            middle_rate: reach.middle_rate * all
                + root3 * errors.middle_rate
                + of_mismatch.middle_rate,
            feedback: reach.feedback * s.disturbance_bound + errors.feedback,
            feedback_norm: of_mismatch.feedback,
            feedback_moment: (self.along_moment + self.root_condition * self.any_moment)
                * reach.feedback
                + (self.along_moment + self.any_moment)
                    * (self.turning * (reach.feedback_age + 0.5 * tau * reach.feedback)
                        + self.turned * reach.feedback
                        + self.turned_early * early_feedback)
                + self.early_moment * early_feedback,
        }
    }
}

/// Largest effects at one tick, per unit of their causes: of the disturbance, of the errors of
/// angle and rate, and the others as [`SampledError`] names them.
struct Reaches {
    disturbance: Reach,
    /// Part of its feedback by what happened before the nominal motion began.
    early_feedback: f64,
    errors: [Reach; 2],
    changes: Reach,
    mispredictions: Reach,
    shifts: Reach,
}

impl Reaches {
    /// Returns the effect of the errors of measurement.
    fn of_errors(&self, s: &Settings) -> Reach {
        self.errors[0].times(s.angle_error).plus(&self.errors[1].times(s.rate_error))
    }
}

impl Parts {
    /// Returns the jump of the rates at each tick, because a command changes by K (ô⁺ − ô) and
    /// begins to act at another time than assumed. The arguments are those of
    /// [`Self::deviation`], with the effect of `pulses` (per rad/s at each tick) beside them.
    ///
    /// Each pulse changes the later commands too. The sum of all is that of a geometric series
    /// (small gain).
    fn pulse(&self, s: &Settings, reaches: &Reaches, pulses: &Reach) -> Pulse {
        if s.delay_error == 0.0 {
            return Pulse { of_box: 0.0, of_ball: 0.0 };
        }
        let root3 = 3.0_f64.sqrt();
        let all = self.pulse_inertia * (1.0 + self.pulse_mismatch);
        let again = s.delay_error * pulses.change;
        if again * all >= 1.0 {
            return Pulse { of_box: f64::INFINITY, of_ball: f64::INFINITY };
        }
        let (errors, reach) = (reaches.of_errors(s), &reaches.disturbance);
        let of_box = (reach.change * s.disturbance_bound + errors.change)
            / (1.0 - again * self.pulse_common);
        // The parts that do not keep to the axes are added as norms.
        let besides = (all - self.pulse_common) * root3 * of_box + all * self.turn;
        let by_inertia = reach.change * self.drive.of_inertia
            + self.mismatched(reaches).change
            + again * besides;
        let of_ball = by_inertia / (1.0 - again * all);
        Pulse {
            of_box: s.delay_error * self.pulse_common * of_box,
            of_ball: s.delay_error * (all * of_ball + besides),
        }
    }
}

impl Pulse {
    /// Returns the deviation that this pulse at each tick causes. `pulses` is per unit of it, and
    /// `largest` bounds the jump of the rates at any tick, rad/s.
    fn deviation(&self, s: &Settings, pulses: &Reach, largest: f64) -> Deviation {
        let Self { of_box, of_ball } = *self;
        if of_box == 0.0 && of_ball == 0.0 {
            return Deviation::default();
        }
        let (of_two, norm) = (SQRT_2 * of_box + of_ball, self.norm());
        let tau = s.period_feedback;
        Deviation {
            // The last terms are those between two ticks.
            angle: pulses.angle * of_two
                + 0.25 * tau * largest
                + 0.125 * tau * tau * pulses.feedback * norm,
            rate: pulses.rate * norm + largest,
            seen_angle: pulses.seen_angle * of_two,
            seen_rate: pulses.seen_rate * norm,
            middle_angle: pulses.middle_angle * of_two,
            middle_rate: pulses.middle_rate * norm,
            feedback: pulses.feedback * of_box,
            feedback_norm: pulses.feedback * of_ball,
            feedback_moment: 0.0,
        }
    }
}

/// Returns what is left of the limits (rad/s, N m) beyond a motion with ‖x̃_ω‖ ≤ `x` and ‖a‖ ≤ `a`,
/// with the deviation that is never exceeded and `more` of it, at any attitude.
fn left(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    more: Option<&Deviation>,
    (x, a): (f64, f64),
) -> (f64, f64) {
    let mut deviation = *tightening.forever();
    let mut of_moment = *tightening.moment_loss(usize::MAX);
    if let Some(more) = more {
        deviation = deviation.plus(more);
        of_moment =
            MomentLoss::new(dynamics, &deviation, tightening.bearing, s.period_optimisation);
    }
    let Deviation { angle, rate, .. } = deviation;
    let of_rates = s.limit_rate - RateLoss::new(angle, rate, 0.0, 0.0).at(TURN_OF_RATES * x, x);
    let loss = of_moment.at(tightening.bearing, dynamics.slopes(x, a), (x, a));
    (of_rates - x, s.limit_moment - loss - dynamics.nominal_moment(x, a))
}

/// Returns the rate κ (1/s) at which the sideslip has to brake beyond a horizon that ends with the
/// angle `sideslip` and the rates `rates`. While braking, β travels by |β̇|/κ, and all limits must
/// hold. `carried` is the deviation that the plan's changes of acceleration leave at the end of the
/// horizon, and `last` the size of the acceleration before it. The result is `None` if that is
/// impossible.
pub(super) fn braking(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    sideslip: f64,
    rates: &Vector3<f64>,
    (carried, last): (&Carried, f64),
) -> Option<f64> {
    let with = |more: Option<&Deviation>| {
        let angle = tightening.forever().angle + more.map_or(0.0, |more| more.angle);
        let room = s.sideslip_domain - angle - sideslip.abs();
        let by_room = if rates.y == 0.0 { 0.0 } else { rates.y.abs() / room };
        // A κ beyond 1/h would reverse the motion.
        (room >= 0.0 && by_room * s.period_optimisation <= 1.0).then_some(by_room.max(BRAKING))
    };
    let mut braking = with(None)?;
    let mut more = None;
    if let Some(switching) = &tightening.switching {
        let most = 2.0 * braking;
        let left = while_braking(s, switching, carried, last, (rates, most));
        braking = with(Some(&left)).filter(|&braking| braking <= most)?;
        more = Some(left);
    }
    let sizes = (rates.norm(), braked(rates, braking).norm());
    let (rate, moment) = left(s, dynamics, tightening, more.as_ref(), sizes);
    (rate >= 0.0 && moment >= 0.0).then_some(braking)
}

/// Returns the acceleration, but for its sign, of a motion that brakes.
fn braked(rates: &Vector3<f64>, braking: f64) -> Vector3<f64> {
    rates.component_mul(&Vector3::new(BRAKING, braking, BRAKING))
}

/// Returns what changes of the acceleration add to the deviation while a motion with these `rates`
/// at first brakes by no more than the rate `most` (1/s). The first change is that from the
/// acceleration of size `last`. From step to step the acceleration changes by less than κ h of
/// itself.
fn while_braking(
    s: &Settings,
    switching: &Switching,
    carried: &Carried,
    last: f64,
    (rates, most): (&Vector3<f64>, f64),
) -> Deviation {
    let a = braked(rates, most).norm();
    let first = switching.begin(carried, last + a);
    switching.forever(&first, most * s.period_optimisation * a)
}

/// Returns the largest ‖x̃_ω‖ at the end of the horizon from which the motion can brake if the
/// delay is not exact, rad/s. The other arguments are those of [`while_braking`].
pub(super) fn terminal_rate(
    s: &Settings,
    dynamics: &Dynamics,
    tightening: &Tightening,
    switching: &Switching,
    (carried, last, rates): (&Carried, f64, &Vector3<f64>),
) -> f64 {
    let more = while_braking(s, switching, carried, last, (rates, 2.0 * BRAKING));
    largest_rate(s, |x| left(s, dynamics, tightening, Some(&more), (x, BRAKING * x)))
}

/// Returns the largest ‖x̃_ω‖ (rad/s) for which something is `left` of both limits.
fn largest_rate(s: &Settings, left: impl Fn(f64) -> (f64, f64)) -> f64 {
    let is_left = |x: f64| {
        let (rate, moment) = left(x);
        rate > 0.0 && moment > 0.0
    };
    let (mut low, mut high) = (0.0, s.limit_rate);
    if is_left(0.0) {
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if is_left(middle) { low = middle } else { high = middle }
        }
    }
    low
}

/// Computes what is left of the limits at rest and for the motion beyond the horizon, at any
/// attitude.
fn assess(s: &Settings, dynamics: &Dynamics, tightening: &Tightening) -> Assessment {
    let left = |x: f64| left(s, dynamics, tightening, None, (x, BRAKING * x));
    let (rate, moment) = left(0.0);
    Assessment {
        rate_left: rate / s.limit_rate,
        moment_left: moment / s.limit_moment,
        terminal_rate: largest_rate(s, left),
    }
}

use crate::linearise::TURN_BY_ANGLES as TURN_OF_RATES;

/// Returns the largest ‖I W s‖ over the corners s of the unit box at any α and |β| ≤ `sideslip`,
/// kg m².
/// With the larger eigenvalue λ of I² in the plane of symmetry, ‖I y‖² ≤ λ (y_x² + y_z²) + I_yy²
/// y_y² for y = W s. α turns y in that plane, and y_x² + y_z² = cos²β (s₁ sin β + s₃)² + s₂².
fn bearing(s: &Settings, sideslip: f64) -> f64 {
    let square = s.body.inertia * s.body.inertia;
    let any = s.body.inertia.symmetric_eigenvalues().max() * 3.0_f64.sqrt();
    if square[(0, 1)] != 0.0 || square[(1, 2)] != 0.0 {
        return any;
    }
    let (xx, zz, xz, yy) = (square[(0, 0)], square[(2, 2)], square[(0, 2)], square[(1, 1)]);
    let plane = 0.5 * (xx + zz) + (0.25 * powi(xx - zz, 2) + xz * xz).sqrt();
    // The maximum of (1 − x²) (1 + x)² is at one half.
    let sine = sin(sideslip).min(0.5);
    let across = 1.0 + (1.0 - sine * sine) * powi(1.0 + sine, 2);
    (3.0 * yy + (plane - yy).max(0.0) * across).sqrt().min(any)
}

/// Loss of the rate limit by a deviation, rad/s: ‖W (x̃_ω + o_ω)‖ ≤ ‖W̃ x̃_ω‖ + ‖(W − W̃) x̃_ω‖ +
/// ‖o_ω‖.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RateLoss {
    constant: f64,
    by_angles: f64,
    by_size: f64,
    /// Coefficients of ‖a‖, ‖x_ω‖ ‖a‖, ‖x_ω‖² and ‖x_ω‖³ in [`Self::within`].
    within: [f64; 4],
    /// Change of the angles' deviation over an optimisation period, rad.
    change: f64,
}

impl RateLoss {
    /// Computes the loss of a deviation of the angles and rates (rad, rad/s). The deviation of the
    /// angles changes by up to `change` (rad) over an optimisation period `h` (s).
    fn new(angle: f64, rate: f64, change: f64, h: f64) -> Self {
        // ∂ω/∂(α, β) is ∂W[·] x, which changes by ∂²W[x, ·] x + ∂W[·] a; its second derivative is
        // ∂³W[x, x, ·] x + ∂²W[a, ·] x + 2 ∂²W[x, ·] a, and that of ω is 2 Ẇ a + ∂²W[x, x] x +
        // ∂W[a] x.
        let quarter = 0.25 * change * h;
        let curved = 0.125 * h * h;
        let two = curved * SQRT_2 * angle;
        // |o₁² − o₂²| = |o₁ − o₂| (o₁ + o₂).
        let squares = 0.125 * CURVATURE * change * (2.0 * angle + change) * h;
        Self {
            change,
            constant: rate,
            by_angles: angle,
            by_size: 0.5 * CURVATURE * angle * angle,
            within: [
                quarter * TURN_OF_RATES + squares,
                3.0 * (curved * TURN + two * CURVATURE),
                quarter * CURVATURE,
                curved * CURVATURE + two * DRIFT_BY_ANGLES_TWICE,
            ],
        }
    }

    /// Returns the loss of this deviation and some more of the angles and rates (rad, rad/s).
    pub(super) fn with(&self, (angle, rate): (f64, f64), h: f64) -> Self {
        Self::new(self.by_angles + angle, self.constant + rate, self.change + angle, h)
    }

    /// Returns the loss at a stage with ‖∂ω/∂(α, β)‖ = `by_angles` and ‖x̃_ω‖ = `size`, rad/s.
    #[inline]
    pub(super) fn at(&self, by_angles: f64, size: f64) -> f64 {
        self.constant + by_angles * self.by_angles + size * self.by_size
    }

    /// Returns the largest amount by which ‖ω̃‖ and the loss together exceed, within an
    /// optimisation period with ‖x̃_ω‖ ≤ x and a held acceleration ‖a‖ ≤ a, the straight line
    /// between their values at both ends, rad/s.
    ///
    /// Each factor exceeds its own line by up to h²/8 times its second derivative. Where one factor
    /// of a product grows and the other falls, the product of two lines exceeds the line between
    /// its ends by up to a quarter of the product of both changes.
    #[inline]
    pub(super) fn within(&self, x: f64, a: f64) -> f64 {
        let [of_a, xa, xx, xxx] = self.within;
        a * (of_a + xa * x) + x * x * (xx + xxx * x)
    }
}

/// Loss of the moment limit by a deviation, N m: m(x̃ + ô, a + K ô) = m(x̃, a) + I W K ô +
/// ∂m ô + terms of second order in ô. All of it belongs to the middle of a feedback period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MomentLoss {
    /// Deviation of the angles, rad.
    angle: f64,
    /// Deviation of the rates, rad/s.
    rate: f64,
    /// Half width of the box part of K ô, rad/s².
    feedback: f64,
    bearing: f64,
    constant: f64,
    by_acceleration: f64,
    by_size: f64,
    by_size_squared: f64,
    /// h²/8 times the coefficients of ‖a‖², ‖a‖, ‖x_ω‖ ‖a‖, ‖x_ω‖² ‖a‖, and of ‖x_ω‖ to the powers
    /// 2, 3 and 4 in the second derivative of the moment and its loss.
    curved: [f64; 7],
}

impl MomentLoss {
    /// Computes the loss of a deviation; `bearing` is [`Tightening::bearing`].
    /// The optimisation period is `h` (s).
    pub(super) fn new(dynamics: &Dynamics, deviation: &Deviation, bearing: f64, h: f64) -> Self {
        let Deviation {
            middle_angle: angle,
            middle_rate: rate,
            feedback,
            feedback_norm,
            feedback_moment,
            ..
        } = *deviation;
        let largest = dynamics.largest;
        let spread = largest - dynamics.smallest;
        // The second derivatives are those of I W a, and of I Ẇ x + ω × I ω by rates, by both, and
        // by angles.
        let by_rates_twice = (largest * dynamics.geometry.drift + 0.5 * spread) * rate * rate;
        let [aa, xxa, xxxx] = std::array::from_fn(|i| {
            dynamics.curvature[i] + angle * dynamics.curvature_by_angles[i]
        });
        let [xa, xxx] = dynamics.curvature_by_rates.map(|c| rate * c);
        let [of_a, xx] = dynamics.curvature_of_bearing.map(|c| feedback * c);
        Self {
            curved: [aa, of_a, xa, xxa, xx, xxx, xxxx].map(|c| 0.125 * h * h * c),
            angle,
            rate,
            feedback,
            bearing,
            constant: feedback_norm * largest + feedback_moment + by_rates_twice,
            by_acceleration: 0.5 * largest * CURVATURE * angle * angle,
            by_size: (largest * DRIFT_MIXED + 4.0 * spread) * angle * rate,
            by_size_squared: 0.5
                * (largest * DRIFT_BY_ANGLES_TWICE + 12.0 * spread)
                * angle
                * angle,
        }
    }

    /// Returns the loss at a point of the plan, N m. `bearing` is the largest ‖I W s‖ over the
    /// corners s of the unit box, at the vehicle's angles (kg m²), `slopes` holds ‖∂m/∂(α, β)‖ and
    /// ‖∂m/∂x_ω‖, and `sizes` holds ‖x̃_ω‖ and ‖a‖.
    #[inline]
    pub(super) fn at(&self, bearing: f64, slopes: (f64, f64), sizes: (f64, f64)) -> f64 {
        let (x, a) = (sizes.0 + self.rate, sizes.1);
        self.feedback * bearing
            + self.constant
            + slopes.0 * self.angle
            + slopes.1 * self.rate
            + self.by_acceleration * a
            + (self.by_size + self.by_size_squared * x) * x
    }
}

/// One end of an interval of the plan, with the acceleration that is held in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    /// Norm of the moment, ‖m̃‖, N m.
    pub moment: f64,
    /// Largest ‖I W s‖ over the corners s of the unit box, kg m².
    pub bearing: f64,
    /// Norms of ∂m/∂(α, β) and of ∂m/∂x_ω.
    pub slopes: (f64, f64),
    /// Norm of the rates, ‖x̃_ω‖, rad/s.
    pub size: f64,
}

/// Acceleration in an interval of the plan, and its feedback periods.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Norm of the held acceleration, ‖a‖, rad/s².
    pub acceleration: f64,
    /// Number of feedback periods in it.
    pub ratio: usize,
    /// Share of the loss that counts.
    pub share: f64,
}

impl MomentLoss {
    /// Returns a bound on ‖m‖ at the middles of all feedback periods of an interval, for any
    /// deviation, N m.
    ///
    /// ‖m̃‖ and every factor of the loss lie below the straight line between their values at both
    /// ends, or exceed it by at most h²/8 times their second derivative; so does their sum. The
    /// first middle is half a feedback period after the beginning, the last one as much before the
    /// end.
    #[inline]
    pub(super) fn largest_moment(&self, dynamics: &Dynamics, ends: &[End; 2], held: Held) -> f64 {
        let Held { acceleration: a, ratio, share } = held;
        let [from, to] = ends;
        let shift = 0.5 / ratio as f64;
        let on_the_line = |from: f64, to: f64| {
            let (low, high) = if from < to { (from, to) } else { (to, from) };
            high - shift * (high - low)
        };
        let [apart, to_apart] =
            [from, to].map(|end| end.moment + share * self.at(0.0, end.slopes, (end.size, a)));
        let feedback = share * self.feedback;
        // The deviation turns the vehicle, but no attitude needs more than `bearing`.
        let turned = feedback * dynamics.largest * TURN * 3.0_f64.sqrt() * self.angle;
        let along =
            on_the_line(apart + feedback * from.bearing, to_apart + feedback * to.bearing) + turned;
        let anywhere = on_the_line(apart, to_apart) + feedback * self.bearing;
        let x = from.size.max(to.size);
        let [aa, of_a, xa, xxa, xx, xxx, xxxx] = self.curved;
        let curved = a * (aa * a + of_a + x * (xa + x * xxa)) + x * x * (xx + x * (xxx + x * xxxx));
        along.min(anywhere) + curved
    }
}

impl Dynamics {
    /// Returns bounds on ‖∂m/∂(α, β)‖ and ‖∂m/∂x_ω‖ for ‖x_ω‖ ≤ x and ‖a‖ ≤ a at any attitude of
    /// the domain.
    fn slopes(&self, x: f64, a: f64) -> (f64, f64) {
        let Self { largest, gyroscopic, geometry, .. } = self;
        (
            largest * (TURN_OF_RATES * a + CURVATURE * x * x) + TURN_OF_RATES * gyroscopic * x * x,
            (largest * geometry.drift_by_rates + gyroscopic) * x,
        )
    }

    /// Returns a bound on ‖m‖ for ‖x_ω‖ ≤ x and ‖a‖ ≤ a, N m.
    fn nominal_moment(&self, x: f64, a: f64) -> f64 {
        let Self { largest, smallest, geometry, .. } = self;
        largest * (a + geometry.drift * x * x) + 0.5 * (largest - smallest) * x * x
    }

    /// Returns a bound on ‖d²m/dt²‖ of a nominal motion with a held and these sizes, N m/s².
    #[inline]
    pub(super) fn moment_curvature(&self, x: f64, a: f64) -> f64 {
        let [aa, xxa, xxxx] = self.curvature;
        aa * a * a + x * x * (xxa * a + xxxx * x * x)
    }

    /// Returns bounds on the second time derivatives of ∂m/∂(α, β) and ∂m/∂x_ω (Frobenius) and of
    /// the largest ‖I W s‖ over the corners s of the unit box, of a nominal motion with a held and
    /// these sizes.
    fn slope_curvatures(&self, x: f64, a: f64) -> [f64; 3] {
        let [aa, xxa, xxxx] = self.curvature_by_angles;
        let [xa, xxx] = self.curvature_by_rates;
        let [of_a, xx] = self.curvature_of_bearing;
        let square = x * x;
        [
            aa * a * a + square * (xxa * a + xxxx * square),
            x * (xa * a + xxx * square),
            of_a * a + xx * square,
        ]
    }

    /// Returns a bound on ‖d²ω/dt²‖ of a nominal motion with a held and these sizes, rad/s³:
    /// 2 Ẇ a + ∂²W [x, x] x + ∂W [a] x.
    pub(super) fn rate_curvature(x: f64, a: f64) -> f64 {
        3.0 * TURN * x * a + CURVATURE * powi(x, 3)
    }
}

/// Returns the largest value of a setting between 0 and `tried` for which the design holds with the
/// other settings unchanged; `None` if not even 0 does.
fn largest(tried: f64, with: impl Fn(f64) -> Settings) -> Option<f64> {
    let holds = |value: f64| tighten(&with(value)).is_ok_and(|(_, assessment)| assessment.holds());
    if !holds(0.0) {
        return None;
    }
    let (mut low, mut high) = (0.0, tried);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// Returns the largest share, at most 1, of Δ̄ and the errors together for which the design holds.
pub(super) fn largest_share(s: &Settings) -> Option<f64> {
    largest(1.0, |share| counting(s, share))
}

/// Returns the error that says why the guarantee cannot be given, and which values would be
/// accepted.
pub(super) fn refusal(s: &Settings, assessment: &Assessment) -> DesignError {
    let error_share = largest(1.0, |share| Settings {
        angle_error: share * s.angle_error,
        rate_error: share * s.rate_error,
        ..*s
    });
    let errors = (s.rate_error > 0.0 || s.angle_error > 0.0).then_some(error_share).flatten();
    DesignError::NoGuarantee {
        moment_left: assessment.moment_left,
        rate_left: assessment.rate_left,
        limit_moment: s.limit_moment,
        limit_rate: s.limit_rate,
        disturbance: largest(s.disturbance_bound, |disturbance_bound| Settings {
            disturbance_bound,
            ..*s
        }),
        delay: (s.delay > 0.0)
            .then(|| largest(s.delay, |delay| Settings { delay, ..*s }))
            .flatten()
            .filter(|&delay| delay > s.delay_error),
        delay_error: (s.delay_error > 0.0)
            .then(|| largest(s.delay_error, |delay_error| Settings { delay_error, ..*s }))
            .flatten(),
        errors: errors.map(|share| (share * s.angle_error, share * s.rate_error)),
    }
}
