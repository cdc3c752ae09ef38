//! The structured singular value for independent complex numbers: the inverse of the size of the
//! smallest diagonal Δ for which I − M Δ is singular.
//!
//! J. Doyle, "Analysis of feedback systems with structured uncertainties", IEE Proceedings D 129
//! (1982). The upper bound by σ̄(D M D⁻¹) for any diagonal D > 0 is convex in log D, and its least
//! value is exact for up to three numbers. For more of them a balancing D is taken. A margin that
//! follows from an upper bound is a safe one.

use nalgebra::{Complex, ComplexField, DMatrix, Matrix2, Matrix3};

/// A complex matrix.
pub(crate) type ComplexMatrix = DMatrix<Complex<f64>>;

/// Range of log D around the balanced matrix.
const RANGE: f64 = 3.0;
/// Factor on a row whose column has no other entry.
const SMALL: f64 = 1e-10;

/// Returns the largest singular value of a matrix.
pub(crate) fn largest_singular_value(matrix: &ComplexMatrix) -> f64 {
    let n = matrix.nrows();
    match n {
        0 => 0.0,
        1 => matrix[(0, 0)].norm(),
        2 | 3 => scaled_singular_value(matrix, [1.0; 3]),
        _ => (matrix.adjoint() * matrix).symmetric_eigenvalues().max().max(0.0).sqrt(),
    }
}

/// Returns the largest singular value of D M D⁻¹ for two or three numbers. Nothing is allocated,
/// since this takes most of the time of a disk margin.
fn scaled_singular_value(matrix: &ComplexMatrix, d: [f64; 3]) -> f64 {
    let scaled = |i: usize, j: usize| matrix[(i, j)] * (d[i] / d[j]);
    let largest = if matrix.nrows() == 2 {
        let scaled = Matrix2::from_fn(scaled);
        (scaled.adjoint() * scaled).symmetric_eigenvalues().max()
    } else {
        let scaled = Matrix3::from_fn(scaled);
        (scaled.adjoint() * scaled).symmetric_eigenvalues().max()
    };
    largest.max(0.0).sqrt()
}

/// Scales a matrix to D M D⁻¹ in which each row is as large as its column (E. E. Osborne, Journal
/// of the ACM 7, 1960). Its largest singular value is an upper bound, and often a close one.
pub(crate) fn balanced<T: ComplexField<RealField = f64>>(mut matrix: DMatrix<T>) -> DMatrix<T> {
    let n = matrix.nrows();
    for _ in 0..10 {
        for i in 0..n {
            let others =
                |of: &dyn Fn(usize) -> f64| -> f64 { (0..n).filter(|j| *j != i).map(of).sum() };
            let row = others(&|j| matrix[(i, j)].clone().modulus_squared());
            let column = others(&|j| matrix[(j, i)].clone().modulus_squared());
            if row > 0.0 && column > 0.0 {
                scale(&mut matrix, i, (column / row).powf(0.25));
            } else if row > 0.0 || column > 0.0 {
                // Rows and columns without a counterpart can be scaled arbitrarily small.
                scale(&mut matrix, i, if row > 0.0 { SMALL } else { 1.0 / SMALL });
            }
        }
    }
    matrix
}

fn scale<T: ComplexField<RealField = f64>>(matrix: &mut DMatrix<T>, i: usize, factor: f64) {
    matrix.row_mut(i).scale_mut(factor);
    matrix.column_mut(i).scale_mut(1.0 / factor);
}

/// Returns an upper bound of the structured singular value: the least σ̄(D M D⁻¹) for up to three
/// numbers, and that of the balanced matrix for more.
pub(crate) fn upper_bound(matrix: &ComplexMatrix) -> f64 {
    let matrix = balanced(matrix.clone());
    // One number of D is free; all others follow one inside the other.
    let with = |x: f64, y: f64| scaled_singular_value(&matrix, [1.0, x.exp(), y.exp()]);
    match matrix.nrows() {
        2 => least(&mut |x| with(x, 0.0), RANGE).1,
        3 => least(&mut |x| least(&mut |y| with(x, y), RANGE).1, RANGE).1,
        _ => largest_singular_value(&matrix),
    }
}

