//! Comparison of a component's derivatives with its responses, and its delay from them.

use crate::Matrix;
use crate::continuous::Continuous;
use crate::margins::structured::least;
use crate::model::Step;
use crate::realisation::least_squares;
use crate::responses::{Lags, Scales};

/// Difference between the derivatives of a component and its response to a step, relative to the
/// largest response of a variable, up to which they describe the component: soon after the step,
/// and over as many steps as an output may lag behind, in which the operating point moves.
pub(crate) const DESCRIBED: f64 = 0.02;
pub(crate) const AT_LENGTH: f64 = 0.2;
/// Number of responses from which a delay is found.
const FITTED: usize = 4;
/// Shortest delay within a step that differs from a change of the operating point, in steps.
const SMALLEST_PART: f64 = 1e-3;

/// Returns whether derivatives describe the responses of states and outputs to a change that is
/// held for one step.
pub(crate) fn describes(
    system: &Continuous,
    lags: &[Matrix],
    scales: &Scales,
    length: f64,
    accuracy: f64,
) -> bool {
    let states = system.a.nrows();
    let expected: Lags = system
        .responses(length, lags.len())
        .iter()
        .map(|[state, output]| {
            Matrix::from_fn(states + output.nrows(), output.ncols(), |row, column| {
                let value = match row.checked_sub(states) {
                    None => state[(row, column)],
                    Some(row) => output[(row, column)],
                };
                value * scales.inputs[column] / scales.outputs[row]
            })
        })
        .collect();
    let differences: Lags = expected.iter().zip(lags).map(|(a, b)| a - b).collect();
    (0..lags[0].nrows()).all(|row| {
        let largest =
            |lags: &[Matrix]| lags.iter().map(|matrix| matrix.row(row).amax()).fold(0.0, f64::max);
        largest(&differences) <= accuracy * largest(lags) + 1e-9
    })
}

/// Returns the largest difference between the responses of repeated steps and those that were
/// measured, relative to the largest response of a variable.
pub(crate) fn deviation(steps: &[Step], lags: &[Matrix]) -> f64 {
    let mut state = steps[0].b.clone();
    let mut differences = vec![&steps[0].d - &lags[0]];
    for (lag, measured) in lags.iter().enumerate().skip(1) {
        let step = &steps[lag % steps.len()];
        differences.push(&step.c * &state - measured);
        state = &step.a * state;
    }
    let largest =
        |lags: &[Matrix], row: usize| lags.iter().map(|m| m.row(row).amax()).fold(0.0, f64::max);
    (0..lags[0].nrows())
        .map(|row| largest(&differences, row) / largest(lags, row).max(1e-9))
        .fold(0.0, f64::max)
}

/// Gives a system the delay and the matrix B of its responses, and no D. While an input has not
/// acted yet, the component's own derivatives by it are zero. With a trial of the delay, the
/// responses are linear in B; the delay is the one with the least residual. Returns the whole steps
/// of it, too.
pub(crate) fn delayed(
    system: Continuous,
    lags: &Lags,
    scales: &Scales,
    length: f64,
) -> (Continuous, usize) {
    let states = system.a.nrows();
    let state = |matrix: &Matrix| {
        Matrix::from_fn(states, matrix.ncols(), |row, column| {
            matrix[(row, column)] * scales.outputs[row] / scales.inputs[column]
        })
    };
    let largest = lags.iter().map(|matrix| matrix.rows(0, states).amax()).fold(0.0, f64::max);
    let begins = |matrix: &Matrix| matrix.rows(0, states).amax() > 1e-6 * largest;
    let Some(whole) = lags.iter().position(begins) else { return (system, 0) };
    let measured: Vec<Matrix> =
        lags[whole..].iter().take(FITTED).map(|matrix| weighted(state(matrix), scales)).collect();
    let measured = stacked(&measured);
    // The response to an input that moves each state by itself.
    let (none, each) = (Matrix::zeros(0, states), Matrix::identity(states, states));
    let fit = |part: f64| {
        let trial = Continuous {
            a: system.a.clone(),
            b: each.clone(),
            c: none.clone(),
            d: none.clone(),
            delay: part * length,
        };
        let responses = trial.responses(length, FITTED.min(lags.len() - whole));
        let responses: Vec<Matrix> =
            responses.into_iter().map(|[state, _]| weighted(state, scales)).collect();
        let responses = stacked(&responses);
        let b = least_squares(responses.clone(), &measured);
        let rest = (responses * &b - &measured).norm();
        (b, rest)
    };
    let (middle, _) = least(&mut |x| fit(0.5 + x).1, 0.5);
    let part = 0.5 + middle;
    // A change of the operating point over a step is no delay.
    let counts = (SMALLEST_PART..=1.0 - SMALLEST_PART).contains(&part);
    let part = if counts { part } else { part.round() };
    let d = Matrix::zeros(system.c.nrows(), lags[0].ncols());
    let delay = (whole as f64 + part) * length;
    (Continuous { b: fit(part).0, d, delay, ..system }, whole)
}

/// Divides the states by their typical magnitudes.
fn weighted(mut matrix: Matrix, scales: &Scales) -> Matrix {
    for row in 0..matrix.nrows() {
        matrix.row_mut(row).unscale_mut(scales.outputs[row]);
    }
    matrix
}

fn stacked(matrices: &[Matrix]) -> Matrix {
    let rows = matrices[0].nrows();
    let mut all = Matrix::zeros(rows * matrices.len(), matrices[0].ncols());
    for (place, matrix) in matrices.iter().enumerate() {
        all.rows_mut(place * rows, rows).copy_from(matrix);
    }
    all
}

/// Leaves out the states that neither an input nor another state moves, or that move nothing.
pub(crate) fn reduced(system: Continuous, states: &[usize]) -> (Continuous, Vec<usize>) {
    let Continuous { a, b, c, d, delay } = system;
    let reach = |start: &dyn Fn(usize) -> bool, leads: &dyn Fn(usize, usize) -> bool| {
        let mut reached: Vec<bool> = (0..states.len()).map(start).collect();
        for _ in 0..states.len() {
            for to in 0..states.len() {
                reached[to] |= (0..states.len()).any(|from| reached[from] && leads(from, to));
            }
        }
        reached
    };
    let moved = reach(&|i| b.row(i).amax() > 0.0, &|from, to| a[(to, from)] != 0.0);
    let seen = reach(&|i| c.column(i).amax() > 0.0, &|from, to| a[(from, to)] != 0.0);
    let kept: Vec<usize> = (0..states.len()).filter(|i| moved[*i] && seen[*i]).collect();
    let system = Continuous {
        a: a.select_rows(&kept).select_columns(&kept),
        b: b.select_rows(&kept),
        c: c.select_columns(&kept),
        d,
        delay,
    };
    (system, kept)
}
