//! The largest eigenvalue of a matrix, by squaring.
//!
//! The columns of Aᴺ tend to the span of the eigenvectors of the largest eigenvalues. With N = 2⁴⁰
//! they are there to ten digits and more, for defective matrices too, such as those of loops with
//! delays.

use crate::margins::structured::balanced;
use nalgebra::{Complex, ComplexField, DMatrix, DVector};
use std::f64::consts::PI;

/// Logarithm of a norm from which its growth is evaluated: transients of quantities in different
/// components are smaller.
const GROWN: f64 = 60.0;
/// Number of squarings, and the relative error from which on there are no more.
const SQUARINGS: i32 = 40;
const SMALL: f64 = 1e-12;

/// Returns the largest magnitude of an eigenvalue of a square matrix.
pub(crate) fn spectral_radius<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> f64 {
    dominant(a).norm()
}

/// Returns whether all eigenvalues lie within the unit circle. Far from it, few squarings decide.
pub(crate) fn is_stable<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> bool {
    let (mut power, mut square) = (a.clone(), a.clone());
    // ln ‖Aᴺ‖ for N = 2ᵏ, and before.
    let (mut logarithm, mut before) = (0.0, 0.0);
    for squaring in 0..=SQUARINGS {
        let size = power.norm();
        if size == 0.0 || !size.is_finite() {
            return size == 0.0;
        }
        logarithm = 2.0 * logarithm + size.ln();
        // ‖Aᴺ‖ < 1 is enough. A norm that is squared from N to 2 N grows for good.
        if logarithm < 0.0 {
            return true;
        }
        if squaring > 0 && logarithm > GROWN && logarithm > 1.9 * before {
            return false;
        }
        before = logarithm;
        power.unscale_mut(size);
        if squaring < SQUARINGS {
            power.mul_to(&power, &mut square);
            std::mem::swap(&mut power, &mut square);
        }
    }
    false
}

/// Returns an eigenvalue of the largest magnitude. As the power of a matrix grows, its columns come
/// to lie in the span of the eigenvectors of a pair, which then is read off.
pub(crate) fn dominant<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> Complex<f64> {
    let mut power = balanced(a.clone());
    let complex = power.map(|value| Complex::new(value.clone().real(), value.imaginary()));
    let mut square = power.clone();
    let mut logarithm = 0.0;
    let mut found = Complex::new(0.0, 0.0);
    for squaring in 0..=SQUARINGS {
        let size = power.norm();
        if size == 0.0 || !size.is_finite() {
            return Complex::new(if size == 0.0 { 0.0 } else { f64::INFINITY }, 0.0);
        }
        logarithm += size.ln() / f64::powi(2.0, squaring);
        power.unscale_mut(size);
        let (before, (now, residual)) = (found, pair(&complex, &power, logarithm.exp()));
        found = now;
        // A pair that grows into one of a defective matrix has a small residual, but goes on.
        let is_still = (now.norm() - before.norm()).abs() <= SMALL * now.norm();
        if squaring == SQUARINGS || (residual < SMALL && is_still) {
            break;
        }
        power.mul_to(&power, &mut square);
        std::mem::swap(&mut power, &mut square);
    }
    found
}

