//! Time-varying sliding-mode control (TVSMC) of Wu et al. (2015): BTVSMC (62), BTVSMC/DO (36) and
//! SOTVSMC/DO (45), and the feedback linearisation (61) with which they are compared.
//!
//! All of them linearise Θ̈ = K M + B + Δv by M = K⁻¹ (v − B), (15), with K = R I⁻¹ and B = Ṙ ω − R
//! I⁻¹ (ω × I ω), and choose v. The printed Δv lacks a derivative and has R I⁻¹ where R belongs,
//! (12), and its F is wrong in four entries, (13). This does not matter here, because Δv is
//! estimated as a whole.

mod boundary_layer;
mod fbl;
mod observer;
mod second_order;
mod settings;
mod surface;

pub use boundary_layer::{BoundaryLayer, FiniteTimeLayer, saturated};
pub use fbl::{Fbl, FblSettings};
pub use observer::{Estimate, Observer};
pub use second_order::{SecondOrder, SecondOrderForm};
pub use settings::Settings;
pub use surface::{Anchor, Surface, TrackingError};

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::{DesignError, invalid};
use crate::linearise;
use ::settings::{Declared, Invalid};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics;
use vehicle::math::powf;
use vehicle::reference::Reference;

/// A reaching law, which drives the sliding variable to zero.
pub trait Reaching: Copy + Declared {
    /// The integral state of the law.
    type Memory: Copy + Default + Serialize + DeserializeOwned + Send;

    /// Checks that the law works at this period (s).
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    fn check(&self, period: f64) -> Result<(), DesignError>;

    /// Returns ṡ at s (rad/s), rad/s².
    fn sliding_rate(&self, memory: &Self::Memory, s: &Vector3<f64>) -> Vector3<f64>;

    /// Advances the integral over `period` (s), in which s (rad/s) is held.
    fn advance(&self, memory: &mut Self::Memory, s: &Vector3<f64>, period: f64);
}

/// The laws BTVSMC and BTVSMC/DO, (62) and (36).
pub type Btvsmc = Tvsmc<BoundaryLayer>;
/// The law SOTVSMC/DO, (45).
pub type SotvsmcDo = Tvsmc<SecondOrder>;

/// A commanded moment, with the data from which the shortfall of the actuators follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Commanded {
    /// Commanded moment M, N m.
    pub moment: Vector3<f64>,
    /// Angles Θ at that tick, rad.
    pub angles: Vector3<f64>,
    /// Loss K M − (v − B) by a limit on M, rad/s².
    pub cut: Vector3<f64>,
}

impl Commanded {
    /// Returns the command of `moment` (N m), which no limit has reduced.
    pub(crate) fn new(measured: &Measurement, moment: Vector3<f64>) -> Self {
        Self { moment, angles: measured.angles, cut: Vector3::zeros() }
    }

    /// Replaces the command by `applied` (N m) and records the rest as the loss.
    pub(crate) fn limit(&mut self, body: &RigidBody, applied: &Vector3<f64>) {
        self.cut = gain(body, &self.angles, applied - self.moment);
        self.moment = *applied;
    }

    /// Returns v_achieved − v = K (M_achieved − M_wanted), rad/s², with the moment that was
    /// measured at the next tick, or with the commanded one.
    pub(crate) fn shortfall(
        &self,
        body: &RigidBody,
        achieved: Option<Vector3<f64>>,
    ) -> Vector3<f64> {
        self.cut
            + achieved.map_or_else(Vector3::zeros, |m| gain(body, &self.angles, m - self.moment))
    }
}

/// Returns the angular acceleration K M = R I⁻¹ M, rad/s².
fn gain(body: &RigidBody, angles: &Vector3<f64>, moment: Vector3<f64>) -> Vector3<f64> {
    kinematics::r(angles) * (body.inverse * moment)
}

/// The state that a time-varying sliding mode carries from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory<Integral> {
    /// Whether there has been a tick.
    pub started: bool,
    /// Anchor of the surface in force.
    pub anchor: Anchor,
    /// Sliding variable s at the last tick, rad/s.
    pub sliding: Vector3<f64>,
    /// Drive v − b at the last tick, rad/s².
    pub drive: Vector3<f64>,
    /// Commanded moment of the last tick.
    pub commanded: Commanded,
    /// Whether the actuators saturated in the interval before the last tick.
    pub saturated: bool,
    /// State of the reaching law.
    pub integral: Integral,
    /// State of the observer; it stays zero without one.
    pub estimate: Estimate,
}

