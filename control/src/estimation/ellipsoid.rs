//! Calibration of a three-axis sensor that measures a field of constant size: least-squares fit of
//! an ellipsoid.
//!
//! Li, Griffiths: *Least squares ellipsoid specific fitting*, Geometric Modeling and
//! Processing 2004. The readings m = A h + b + noise of a turning field h lie on an ellipsoid. Its
//! matrix gives W = A⁻¹ and b, so that W (m − b) is the field divided by its size. W is the
//! symmetric solution: readings alone cannot reveal a rotation within A.

use nalgebra::{
    Matrix3, Matrix3x4, Matrix4, Matrix6, RowVector4, SMatrix, SVector, Vector3, Vector4, Vector6,
};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::AXES;

/// Correction of a sensor: the field is `matrix` (reading − `bias`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Correction {
    /// Correction matrix, the inverse of scale, misalignment and soft iron, of accelerometer and
    /// magnetometer up to a factor.
    #[setting(part, unit = "1", nominal = 1.0)]
    pub matrix: Matrix3<f64>,
    /// Bias.
    #[setting(part, each = AXES)]
    pub bias: Vector3<f64>,
}

impl Default for Correction {
    /// Returns the correction that changes nothing.
    fn default() -> Self {
        Self { matrix: Matrix3::identity(), bias: Vector3::zeros() }
    }
}

impl Correction {
    /// Returns the field behind a reading.
    pub fn apply(&self, reading: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * (reading - self.bias)
    }
}

/// A calibration with measures of its quality.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Matrix W for a field of size 1, and bias b.
    pub correction: Correction,
    /// Root mean square of ‖W (m − b)‖ − 1, to first order.
    pub residual: f64,
    /// Condition number of the ellipsoid fit: largest over second-smallest eigenvalue of the
    /// scatter of W (m − b), as the smallest eigenvalue belongs to the ellipsoid itself. It is 16
    /// for uniform coverage of all directions.
    pub condition: f64,
}

/// Reasons why readings give no calibration.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The best fit is not an ellipsoid.
    #[error("the readings do not lie on an ellipsoid")]
    NoEllipsoid,
    /// More than one ellipsoid fits the readings.
    #[error("the readings do not cover the sphere: condition {0:.0}")]
    Coverage(f64),
}

/// Largest accepted condition number of a fit.
const CONDITION: f64 = 1000.0;

type Row = SVector<f64, 10>;

/// Largest sum of products that is fitted.
const LARGEST: f64 = 1e30;

/// Sum of d dᵀ over the readings, d = (x², y², z², 2yz, 2xz, 2xy, 2x, 2y, 2z, 1). It contains all
/// data that a fit needs, for any number of readings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scatter {
    sum: SMatrix<f64, 10, 10>,
    count: f64,
    /// Size of the first reading, by which all readings are divided.
    scale: f64,
}

impl Default for Scatter {
    /// Returns a scatter without readings.
    fn default() -> Self {
        Self { sum: SMatrix::zeros(), count: 0.0, scale: 1.0 }
    }
}

impl Scatter {
    /// Adds a reading to the sums.
    pub fn add(&mut self, reading: &Vector3<f64>) {
        if self.count == 0.0 && reading.norm() > 0.0 {
            self.scale = reading.norm();
        }
        let p = (reading / self.scale).push(1.0);
        let mut d = Row::zeros();
        for (i, (a, b)) in PRODUCTS.into_iter().enumerate() {
            d[i] = p[a] * p[b] * if a == b { 1.0 } else { 2.0 };
        }
        self.sum += d * d.transpose();
        self.count += 1.0;
    }

