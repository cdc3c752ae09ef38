//! Errors of the measured angles that change slowly.

use super::moving::Vehicle;
use super::waveform::{Progress, Waveform};
use control::crmpc::Settings;
use nalgebra::Vector3;

/// Slow part of the errors of the angles.
#[derive(Clone, Debug)]
pub struct Slow {
    /// Bound on the errors of angle of attack and sideslip, rad. That of the bank angle has none.
    pub angle: f64,
    /// Bound on the rate of change of each error, rad/s.
    pub rate: f64,
    /// Waveform of the derivative, relative to its bound.
    pub derivative: Waveform,
    /// Errors at the start, relative to the bound.
    pub begin: Vector3<f64>,
}

impl Slow {
    /// Returns errors at the bounds of the settings.
    pub fn new(s: &Settings, derivative: Waveform, begin: Vector3<f64>) -> Self {
        Self { angle: s.slow_angle_error, rate: s.slow_angle_rate, derivative, begin }
    }

    /// Returns whether the errors stay within the bounds of the settings.
    pub(super) fn is_assumed(&self, s: &Settings) -> bool {
        self.angle <= s.slow_angle_error && self.rate <= s.slow_angle_rate
    }
}

/// Slow errors over time.
pub(super) struct SlowErrors {
    bounds: Slow,
    derivative: Progress,
    now: Vector3<f64>,
    time: f64,
}

impl SlowErrors {
    pub(super) fn new(slow: &Slow, seed: u64) -> Self {
        Self {
            derivative: Progress::new(&slow.derivative, seed.wrapping_add(1 << 33)),
            now: slow.begin * slow.angle,
            time: 0.0,
            bounds: slow.clone(),
        }
    }

    /// Returns the errors at `time` (s), which must not decrease, rad.
    pub(super) fn at(&mut self, time: f64, vehicle: &Vehicle) -> Vector3<f64> {
        let Slow { angle, rate, .. } = self.bounds;
        self.now += self.derivative.at(time, vehicle) * (rate * (time - self.time));
        self.time = time;
        for i in 0..2 {
            self.now[i] = self.now[i].clamp(-angle, angle);
        }
        self.now
    }
}
