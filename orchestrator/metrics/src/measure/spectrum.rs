//! Content of signals above a frequency.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::PI;

/// Returns the RMS of the content above `frequency` (Hz), as the root of the sum of the signals'
/// mean squares. `values` holds the values of all `signals`, sample by sample, `step` (s) apart.
/// Each signal's mean is taken away, and a Hann window keeps slow changes from leaking into fast
/// ones. The result is `None` with fewer than 16 samples, or if `frequency` is not below half of
/// the sampling rate.
pub(super) fn rms_above(values: &[f64], signals: usize, step: f64, frequency: f64) -> Option<f64> {
    let samples = values.len().checked_div(signals)?;
    if samples < 16 || frequency >= 0.5 / step {
        return None;
    }
    let count = samples as f64;
    let window = |k: usize| 1.0 - (2.0 * PI * k as f64 / count).cos();
    let transform = FftPlanner::new().plan_fft_forward(samples);
    let mean_square = |signal: usize| {
        let samples_of_signal = || values.iter().skip(signal).step_by(signals);
        let mean = samples_of_signal().sum::<f64>() / count;
        let windowed = samples_of_signal().enumerate().map(|(k, value)| window(k) * (value - mean));
        let mut spectrum: Vec<_> = windowed.map(|value| Complex::new(value, 0.0)).collect();
        transform.process(&mut spectrum);
        let first = (frequency * count * step).ceil() as usize;
        // The other half of the spectrum is the mirror image of this one. The mean square of the
        // window is 3/2.
        let above = spectrum.iter().take(samples / 2 + 1).skip(first).map(Complex::norm_sqr);
        2.0 * above.sum::<f64>() / (1.5 * count * count)
    };
    Some((0..signals).map(mean_square).sum::<f64>().sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the values of two signals over 10 s, `step` s apart.
    fn sampled(step: f64, value: impl Fn(f64) -> [f64; 2]) -> Vec<f64> {
        (0..(10.0 / step) as usize).flat_map(|k| value(k as f64 * step)).collect()
    }

    #[test]
    fn oracle_a_fast_sine_counts_with_its_rms_and_a_slow_one_does_not() {
        let wave = |time: f64| {
            let sine = |amplitude: f64, hertz: f64| amplitude * (2.0 * PI * hertz * time).sin();
            [100.0 + 50.0 * time + sine(1000.0, 0.3) + sine(3.0, 12.3), sine(4.0, 20.0)]
        };
        let rms = rms_above(&sampled(0.01, wave), 2, 0.01, 5.0).unwrap();
        // 3²/2 + 4²/2
        assert!((rms / 12.5_f64.sqrt() - 1.0).abs() < 0.01, "{rms}");
        let slow = |time: f64| [100.0 + 50.0 * time + 1000.0 * (2.0 * time).sin(), 0.0];
        let rms = rms_above(&sampled(0.01, slow), 2, 0.01, 5.0).unwrap();
        assert!(rms < 0.1, "{rms}");
    }

    #[test]
    fn nothing_is_above_half_of_the_sampling_rate() {
        let values = sampled(0.2, |_| [0.0, 1.0]);
        assert_eq!(rms_above(&values, 2, 0.2, 5.0), None);
        assert_eq!(rms_above(&[], 0, 0.2, 1.0), None);
    }
}