/// Returns the larger eigenvalue of a pair in whose span a sum of the columns of a high power is,
/// and its relative error, about. All eigenvalues are about as large as `radius`.
fn pair<T: ComplexField<RealField = f64>>(
    a: &DMatrix<Complex<f64>>,
    power: &DMatrix<T>,
    radius: f64,
) -> (Complex<f64>, f64) {
    // Each part of the system has a share in it, though nothing may couple them.
    let sum = power * DVector::from_fn(a.nrows(), |row, _| T::from_real(1.0 / (row as f64 + PI)));
    let v = sum.map(|value| Complex::new(value.clone().real(), value.imaginary()));
    let w = a * &v * Complex::new(1.0 / radius, 0.0);
    let x = a * &w * Complex::new(1.0 / radius, 0.0);
    let vv = v.dotc(&v);
    let one = v.dotc(&w) / vv;
    // The part of A v beside v: without it, there is one eigenvalue.
    let beside = &w - &v * one;
    let size = beside.dotc(&beside);
    if size.norm() <= 1e-14 * w.norm_squared() {
        return (one * radius, beside.norm() / v.norm());
    }
    // A² v = s A v − p v, of which the part beside v gives s: so pairs that are nearly equal keep
    // their digits.
    let s = beside.dotc(&(&x - &v * (v.dotc(&x) / vv))) / size;
    let p = -v.dotc(&(&x - &w * s)) / vv;
    let root = (s * s * 0.25 - p).sqrt();
    let (one, other) = (s * 0.5 + root, s * 0.5 - root);
    // An eigenvalue errs by this, the more the nearer the pair is to one.
    let residual = (&x - &w * s + &v * p).norm() / beside.norm();
    ((if one.norm() >= other.norm() { one } else { other }) * radius, residual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;

    #[test]
    fn oracle_pairs_real_values_and_a_chain_of_delays() {
        let (radius, angle) = (0.998_f64, 0.3_f64);
        let (re, im) = (radius * angle.cos(), radius * angle.sin());
        let turn = Matrix::from_row_slice(2, 2, &[re, -im, im, re]);
        // The basis is skewed, and a chain of ten delays of a defective zero hangs on it.
        let mut a = Matrix::zeros(12, 12);
        a.view_mut((0, 0), (2, 2)).copy_from(&turn);
        for i in 2..12 {
            a[(i, i - 1)] = 40.0;
        }
        let found = dominant(&a);
        assert!((found.norm() - radius).abs() < 1e-9, "{found}");
        assert!((found.arg().abs() - angle).abs() < 1e-9, "{found}");
        let real = Matrix::from_row_slice(2, 2, &[-1.25, 7.0, 0.0, 0.5]);
        assert!((dominant(&real) - Complex::new(-1.25, 0.0)).norm() < 1e-10);
        assert_eq!(spectral_radius(&Matrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0])), 0.0);
        let double = Matrix::from_row_slice(2, 2, &[0.9, 1.0, 0.0, 0.9]);
        assert!((spectral_radius(&double) - 0.9).abs() < 1e-10);
        let complex = turn.map(|value| Complex::new(0.0, value));
        assert!((spectral_radius(&complex) - radius).abs() < 1e-10);
    }

    proptest::proptest! {
        /// Against nalgebra's eigenvalues: with equal pairs, pairs of nearly equal size, zeros, and
        /// parts that nothing couples.
        #[test]
        fn oracle_the_radius_is_that_of_the_schur_form(
            entries in proptest::collection::vec(-1.0..1.0, 36),
            sizes in proptest::collection::vec(0.1..1.2, 3),
            angle in 0.0..std::f64::consts::PI,
            kind in 0..5_u8,
        ) {
            let basis = Matrix::from_row_slice(6, 6, &entries) + Matrix::identity(6, 6) * 3.0;
            let mut own = Matrix::zeros(6, 6);
            for (pair, size) in sizes.iter().enumerate() {
                let size: f64 = match kind {
                    0 | 4 => *size,
                    1 => sizes[0],
                    2 => sizes[0] * (1.0 + 1e-9 * pair as f64),
                    _ => size * f64::from(u8::from(pair == 0)),
                };
                let (s, c) = angle.sin_cos();
                let place = 2 * pair;
                own[(place, place)] = size * c;
                own[(place, place + 1)] = -size * s;
                own[(place + 1, place)] = size * s;
                own[(place + 1, place + 1)] = size * c;
            }
            // Parts that nothing couples, in units of their own.
            let basis = if kind == 4 {
                Matrix::from_fn(6, 6, |row, column| {
                    if row == column { entries[row].abs().mul_add(1e6, 1.0) } else { 0.0 }
                })
            } else {
                basis
            };
            let a = &basis * own * basis.clone().try_inverse().unwrap();
            let oracle = a.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max);
            let found = spectral_radius(&a);
            proptest::prop_assert!((found - oracle).abs() < 1e-9 * oracle, "{found} {oracle}");
        }
    }
}
