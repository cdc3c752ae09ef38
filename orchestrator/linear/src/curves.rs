//! Frequency responses of a loop as curves that figures draw.

use crate::Matrix;
use crate::linearise::Linearised;
use crate::margins::disk::{Responses, largest_gain, return_ratio, sensitivity};
use crate::spectrum::spectral_radius;
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Number of frequencies, and the lowest one in relation to the largest.
const FREQUENCIES: usize = 400;
const LOWEST: f64 = 1e-3;
/// Number of points on the edge of a disk.
const AROUND: usize = 181;

/// Frequency responses of a loop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResponseCurves {
    /// Frequencies, rad/s.
    pub frequency: Vec<f64>,
    /// Phase of the return ratio L at the signal with the smallest disk margin, while the loops of
    /// the others are closed; deg, continuous from −180° on at the frequency where |L| is 1.
    pub phase: Vec<f64>,
    /// Magnitude of L, dB.
    pub gain: Vec<f64>,
    /// Largest singular value of the sensitivity of all signals together, at the frequency of the
    /// input, dB. A loop with a period of several samples responds at others, too.
    pub sensitivity: Vec<f64>,
}

impl ResponseCurves {
    /// Computes the responses of a loop; `None` if it is unstable.
    pub fn of(found: &Linearised) -> Option<Self> {
        let open = &found.open;
        let closed: Matrix = open.closed(&vec![1.0; open.channels()])?;
        if spectral_radius(&closed) >= 1.0 {
            return None;
        }
        let responses = Responses::of(open);
        let disk = |channel: &usize| responses.disk(&[*channel]).alpha;
        let worst = (0..open.channels()).min_by(|a, b| disk(a).total_cmp(&disk(b)))?;
        let largest = PI / open.sampling();
        let frequency: Vec<f64> = (0..FREQUENCIES)
            .map(|k| largest * LOWEST.powf(1.0 - k as f64 / (FREQUENCIES - 1) as f64))
            .collect();
        let ratios: Vec<Complex<f64>> =
            frequency.iter().map(|w| return_ratio(open, worst, *w)).collect();
        let count = open.channels();
        let all: Vec<usize> = (0..count).collect();
        let s = frequency.iter().map(|w| {
            let s = sensitivity(open, *w);
            largest_gain(open, &all, s.view((0, 0), (count, count)).into_owned())
        });
        Some(Self {
            sensitivity: s.map(decibel).collect(),
            phase: phases(&ratios),
            gain: ratios.iter().map(|l| decibel(l.norm())).collect(),
            frequency,
        })
    }
}

/// Returns a magnitude in dB.
pub fn decibel(magnitude: f64) -> f64 {
    20.0 * magnitude.log10()
}

/// Returns the edge of the set that the return ratio of a loop with the disk margin `alpha` does
/// not enter, −(2 − δ)/(2 + δ) for |δ| = α, as phase (deg) and magnitude (dB). α is below 2.
pub fn excluded(alpha: f64) -> (Vec<f64>, Vec<f64>) {
    let points = (0..AROUND).map(|k| {
        let delta = Complex::from_polar(alpha, TAU * k as f64 / (AROUND - 1) as f64);
        let l = -(Complex::from(2.0) - delta) / (Complex::from(2.0) + delta);
        let phase = l.arg().to_degrees();
        (if phase > 0.0 { phase - 360.0 } else { phase }, decibel(l.norm()))
    });
    points.unzip()
}

/// Returns phases without jumps, deg, between −360° and 0° where the magnitude is closest to 1.
fn phases(values: &[Complex<f64>]) -> Vec<f64> {
    let mut phases: Vec<f64> = Vec::new();
    for value in values {
        let phase = value.arg().to_degrees();
        let turns = phases.last().map_or(0.0, |last| ((last - phase) / 360.0).round());
        phases.push(phase + 360.0 * turns);
    }
    let from_one = |value: &Complex<f64>| value.norm().ln().abs();
    let crossing =
        (0..values.len()).min_by(|a, b| from_one(&values[*a]).total_cmp(&from_one(&values[*b])));
    let turns = crossing.map_or(0.0, |place| (phases[place] / 360.0).ceil());
    phases.iter().map(|phase| phase - 360.0 * turns).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_phases_of_a_delayed_integrator_fall_without_jumps() {
        let frequencies: Vec<f64> = (1..400).map(|k| 0.05 * f64::from(k)).collect();
        let values: Vec<Complex<f64>> =
            frequencies.iter().map(|w| Complex::from_polar(1.0 / w, -0.5 * PI - 0.7 * w)).collect();
        for (w, phase) in frequencies.iter().zip(phases(&values)) {
            let exact = -90.0 - (0.7 * w).to_degrees();
            assert!((phase - exact).abs() < 1e-9, "{w}: {phase} {exact}");
        }
    }

    #[test]
    fn oracle_the_edge_of_a_disk_holds_its_gain_and_phase_margin() {
        let alpha = 0.8;
        let (phase, gain) = excluded(alpha);
        let largest = gain.iter().copied().fold(f64::MIN, f64::max);
        assert!((largest - decibel((2.0 + alpha) / (2.0 - alpha))).abs() < 1e-9);
        let turn = 2.0 * (0.5_f64 * alpha).atan().to_degrees();
        let least = phase.iter().copied().fold(f64::MAX, f64::min);
        assert!((least + 180.0 + turn).abs() < 1e-2, "{least} {turn}");
    }
}
