//! Integration of stiff and other ordinary differential equations by Radau IIA of order 5.
//!
//! Method, estimate of the error, Newton's iteration and choice of the step: E. Hairer, G. Wanner,
//! Solving Ordinary Differential Equations II, 2nd edition, section IV.8, and their code RADAU5.
//! Powers are taken from `libm`, because those of the system differ in their last bits.

use super::model::Refusal;
use fmi_master::instance::CallFailure;
use fmi_master::quantity::rounded;
use nalgebra::{Complex, DMatrix, DVector, Dyn, LU};

/// A system of ordinary differential equations.
pub(super) trait System {
    /// Name of the call that computes the derivatives, in failures.
    const CALL: &'static str;
    /// Computes the derivatives by time, at a time (s) and for these states.
    fn derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<(), Refusal>;
    /// Computes the Jacobian matrix of the derivatives by the states.
    fn jacobian(&mut self, at: &Point, jacobian: &mut DMatrix<f64>) -> Result<(), Refusal>;
}

/// States at a time (s), with their derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Point {
    pub(super) time: f64,
    pub(super) states: Vec<f64>,
    pub(super) derivatives: Vec<f64>,
}

/// A step, with the polynomial of the states within it.
pub(super) struct Step {
    pub(super) end: Point,
    length: f64,
    coefficients: [DVector<f64>; 3],
}

impl Step {
    /// A step without states.
    pub(super) fn empty(time: f64) -> Self {
        let end = Point { time, ..Point::default() };
        Self { end, length: 0.0, coefficients: Stages::default() }
    }

    /// Returns the times (s) of the stages of a step that begins at this time (s).
    pub(super) fn nodes(&self, begin: f64) -> [f64; 3] {
        [
            begin + C[0] * (self.end.time - begin),
            begin + C[1] * (self.end.time - begin),
            self.end.time,
        ]
    }

    /// Interpolates the states at a time (s) within the step.
    pub(super) fn states(&self, time: f64, states: &mut [f64]) {
        let s = (time - self.end.time) / self.length;
        let [first, second, third] = &self.coefficients;
        for (i, state) in states.iter_mut().enumerate() {
            let inner = second[i] + (s - (C[0] - 1.0)) * third[i];
            *state = self.end.states[i] + s * (first[i] + (s - (C[1] - 1.0)) * inner);
        }
    }
}

/// Values of the three stages.
type Stages = [DVector<f64>; 3];

/// Decompositions of the two matrices of Newton's iteration, for a length of the step.
#[derive(Clone)]
struct Matrices {
    length: f64,
    real: LU<f64, Dyn, Dyn>,
    complex: LU<Complex<f64>, Dyn, Dyn>,
}

/// The integrator with what it remembers from step to step.
#[derive(Clone)]
pub(super) struct Radau {
    /// Relative tolerance of the error estimate, which is of a lower order than the method.
    tolerance: f64,
    /// Typical magnitudes of the states.
    pub(super) nominals: Vec<f64>,
    /// Length of the next step, s.
    next: f64,
    jacobian: Option<DMatrix<f64>>,
    matrices: Option<Matrices>,
    /// Factor by which the last correction of Newton's iteration bounds the next ones.
    remainder: f64,
    /// Length and error of the last step.
    last: Option<(f64, f64)>,
}

/// Length of the next step, s, and length and error of the last one.
pub(super) type Pace = (f64, Option<(f64, f64)>);

/// Outcome of a trial step.
enum Trial {
    /// The step, with the length of the next one.
    Accepted(Step, f64),
    /// The step has to be tried again, its length multiplied by this factor.
    Rejected(f64),
}

/// Outcome of Newton's iteration.
enum Newton {
    /// The changes of the states at the stages, the number of iterations, and their rate.
    Solved(Stages, i32, f64),
    /// The iteration is too slow for this length; a shorter step has this factor.
    Slow(f64),
}

