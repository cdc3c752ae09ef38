//! Two-loop sliding-mode control of Jia, Zhou and Zhou, "Re-entry attitude two-loop SMC of the
//! spacecraft and its logic selection". An outer sliding mode commands body rates that steer the
//! attitude, and an inner one commands the moment that follows them.
//!
//! The paper orders its angles φ = [γ, β, α], bank first, and its γ grows with the roll rate; ours
//! are Θ = [α, β, σ] with σ̇ = −p cos α − … Hence φ = P Θ with
//! P = [[0, 0, −1], [0, 1, 0], [1, 0, 0]], and the paper's R is P R(Θ). Both loops act on each
//! angle separately and are odd functions, so they commute with P. The law is therefore written in
//! our order, and gains are those of α, β, σ.

mod settings;

pub use settings::{Form, Loop, OuterKinematics, TwoLoopSettings};

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::DesignError;
use crate::sliding::Commanded;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::math::exp;
use vehicle::reference::Reference;

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

    /// Advances both integrals over the interval before a tick, unless they rest, and finds whether
    /// the actuators saturated in it.
    fn integrate(&self, memory: &mut TwoLoopMemory, measured: &Measurement, rests: bool) {
        let TwoLoopSettings { body, period, achieved_moment_used, threshold, .. } = &self.settings;
        if !rests {
            memory.outer_integral += memory.angle_error * *period;
            memory.inner_integral += memory.rate_error * *period;
        }
        let achieved = measured.achieved_moment.filter(|_| *achieved_moment_used);
        memory.saturated = memory.commanded.shortfall(body, achieved).norm() > *threshold;
    }

    /// The outer loop: Jia, (4), (7).
    fn outer(
        &self,
        measured: &Measurement,
        command: &Reference,
        integral: &Vector3<f64>,
        rests: bool,
    ) -> Outer {
        let TwoLoopSettings { form, kinematics, outer, .. } = &self.settings;
        let Measurement { angles, rates, .. } = measured;
        let inverse = kinematics.r_inverse(angles);
        let angle_rates = kinematics.r(angles) * rates;
        let (sign, _) = form.signs();
        let e_w = command.angles - angles;
        let e_w_dot = command.rates - angle_rates;
        let s_w = outer.sliding(&e_w, integral);
        let x = command.rates + outer.k().component_mul(&e_w) + outer.layer.value(&s_w) * sign;
        let omega_c = inverse * x;
        // The derivative ω̇_c follows from ω_c = R⁻¹ x.
        let integrand = if rests { Vector3::zeros() } else { outer.k().component_mul(&e_w) };
        let s_w_dot = e_w_dot + integrand;
        let x_dot = command.accelerations
            + outer.k().component_mul(&e_w_dot)
            + outer.layer.slope(&s_w).component_mul(&s_w_dot) * sign;
        let omega_c_dot = inverse * (x_dot - kinematics.r_dot(angles, &angle_rates) * omega_c);
        Outer { error: e_w, sliding: s_w, rates: omega_c, accelerations: omega_c_dot }
    }

    /// The inner loop: Jia, (8), (11) without M_d, which is not known.
    fn inner(&self, measured: &Measurement, outer: &Outer, integral: &Vector3<f64>) -> Inner {
        let TwoLoopSettings { form, body, inner, .. } = &self.settings;
        let rates = &measured.rates;
        let (_, sign) = form.signs();
        let omega_e = outer.rates - rates;
        let s_n = inner.sliding(&omega_e, integral);
        let acceleration = outer.accelerations
            + inner.k().component_mul(&omega_e)
            + inner.layer.value(&s_n) * sign;
        let moment = body.inertia * acceleration + rates.cross(&(body.inertia * rates));
        Inner { error: omega_e, sliding: s_n, moment }
    }
}

/// Outcome of the outer loop at a tick.
struct Outer {
    /// Angle error e_w (rad), and sliding variable s_w (rad).
    error: Vector3<f64>,
    sliding: Vector3<f64>,
    /// Commanded rates ω_c (rad/s), and their derivative (rad/s²).
    rates: Vector3<f64>,
    accelerations: Vector3<f64>,
}

/// Outcome of the inner loop at a tick.
struct Inner {
    /// Rate error ω_e (rad/s), and sliding variable s_n (rad/s).
    error: Vector3<f64>,
    sliding: Vector3<f64>,
    /// Moment, N m.
    moment: Vector3<f64>,
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
        let reference = reference(time);
        let command = self.filter(memory, measured, &reference);
        let rests = self.settings.anti_windup && memory.saturated;
        if memory.started {
            self.integrate(memory, measured, rests);
        }
        let outer = self.outer(measured, &command, &memory.outer_integral, rests);
        let inner = self.inner(measured, &outer, &memory.inner_integral);
        *memory = TwoLoopMemory {
            started: true,
            command,
            reference,
            angle_error: outer.error,
            rate_error: inner.error,
            outer_sliding: outer.sliding,
            inner_sliding: inner.sliding,
            rate_command: outer.rates,
            commanded: Commanded::new(measured, inner.moment),
            ..*memory
        };
        inner.moment
    }

    fn limited(&mut self, memory: &mut TwoLoopMemory, applied: &Vector3<f64>) {
        memory.commanded.limit(&self.settings.body, applied);
    }
}
