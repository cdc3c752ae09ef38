//! Two-loop sliding-mode control of Jia, Zhou and Zhou, "Re-entry attitude two-loop SMC of the
//! spacecraft and its logic selection". An outer sliding mode commands body rates that steer the
//! attitude, and an inner one commands the moment that follows them.
//!
//! The paper orders its angles φ = [γ, β, α], bank first, and its γ grows with the roll rate; ours
//! are Θ = [α, β, σ] with σ̇ = −p cos α − … Hence φ = P Θ with
//! P = [[0, 0, −1], [0, 1, 0], [1, 0, 0]], and the paper's R is P R(Θ). Both loops act on each
//! angle separately and are odd functions, so they commute with P. The law is therefore written in
//! our order, and gains are those of α, β, σ.

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::{DesignError, invalid};
use crate::sliding::{Commanded, FiniteTimeLayer, sampled_decay};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use std::sync::LazyLock;
use toml::Table;
use vehicle::axes::{NUMBERED_ANGLES, NUMBERED_AXES, NUMBERED_RATES};
use vehicle::data;
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;
use vehicle::math::{exp, sin_cos};
use vehicle::reference::Reference;
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
    pub anti_windup: bool,
    /// Norm of the missing angular acceleration above which the actuators count as saturated.
    ///
    /// It is that of ‖R I⁻¹ (M_achieved − M)‖.
    #[setting(name = "antiWindupThreshold", unit = "rad/s2", above = 0.0, nominal = 0.01)]
    pub threshold: f64,
    #[allow(missing_docs)] // Its type says what it is.
    pub form: Form,
    #[allow(missing_docs)]
    pub kinematics: OuterKinematics,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    settings: Table,
}

const FILE: &str = "two-loop-smc.toml";