impl Radau {
    /// Makes an integrator with this relative tolerance.
    pub(super) fn new(tolerance: f64) -> Self {
        Self {
            tolerance: 0.1 * libm::pow(tolerance, 2.0 / 3.0),
            nominals: Vec::new(),
            next: f64::INFINITY,
            jacobian: None,
            matrices: None,
            remainder: 1.0,
            last: None,
        }
    }

    /// Takes into account that an event has changed the equations.
    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    /// Returns what the length of the next step depends on.
    pub(super) fn pace(&self) -> Pace {
        (self.next, self.last)
    }

    /// Goes back to an earlier pace.
    pub(super) fn set_pace(&mut self, pace: Pace) {
        (self.next, self.last) = pace;
    }

    /// Makes one step, which ends at the time `end` (s) or before it.
    pub(super) fn step<S: System>(
        &mut self,
        system: &mut S,
        from: &Point,
        end: f64,
    ) -> Result<Step, CallFailure> {
        let span = end - from.time;
        // One last step that is a little longer is better than two.
        let mut length = if self.next > 0.99 * span { span } else { self.next };
        let shortest = 16.0 * f64::EPSILON * from.time.abs().max(end.abs());
        let mut is_retried = false;
        let mut discarded = None;
        loop {
            let at = if length == span { end } else { from.time + length };
            let factor = match self.trial(system, from, at, is_retried) {
                Ok(Trial::Accepted(step, next)) => {
                    // A span that shortens a step says nothing about the next one.
                    let is_cut = length == span && !is_retried && self.next.is_finite();
                    self.next = if is_cut { next.max(self.next) } else { next };
                    return Ok(step);
                }
                Ok(Trial::Rejected(factor)) => factor,
                Err(Refusal::Discarded(failure)) => {
                    discarded = Some(failure);
                    0.25
                }
                Err(Refusal::Failed(failure)) => return Err(failure),
            };
            is_retried |= factor < 1.0;
            length *= factor;
            if length.is_nan() || length <= shortest {
                return Err(discarded.unwrap_or_else(|| {
                    let time = rounded(from.time);
                    let text = format!("the integration needs steps below {shortest:.0e} s at t = {time} s: the derivatives are not finite, or jump without an event");
                    CallFailure::new(S::CALL, text)
                }));
            }
        }
    }

    /// Tries a step to the time `at`.
    fn trial(
        &mut self,
        system: &mut impl System,
        from: &Point,
        at: f64,
        is_retried: bool,
    ) -> Result<Trial, Refusal> {
        let (count, length) = (from.states.len(), at - from.time);
        let is_fresh = self.jacobian.is_none();
        if is_fresh {
            let mut jacobian = DMatrix::zeros(count, count);
            system.jacobian(from, &mut jacobian)?;
            (self.jacobian, self.matrices, self.remainder) = (Some(jacobian), None, 1.0);
        }
        self.decompose(length);
        let magnitudes = from.states.iter().zip(&self.nominals);
        let scale = magnitudes.map(|(state, nominal)| self.tolerance * (nominal + state.abs()));
        let scale = DVector::from_iterator(count, scale);
        let (z, iterations, rate) = match self.newton(system, from, length, &scale)? {
            Newton::Solved(z, iterations, rate) => (z, iterations, rate),
            Newton::Slow(factor) if is_fresh => return Ok(Trial::Rejected(factor)),
            Newton::Slow(_) => {
                self.jacobian = None;
                return Ok(Trial::Rejected(1.0));
            }
        };

        let sum = (&z[0] * E[0] + &z[1] * E[1] + &z[2] * E[2]) / length;
        let mut error = &sum + DVector::from_column_slice(&from.derivatives);
        self.solve(&mut error);
        let mut size = mean(&error, &scale);
        if size >= 1.0 && (self.last.is_none() || is_retried) {
            let mut filtered = vec![0.0; count];
            let shifted: Vec<f64> =
                from.states.iter().zip(error.iter()).map(|(y, e)| y + e).collect();
            system.derivatives(from.time, &shifted, &mut filtered)?;
            error = sum + DVector::from_vec(filtered);
            self.solve(&mut error);
            size = mean(&error, &scale);
        }
        if !size.is_finite() {
            return Ok(Trial::Rejected(0.5));
        }
        let size = size.max(1e-10);
        let effort = f64::from(1 + 2 * ITERATIONS) / f64::from(iterations + 2 * ITERATIONS);
        let safety = 0.9 * effort.min(1.0);
        let quotient =
            |error: f64, safety: f64| (libm::pow(error, 0.25) / safety).clamp(0.125, 5.0);
        let mut shrink = quotient(size, safety);
        if size >= 1.0 {
            let is_first = self.last.is_none() && !is_retried;
            return Ok(Trial::Rejected(if is_first { 0.1 } else { 1.0 / shrink }));
        }
        // Gustafsson's predictive controller
        if let Some((last_length, last_error)) = self.last {
            let predicted = last_length / length * quotient(size * size / last_error, 0.9);
            shrink = shrink.max(predicted.clamp(0.125, 5.0));
        }
        if is_retried {
            shrink = shrink.max(1.0);
        }

        let states = from.states.iter().zip(z[2].iter()).map(|(y, z)| y + z).collect();
        let mut end = Point { time: at, states, derivatives: vec![0.0; count] };
        system.derivatives(at, &end.states, &mut end.derivatives)?;
        self.last = Some((length, size.max(1e-2)));
        if rate > GOOD_RATE {
            self.jacobian = None;
        }
        Ok(Trial::Accepted(Step { end, length, coefficients: polynomial(&z) }, length / shrink))
    }

