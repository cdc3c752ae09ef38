//! Smaller models with the same responses.

use crate::Matrix;
use crate::model::Step;
use nalgebra::DVector as Vector;
use std::f64::consts::PI;

/// Combines communication points between which no opened signal changes, so that injected values
/// are held there too. Returns the number of samples that are left.
pub(crate) fn held(step: Step, ticks: usize, channels: usize) -> (Step, usize) {
    let Step { a, b, c, d } = step;
    let largest = c.amax().max(d.amax());
    let is_held = |group: usize| {
        let same = |matrix: &Matrix, tick: usize| {
            let first = tick / group * group;
            let [now, then] = [tick, first].map(|tick| matrix.rows(tick * channels, channels));
            (now - then).amax() <= 1e-9 * largest
        };
        ticks.is_multiple_of(group) && (0..ticks).all(|tick| same(&c, tick) && same(&d, tick))
    };
    let group = (1..=ticks).rev().find(|group| is_held(*group)).unwrap_or(1);
    let samples = ticks / group;
    let summed = |matrix: &Matrix| {
        let mut sums = Matrix::zeros(matrix.nrows(), samples * channels);
        for tick in 0..ticks {
            let mut columns = sums.columns_mut(tick / group * channels, channels);
            columns += matrix.columns(tick * channels, channels);
        }
        sums
    };
    let first_rows: Vec<usize> = (0..samples * channels)
        .map(|row| row / channels * group * channels + row % channels)
        .collect();
    let step = Step {
        b: summed(&b),
        c: c.select_rows(&first_rows),
        d: summed(&d).select_rows(&first_rows),
        a,
    };
    (step, samples)
}

/// Leaves out the states on which neither another state nor an output depends. Returns the places
/// of those that are left.
pub(crate) fn reduced(step: Step) -> (Step, Vec<usize>) {
    let mut step = step;
    let mut kept: Vec<usize> = (0..step.a.ncols()).collect();
    loop {
        let counts = |i: &usize| {
            let by_others = (0..step.a.nrows()).any(|row| row != *i && step.a[(row, *i)] != 0.0);
            by_others || step.c.column(*i).amax() > 0.0
        };
        let left: Vec<usize> = (0..step.a.ncols()).filter(counts).collect();
        if left.len() == step.a.ncols() {
            return (step, kept);
        }
        kept = left.iter().map(|place| kept[*place]).collect();
        step = Step {
            a: step.a.select_rows(&left).select_columns(&left),
            b: step.b.select_rows(&left),
            c: step.c.select_columns(&left),
            d: step.d,
        };
    }
}

/// Combines states that always change to the same value, such as the remembered values of a signal
/// that is held. All eigenvalues except zeros stay: where they are not zero, the components of
/// these states in an eigenvector are equal.
pub(crate) fn merged(mut a: Matrix) -> Matrix {
    loop {
        let n = a.nrows();
        let rows = a.transpose();
        // Rows begin with many zeros. A weighted sum tells most of them apart.
        let sums = &a * Vector::from_fn(n, |column, _| 1.0 / (column as f64 + PI));
        let is_same = |a: usize, b: usize| {
            sums[a] == sums[b] && rows.column(a).iter().eq(rows.column(b).iter())
        };
        let first = |row: usize| (0..row).find(|other| is_same(*other, row)).unwrap_or(row);
        let equal: Vec<usize> = (0..n).map(first).collect();
        let kept: Vec<usize> = (0..n).filter(|row| equal[*row] == *row).collect();
        if kept.len() == n {
            return a;
        }
        let mut sums = Matrix::zeros(n, n);
        for (column, into) in equal.iter().enumerate() {
            let mut sum = sums.column_mut(*into);
            sum += a.column(column);
        }
        a = sums.select_rows(&kept).select_columns(&kept);
    }
}