/// The law v = b − z₁ + ṡ, (27), with one of the reaching laws; without observer z₁ = 0.
///
/// ```
/// use control::closed_loop::fly;
/// use control::sliding::{Settings, SotvsmcDo};
/// use control::Controller;
/// use vehicle::Scenario;
///
/// let settings = Settings::sotvsmc_do();
/// let mut law = SotvsmcDo::new(settings)?;
/// let mut memory = law.memory();
/// let mut last = f64::INFINITY;
/// fly(&mut law, &mut memory, settings.period, &Scenario::tvsmc2015(), |sample| {
///     last = (sample.measured.angles - sample.reference.angles).norm().to_degrees();
/// })?;
/// assert!(last < 0.01, "the observer leaves no error at rest: {last} deg");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tvsmc<R> {
    settings: Settings<R>,
}

impl<R: Reaching> Tvsmc<R> {
    /// Checks the settings of the law.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings<R>) -> Result<Self, DesignError> {
        ::settings::check(&settings)?;
        if let Some(observer) = &settings.observer {
            ::settings::check(observer)
                .map_err(|error| Invalid { name: format!("observer.{}", error.name), ..error })?;
        }
        settings.reaching.check(settings.period)?;
        Ok(Self { settings })
    }

    /// Advances observer and reaching law from the last tick to this one, with the moment that the
    /// actuators achieved since then.
    fn integrate(&self, memory: &mut Memory<R::Memory>, achieved: Option<Vector3<f64>>) {
        let Settings { body, period, reaching, observer, threshold, .. } = &self.settings;
        let shortfall = memory.commanded.shortfall(body, achieved);
        if let Some(observer) = observer {
            // The observer must know the v that acted; otherwise it would treat the shortfall as a
            // disturbance.
            let drive = memory.drive + shortfall;
            memory.estimate = observer.advance(&memory.estimate, &memory.sliding, &drive, *period);
        }
        reaching.advance(&mut memory.integral, &memory.sliding, *period);
        memory.saturated = shortfall.norm() > *threshold;
    }
}

impl<R: Reaching> Controller for Tvsmc<R> {
    type Memory = Memory<R::Memory>;

    /// The moment at a tick does not depend on the moment achieved before it, which has effect from
    /// the next tick on. This avoids an algebraic loop with actuators that respond at once.
    fn command(
        &mut self,
        memory: &mut Self::Memory,
        _tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let Settings { body, surface, reaching, anti_windup, .. } = &self.settings;
        let reference = reference(time);
        let (error, angle_rates) = tracking_error(measured, &reference);
        let re_anchor = *anti_windup && memory.saturated;
        if memory.started {
            self.integrate(
                memory,
                measured.achieved_moment.filter(|_| self.settings.achieved_moment_used),
            );
        }
        if !memory.started || re_anchor {
            if memory.started {
                // The sliding variable s jumps to zero, and its estimate by the same amount.
                memory.estimate.sliding -= surface.sliding(&memory.anchor, time, &error);
            }
            memory.anchor = surface.anchor(time, &error);
            memory.integral = R::Memory::default();
            memory.started = true;
        }
        let s = surface.sliding(&memory.anchor, time, &error);
        let b = surface.equivalent(&memory.anchor, time, &error, &reference.accelerations);
        // Wu 2015, (27) and (15).
        let v = b - memory.estimate.disturbance + reaching.sliding_rate(&memory.integral, &s);
        let moment = linearise::moment(body, &measured.angles, &angle_rates, &v);
        memory.sliding = s;
        memory.drive = v - b;
        memory.commanded = Commanded::new(measured, moment);
        moment
    }

    fn limited(&mut self, memory: &mut Self::Memory, applied: &Vector3<f64>) {
        memory.commanded.limit(&self.settings.body, applied);
    }
}

/// Returns e = Θ − Θ_r (rad) and ė (rad/s), and Θ̇ (rad/s).
pub(crate) fn tracking_error(
    measured: &Measurement,
    reference: &Reference,
) -> (TrackingError, Vector3<f64>) {
    let angle_rates = kinematics::r(&measured.angles) * measured.rates;
    let error = TrackingError {
        angles: measured.angles - reference.angles,
        rates: angle_rates - reference.rates,
    };
    (error, angle_rates)
}

/// Returns sgn(x), which is 0 at 0.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns sig^a(x) = |x|^a sgn(x).
fn power(x: f64, a: f64) -> f64 {
    powf(x.abs(), a) * sign(x)
}

/// Returns an error for a rate of decay (1/s) that becomes growth with ticks of `period` (s):
/// 1 − rate·period must exceed −1.
pub(crate) fn sampled_decay(name: &str, rate: f64, period: f64) -> Result<(), DesignError> {
    let high = 2.0 / period;
    if rate < high {
        Ok(())
    } else {
        Err(invalid(name, rate, format!("must be below {high}, twice the frequency of the ticks")))
    }
}
