//! One sensor with three axes and its errors, in the order in which they act on the measured
//! quantity: scale, misalignment and bias, which may drift; bandwidth; white noise; range;
//! resolution of the converter.

use crate::axes::AXES;
use crate::error::{Error, finite, not_negative};
use crate::math::exp;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;
use std::f64::consts::TAU;

/// Errors of one sensor, in the unit of the quantity that it measures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Triad {
    /// Matrix of scale and misalignment; for the magnetometer with soft iron.
    #[setting(part, unit = "1", nominal = 1.0, used_with = "sensor.set = 2", file)]
    pub matrix: Matrix3<f64>,
    /// Bias; for the magnetometer with hard iron.
    #[setting(part, each = AXES, used_with = "sensor.set = 2", file)]
    pub bias: Vector3<f64>,
    /// Rate of change of the bias.
    #[setting(part, rate, each = AXES, used_with = "sensor.set = 2", file)]
    pub drift: Vector3<f64>,
    /// Standard deviation of a random part of the bias, which wanders: a Gauss-Markov process that
    /// is stationary from the start.
    #[setting(part, min = 0.0, used_with = "sensor.set = 2", file)]
    pub instability: f64,
    /// Correlation time of the wandering bias; 0 for one that stays.
    #[setting(part, unit = "s", min = 0.0, nominal = 1e3)]
    #[setting(used_with = "sensor.set = 2 and ~.instability > 0")]
    #[setting(file)]
    pub correlation: f64,
    /// Standard deviation of the white noise on the samples.
    #[setting(part, min = 0.0, used_with = "sensor.set = 2", file)]
    pub noise: f64,
    /// Bandwidth (3 dB) of the first-order low-pass filter; 0 for no filter.
    #[setting(part, unit = "Hz", min = 0.0, nominal = 50.0, used_with = "sensor.set = 2", file)]
    pub bandwidth: f64,
    /// Largest magnitude of a reading; 0 for no limit.
    #[setting(part, min = 0.0, used_with = "sensor.set = 2", file)]
    pub range: f64,
    /// Quantization step of the reading; 0 for none.
    #[setting(part, min = 0.0, used_with = "sensor.set = 2", file)]
    pub resolution: f64,
    /// Time window in which the sensor repeats its last value.
    #[setting(part, used_with = "sensor.set >= 1")]
    pub freeze: Window,
}

/// Time window start ≤ t < end, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Window {
    /// Start, included.
    #[setting(part, unit = "s", nominal = 1.0, used_with = "~.end != 0")]
    pub start: f64,
    /// End, excluded.
    #[setting(part, unit = "s", nominal = 1.0)]
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
            instability: 0.0,
            correlation: 0.0,
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
    /// Part of the bias that wanders.
    wander: Vector3<f64>,
}

/// Normal numbers of variance 1 for a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Draws {
    /// For the white noise.
    pub noise: Vector3<f64>,
    /// For the wandering bias.
    pub wander: Vector3<f64>,
}

impl Triad {
    /// Refuses negative values and values that are not finite; `path` leads to this sensor.
    pub(crate) fn check(&self, path: &str) -> Result<(), Error> {
        for (name, value) in [
            ("instability", self.instability),
            ("correlation", self.correlation),
            ("noise", self.noise),
            ("bandwidth", self.bandwidth),
            ("range", self.range),
            ("resolution", self.resolution),
        ] {
            not_negative(format!("{path}.{name}"), value, "")?;
        }
        finite(format!("{path}.matrix"), &self.matrix)?;
        finite(format!("{path}.bias"), &self.bias)?;
        finite(format!("{path}.drift"), &self.drift)
    }

    /// Returns the sensor with the bias that it has drifted to after the time `elapsed` (s).
    #[must_use]
    pub fn drifted(&self, elapsed: f64) -> Self {
        Self { bias: self.bias + self.drift * elapsed, ..*self }
    }

    /// Takes the sample at `time` (s), which is the given time (s) after the one in `before`, if
    /// there was one. The filter is exact for a signal that is linear in time between samples.
    pub fn sample(
        &self,
        time: f64,
        felt: &Vector3<f64>,
        draws: &Draws,
        before: Option<(&Memory, f64)>,
    ) -> Memory {
        let wander = self.wandered(&draws.wander, before);
        let input = self.matrix * felt + self.bias + wander;
        let filtered =
            before.map_or(input, |(before, elapsed)| self.filtered(&input, before, elapsed));
        let value = match before {
            Some((before, _)) if self.freeze.holds(time) => before.value,
            _ => (filtered + draws.noise * self.noise).map(|value| self.convert(value)),
        };
        Memory { input, filtered, value, wander }
    }

    /// Returns the wandering part of the bias.
    fn wandered(&self, draw: &Vector3<f64>, before: Option<(&Memory, f64)>) -> Vector3<f64> {
        let Some((before, elapsed)) = before else { return draw * self.instability };
        if self.correlation == 0.0 {
            return before.wander;
        }
        let kept = exp(-elapsed / self.correlation);
        before.wander * kept + draw * (self.instability * (1.0 - kept * kept).sqrt())
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
