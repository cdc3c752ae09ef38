//! Turntable that carries the sensors. It follows the attitude angles of the vehicle with a servo
//! of first order and limited rate in each axis:
//!
//! θ̇ = sat((Θ_c − θ)/τ)
//!
//! Θ_c are the vehicle's angles, rounded by a converter. They are given at the sensors' samples and
//! lie on a straight line between them, so that the solution has a closed form.

use crate::error::{Error, not_negative};
use crate::kinematics::Kinematics;
use crate::math::{exp, ln};
use crate::platform::Pose;
use crate::sensors::Instant;
use crate::time::tolerance;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::f64::consts::TAU;

/// Servo of the turntable, the same in each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Config {
    /// Bandwidth of the first-order servo of a turntable that carries the sampled sensors; 0 for
    /// sensors on the vehicle.
    #[setting(unit = "Hz", min = 0.0, nominal = 10.0, used_with = "sensor.set >= 1")]
    pub bandwidth: f64,
    /// Maximum rate of the turntable's angles; 0 for no limit.
    #[setting(unit = "rad/s", min = 0.0, nominal = 1.0)]
    #[setting(used_with = "sensor.set >= 1 and turntable.bandwidth > 0")]
    pub rate: f64,
    /// Quantization step of the angles commanded to the turntable; 0 for none.
    #[setting(unit = "rad", min = 0.0, nominal = 1e-3)]
    #[setting(used_with = "sensor.set >= 1 and turntable.bandwidth > 0")]
    pub resolution: f64,
}

/// Turntable at a sample of the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Standing {
    at: Instant,
    /// Commanded angles Θ_c, rad.
    command: Vector3<f64>,
    /// Lag of the angles θ behind the command, Θ_c − θ, rad.
    error: Vector3<f64>,
}

/// Turntable with its state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Turntable {
    config: Config,
    /// State at the sample before the last one.
    before: Option<Standing>,
    /// State at the last sample.
    last: Option<Standing>,
}

impl Turntable {
    /// Makes a turntable that starts at the first attitude that it is given, or `None` without a
    /// bandwidth.
    ///
    /// # Errors
    /// Names the value that is negative or not finite.
    pub fn new(config: &Config) -> Result<Option<Self>, Error> {
        for (name, value) in [
            ("turntable.bandwidth", config.bandwidth),
            ("turntable.rate", config.rate),
            ("turntable.resolution", config.resolution),
        ] {
            not_negative(name, value, "")?;
        }
        Ok((config.bandwidth > 0.0).then_some(Self { config: *config, before: None, last: None }))
    }

    /// Whether both have the same configuration.
    pub(crate) fn same_configuration(&self, other: &Self) -> bool {
        self.config == other.config
    }

    /// Whether a restored turntable is possible at `time` (s). A step that has `failed` may have
    /// gone beyond `time`.
    pub(crate) fn fits(&self, time: f64, failed: bool) -> bool {
        let latest = if failed { f64::MAX } else { time + tolerance(time) };
        self.before.iter().chain(&self.last).all(|standing| {
            standing.at.time <= latest
                && standing.command.iter().chain(&standing.error).all(|value| value.is_finite())
        })
    }

    /// Moves to the sample at an instant at which the vehicle has this pose. A call repeated at the
    /// same tick replaces the last one.
    pub fn follow(&mut self, at: Instant, vehicle: &Pose) {
        let standing = self.standing(at, vehicle);
        self.before = self.base(at);
        self.last = Some(standing);
    }

    /// Pose of the turntable at a sample at which the vehicle has this pose and its trajectory
    /// turns with `turn_rate` (rad/s).
    pub fn pose(&self, at: Instant, vehicle: &Pose, turn_rate: &Vector3<f64>) -> Pose {
        let Standing { command, error, .. } = self.standing(at, vehicle);
        let (angles, rates) = (command - error, error.map(|error| self.rate(error)));
        // The table turns with the axes of the trajectory, as the vehicle does.
        let turn = Kinematics::Exact.turn(&angles) * turn_rate;
        Pose {
            kinematics: Kinematics::Exact,
            angles,
            rates: Kinematics::Exact.r_inverse(&angles) * (rates - turn),
            alpha_rate: rates.x,
            ..*vehicle
        }
    }

    /// State at the last sample before the one at an instant.
    fn base(&self, at: Instant) -> Option<Standing> {
        if self.last.is_some_and(|last| last.at.tick == at.tick) { self.before } else { self.last }
    }

    fn standing(&self, at: Instant, vehicle: &Pose) -> Standing {
        let command = vehicle.angles.map(|angle| match self.config.resolution {
            0.0 => angle,
            step => (angle / step).round() * step,
        });
        let error = self.base(at).map_or_else(Vector3::zeros, |base| {
            let elapsed = at.time - base.at.time;
            let slope = (command - base.command) / elapsed;
            base.error.zip_map(&slope, |error, slope| self.error_after(elapsed, error, slope))
        });
        Standing { at, command, error }
    }

    /// Rate of an angle (rad/s) that is behind its command by `error` (rad).
    fn rate(&self, error: f64) -> f64 {
        let rate = TAU * self.config.bandwidth * error;
        if self.config.rate == 0.0 { rate } else { rate.clamp(-self.config.rate, self.config.rate) }
    }

    /// Error e = Θ_c − θ (rad) after the time `left` (s) under a command of constant `slope`
    /// (rad/s): ė = slope − sat(e/τ). The solution is monotone, so that it passes the region in
    /// which the rate is not limited once at most.
    fn error_after(&self, mut left: f64, mut error: f64, slope: f64) -> f64 {
        let tau = 1.0 / (TAU * self.config.bandwidth);
        let edge = if self.config.rate == 0.0 { f64::INFINITY } else { self.config.rate * tau };
        if error.abs() > edge {
            let drift = slope - self.rate(error);
            let way = error.signum() * edge - error;
            if way * drift <= 0.0 || way / drift >= left {
                return error + drift * left;
            }
            left -= way / drift;
            error += way;
        }
        // The steady error of a servo that follows the slope, if its rate limit allows it.
        let end = slope * tau;
        let limit = end.clamp(-edge, edge);
        let to_limit =
            if limit == end { f64::INFINITY } else { tau * ln((end - error) / (end - limit)) };
        if left <= to_limit {
            return end + (error - end) * exp(-left / tau);
        }
        limit + (slope - limit / tau) * (left - to_limit)
    }
}
