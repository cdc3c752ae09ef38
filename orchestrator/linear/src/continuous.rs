//! Components with continuous states: derivatives at an instant, and the exact step under held
//! inputs.

use crate::Matrix;
use crate::model::Step;
use fmi_master::instance::{CallFailure, Instance};

/// A continuous linear system: ẋ = A x + B u, y = C x + D u.
#[derive(Clone, Debug, PartialEq)]
pub struct Continuous {
    /// Matrix A, 1/s.
    pub a: Matrix,
    /// Matrix B, derivatives by inputs.
    pub b: Matrix,
    /// Matrix C, outputs by states.
    pub c: Matrix,
    /// Matrix D, outputs by inputs.
    pub d: Matrix,
    /// Time after which an input acts, s.
    pub delay: f64,
}

/// A delay, in steps of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    /// Whole steps.
    pub whole: usize,
    /// Part of a further step.
    pub part: f64,
}

impl Steps {
    /// Converts a time; both in s.
    pub fn of(time: f64, step: f64) -> Self {
        let steps = time / step;
        // A whole multiple may be inexact by rounding.
        let whole = (steps + 1e-9).floor();
        let part = steps - whole;
        Self { whole: whole as usize, part: if part < 1e-9 { 0.0 } else { part } }
    }

    /// Returns the number of earlier steps whose inputs act in a step.
    pub fn remembered(self) -> usize {
        self.whole + usize::from(self.part > 0.0)
    }
}

/// Value references of a component's states, their derivatives, inputs and outputs.
pub struct References<'a> {
    /// States.
    pub states: &'a [u32],
    /// Derivatives of the states, in their order.
    pub derivatives: &'a [u32],
    /// Inputs.
    pub inputs: &'a [u32],
    /// Outputs.
    pub outputs: &'a [u32],
}

impl Continuous {
    /// Asks an instance for its partial derivatives at its present state.
    ///
    /// # Errors
    /// Returns an error if the instance has no derivatives.
    pub fn of(instance: &mut dyn Instance, references: &References) -> Result<Self, CallFailure> {
        let References { states, derivatives, inputs, outputs } = references;
        let mut partial = |unknown: &[u32], known: &[u32]| {
            let mut matrix = Matrix::zeros(unknown.len(), known.len());
            for (column, reference) in known.iter().enumerate() {
                let added = &mut matrix.as_mut_slice()[column * unknown.len()..][..unknown.len()];
                if !unknown.is_empty() {
                    instance.directional_derivative(unknown, &[*reference], &[1.0], added)?;
                }
            }
            Ok(matrix)
        };
        Ok(Self {
            a: partial(derivatives, states)?,
            b: partial(derivatives, inputs)?,
            c: partial(outputs, states)?,
            d: partial(outputs, inputs)?,
            delay: 0.0,
        })
    }

    /// Returns the responses of states and outputs to inputs of 1 over one step of this length (s),
    /// after each of `count` steps.
    pub fn responses(&self, length: f64, count: usize) -> Vec<[Matrix; 2]> {
        let Steps { whole, part } = Steps::of(self.delay, length);
        let [first, rest] = [part, 1.0 - part].map(|part| self.step(part * length));
        let mut state = Matrix::zeros(self.a.nrows(), self.b.ncols());
        let one = Matrix::identity(self.b.ncols(), self.b.ncols());
        let none = &one * 0.0;
        (0..count)
            .map(|lag| {
                let at = |age: usize| if lag == age { &one } else { &none };
                let (older, newer) = (at(whole + 1), at(whole));
                state = &first.a * &state + &first.b * older;
                let output = &rest.c * &state + &rest.d * newer;
                state = &rest.a * &state + &rest.b * newer;
                [state.clone(), output]
            })
            .collect()
    }

    /// Returns the step of this length (s) under inputs that act at once and are held, after which
    /// the outputs are read: x⁺ = e^{Ah} x + ∫e^{As}ds B u, y = C x⁺ + D u.
    pub fn step(&self, length: f64) -> Step {
        let (n, m) = (self.a.nrows(), self.b.ncols());
        let mut both = Matrix::zeros(n + m, n + m);
        both.view_mut((0, 0), (n, n)).copy_from(&(&self.a * length));
        both.view_mut((0, n), (n, m)).copy_from(&(&self.b * length));
        let both = both.exp();
        let a = both.view((0, 0), (n, n)).into_owned();
        let b = both.view((0, n), (n, m)).into_owned();
        Step { c: &self.c * &a, d: &self.c * &b + &self.d, a, b }
    }
}