    /// Fits the ellipsoid with the least sum of squares of its quadric over the readings, subject
    /// to 4 J − I² = 1.
    ///
    /// # Errors
    /// Returns an error if the readings do not determine an ellipsoid.
    pub fn fit(&self) -> Result<Fit, FitError> {
        // Readings are near 1; the eigenvalues of matrices far from that, or not finite, cannot be
        // computed.
        if !(self.sum.amax() < LARGEST && self.count.is_finite()) {
            return Err(FitError::NoEllipsoid);
        }
        let s = self.sum / self.count.max(1.0);
        let v = quadric(&s).ok_or(FitError::NoEllipsoid)?;
        // Li, Griffiths 2004, (3): the quadric xᵀ Q x + 2 nᵀ x + d = 0.
        let q = Matrix3::new(v[0], v[5], v[4], v[5], v[1], v[3], v[4], v[3], v[2]);
        let n = Vector3::new(v[6], v[7], v[8]);
        let inverse = q.try_inverse().ok_or(FitError::NoEllipsoid)?;
        let bias = -(inverse * n);
        let size = n.dot(&(inverse * n)) - v[9];
        if !(q / size).amax().is_finite() {
            return Err(FitError::NoEllipsoid);
        }
        let squared = (q / size).symmetric_eigen();
        if !(squared.eigenvalues.min() > 0.0 && size.is_finite()) {
            return Err(FitError::NoEllipsoid);
        }
        let roots = Matrix3::from_diagonal(&squared.eigenvalues.map(f64::sqrt));
        let matrix = squared.eigenvectors * roots * squared.eigenvectors.transpose();

        // For u = W (m − b), uᵀu − 1 is the quadric divided by `size`.
        let residual = v.dot(&(s * v)).max(0.0).sqrt() / (2.0 * size.abs());
        let seen = seen_from(&matrix, &bias, &s);
        if !seen.iter().all(|value| value.is_finite()) {
            return Err(FitError::NoEllipsoid);
        }
        let mut eigenvalues = seen.symmetric_eigenvalues();
        eigenvalues.as_mut_slice().sort_by(f64::total_cmp);
        let condition = eigenvalues[9] / eigenvalues[1].max(f64::MIN_POSITIVE);
        if condition > CONDITION {
            return Err(FitError::Coverage(condition));
        }
        let correction = Correction { matrix: matrix / self.scale, bias: bias * self.scale };
        Ok(Fit { correction, residual, condition })
    }
}

/// Factors of the entries of d among (x, y, z, 1).
const PRODUCTS: [(usize, usize); 10] =
    [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1), (0, 3), (1, 3), (2, 3), (3, 3)];

/// Returns the v with the least vᵀ S v and 4 J − I² = 1, up to its size. Li, Griffiths 2004,
/// (11)–(15).
fn quadric(s: &SMatrix<f64, 10, 10>) -> Option<Row> {
    let s11: Matrix6<f64> = s.fixed_view::<6, 6>(0, 0).into();
    let s12: SMatrix<f64, 6, 4> = s.fixed_view::<6, 4>(0, 6).into();
    let s22: Matrix4<f64> = s.fixed_view::<4, 4>(6, 6).into();
    let to_v2 = -(s22.try_inverse()? * s12.transpose());
    let reduced = s11 + s12 * to_v2;
    let mut c = Matrix6::<f64>::from_diagonal(&Vector6::from([-1.0, -1.0, -1.0, -4.0, -4.0, -4.0]));
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        c[(i, j)] = 1.0;
        c[(j, i)] = 1.0;
    }
    // The pencil is reduced v1 = λ C v1. C has one positive eigenvalue, and so has the pencil.
    // Without noise its λ is 0 except for rounding; with a multiple of the unit matrix added it is
    // positive, and 1/λ is the largest eigenvalue of L⁻¹ C L⁻ᵀ.
    let reduced = (reduced + reduced.transpose()) / 2.0;
    let l = (reduced + Matrix6::identity() * (1e-13 * reduced.trace())).cholesky()?.l();
    let half = l.solve_lower_triangular(&c)?;
    let pencil = l.solve_lower_triangular(&half.transpose())?;
    if !pencil.iter().all(|value| value.is_finite()) {
        return None;
    }
    let eigen = ((pencil + pencil.transpose()) / 2.0).symmetric_eigen();
    let w: Vector6<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    let v1 = l.transpose().solve_upper_triangular(&w)?;
    let v1 = v1 / v1.norm();
    let v2: Vector4<f64> = to_v2 * v1;
    Some(Row::from_fn(|i, _| if i < 6 { v1[i] } else { v2[i - 6] }))
}