    /// Decomposes the matrices of Newton's iteration for a length, unless they are at hand.
    fn decompose(&mut self, length: f64) {
        let is_at_hand = |m: &Matrices| (m.length - length).abs() <= 1e-9 * length;
        let Some(jacobian) = &self.jacobian else { return };
        if self.matrices.as_ref().is_some_and(is_at_hand) {
            return;
        }
        let count = jacobian.nrows();
        let real = DMatrix::from_diagonal_element(count, count, GAMMA / length) - jacobian;
        let shift = Complex::new(ALPHA, BETA) / length;
        let mut complex = jacobian.map(|element| Complex::new(-element, 0.0));
        for i in 0..count {
            complex[(i, i)] += shift;
        }
        self.matrices = Some(Matrices { length, real: real.lu(), complex: complex.lu() });
    }

    /// Solves the real system. A singular matrix gives a vector that is not finite.
    fn solve(&self, vector: &mut DVector<f64>) {
        if !self.matrices.as_ref().is_some_and(|matrices| matrices.real.solve_mut(vector)) {
            vector.fill(f64::NAN);
        }
    }

    /// Solves the equations of the three stages.
    fn newton(
        &mut self,
        system: &mut impl System,
        from: &Point,
        length: f64,
        scale: &DVector<f64>,
    ) -> Result<Newton, Refusal> {
        let count = from.states.len();
        let zero = || DVector::zeros(count);
        let mut z: Stages = [zero(), zero(), zero()];
        let (mut w, mut slopes) = (z.clone(), z.clone());
        let mut at = vec![0.0; count];
        let wanted = (10.0 * f64::EPSILON / self.tolerance).max(self.tolerance.sqrt().min(0.03));
        let mut remainder = libm::pow(self.remainder.max(f64::EPSILON), 0.8);
        let (mut rate, mut last_size, mut last_ratio) = (0.0, 0.0, 0.0);
        for iteration in 1..=ITERATIONS {
            for (stage, slope) in slopes.iter_mut().enumerate() {
                for (at, (y, z)) in at.iter_mut().zip(from.states.iter().zip(z[stage].iter())) {
                    *at = y + z;
                }
                system.derivatives(from.time + C[stage] * length, &at, slope.as_mut_slice())?;
            }
            let mut change = combined(&T_INVERSE, &slopes);
            change[0] -= &w[0] * (GAMMA / length);
            change[1] -= (&w[1] * ALPHA - &w[2] * BETA) / length;
            change[2] -= (&w[2] * ALPHA + &w[1] * BETA) / length;
            self.solve(&mut change[0]);
            let mut pair = change[1].zip_map(&change[2], Complex::new);
            if !self.matrices.as_ref().is_some_and(|m| m.complex.solve_mut(&mut pair)) {
                return Ok(Newton::Slow(0.5));
            }
            (change[1], change[2]) = (pair.map(|value| value.re), pair.map(|value| value.im));
            let means = [0, 1, 2].map(|stage| mean(&change[stage], scale));
            let size = (means.iter().map(|mean| mean * mean).sum::<f64>() / 3.0).sqrt();
            if !size.is_finite() {
                return Ok(Newton::Slow(0.5));
            }
            if iteration > 1 {
                let ratio: f64 = size / last_size;
                rate = if iteration == 2 { ratio } else { (ratio * last_ratio).sqrt() };
                last_ratio = ratio;
                if rate >= 0.99 {
                    return Ok(Newton::Slow(0.5));
                }
                remainder = rate / (1.0 - rate);
                let left = ITERATIONS - 1 - iteration;
                let expected = remainder * size * libm::pow(rate, f64::from(left)) / wanted;
                if expected >= 1.0 {
                    let excess = expected.clamp(1e-4, 20.0);
                    return Ok(Newton::Slow(0.8 * libm::pow(excess, -1.0 / f64::from(4 + left))));
                }
            }
            last_size = size.max(f64::EPSILON);
            for (w, change) in w.iter_mut().zip(&change) {
                *w += change;
            }
            z = combined(&T, &w);
            if remainder * size <= wanted {
                self.remainder = remainder;
                return Ok(Newton::Solved(z, iteration, rate));
            }
        }
        Ok(Newton::Slow(0.5))
    }
}

