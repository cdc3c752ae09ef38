//! Settings of the two-loop controller, with ours from `data/two-loop-smc.toml`.

use crate::error::{DesignError, invalid};
use crate::sliding::{FiniteTimeLayer, sampled_decay};
use ::settings::{Choice, Declared};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use vehicle::axes::{NUMBERED_ANGLES, NUMBERED_AXES, NUMBERED_RATES};
use vehicle::data::Tables;
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;
use vehicle::math::sin_cos;
use vehicle::scenario::Scenario;

/// One loop with s = e + K ∫e dt and the reaching law ṡ = −ρ f SAT(s/ε).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Loop {
    /// Gain K on the integral of the error, diagonal.
    #[setting(part, unit = "1/s", above = 0.0)]
    pub k: [f64; 3],
    /// Reaching law; its ρ is in rad/s (outer) or rad/s² (inner).
    #[setting(name = "", text = "")]
    pub layer: FiniteTimeLayer,
}

/// Signs of the reaching terms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[setting(name = "ReachingForm")]
pub enum Form {
    /// Signs with which both loops reach their sliding surfaces.
    ///
    /// The sign is + ρ f SAT in both loops, f > 0: ṡ = −ρ f SAT(s/ε).
    #[default]
    Corrected,
    /// Opposite sign of I rho SIGN(s_n) in the inner loop, as printed in (10).
    ///
    /// The sign is − I ρ f SAT(s_n/ε) in the inner loop: ṡ_n = +ρ f SAT(s_n/ε).
    PrintedSign,
    /// Factor f of (7) and (11) with its minus sign, as printed.
    ///
    /// ṡ_w = +ρ f SAT(s_w/ε). In the inner loop two minus signs cancel.
    PrintedFactor,
}

/// Matrix R that the outer loop uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum OuterKinematics {
    /// Matrix with consistent order and axes.
    ///
    /// This is R (2) of Chai 2022.
    #[default]
    Corrected,
    /// Matrix (3) as printed.
    ///
    /// Its rows are those of α, β, γ against φ = [γ, β, α], for axes with y up.
    Printed,
}

/// Settings of the controller. Units SI, angles rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct TwoLoopSettings {
    /// Model of the vehicle that the controller uses.
    #[setting(skip)]
    pub body: RigidBody,
    /// Sampling period of the control law.
    #[setting(name = "period.feedback", unit = "s", min = 1e-4, max = 10.0, nominal = 0.01)]
    pub period: f64,
    /// Outer loop.
    ///
    /// It has the angles α, β, σ.
    #[setting(unit = "rad", each = NUMBERED_ANGLES)]
    pub outer: Loop,
    /// Inner loop.
    ///
    /// It has the body rates p, q, r.
    #[setting(unit = "rad/s", each = NUMBERED_RATES)]
    pub inner: Loop,
    /// Bound on the disturbance moment that the inner loop must overcome.
    ///
    /// It bounds each component of M_d.
    #[setting(name = "disturbanceMoment.bound", each = NUMBERED_AXES, unit = "N.m", min = 0.0, nominal = 1e5)]
    pub disturbance: [f64; 3],
    /// Whether the inputs achievedMoment are connected; otherwise the law assumes that the
    /// commanded moment acts.
    #[setting(name = "achievedMoment.used")]
    pub achieved_moment_used: bool,
    /// Natural frequency of the critically damped filter on the reference; 0 for no filter.
    #[setting(name = "commandFilter.frequency", unit = "1/s", min = 0.0)]
    pub filter: f64,
    /// Whether the integrals are held while the actuators saturate.
    #[setting(used_with = "achievedMoment.used = true")]
    pub anti_windup: bool,
    /// Norm of the missing angular acceleration above which the actuators count as saturated.
    ///
    /// It is that of ‖R I⁻¹ (M_achieved − M)‖.
    #[setting(name = "antiWindupThreshold", unit = "rad/s2", above = 0.0, nominal = 0.01)]
    #[setting(used_with = "achievedMoment.used = true and antiWindup = true")]
    pub threshold: f64,
    #[allow(missing_docs)] // Its type says what it is.
    pub form: Form,
    #[allow(missing_docs)]
    pub kinematics: OuterKinematics,
}