impl TwoLoopSettings {
    /// Returns our gains for the scenario of section V; the paper prints none.
    #[allow(clippy::missing_panics_doc)]
    pub fn ours() -> Self {
        static READ: LazyLock<File> =
            LazyLock::new(|| data::embedded(FILE, include_str!("../data/two-loop-smc.toml")));
        // This cannot fail, as the tests that use it show: the scenario is embedded.
        let body = Scenario::two_loop().inertia.body(1.0).unwrap_or_else(|error| panic!("{error}"));
        let mut settings = Self { body, ..Self::default() };
        data::set(&mut settings, FILE, &READ.settings);
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

    fn check(&self) -> Result<(), DesignError> {
        settings::check(self)?;
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
    fn signs(self) -> (f64, f64) {
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

    fn r_inverse(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Corrected => kinematics::r_inverse(angles),
            Self::Printed => self.r(angles).transpose(),
        }
    }

    fn r_dot(self, angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Matrix3<f64> {
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
    fn sliding(&self, error: &Vector3<f64>, integral: &Vector3<f64>) -> Vector3<f64> {
        error + self.k().component_mul(integral)
    }

    fn k(&self) -> Vector3<f64> {
        Vector3::from(self.k)
    }
}

/// The state that the controller carries from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwoLoopMemory {
    /// Whether there has been a tick.
    pub started: bool,
    /// Filtered command at the last tick, and the reference from which it was filtered.
    command: Reference,
    reference: Reference,
    /// Integral ∫e_w dt up to the last tick, rad s.
    pub outer_integral: Vector3<f64>,
    /// Integral ∫ω_e dt up to the last tick, rad.
    pub inner_integral: Vector3<f64>,
    /// Angle error e_w at the last tick, rad.
    pub angle_error: Vector3<f64>,
    /// Rate error ω_e at the last tick, rad/s.
    pub rate_error: Vector3<f64>,
    /// Sliding variable s_w at the last tick, rad.
    pub outer_sliding: Vector3<f64>,
    /// Sliding variable s_n at the last tick, rad/s.
    pub inner_sliding: Vector3<f64>,
    /// Commanded rates ω_c at the last tick, rad/s.
    pub rate_command: Vector3<f64>,
    /// Commanded moment of the last tick.
    pub commanded: Commanded,
    /// Whether the actuators saturated in the interval before the last tick.
    pub saturated: bool,
}

/// The two-loop sliding-mode controller.
///
/// ```
/// use control::closed_loop::fly;
/// use control::two_loop::{TwoLoopSettings, TwoLoopSmc};
/// use control::Controller;
/// use vehicle::Scenario;
///
/// let settings = TwoLoopSettings::ours();
/// let mut law = TwoLoopSmc::new(settings)?;
/// let mut memory = law.memory();
/// let mut last = f64::INFINITY;
/// fly(&mut law, &mut memory, settings.period, &Scenario::two_loop(), |sample| {
///     last = (sample.measured.angles - sample.reference.angles).norm().to_degrees();
/// })?;
/// assert!(last < 0.1, "{last} deg");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoLoopSmc {
    settings: TwoLoopSettings,
}

impl TwoLoopSmc {
    /// Checks the settings of the controller.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault, including ρ_n ≤ 2^((b+1)/2) |I⁻¹ M_d|.
    pub fn new(settings: TwoLoopSettings) -> Result<Self, DesignError> {
        settings.check()?;
        Ok(Self { settings })
    }

    /// Returns the filtered command. It starts at the measured angles and rates and follows a
    /// smooth reference without lag.
    fn filter(
        &self,
        memory: &TwoLoopMemory,
        measured: &Measurement,
        reference: &Reference,
    ) -> Reference {
        let TwoLoopSettings { filter: w, period, .. } = self.settings;
        if w == 0.0 {
            return *reference;
        }
        let (angles, rates) = if memory.started {
            // Over the interval before this tick, x = r + d with d̈ + 2 w ḋ + w² d = 0. The change
            // of r is taken from its derivatives, so that its jumps are filtered.
            let TwoLoopMemory { command, reference: before, .. } = memory;
            let (d, d_rate) = (command.angles - before.angles, command.rates - before.rates);
            let (slope, decay) = (d_rate + d * w, exp(-w * period));
            let (a, b) = (before.accelerations, reference.accelerations);
            let moved =
                before.angles + before.rates * period + (a * 2.0 + b) * (period * period / 6.0);
            let angles = moved + (d + slope * period) * decay;
            let rates =
                before.rates + (a + b) * (0.5 * period) + (d_rate - slope * (w * period)) * decay;
            (angles, rates)
        } else {
            (measured.angles, self.settings.kinematics.r(&measured.angles) * measured.rates)
        };
        let (d, d_rate) = (angles - reference.angles, rates - reference.rates);
        let accelerations = reference.accelerations - d_rate * (2.0 * w) - d * (w * w);
        Reference { angles, rates, accelerations }
    }
}

impl Controller for TwoLoopSmc {
    type Memory = TwoLoopMemory;

    /// As in [`crate::sliding::Tvsmc`], the moment achieved before a tick has effect from the next
    /// tick on.
    fn command(
        &mut self,
        memory: &mut TwoLoopMemory,
        _tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let TwoLoopSettings {
            form,
            kinematics,
            body,
            period,
            outer,
            inner,
            achieved_moment_used,
            anti_windup,
            threshold,
            ..
        } = &self.settings;
        let reference = reference(time);
        let command = self.filter(memory, measured, &reference);
        let rests = *anti_windup && memory.saturated;
        if memory.started {
            if !rests {
                memory.outer_integral += memory.angle_error * *period;
                memory.inner_integral += memory.rate_error * *period;
            }
            let achieved = measured.achieved_moment.filter(|_| *achieved_moment_used);
            memory.saturated = memory.commanded.shortfall(body, achieved).norm() > *threshold;
        }
        let Measurement { angles, rates, .. } = measured;
        let inverse = kinematics.r_inverse(angles);
        let angle_rates = kinematics.r(angles) * rates;
        let (outer_sign, inner_sign) = form.signs();

        // Outer loop: Jia, (4), (7).
        let e_w = command.angles - angles;
        let e_w_dot = command.rates - angle_rates;
        let s_w = outer.sliding(&e_w, &memory.outer_integral);
        let x =
            command.rates + outer.k().component_mul(&e_w) + outer.layer.value(&s_w) * outer_sign;
        let omega_c = inverse * x;
        // The derivative ω̇_c follows from ω_c = R⁻¹ x.
        let integrand = if rests { Vector3::zeros() } else { outer.k().component_mul(&e_w) };
        let s_w_dot = e_w_dot + integrand;
        let x_dot = command.accelerations
            + outer.k().component_mul(&e_w_dot)
            + outer.layer.slope(&s_w).component_mul(&s_w_dot) * outer_sign;
        let omega_c_dot = inverse * (x_dot - kinematics.r_dot(angles, &angle_rates) * omega_c);

        // Inner loop: Jia, (8), (11) without M_d, which is not known.
        let omega_e = omega_c - rates;
        let s_n = inner.sliding(&omega_e, &memory.inner_integral);
        let acceleration =
            omega_c_dot + inner.k().component_mul(&omega_e) + inner.layer.value(&s_n) * inner_sign;
        let moment = body.inertia * acceleration + rates.cross(&(body.inertia * rates));

        *memory = TwoLoopMemory {
            started: true,
            command,
            reference,
            angle_error: e_w,
            rate_error: omega_e,
            outer_sliding: s_w,
            inner_sliding: s_n,
            rate_command: omega_c,
            commanded: Commanded::new(measured, moment),
            ..*memory
        };
        moment
    }

    fn limited(&mut self, memory: &mut TwoLoopMemory, applied: &Vector3<f64>) {
        memory.commanded.limit(&self.settings.body, applied);
    }
}
