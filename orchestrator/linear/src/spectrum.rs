//! The largest eigenvalue of a matrix, by squaring.
//!
//! ‖Aᴺ‖^(1/N) tends to the largest magnitude of an eigenvalue. With N = 2⁴⁰ it is that magnitude to
//! ten digits and more, for defective matrices too, such as those of loops with delays.

use nalgebra::{Complex, ComplexField, DMatrix, DVector};

/// Logarithm of a norm from which its growth is looked at: transients of quantities in different
/// components are smaller.
const GROWN: f64 = 60.0;
/// Number of squarings.
const SQUARINGS: i32 = 40;

/// Returns the largest magnitude of an eigenvalue of a square matrix.
pub fn spectral_radius<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> f64 {
    power(a).0
}

/// Returns whether all eigenvalues lie within the unit circle. Far from it, few squarings tell.
pub fn is_stable<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> bool {
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

/// Returns an eigenvalue of the largest magnitude.
pub fn dominant<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> Complex<f64> {
    let (radius, power) = power(a);
    if radius == 0.0 || !radius.is_finite() {
        return Complex::new(radius, 0.0);
    }
    let complex = |value: &T| Complex::new(value.clone().real(), value.clone().imaginary());
    let column = (0..power.ncols())
        .max_by(|i, j| power.column(*i).norm().total_cmp(&power.column(*j).norm()));
    let column = power.column(column.unwrap_or(0));
    let v: DVector<Complex<f64>> = DVector::from_iterator(a.nrows(), column.iter().map(complex));
    let a = a.map(|value| complex(&value)) * Complex::new(1.0 / radius, 0.0);
    // In the span of the eigenvectors of a pair, A² v = s A v − p v.
    let (w, x) = (&a * &v, &a * (&a * &v));
    let (vv, vw, ww) = (v.dotc(&v), v.dotc(&w), w.dotc(&w));
    let (vx, wx) = (v.dotc(&x), w.dotc(&x));
    let determinant = vv * ww - vw * vw.conj();
    if determinant.norm() <= 1e-10 * (vv * ww).norm() {
        return vw / vv * radius;
    }
    // Normal equations for (s, −p).
    let s = (vv * wx - vw.conj() * vx) / determinant;
    let p = -(ww * vx - vw * wx) / determinant;
    let root = (s * s * 0.25 - p).sqrt();
    let (one, other) = (s * 0.5 + root, s * 0.5 - root);
    (if one.norm() >= other.norm() { one } else { other }) * radius
}

/// Returns the spectral radius and a high power of the matrix, scaled.
fn power<T: ComplexField<RealField = f64>>(a: &DMatrix<T>) -> (f64, DMatrix<T>) {
    let (mut power, mut square) = (a.clone(), a.clone());
    let mut logarithm = 0.0;
    for squaring in 0..=SQUARINGS {
        let size = power.norm();
        if size == 0.0 || !size.is_finite() {
            return (if size == 0.0 { 0.0 } else { f64::INFINITY }, power);
        }
        logarithm += size.ln() / f64::powi(2.0, squaring);
        power.unscale_mut(size);
        if squaring < SQUARINGS {
            power.mul_to(&power, &mut square);
            std::mem::swap(&mut power, &mut square);
        }
    }
    (logarithm.exp(), power)
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
}
