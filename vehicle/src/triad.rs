//! One sensor with three axes and its errors, in the order in which they act on the measured
//! quantity: scale, misalignment and bias, which may drift; bandwidth; white noise; range;
//! resolution of the converter.

use crate::error::Error;
use crate::math::exp;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Errors of one sensor, in the unit of the quantity that it measures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Triad {
    /// Matrix with scale on the diagonal and misalignment beside it; for a magnetometer it includes
    /// soft iron.
    pub matrix: Matrix3<f64>,
    /// Bias of each axis; for a magnetometer it includes hard iron.
    pub bias: Vector3<f64>,
    /// Change of the bias in a second, per axis.
    pub drift: Vector3<f64>,
    /// Standard deviation of the white noise on each sample.
    pub noise: f64,
    /// Frequency at which a first-order low-pass filter attenuates by 3 dB, Hz; 0 for no filter.
    pub bandwidth: f64,
    /// Largest magnitude of a value; 0 for no limit.
    pub range: f64,
    /// Step of the converter; 0 for no quantization.
    pub resolution: f64,
    /// Window in which the sensor repeats its last value.
    pub freeze: Window,
}

/// Time window start ≤ t < end, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Start of the window, included, s.
    pub start: f64,
    /// End of the window, excluded, s.
    pub end: f64,
}

impl Window {
    /// Whether the window contains `time` (s).
    pub fn holds(&self, time: f64) -> bool {
        let tolerance = crate::time::tolerance(time);
        time + tolerance >= self.start && time + tolerance < self.end
    }
}

impl Default for Triad {
    /// Returns a sensor without errors.
    fn default() -> Self {
        Self {
            matrix: Matrix3::identity(),
            bias: Vector3::zeros(),
            drift: Vector3::zeros(),
            noise: 0.0,
            bandwidth: 0.0,
            range: 0.0,
            resolution: 0.0,
            freeze: Window::default(),
        }
    }
}

/// Memory that a sensor keeps from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Input of the low-pass filter.
    input: Vector3<f64>,
    /// Output of the low-pass filter.
    filtered: Vector3<f64>,
    /// Value that the sensor output.
    pub value: Vector3<f64>,
}

impl Triad {
    /// Refuses negative values and values that are not finite; `path` leads to this sensor.
    pub(crate) fn check(&self, path: &str) -> Result<(), Error> {
        for (name, value) in [
            ("noise", self.noise),
            ("bandwidth", self.bandwidth),
            ("range", self.range),
            ("resolution", self.resolution),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                let problem = format!("= {value} must not be negative");
                return Err(Error::parameter(format!("{path}.{name}"), problem));
            }
        }
        for (name, finite) in [
            ("matrix", self.matrix.iter().all(|value| value.is_finite())),
            ("bias", self.bias.iter().all(|value| value.is_finite())),
            ("drift", self.drift.iter().all(|value| value.is_finite())),
        ] {
            if !finite {
                return Err(Error::parameter(
                    format!("{path}.{name}"),
                    "holds a value that is not finite",
                ));
            }
        }
        Ok(())
    }

    /// Returns the sensor with the bias that it has drifted to after the time `elapsed` (s).
    #[must_use]
    pub fn drifted(&self, elapsed: f64) -> Self {
        Self { bias: self.bias + self.drift * elapsed, ..*self }
    }

    /// Takes the sample at `time` (s), which is the given time (s) after the one in `before`, if
    /// there was one. The filter is exact for a signal that is linear in time between samples.
    /// `noise` is normal with variance 1.
    pub fn sample(
        &self,
        time: f64,
        felt: &Vector3<f64>,
        noise: &Vector3<f64>,
        before: Option<(&Memory, f64)>,
    ) -> Memory {
        let input = self.matrix * felt + self.bias;
        let filtered =
            before.map_or(input, |(before, elapsed)| self.filtered(&input, before, elapsed));
        let value = match before {
            Some((before, _)) if self.freeze.holds(time) => before.value,
            _ => (filtered + noise * self.noise).map(|value| self.convert(value)),
        };
        Memory { input, filtered, value }
    }

    /// Solves τ ẏ = u − y over `elapsed` (s), with u on a straight line from `before.input` to
    /// `input`.
    fn filtered(&self, input: &Vector3<f64>, before: &Memory, elapsed: f64) -> Vector3<f64> {
        if self.bandwidth == 0.0 {
            return *input;
        }
        let x = TAU * self.bandwidth * elapsed;
        let lag = (input - before.input) / x;
        input - lag + (before.filtered - before.input + lag) * exp(-x)
    }

    fn convert(&self, value: f64) -> f64 {
        let value = if self.range == 0.0 { value } else { value.clamp(-self.range, self.range) };
        if self.resolution == 0.0 {
            value
        } else {
            (value / self.resolution).round() * self.resolution
        }
    }
}
