//! Second-order Butterworth low-pass filter by the bilinear transform, with the cut-off frequency
//! met exactly.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, SQRT_2};
use vehicle::math::tan;

/// The filter y_k = b₀ u_k + b₁ u_{k−1} + b₂ u_{k−2} − a₁ y_{k−1} − a₂ y_{k−2}.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    b: [f64; 3],
    a: [f64; 2],
    delay: f64,
}

/// The state that the filter of N signals keeps between samples (direct form II transposed).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct State<const N: usize> {
    first: SVector<f64, N>,
    second: SVector<f64, N>,
}

impl LowPass {
    /// Computes the filter with `cutoff` (Hz), below half the sampling rate, for samples every
    /// `period` (s); 0 Hz gives no filter.
    pub fn new(cutoff: f64, period: f64) -> Self {
        if cutoff == 0.0 {
            return Self { b: [1.0, 0.0, 0.0], a: [0.0; 2], delay: 0.0 };
        }
        let c = tan(PI * cutoff * period);
        let scale = 1.0 / (1.0 + SQRT_2 * c + c * c);
        let b0 = c * c * scale;
        let a = [2.0 * (c * c - 1.0) * scale, (1.0 - SQRT_2 * c + c * c) * scale];
        Self { b: [b0, 2.0 * b0, b0], a, delay: SQRT_2 * period / (2.0 * c) }
    }

    /// Returns the delay (s) of slow signals, which is phase delay and group delay at 0 Hz: √2
    /// period/(2 tan(π cutoff period)). It is √2/(2π cutoff) if the cut-off is far below the
    /// sampling rate.
    pub fn delay(&self) -> f64 {
        self.delay
    }

    /// Returns the state in which a constant `input` passes unchanged.
    pub fn settled<const N: usize>(&self, input: &SVector<f64, N>) -> State<N> {
        let second = input * (self.b[2] - self.a[1]);
        State { first: input * (self.b[1] - self.a[0]) + second, second }
    }

    /// Processes one sample and returns the output.
    pub fn step<const N: usize>(
        &self,
        state: &mut State<N>,
        input: &SVector<f64, N>,
    ) -> SVector<f64, N> {
        let output = input * self.b[0] + state.first;
        state.first = input * self.b[1] - output * self.a[0] + state.second;
        state.second = input * self.b[2] - output * self.a[1];
        output
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector1;

    const PERIOD: f64 = 0.01;

    /// Returns the size of the output for a sine of size 1, after it has settled.
    fn gain(filter: &LowPass, frequency: f64) -> f64 {
        let mut state = filter.settled(&Vector1::new(0.0));
        let output = |state: &mut State<1>, k: u32| {
            let phase = 2.0 * PI * frequency * PERIOD * f64::from(k);
            filter.step(state, &Vector1::new(phase.sin())).x
        };
        let power: f64 =
            (0..20_000).map(|k| output(&mut state, k)).skip(10_000).map(|y| y * y).sum();
        (power / 5000.0).sqrt()
    }

    #[test]
    fn oracle_the_cutoff_takes_3_db_and_slow_signals_pass() {
        for cutoff in [1.0, 7.0, 10.0, 30.0] {
            let filter = LowPass::new(cutoff, PERIOD);
            assert!((gain(&filter, cutoff) - 0.5f64.sqrt()).abs() < 1e-3, "{cutoff} Hz");
            assert!((gain(&filter, cutoff / 50.0) - 1.0).abs() < 1e-5, "{cutoff} Hz");
        }
    }

    #[test]
    fn oracle_a_ramp_comes_later_by_the_delay() {
        for cutoff in [2.0, 10.0, 20.0] {
            let filter = LowPass::new(cutoff, PERIOD);
            let mut state = filter.settled(&Vector1::new(0.0));
            let mut output = 0.0;
            for k in 0..2000 {
                output = filter.step(&mut state, &Vector1::new(f64::from(k) * PERIOD)).x;
            }
            let lag = 1999.0 * PERIOD - output;
            assert!(
                (lag - filter.delay()).abs() < 1e-10,
                "{cutoff} Hz: {lag} s, {} s",
                filter.delay()
            );
        }
        let slow = LowPass::new(0.1, PERIOD).delay() * 2.0 * PI * 0.1;
        assert!((slow - SQRT_2).abs() < 1e-5, "√2/(2π cutoff) in the limit");
    }
}
