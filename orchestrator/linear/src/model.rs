//! Discrete models in state-space form.

use crate::Matrix;
use serde::Serialize;

/// One step of a linear system: x⁺ = A x + B u, y = C x + D u.
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Signal {
    /// Name of the variable, `component.variable`.
    pub name: String,
    /// Unit of the variable, or an empty text.
    pub unit: String,
    /// Typical magnitude of the variable, by which signals of different units are compared.
    #[serde(skip)]
    pub size: f64,
}

/// The open loop over one common period of its components: from the values injected at the opened
/// signals to those that arrive there. The loop is closed by injecting the arriving values: the
/// feedback is positive, and the return ratio is the negative of this system.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenLoop {
    /// Step of one period. Its inputs and outputs are all signals at the first sample of the
    /// period, then all at the second, and so on.
    pub step: Step,
    /// Length of the period, s.
    pub period: f64,
    /// Number of samples in a period at which the opened signals may change.
    pub samples: usize,
    /// The opened signals.
    pub signals: Vec<Signal>,
    /// Names of the states.
    pub states: Vec<String>,
}

impl OpenLoop {
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
}
