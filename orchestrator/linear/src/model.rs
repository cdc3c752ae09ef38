//! Discrete models in state-space form.

use crate::Matrix;
use serde::{Deserialize, Serialize};

/// One step of a linear system: x⁺ = A x + B u, y = C x + D u.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Matrix A, states after by states before.
    pub a: Matrix,
    /// Matrix B, states after by inputs.
    pub b: Matrix,
    /// Matrix C, outputs by states before.
    pub c: Matrix,
    /// Matrix D, outputs by inputs.
    pub d: Matrix,
}

/// A signal at which the loop is opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// Name of the variable, `component.variable`.
    pub name: String,
    /// Unit of the variable, or an empty text.
    pub unit: String,
    /// Typical magnitude of the variable, by which signals of different units are compared.
    #[serde(rename = "nominal")]
    pub size: f64,
}

/// The open loop over one common period of its components: from the values injected at the opened
/// signals to those that arrive there. The loop is closed by injecting the arriving values: the
/// feedback is positive, and the return ratio is the negative of this system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OpenLoop {
    /// Step of one period. Its inputs and outputs are all signals at the first sample of the
    /// period, then all at the second, and so on.
    pub step: Step,
    /// Matrices B and D for changes in parts of a sample, between which a delay ends: for each
    /// sample all signals in its first part, then all in its second, and so on.
    parts: [Matrix; 2],
    /// Length of the period, s.
    pub period: f64,
    /// Number of samples in a period at which the opened signals may change.
    pub samples: usize,
    /// The opened signals.
    pub signals: Vec<Signal>,
    /// Rate of the slowest motion that the model distinguishes from none, 1/s.
    pub slowest: f64,
}

impl OpenLoop {
    /// Makes the open loop of the steps at each sample of a period. Their outputs are the signals in
    /// their typical magnitudes, their inputs these in each part of the sample.
    pub(crate) fn new(steps: &[Step], signals: &[Signal], sampling: f64, slowest: f64) -> Self {
        let Step { a, mut b, mut c, mut d } = lifted(steps);
        let size = |place: usize| signals[place % signals.len()].size;
        for place in 0..d.ncols() {
            b.column_mut(place).unscale_mut(size(place));
            d.column_mut(place).unscale_mut(size(place));
        }
        for place in 0..d.nrows() {
            c.row_mut(place).scale_mut(size(place));
            d.row_mut(place).scale_mut(size(place));
        }
        let samples = steps.len();
        let inputs = d.ncols() / samples;
        let whole = |parts: &Matrix| {
            let mut whole = Matrix::zeros(parts.nrows(), d.nrows());
            for (place, part) in parts.column_iter().enumerate() {
                let signal = place / inputs * signals.len() + place % signals.len();
                let mut column = whole.column_mut(signal);
                column += part;
            }
            whole
        };
        let step = Step { a, b: whole(&b), c, d: whole(&d) };
        let (parts, period, signals) = ([b, d], sampling * samples as f64, signals.to_vec());
        Self { step, parts, period, samples, signals, slowest }
    }

    /// Returns the number of opened signals.
    pub fn channels(&self) -> usize {
        self.signals.len()
    }

    /// Returns the time between two samples, s.
    pub fn sampling(&self) -> f64 {
        self.period / self.samples as f64
    }

    /// Returns the matrix A of the loop that is closed with these gains at all opened signals, 1
    /// for the loop as it is; `None` if there is no such loop, because it would be algebraic.
    pub fn closed(&self, gains: &[f64]) -> Option<Matrix> {
        let Step { a, b, c, d } = &self.step;
        let k = Matrix::from_diagonal(&nalgebra::DVector::from_fn(d.nrows(), |row, _| {
            gains[row % gains.len()]
        }));
        let loops = Matrix::identity(d.nrows(), d.nrows()) - &k * d;
        Some(a + b * loops.try_inverse()? * k * c)
    }

    /// Returns the matrix A of the closed loop in which some signals, given by their indices,
    /// arrive later by a number of samples; `None` if it would be algebraic. A delay that ends
    /// within a part of a sample is interpolated between the ends of this part.
    pub fn delayed(&self, late: &[usize], samples: f64) -> Option<Matrix> {
        let ([b, d], Step { a, c, .. }) = (&self.parts, &self.step);
        let (channels, rows, states) = (self.channels(), c.nrows(), a.nrows());
        let parts = d.ncols() / rows;
        // What is received, by what arrives in this period and by what arrived late in the samples
        // before it, the latest ones last.
        let delay = samples * parts as f64;
        let whole = delay.ceil() as usize;
        let newer = whole as f64 - delay;
        let before = whole.div_ceil(parts);
        let past = before * late.len();
        let (mut now, mut then) = (Matrix::zeros(d.ncols(), rows), Matrix::zeros(d.ncols(), past));
        for row in 0..d.ncols() {
            let (part, channel) = (row / channels, row % channels);
            let Some(place) = late.iter().position(|late| *late == channel) else {
                now[(row, part / parts * channels + channel)] = 1.0;
                continue;
            };
            for (age, share) in [(whole, 1.0 - newer), (whole.saturating_sub(1), newer)] {
                if let Some(part) = part.checked_sub(age) {
                    now[(row, part / parts * channels + channel)] += share;
                } else {
                    let sample = before - (age - part).div_ceil(parts);
                    then[(row, sample * late.len() + place)] += share;
                }
            }
        }
        let inverse = (Matrix::identity(rows, rows) - d * &now).try_inverse()?;
        let (arriving, arriving_past) = (&inverse * c, inverse * (d * &then));
        let mut all = Matrix::zeros(states + past, states + past);
        all.view_mut((0, 0), (states, states)).copy_from(&(a + b * (&now * &arriving)));
        let received_past = now * &arriving_past + then;
        all.view_mut((0, states), (states, past)).copy_from(&(b * received_past));
        for place in 0..past {
            let (sample, channel) = (place / late.len(), late[place % late.len()]);
            let mut row = all.row_mut(states + place);
            if let Some(sample) = (sample + self.samples).checked_sub(before) {
                let arrives = sample * channels + channel;
                row.columns_mut(0, states).copy_from(&arriving.row(arrives));
                row.columns_mut(states, past).copy_from(&arriving_past.row(arrives));
            } else {
                row[states + place + self.samples * late.len()] = 1.0;
            }
        }
        Some(all)
    }
}

/// Makes one step of those of a period: its inputs and outputs are those of the first, then those
/// of the second, and so on.
fn lifted(steps: &[Step]) -> Step {
    let ((outputs, inputs), states) = (steps[0].d.shape(), steps[0].a.ncols());
    let count = steps.len();
    let mut all = Step {
        a: Matrix::identity(states, states),
        b: Matrix::zeros(states, count * inputs),
        c: Matrix::zeros(count * outputs, states),
        d: Matrix::zeros(count * outputs, count * inputs),
    };
    for (place, Step { a, b, c, d }) in steps.iter().enumerate() {
        all.c.rows_mut(place * outputs, outputs).copy_from(&(c * &all.a));
        all.d.rows_mut(place * outputs, outputs).copy_from(&(c * &all.b));
        all.d.view_mut((place * outputs, place * inputs), (outputs, inputs)).copy_from(d);
        (all.a, all.b) = (a * &all.a, a * &all.b);
        all.b.columns_mut(place * inputs, inputs).copy_from(b);
    }
    all
}
