//! Realisation of responses as a linear model of few states.
//!
//! This is the algorithm of B. L. Ho and R. E. Kalman, "Effective construction of linear
//! state-variable models from input/output functions" (Regelungstechnik 14, 1966), in the form for
//! periodic systems, where the matrix of responses is factored before each step of the period (M.
//! Majji, J.-N. Juang and J. L. Junkins, "Time-varying eigensystem realization algorithm", Journal
//! of Guidance, Control, and Dynamics 33, 2010).

use crate::Matrix;
use crate::model::Step;

/// Responses to changes at one step: one matrix, outputs by inputs, for each lag.
pub(crate) type Lags = Vec<Matrix>;

/// Returns a model of each step of a period. `phases` are the responses to changes at each step.
/// Before a step, the changes of the last `memory` steps count. States that add less than
/// `tolerance` to the responses, relative to the largest, are left out.
pub(crate) fn realise(phases: &[Lags], memory: usize, tolerance: f64) -> Vec<Step> {
    let period = phases.len();
    let (outputs, inputs) = phases[0][0].shape();
    let future = phases[0].len() - memory;
    // Before step j, the future outputs are the products of an observability matrix with the
    // state, and the state that of a reachability matrix with the past inputs.
    let factors: Vec<(Matrix, Matrix)> = (0..period)
        .map(|j| {
            let mut hankel = Matrix::zeros(future * outputs, memory * inputs);
            for (ahead, ago) in (0..future).flat_map(|a| (1..=memory).map(move |b| (a, b))) {
                let phase = (j + memory * period - ago) % period;
                let place = (ahead * outputs, (ago - 1) * inputs);
                hankel.view_mut(place, (outputs, inputs)).copy_from(&phases[phase][ahead + ago]);
            }
            factor(hankel, tolerance)
        })
        .collect();
    (0..period)
        .map(|j| {
            let (observability, _) = &factors[j];
            let (next, reachability) = &factors[(j + 1) % period];
            let rows = (future - 1) * outputs;
            let later = observability.rows(outputs, rows).into_owned();
            let a = least_squares(next.rows(0, rows).into_owned(), &later);
            Step {
                a,
                b: reachability.columns(0, inputs).into_owned(),
                c: observability.rows(0, outputs).into_owned(),
                d: phases[j][0].clone(),
            }
        })
        .collect()
}

/// A QR decomposition M = Q R P with pivoting, with the columns of Q and rows of R whose pivot is
/// above `tolerance`, relative to the largest. R is not permuted back.
fn decomposed(
    matrix: Matrix,
    tolerance: f64,
) -> (Matrix, Matrix, nalgebra::PermutationSequence<nalgebra::Dyn>) {
    let decomposition = matrix.col_piv_qr();
    let (q, r) = (decomposition.q(), decomposition.r());
    let pivot = |place: usize| r[(place, place)].abs();
    let places = 0..r.nrows().min(r.ncols());
    let largest = places.clone().map(pivot).fold(0.0, f64::max);
    let rank = places.take_while(|place| pivot(*place) > tolerance * largest).count();
    let kept = (q.columns(0, rank).into_owned(), r.rows(0, rank).into_owned());
    (kept.0, kept.1, decomposition.p().clone())
}

/// Splits a matrix into an orthonormal factor and the rest.
fn factor(matrix: Matrix, tolerance: f64) -> (Matrix, Matrix) {
    let (q, mut r, permutation) = decomposed(matrix, tolerance);
    permutation.inv_permute_columns(&mut r);
    (q, r)
}

/// Returns the X with the smallest ‖M X − Y‖.
fn least_squares(m: Matrix, y: &Matrix) -> Matrix {
    let mut x = Matrix::zeros(m.ncols(), y.ncols());
    let (q, r, permutation) = decomposed(m, 1e-12);
    let rank = r.nrows();
    let right = q.transpose() * y;
    if let Some(solved) = r.columns(0, rank).solve_upper_triangular(&right) {
        x.rows_mut(0, rank).copy_from(&solved);
    }
    permutation.inv_permute_rows(&mut x);
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Responses of a periodic system to a change at each step.
    fn responses(steps: &[Step], count: usize) -> Vec<Lags> {
        let period = steps.len();
        let after = |first: usize| {
            let mut state = steps[first].b.clone();
            let mut lags = vec![steps[first].d.clone()];
            for lag in 1..count {
                let step = &steps[(first + lag) % period];
                lags.push(&step.c * &state);
                state = &step.a * state;
            }
            lags
        };
        (0..period).map(after).collect()
    }

    fn step(a: &[f64], b: &[f64], c: &[f64], d: f64) -> Step {
        Step {
            a: Matrix::from_row_slice(2, 2, a),
            b: Matrix::from_row_slice(2, 1, b),
            c: Matrix::from_row_slice(1, 2, c),
            d: Matrix::from_element(1, 1, d),
        }
    }

    #[test]
    fn oracle_an_integrator_with_a_delay_has_two_states_and_the_same_responses() {
        let system = [step(&[1.0, 0.3, 0.0, 0.0], &[0.0, 1.0], &[1.0, 0.0], 0.2)];
        let given = responses(&system, 16);
        let found = realise(&given, 8, 1e-9);
        assert_eq!(found[0].a.shape(), (2, 2));
        for (lag, (given, found)) in given[0].iter().zip(&responses(&found, 16)[0]).enumerate() {
            assert!((given - found).amax() < 1e-12, "{lag}: {given} {found}");
        }
    }

    #[test]
    fn oracle_a_sample_that_is_held_for_three_steps_is_a_periodic_system_of_one_state() {
        // x⁺ = u at the first step of three, else x; y = x⁺.
        let one = |value| Matrix::from_element(1, 1, value);
        let take = Step { a: one(0.0), b: one(2.0), c: one(0.0), d: one(2.0) };
        let hold = Step { a: one(1.0), b: one(0.0), c: one(1.0), d: one(0.0) };
        let given = responses(&[take, hold.clone(), hold], 12);
        let found = realise(&given, 6, 1e-9);
        // Before the first step nothing of the past counts.
        assert_eq!(
            found.iter().map(|step| step.a.shape()).collect::<Vec<_>>(),
            [(1, 0), (1, 1), (0, 1)]
        );
        for (given, found) in given.iter().zip(&responses(&found, 12)) {
            assert!(given.iter().zip(found).all(|(given, found)| (given - found).amax() < 1e-12));
        }
    }

    #[test]
    fn a_unit_without_memory_has_no_states() {
        let mut lags = vec![Matrix::zeros(2, 3); 8];
        lags[0] = Matrix::from_element(2, 3, 4.0);
        let found = realise(&[lags.clone()], 4, 1e-9);
        assert_eq!((found[0].a.shape(), &found[0].d), ((0, 0), &lags[0]));
    }
}
