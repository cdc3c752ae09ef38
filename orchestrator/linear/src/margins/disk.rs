//! Disk margins and sensitivities, by frequency.
//!
//! A disk margin α says that the loop stays stable while the gain at each opened signal is
//! multiplied by any (2 + δ)/(2 − δ) with a stable δ of magnitude below α, which may change gain
//! and phase at a time, and differ from signal to signal: P. Seiler, A. Packard and P. Gahinet, "An
//! introduction to disk margins", IEEE Control Systems Magazine 40 (2020), with skew 0. α is the
//! inverse of the largest structured singular value of S − I/2 over all frequencies.
//!
//! A loop with a period of several samples responds to a sine with several: those whose frequencies
//! differ by multiples of that of the period. δ acts on each of them by itself, so that in these
//! coordinates it is still diagonal.

use super::structured::{ComplexMatrix, balanced, largest_singular_value, least, upper_bound};
use crate::model::{OpenLoop, Step};
use crate::spectrum::dominant;
use nalgebra::Complex;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Number of frequencies that are evaluated, and their range in relation to the largest.
const FREQUENCIES: usize = 450;
const RANGE: f64 = 1e-6;

/// A largest value over all frequencies.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Peak {
    /// The value.
    pub value: f64,
    /// Its frequency, rad/s.
    pub frequency: f64,
}

/// A disk margin.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Disk {
    /// Radius α.
    pub alpha: f64,
    /// Frequency at which it is reached, rad/s.
    pub frequency: f64,
    /// Factor by which the gain may be multiplied, or divided; infinite from α = 2 on.
    pub gain: f64,
    /// Phase by which the loop may be turned at an unchanged gain, deg.
    pub phase: f64,
}

impl Disk {
    fn new(peak: Peak) -> Self {
        let alpha = 1.0 / peak.value;
        let gain = if alpha < 2.0 { (2.0 + alpha) / (2.0 - alpha) } else { f64::INFINITY };
        let phase = (2.0 * (0.5 * alpha).atan()).to_degrees();
        Self { alpha, frequency: peak.frequency, gain, phase }
    }
}

/// The sensitivity S = (I + L)⁻¹ of a loop at many frequencies.
pub(crate) struct Responses<'a> {
    open: &'a OpenLoop,
    /// Frequencies in rad/s, ascending, with the sensitivities there.
    known: Vec<(f64, ComplexMatrix)>,
}

impl<'a> Responses<'a> {
    /// Computes the sensitivities of a stable loop.
    pub(crate) fn of(open: &'a OpenLoop) -> Self {
        let largest = PI / open.period;
        let mut frequencies: Vec<f64> = (0..=FREQUENCIES)
            .map(|k| largest * RANGE.powf(1.0 - k as f64 / FREQUENCIES as f64))
            .collect();
        // A weakly damped motion may have its peak between two of them.
        if let Some(closed) = open.closed(&vec![1.0; open.channels()]) {
            let own = dominant(&closed).arg().abs() / open.period;
            frequencies.extend(Some(own).filter(|frequency| *frequency > RANGE * largest));
        }
        frequencies.sort_by(f64::total_cmp);
        let known = frequencies.into_iter().map(|w| (w, sensitivity(open, w))).collect();
        Self { open, known }
    }

    /// Returns the disk margin of some signals, while the loops of the others stay closed.
    pub(crate) fn disk(&self, channels: &[usize]) -> Disk {
        let shifted = |mut s: ComplexMatrix| {
            for i in 0..s.nrows() {
                s[(i, i)] -= 0.5;
            }
            s
        };
        let bound = |s| largest_singular_value(&balanced(shifted(s)));
        Disk::new(self.peak(channels, &bound, &|s| upper_bound(&shifted(s))))
    }

    /// Returns the largest singular value of the sensitivity of some signals, in ascending order,
    /// each in its typical magnitude.
    pub(crate) fn sensitivity(&self, channels: &[usize]) -> Peak {
        let value = |s| largest_gain(self.open, channels, s);
        self.peak(channels, &value, &value)
    }

