//! Gains, phase and delay at which the loop becomes unstable, by the eigenvalues of the closed
//! loop.

use crate::Matrix;
use crate::model::{OpenLoop, Step};
use crate::spectrum::{dominant, is_stable, spectral_radius};
use nalgebra::{Complex, ComplexField, DMatrix};
use serde::Serialize;

/// Factor between the gains that are tried, and the largest one.
const FACTOR: f64 = 1.3;
const LARGEST_GAIN: f64 = 1e3;
/// Angle between the phases that are tried, deg.
const TURN: f64 = 6.0;
/// Most parts of a sample between the delays that are tried, and the longest delay in samples.
const PARTS: f64 = 4.0;
const LONGEST_DELAY: f64 = 200.0;
/// Number of delays that are tried up to the one that the phase suggests.
const TRIALS: f64 = 8.0;
/// Steps that enclose a change of stability, and the relative width at which they end.
const REFINEMENTS: usize = 60;
const ACCURACY: f64 = 1e-8;

/// A change at which the loop becomes unstable.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Crossing {
    /// The change.
    pub value: f64,
    /// Frequency of the oscillation there, rad/s.
    pub frequency: f64,
}

/// Gains, phase and delay at which the loop becomes unstable; `None` if none within the searched
/// range does.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Classical {
    /// Least factor above 1, up to 1000.
    pub gain_above: Option<Crossing>,
    /// Largest factor below 1, down to 0.001.
    pub gain_below: Option<Crossing>,
    /// Least phase lag, deg.
    pub phase: Option<Crossing>,
    /// Least delay in addition, s.
    pub delay: Option<Crossing>,
    /// Longest delay that was searched, s.
    pub longest_delay: f64,
}

/// Searches for some signals, given by their indices, which change in the same way.
pub(super) fn classical(open: &OpenLoop, changed: &[usize]) -> Classical {
    let gains = |gain: f64| -> Vec<f64> {
        (0..open.channels()).map(|i| if changed.contains(&i) { gain } else { 1.0 }).collect()
    };
    let by_gain = |logarithm: f64| open.closed(&gains(logarithm.exp()));
    let by_phase = |lag: f64| {
        let turn = Complex::from_polar(1.0, -lag.to_radians());
        turned_loop(open, &|i| if changed.contains(&i) { turn } else { Complex::new(1.0, 0.0) })
    };
    let by_delay = |samples: f64| open.delayed(changed, samples);
    let gain = |direction: f64| {
        let last = LARGEST_GAIN.ln();
        let crossing = first(&|x| by_gain(direction * x), FACTOR.ln(), last, open)?;
        Some(Crossing { value: (direction * crossing.value).exp(), ..crossing })
    };
    let phase = first(&by_phase, TURN, 180.0, open);
    // A delay turns the loop by its product with the frequency, which guides the search.
    let sampling = open.sampling();
    let expected = phase
        .filter(|at| at.frequency > 0.0)
        .map_or(0.0, |at| at.value.to_radians() / (at.frequency * sampling));
    let trial = (expected / TRIALS).clamp(1.0 / PARTS, LONGEST_DELAY / TRIALS);
    let delay = first(&by_delay, trial, LONGEST_DELAY, open);
    Classical {
        gain_above: gain(1.0),
        gain_below: gain(-1.0),
        phase,
        delay: delay.map(|found| Crossing { value: found.value * sampling, ..found }),
        longest_delay: LONGEST_DELAY * sampling,
    }
}

/// Returns the rate 1/s of a motion with this eigenvalue over a period, its growth and its frequency
/// together.
pub(crate) fn rate(eigenvalue: Complex<f64>, open: &OpenLoop) -> f64 {
    eigenvalue.ln().norm() / open.period
}

/// Closes the loop with a complex factor at each signal.
fn turned_loop(
    open: &OpenLoop,
    factor: &dyn Fn(usize) -> Complex<f64>,
) -> Option<DMatrix<Complex<f64>>> {
    let Step { a, b, c, d } = &open.step;
    let complex = |matrix: &Matrix| matrix.map(|value| Complex::new(value, 0.0));
    let n = d.nrows();
    let count = open.channels();
    let k = DMatrix::from_fn(n, n, |row, column| {
        if row == column { factor(row % count) } else { Complex::new(0.0, 0.0) }
    });
    let inverse = (DMatrix::identity(n, n) - &k * complex(d)).try_inverse()?;
    Some(complex(a) + complex(b) * inverse * k * complex(c))
}

/// Finds the least change at which the closed loop has an eigenvalue outside the unit circle, up to
/// `last`. A loop that cannot be closed counts as unstable. One that only moves more slowly than the
/// model shows does not: two integrators in a row, which a reduced gain never makes unstable, have
/// a pair of eigenvalues 1, which small errors move to both sides of the unit circle.
fn first<T: ComplexField<RealField = f64>>(
    closed: &dyn Fn(f64) -> Option<DMatrix<T>>,
    step: f64,
    last: f64,
    open: &OpenLoop,
) -> Option<Crossing> {
    let growth = |x: f64| closed(x).map_or(1.0, |a| spectral_radius(&a).ln());
    let is_certain = |x: f64| closed(x).is_none_or(|a| rate(dominant(&a), open) > open.slowest);
    let (mut stable, mut next) = (0.0, step);
    let mut unstable = loop {
        if next > last {
            return None;
        }
        if closed(next).is_some_and(|a| is_stable(&a)) {
            stable = next;
        } else if is_certain(next) {
            break next;
        }
        next += step;
    };
    // Regula falsi (Illinois) on the logarithm of the largest magnitude, which is smooth there.
    let (mut below, mut above) = (growth(stable), growth(unstable));
    for _ in 0..REFINEMENTS {
        if unstable - stable <= ACCURACY * unstable {
            break;
        }
        let mut middle = (stable * above - unstable * below) / (above - below);
        if !(middle > stable && middle < unstable) {
            middle = 0.5 * (stable + unstable);
        }
        let value = growth(middle);
        if value < 0.0 {
            (stable, below, above) = (middle, value, 0.5 * above);
        } else {
            (unstable, above, below) = (middle, value, 0.5 * below);
        }
        if value.abs() < ACCURACY * 1e-3 {
            stable = middle;
            break;
        }
    }
    let frequency = closed(stable).map_or(0.0, |a| dominant(&a).arg().abs() / open.period);
    Some(Crossing { value: stable, frequency })
}
