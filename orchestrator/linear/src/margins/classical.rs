//! Gains, phase and delay at which the loop becomes unstable, by the eigenvalues of the closed
//! loop.

use crate::Matrix;
use crate::model::{OpenLoop, Step};
use crate::propagation::{Delay, Net};
use crate::spectrum::{dominant, is_stable, spectral_radius};
use nalgebra::{Complex, ComplexField, DMatrix};
use serde::Serialize;

/// Factor between the gains that are tried, and the largest one.
const FACTOR: f64 = 1.3;
const LARGEST_GAIN: f64 = 1e3;
/// Angle between the phases that are tried, deg.
const TURN: f64 = 6.0;
/// Most parts of a step between the delays that are tried, and the longest delay in steps.
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

/// Searches for one signal, or for all of them changed in the same way.
pub(super) fn classical(net: &Net, open: &OpenLoop, channel: Option<usize>) -> Classical {
    let count = open.channels();
    let gains = |gain: f64| -> Vec<f64> {
        (0..count).map(|i| if channel.is_none_or(|c| c == i) { gain } else { 1.0 }).collect()
    };
    let by_gain = |logarithm: f64| open.closed(&gains(logarithm.exp()));
    let by_phase = |lag: f64| {
        let turn = Complex::from_polar(1.0, -lag.to_radians());
        let turned = |i: usize| channel.is_none_or(|c| c == i);
        turned_loop(open, &|i| if turned(i) { turn } else { Complex::new(1.0, 0.0) })
    };
    let (step, takes_parts) = (net.receiving_step(channel), net.takes_parts(channel));
    let whole = |steps: f64| if takes_parts { steps } else { steps.floor() };
    let held = (open.sampling() / net.length).round() as u64;
    let by_delay =
        |steps: f64| Some(net.closed(Delay { channel, held, time: whole(steps) * step }));
    let gain = |direction: f64| {
        let last = LARGEST_GAIN.ln();
        let crossing = first(&|x| by_gain(direction * x), FACTOR.ln(), last, [0.0, open.period])?;
        Some(Crossing { value: (direction * crossing.value).exp(), ..crossing })
    };
    let phase = first(&by_phase, TURN, 180.0, [0.0, open.period]);
    // A delay turns the loop by its product with the frequency, which guides the search.
    let expected = phase
        .filter(|at| at.frequency > 0.0)
        .map_or(0.0, |at| at.value.to_radians() / (at.frequency * step));
    let trial = (expected / TRIALS).clamp(1.0 / PARTS, LONGEST_DELAY / TRIALS);
    let (trial, grain) = if takes_parts { (trial, 0.0) } else { (trial.ceil(), 1.0) };
    let delay = first(&by_delay, trial, LONGEST_DELAY, [grain, open.period]);
    Classical {
        gain_above: gain(1.0),
        gain_below: gain(-1.0),
        phase,
        delay: delay.map(|found| Crossing { value: whole(found.value) * step, ..found }),
        longest_delay: LONGEST_DELAY * step,
    }
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
/// `last`, to the `grain` in which it changes. A loop that cannot be closed counts as unstable.
fn first<T: ComplexField<RealField = f64>>(
    closed: &dyn Fn(f64) -> Option<DMatrix<T>>,
    step: f64,
    last: f64,
    [grain, period]: [f64; 2],
) -> Option<Crossing> {
    let is_stable_at = |x: f64| closed(x).is_some_and(|a| is_stable(&a));
    let mut stable = 0.0;
    let mut unstable = loop {
        let next = stable + step;
        if next > last {
            return None;
        }
        if !is_stable_at(next) {
            break next;
        }
        stable = next;
    };
    // Regula falsi (Illinois) on the logarithm of the largest magnitude, which is smooth there.
    let excess = |x: f64| closed(x).map_or(1.0, |a| spectral_radius(&a).ln());
    let (mut below, mut above) = (excess(stable), excess(unstable));
    for _ in 0..REFINEMENTS {
        if unstable - stable <= grain.max(ACCURACY * unstable) {
            break;
        }
        let mut middle = (stable * above - unstable * below) / (above - below);
        if !(middle > stable && middle < unstable) {
            middle = 0.5 * (stable + unstable);
        }
        let value = excess(middle);
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
    let frequency = closed(stable).map_or(0.0, |a| dominant(&a).arg().abs() / period);
    Some(Crossing { value: stable, frequency })
}
