//! One sensor with three axes, and what lies between what it feels and what it says, in the order in which it acts:
//! scale, misalignment and bias; bandwidth; white noise; range; resolution of the converter.

use crate::error::Error;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Errors of a sensor; the unit is that of what it measures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triad {
    /// Scale on the diagonal, misalignment beside it; of a magnetometer with soft iron.
    pub matrix: Matrix3<f64>,
    /// Bias; of a magnetometer with hard iron.
    pub bias: Vector3<f64>,
    /// Standard deviation of the white noise on each sample.
    pub noise: f64,
    /// Frequency at which a first-order low-pass filter takes 3 dB, Hz; 0 for none.
    pub bandwidth: f64,
    /// Largest value, either way; 0 for no limit.
    pub range: f64,
    /// Step of the converter; 0 for none.
    pub resolution: f64,
    /// When it repeats its last value.
    pub freeze: Window,
}

/// start ≤ t < end, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// From this time on, s.
    pub start: f64,
    /// Until this time, s.
    pub end: f64,
}

impl Window {
    /// Whether it holds `time` (s).
    pub fn holds(&self, time: f64) -> bool {
        let tolerance = crate::time::tolerance(time);
        time + tolerance >= self.start && time + tolerance < self.end
    }
}

impl Default for Triad {
    /// Without errors.
    fn default() -> Self {
        Self {
            matrix: Matrix3::identity(),
            bias: Vector3::zeros(),
            noise: 0.0,
            bandwidth: 0.0,
            range: 0.0,
            resolution: 0.0,
            freeze: Window::default(),
        }
    }
}

/// Names of a sensor's values, as the units have them.
pub(crate) struct Names {
    pub(crate) matrix: &'static str,
    pub(crate) bias: &'static str,
    pub(crate) noise: &'static str,
    pub(crate) bandwidth: &'static str,
    pub(crate) range: &'static str,
    pub(crate) resolution: &'static str,
}

/// What a sensor keeps from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// What came to the low-pass filter.
    input: Vector3<f64>,
    /// What came out of it.
    filtered: Vector3<f64>,
    /// What the sensor said.
    pub value: Vector3<f64>,
}

impl Triad {
    /// Refuses negative values and what is not finite.
    pub(crate) fn check(&self, names: &Names) -> Result<(), Error> {
        for (name, value) in [
            (names.noise, self.noise),
            (names.bandwidth, self.bandwidth),
            (names.range, self.range),
            (names.resolution, self.resolution),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::Parameter { name, problem: format!("= {value} must not be negative") });
            }
        }
        for (name, finite) in [
            (names.matrix, self.matrix.iter().all(|value| value.is_finite())),
            (names.bias, self.bias.iter().all(|value| value.is_finite())),
        ] {
            if !finite {
                return Err(Error::Parameter { name, problem: "holds a value that is not finite".into() });
            }
        }
        Ok(())
    }

    /// The sample at `time` (s), which is `elapsed` (s) after the one before, if there was one. The filter is exact for a
    /// signal that is linear in time between samples. `noise` is normal with variance 1.
    pub fn sample(
        &self,
        time: f64,
        felt: &Vector3<f64>,
        noise: &Vector3<f64>,
        before: Option<(&Memory, f64)>,
    ) -> Memory {
        let input = self.matrix * felt + self.bias;
        let filtered = before.map_or(input, |(before, elapsed)| self.filtered(&input, before, elapsed));
        let value = match before {
            Some((before, _)) if self.freeze.holds(time) => before.value,
            _ => (filtered + noise * self.noise).map(|value| self.convert(value)),
        };
        Memory { input, filtered, value }
    }

    /// τ ẏ = u − y with u from `before.input` to `input` along a straight line.
    fn filtered(&self, input: &Vector3<f64>, before: &Memory, elapsed: f64) -> Vector3<f64> {
        if self.bandwidth == 0.0 {
            return *input;
        }
        let x = TAU * self.bandwidth * elapsed;
        let lag = (input - before.input) / x;
        input - lag + (before.filtered - before.input + lag) * (-x).exp()
    }

    fn convert(&self, value: f64) -> f64 {
        let value = if self.range == 0.0 { value } else { value.clamp(-self.range, self.range) };
        if self.resolution == 0.0 { value } else { (value / self.resolution).round() * self.resolution }
    }
}