/// Finds the least value of a function with one minimum between −`range` and `range`, by parabolas
/// through the best three points, or golden sections where they do not get nearer: R. Brent,
/// "Algorithms for minimization without derivatives" (1973), chapter 5. Returns its place and the
/// value.
pub(crate) fn least(function: &mut dyn FnMut(f64) -> f64, range: f64) -> (f64, f64) {
    let tolerance = 2.5e-9 * range;
    let share = 0.5 * (3.0 - 5.0_f64.sqrt());
    let (mut low, mut high) = (-range, range);
    let start = low + share * (high - low);
    // The best point, the next best, and the one that this was before.
    let mut best = [(start, function(start)); 3];
    let (mut step, mut before) = (0.0_f64, 0.0_f64);
    loop {
        let [(x, y), (x1, y1), (x2, y2)] = best;
        let middle = 0.5 * (low + high);
        if (x - middle).abs() <= 2.0 * tolerance - 0.5 * (high - low) {
            return best[0];
        }
        let (r, q) = ((x - x1) * (y - y2), (x - x2) * (y - y1));
        let (p, q) = ((x - x2) * q - (x - x1) * r, 2.0 * (q - r));
        let parabola = -p / q;
        let is_shrinking = parabola.abs() < 0.5 * before.abs();
        let is_inside = x + parabola > low && x + parabola < high;
        before = step;
        if is_shrinking && is_inside {
            step = parabola;
            let ends = (x + step - low).min(high - x - step);
            if ends < 2.0 * tolerance {
                step = tolerance.copysign(middle - x);
            }
        } else {
            before = if x >= middle { low - x } else { high - x };
            step = share * before;
        }
        let next = x + step.abs().max(tolerance).copysign(step);
        let value = function(next);
        if value <= y {
            *(if next >= x { &mut low } else { &mut high }) = x;
            best = [(next, value), best[0], best[1]];
        } else {
            *(if next < x { &mut low } else { &mut high }) = next;
            if value <= y1 || x1 == x {
                best = [best[0], (next, value), best[1]];
            } else if value <= y2 || x2 == x || x2 == x1 {
                best[2] = (next, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize, entries: &[(f64, f64)]) -> ComplexMatrix {
        let entries: Vec<_> = entries.iter().map(|(re, im)| Complex::new(*re, *im)).collect();
        ComplexMatrix::from_row_slice(n, n, &entries)
    }

    #[test]
    fn oracle_a_triangular_matrix_has_the_largest_of_its_diagonal() {
        let m = matrix(2, &[(0.5, 0.0), (100.0, 0.0), (0.0, 0.0), (-0.7, 0.2)]);
        // The infimum is not reached by any D.
        for m in [m.clone(), m.transpose()] {
            let value = upper_bound(&m);
            assert!((value - 0.7_f64.hypot(0.2)).abs() < 1e-9, "{value}");
        }
    }

    #[test]
    fn oracle_two_numbers_of_a_matrix_without_diagonal() {
        // det(I − MΔ) = 1 − m12 m21 δ1 δ2, so μ = √|m12 m21|.
        let m = matrix(2, &[(0.0, 0.0), (9.0, 0.0), (0.0, 4.0), (0.0, 0.0)]);
        assert!((upper_bound(&m) - 6.0).abs() < 1e-6);
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig::with_cases(20))]
        /// For three numbers the bound is reached by a Δ: μ is the largest spectral radius of U M
        /// over diagonal unitary U.
        #[test]
        fn oracle_the_bound_is_reached_for_three_numbers(entries in proptest::collection::vec((-1.0..1.0, -1.0..1.0), 9)) {
            let m = matrix(3, &entries);
            let radius = |angles: [f64; 2]| {
                let mut turned = m.clone();
                for (row, angle) in angles.iter().enumerate() {
                    let turn = Complex::from_polar(1.0, *angle);
                    turned.row_mut(row).iter_mut().for_each(|value| *value *= turn);
                }
                let values = nalgebra::Schur::new(turned).eigenvalues().unwrap();
                values.iter().map(|value| value.norm()).fold(0.0, f64::max)
            };
            let grid = 48;
            let step = std::f64::consts::TAU / f64::from(grid);
            let mut best = (0.0, [0.0; 2]);
            for (i, j) in (0..grid).flat_map(|i| (0..grid).map(move |j| (i, j))) {
                let angles = [f64::from(i) * step, f64::from(j) * step];
                let value = radius(angles);
                if value > best.0 { best = (value, angles); }
            }
            let mut width = step;
            while width > 1e-9 {
                let around = [[width, 0.0], [-width, 0.0], [0.0, width], [0.0, -width],
                    [width, width], [-width, -width], [width, -width], [-width, width]];
                let better = around.map(|[x, y]| [best.1[0] + x, best.1[1] + y])
                    .into_iter().find(|angles| radius(*angles) > best.0);
                match better {
                    Some(angles) => best = (radius(angles), angles),
                    None => width *= 0.5,
                }
            }
            let bound = upper_bound(&m);
            proptest::prop_assert!(bound >= best.0 - 1e-9 && bound <= best.0 * (1.0 + 1e-5), "{bound} {}", best.0);
        }
    }
}