static FILE: LazyLock<Tables> = LazyLock::new(|| {
    Tables::new("two-loop-smc.toml", include_str!("../../data/two-loop-smc.toml"))
});

impl TwoLoopSettings {
    /// Returns our gains for the scenario of section V; the paper prints none.
    #[allow(clippy::missing_panics_doc)]
    pub fn ours() -> Self {
        // This cannot fail, as the tests that use it show: the scenario is embedded.
        let body = Scenario::two_loop().inertia.body(1.0).unwrap_or_else(|error| panic!("{error}"));
        let mut settings = Self { body, ..Self::default() };
        FILE.set("settings", &mut settings);
        settings
    }

    /// Returns the bound on each component of |I⁻¹ M_d|, rad/s².
    pub fn disturbance_acceleration(&self) -> Vector3<f64> {
        self.body.inverse.abs() * Vector3::from(self.disturbance)
    }

    /// Returns the gains that ρ_n must exceed, 2^((b+1)/2) |I⁻¹ M_d|, rad/s². With them the
    /// reaching law is as strong as the disturbance at the edge |s_n| = ε of its layer, so that
    /// s_n does not leave it.
    pub fn needed_reaching(&self) -> Vector3<f64> {
        let acceleration = self.disturbance_acceleration();
        Vector3::from_fn(|i, _| acceleration[i] / self.inner.layer.edge_factor(i))
    }

    pub(super) fn check(&self) -> Result<(), DesignError> {
        ::settings::check(self)?;
        let Self { period, filter, outer, inner, .. } = self;
        if *filter >= 1.0 / period {
            let problem = format!("must be below {}, the frequency of the ticks", 1.0 / period);
            return Err(invalid("commandFilter.frequency", *filter, problem));
        }
        outer.check("outer", *period)?;
        inner.check("inner", *period)?;
        let (acceleration, needed) = (self.disturbance_acceleration(), self.needed_reaching());
        for axis in 0..3 {
            let FiniteTimeLayer { rho, b, .. } = inner.layer;
            if rho[axis] <= needed[axis] {
                return Err(DesignError::WeakReaching {
                    index: axis + 1,
                    rho: rho[axis],
                    b: b[axis],
                    acceleration: acceleration[axis],
                    needed: needed[axis],
                });
            }
        }
        Ok(())
    }
}

impl Form {
    /// Returns the factors on ρ f SAT in the outer and in the inner loop.
    pub(super) fn signs(self) -> (f64, f64) {
        match self {
            Self::Corrected => (1.0, 1.0),
            Self::PrintedSign => (1.0, -1.0),
            Self::PrintedFactor => (-1.0, 1.0),
        }
    }
}

impl OuterKinematics {
    /// Returns the matrix R in Θ̇ = R ω.
    pub fn r(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Corrected => kinematics::r(angles),
            Self::Printed => {
                // Jia, (3): φ̇ = R ω, and Θ = Pᵀ φ.
                let (sa, ca) = sin_cos(angles.x);
                Matrix3::new(ca, -sa, 0.0, sa, ca, 0.0, 0.0, 0.0, -1.0)
            }
        }
    }

    pub(super) fn r_inverse(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Corrected => kinematics::r_inverse(angles),
            Self::Printed => self.r(angles).transpose(),
        }
    }

    pub(super) fn r_dot(self, angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Corrected => kinematics::r_dot(angles, angle_rates),
            Self::Printed => {
                let (sa, ca) = sin_cos(angles.x);
                Matrix3::new(-sa, -ca, 0.0, ca, -sa, 0.0, 0.0, 0.0, 0.0) * angle_rates.x
            }
        }
    }
}

impl Loop {
    fn check(&self, name: &str, period: f64) -> Result<(), DesignError> {
        let k = self.k.iter().copied().fold(0.0, f64::max);
        sampled_decay(&format!("{name}.k"), k, period)?;
        sampled_decay(&format!("{name}.rho"), self.layer.steepest(), period)
    }

    /// Returns the sliding variable s, in the units of the loop.
    pub(super) fn sliding(&self, error: &Vector3<f64>, integral: &Vector3<f64>) -> Vector3<f64> {
        error + self.k().component_mul(integral)
    }

    pub(super) fn k(&self) -> Vector3<f64> {
        Vector3::from(self.k)
    }
}