/// Returns the root of the mean of the squares, each value measured by its scale.
fn mean(values: &DVector<f64>, scale: &DVector<f64>) -> f64 {
    let sum: f64 = values.iter().zip(scale.iter()).map(|(v, s)| (v / s) * (v / s)).sum();
    (sum / values.len() as f64).sqrt()
}

/// Multiplies a matrix by the vector of the stages.
fn combined(matrix: &[[f64; 3]; 3], stages: &Stages) -> Stages {
    let [first, second, third] = stages;
    matrix.map(|row| first * row[0] + second * row[1] + third * row[2])
}

/// Returns the coefficients of the polynomial through the stages, in Newton's form.
fn polynomial(z: &Stages) -> Stages {
    let first = (&z[1] - &z[2]) / (C[1] - 1.0);
    let slope = (&z[0] - &z[1]) / (C[0] - C[1]);
    let before = (&slope - &z[0] / C[0]) / C[1];
    let second = (slope - &first) / (C[0] - 1.0);
    let third = &second - before;
    [first, second, third]
}

/// Largest number of iterations of a Newton's iteration.
const ITERATIONS: i32 = 7;
/// Rate of Newton's iteration up to which the Jacobian matrix is kept for the next step.
const GOOD_RATE: f64 = 0.01;

// Coefficients of the method, (IV.5.9), and the transformation of its matrix, (IV.8.8)
const C: [f64; 3] = [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0];
const GAMMA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752_3;
const BETA: f64 = 3.050_430_199_247_410_5;
const T: [[f64; 3]; 3] = [
    [9.123_239_487_089_295e-2, -1.412_552_950_209_542e-1, -3.002_919_410_514_742_4e-2],
    [2.417_179_327_071_07e-1, 2.041_293_522_937_999_4e-1, 3.829_421_127_572_619e-1],
    [9.660_481_826_150_93e-1, 1.0, 0.0],
];
const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 3.391_992_518_158_098_4e-1, 5.417_705_399_358_749e-1],
    [-4.178_718_591_551_905, -3.276_828_207_610_623_7e-1, 4.766_235_545_005_504_4e-1],
    [-5.028_726_349_457_868e-1, 2.571_926_949_855_605, -5.960_392_048_282_249e-1],
];
/// Weights of the stages in the estimate of the error, (IV.8.19)
const E: [f64; 3] = [-10.048_809_399_827_416, 1.382_142_733_160_749, -1.0 / 3.0];

#[cfg(test)]
mod tests;
