//! R of Chai 2022 (2) against its properties and against numerical differentiation.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use vehicle::kinematics::{r, r_alpha, r_alpha_alpha, r_alpha_beta, r_beta, r_beta_beta, r_dot, r_inverse};

fn attitude() -> impl Strategy<Value = Vector3<f64>> {
    (-3.0..3.0, -1.4..1.4, -3.0..3.0).prop_map(|(alpha, beta, sigma)| Vector3::new(alpha, beta, sigma))
}

type Of = fn(&Vector3<f64>) -> Matrix3<f64>;

proptest! {
    #[test]
    fn oracle_r_times_its_inverse_is_the_identity(angles in attitude()) {
        prop_assert!((r(&angles) * r_inverse(&angles) - Matrix3::identity()).amax() < 1e-14 / angles.y.cos().powi(2));
    }

    #[test]
    fn oracle_r_r_transposed_has_eigenvalues_sec2_beta_1_1(angles in attitude()) {
        let mut eigenvalues: Vec<f64> =
            (r(&angles) * r(&angles).transpose()).symmetric_eigenvalues().iter().copied().collect();
        eigenvalues.sort_by(f64::total_cmp);
        let sec2 = 1.0 / angles.y.cos().powi(2);
        prop_assert!((eigenvalues[0] - 1.0).abs() < 1e-13 * sec2);
        prop_assert!((eigenvalues[1] - 1.0).abs() < 1e-13 * sec2);
        prop_assert!((eigenvalues[2] / sec2 - 1.0).abs() < 1e-13);
    }

    #[test]
    fn oracle_determinant_is_sec_beta_and_the_inverse_has_norm_1(angles in attitude()) {
        prop_assert!((r(&angles).determinant() * angles.y.cos() - 1.0).abs() < 1e-13);
        prop_assert!((r_inverse(&angles).singular_values().max() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn oracle_partial_derivatives_against_differences(angles in attitude()) {
        let h = 1e-5;
        let scale = 1.0 / angles.y.cos().powi(5);
        let pairs: [(Of, usize, Of); 6] = [
            (r, 0, r_alpha),
            (r, 1, r_beta),
            (r_alpha, 0, r_alpha_alpha),
            (r_alpha, 1, r_alpha_beta),
            (r_beta, 0, r_alpha_beta),
            (r_beta, 1, r_beta_beta),
        ];
        for (of, axis, exact) in pairs {
            let mut shift = Vector3::zeros();
            shift[axis] = h;
            let numeric = (of(&(angles + shift)) - of(&(angles - shift))) / (2.0 * h);
            let error = (numeric - exact(&angles)).amax();
            prop_assert!(error < 1e-8 * scale, "{error}");
        }
    }
}

/// A path with all angles and rates of order one.
fn path(t: f64) -> (Vector3<f64>, Vector3<f64>) {
    let angles = Vector3::new(0.5 + 0.3 * (0.7 * t).sin(), 0.4 * t.cos(), 0.2 * t);
    let rates = Vector3::new(0.21 * (0.7 * t).cos(), -0.4 * t.sin(), 0.2);
    (angles, rates)
}

fn differenced_r(t: f64) -> Matrix3<f64> {
    let h = 1e-3;
    let at = |k: f64| r(&path(t + k * h).0);
    (at(-2.0) - at(-1.0) * 8.0 + at(1.0) * 8.0 - at(2.0)) / (12.0 * h)
}

#[test]
fn oracle_r_dot_against_differences_along_a_path() {
    for k in 0..50 {
        let t = 0.2 * f64::from(k);
        let (angles, rates) = path(t);
        assert!((differenced_r(t) - r_dot(&angles, &rates)).amax() < 1e-11, "at {t}");
    }
}

/// Ṙ as Chai 2022 prints it (proof of Lemma 1) differs from the derivative in the entries (1,3) and (3,1) alone.
#[test]
fn published_r_dot_is_wrong_in_two_entries() {
    let (angles, rates) = path(1.0);
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let (ra, rb) = (rates.x, rates.y);
    let printed = Matrix3::new(
        ra * sb / cb * sa - rb * ca / (cb * cb),
        0.0,
        -ra * ca * cb - rb * sa / (cb * cb),
        ra * ca,
        0.0,
        ra * sa,
        ra * sa * cb,
        -rb * cb,
        -ra * ca * cb + rb * sa * sb,
    );
    let difference = printed - differenced_r(1.0);
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        let misprint = [(0, 2), (2, 0)].contains(&(row, column));
        let off = difference[(row, column)].abs();
        assert!(if misprint { off > 0.01 } else { off < 1e-11 }, "({row}, {column}): {off}");
    }
}