    /// Finds the largest value of a function of the sensitivity. Where an upper `bound` of it is
    /// below the largest value so far, it is not computed.
    fn peak(
        &self,
        channels: &[usize],
        bound: &dyn Fn(ComplexMatrix) -> f64,
        value: &dyn Fn(ComplexMatrix) -> f64,
    ) -> Peak {
        let chosen = |s: &ComplexMatrix| {
            let count = self.open.channels();
            let places: Vec<usize> =
                (0..s.nrows()).filter(|place| channels.contains(&(place % count))).collect();
            s.select_rows(&places).select_columns(&places)
        };
        let mut order: Vec<(usize, f64)> =
            self.known.iter().enumerate().map(|(k, (_, s))| (k, bound(chosen(s)))).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut best = (0, 0.0);
        for (k, bound) in order {
            if bound <= best.1 {
                break;
            }
            let found = value(chosen(&self.known[k].1));
            if found > best.1 {
                best = (k, found);
            }
        }
        let (k, found) = best;
        let frequency = self.known[k].0;
        let at = |place: usize| self.known[place].0;
        let below = at(k.saturating_sub(1));
        let above = at((k + 1).min(self.known.len() - 1));
        // Within its neighbours a peak of a smooth function has no other beside it.
        let reach = (above / frequency).ln().max((frequency / below).ln());
        let limit = PI / self.open.period;
        let near = |x: f64| (frequency * (x * reach).exp()).min(limit);
        let (x, negative) = least(&mut |x| -value(chosen(&sensitivity(self.open, near(x)))), 1.0);
        if -negative > found {
            Peak { value: -negative, frequency: near(x) }
        } else {
            Peak { value: found, frequency }
        }
    }
}

/// Returns the largest singular value of a response of some signals, in ascending order, to
/// themselves, each in its typical magnitude.
pub(crate) fn largest_gain(open: &OpenLoop, channels: &[usize], mut s: ComplexMatrix) -> f64 {
    for place in 0..s.nrows() {
        let size = open.signals[channels[place % channels.len()]].size;
        s.row_mut(place).unscale_mut(size);
        s.column_mut(place).scale_mut(size);
    }
    largest_singular_value(&s)
}

/// Returns the sensitivity S = (I − G)⁻¹ of the open loop G = −L at a frequency (rad/s), with the
/// parts at all frequencies that the period mixes. It is computed from the closed loop, whose
/// poles are not on the unit circle: w = E (C x + d) and x⁺ = A x + B w with E = (I − D)⁻¹.
pub(crate) fn sensitivity(open: &OpenLoop, frequency: f64) -> ComplexMatrix {
    let Step { a, b, c, d } = &open.step;
    let n = d.nrows();
    let infinite = || ComplexMatrix::from_element(n, n, Complex::new(f64::INFINITY, 0.0));
    let Some(e) = (crate::Matrix::identity(n, n) - d).try_inverse() else { return infinite() };
    let complex = |matrix: &crate::Matrix| matrix.map(|value| Complex::new(value, 0.0));
    let (input, output) = (b * &e, &e * c);
    let mut resolvent = complex(&-(a + b * &output));
    let z = Complex::from_polar(1.0, frequency * open.period);
    for i in 0..resolvent.nrows() {
        resolvent[(i, i)] += z;
    }
    let mut lifted = complex(&e);
    if !a.is_empty() {
        let Some(states) = resolvent.lu().solve(&complex(&input)) else { return infinite() };
        lifted += complex(&output) * states;
    }
    let (count, samples) = (open.channels(), open.samples);
    if samples == 1 {
        return lifted;
    }
    let step = open.sampling();
    let sines = ComplexMatrix::from_fn(n, n, |row, column| {
        if row % count != column % count {
            return Complex::new(0.0, 0.0);
        }
        let (sample, harmonic) = ((row / count) as f64, (column / count) as f64);
        Complex::from_polar(1.0, (frequency + TAU * harmonic / open.period) * sample * step)
    });
    let inverse = sines.adjoint() * Complex::new(1.0 / samples as f64, 0.0);
    inverse * lifted * sines
}

/// Returns the return ratio L at one signal while the loops of the others are closed, at a
/// frequency (rad/s). It follows from the sensitivity S = 1/(1 + L).
pub(crate) fn return_ratio(open: &OpenLoop, channel: usize, frequency: f64) -> Complex<f64> {
    sensitivity(open, frequency)[(channel, channel)].inv() - 1.0
}