/// Returns the scatter of W (m − b) from that of m.
fn seen_from(
    matrix: &Matrix3<f64>,
    bias: &Vector3<f64>,
    s: &SMatrix<f64, 10, 10>,
) -> SMatrix<f64, 10, 10> {
    let mut affine = Matrix3x4::zeros();
    affine.fixed_view_mut::<3, 3>(0, 0).copy_from(matrix);
    affine.set_column(3, &-(matrix * bias));
    let row = |i: usize| -> RowVector4<f64> {
        if i == 3 { RowVector4::new(0.0, 0.0, 0.0, 1.0) } else { affine.row(i).into() }
    };
    let mut transformation = SMatrix::<f64, 10, 10>::zeros();
    for (i, (a, b)) in PRODUCTS.into_iter().enumerate() {
        let (a_row, b_row) = (row(a), row(b));
        for (j, (c, d)) in PRODUCTS.into_iter().enumerate() {
            // Off the diagonal an entry of d is twice the product and represents two of them.
            let both = if c == d {
                a_row[c] * b_row[c]
            } else {
                f64::midpoint(a_row[c] * b_row[d], a_row[d] * b_row[c])
            };
            transformation[(i, j)] = both * if a == b { 1.0 } else { 2.0 };
        }
    }
    transformation * s * transformation.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Golden-section sequence, which is uniform in [0, 1).
    fn spread(k: u32, step: f64) -> f64 {
        (f64::from(k) * step).fract()
    }

    /// Directions that cover the part of the sphere with z from `low` to 1.
    fn direction(k: u32, low: f64) -> Vector3<f64> {
        let z = low + (1.0 - low) * spread(k, 0.754_877_666_246_692_8);
        let (sine, cosine) = (std::f64::consts::TAU * spread(k, 0.569_840_290_998_053_2)).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        Vector3::new(radius * cosine, radius * sine, z)
    }

    /// Nearly normal noise with variance 1: the sum of twelve hashed numbers.
    fn noise(k: u32) -> Vector3<f64> {
        let hashed = |i: u32| {
            let mixed = u64::from(i).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            ((mixed ^ (mixed >> 32)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let sum = |axis: u32| (0..12).map(|i| hashed(36 * k + 12 * axis + i)).sum::<f64>() - 6.0;
        Vector3::new(sum(0), sum(1), sum(2))
    }

    const FIELD: f64 = 50.94e-6;

    fn errors() -> Correction {
        Correction {
            matrix: Matrix3::new(1.06, 0.03, -0.02, 0.03, 0.95, 0.04, -0.02, 0.04, 1.02),
            bias: Vector3::new(30e-6, -20e-6, 15e-6),
        }
    }

    fn scatter(count: u32, level: f64, direction: impl Fn(u32) -> Vector3<f64>) -> Scatter {
        let Correction { matrix, bias } = errors();
        let mut scatter = Scatter::default();
        for k in 0..count {
            scatter.add(&(matrix * direction(k) * FIELD + bias + noise(k) * (level * FIELD)));
        }
        scatter
    }

    fn error(fit: &Fit) -> f64 {
        (fit.correction.matrix * FIELD * errors().matrix - Matrix3::identity())
            .singular_values()
            .max()
    }

    #[test]
    fn oracle_matrix_and_bias_come_back_without_noise() {
        let fit = scatter(500, 0.0, |k| direction(k, -1.0)).fit().unwrap();
        assert!(error(&fit) < 1e-10, "{}", error(&fit));
        assert!((fit.correction.bias - errors().bias).norm() < 1e-10 * FIELD);
        assert!(fit.residual < 1e-7 && fit.condition < 20.0, "{fit:?}");
    }

    #[test]
    fn oracle_noise_of_half_a_percent_gives_half_a_percent() {
        let fit = scatter(500, 0.005, |k| direction(k, -1.0)).fit().unwrap();
        assert!(error(&fit) < 5e-3, "{}", error(&fit));
        assert!((fit.residual - 0.005).abs() < 0.001, "{fit:?}");
    }

    #[test]
    fn readings_that_do_not_cover_the_sphere_are_refused() {
        let cap = scatter(2000, 0.005, |k| direction(k, 0.9)).fit();
        assert!(matches!(cap, Err(FitError::Coverage(_) | FitError::NoEllipsoid)), "{cap:?}");
        let circle = scatter(2000, 0.005, |k| {
            direction(k, -1.0).component_mul(&Vector3::new(1.0, 1.0, 0.0)).normalize()
        });
        assert!(circle.fit().is_err(), "{:?}", circle.fit());
        let still = scatter(2000, 0.005, |_| Vector3::z());
        assert!(still.fit().is_err(), "{:?}", still.fit());
        assert!(Scatter::default().fit().is_err());
        let half = scatter(2000, 0.005, |k| direction(k, 0.0)).fit().unwrap();
        assert!(error(&half) < 0.05, "half a sphere is poor, but suffices: {half:?}");
    }
}
