//! Attitude kinematics: the matrix R of Chai 2022 (2), its inverse and its derivatives.
//!
//! Angles `[alpha, beta, sigma]` (angle of attack, sideslip, bank) in rad, body rates `[p, q, r]` in rad/s. The matrices
//! do not depend on the bank angle. R is printed without the term α̇ sin β in its bank row; it stands here as printed.

use nalgebra::{Matrix3, Vector3};

/// R(Θ) of Chai 2022 (2): Θ̇ = R ω. Singular at β = ±π/2.
pub fn r(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let tb = sb / cb;
    Matrix3::new(-ca * tb, 1.0, -sa * tb, sa, 0.0, -ca, -ca * cb, -sb, -cb * sa)
}

/// R⁻¹(Θ), Chai 2022, proof of Lemma 1: ω = R⁻¹ Θ̇. Regular for every Θ.
pub fn r_inverse(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    Matrix3::new(-sb * ca * cb, sa, -cb * ca, cb * cb, 0.0, -sb, -sa * cb * sb, -ca, -cb * sa)
}

/// ∂R/∂α.
pub fn r_alpha(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let tb = sb / cb;
    Matrix3::new(sa * tb, 0.0, -ca * tb, ca, 0.0, sa, sa * cb, 0.0, -cb * ca)
}

/// ∂R/∂β.
pub fn r_beta(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let sec2 = 1.0 / (cb * cb);
    Matrix3::new(-ca * sec2, 0.0, -sa * sec2, 0.0, 0.0, 0.0, ca * sb, -cb, sb * sa)
}

/// Ṙ = R_α α̇ + R_β β̇. Corrects two entries of the print (Chai 2022, proof of Lemma 1): (1,3) is
/// −α̇ cos α **tan β** − β̇ sin α / cos² β, and (3,1) has the term **+ β̇ cos α sin β**.
pub fn r_dot(angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Matrix3<f64> {
    r_alpha(angles) * angle_rates.x + r_beta(angles) * angle_rates.y
}

/// ∂²R/∂α².
pub fn r_alpha_alpha(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let tb = sb / cb;
    Matrix3::new(ca * tb, 0.0, sa * tb, -sa, 0.0, ca, ca * cb, 0.0, cb * sa)
}

/// ∂²R/∂α∂β.
pub fn r_alpha_beta(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let sec2 = 1.0 / (cb * cb);
    Matrix3::new(sa * sec2, 0.0, -ca * sec2, 0.0, 0.0, 0.0, -sa * sb, 0.0, sb * ca)
}

/// ∂²R/∂β².
pub fn r_beta_beta(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let tb = sb / cb;
    let sec2 = 1.0 / (cb * cb);
    Matrix3::new(-2.0 * ca * sec2 * tb, 0.0, -2.0 * sa * sec2 * tb, 0.0, 0.0, 0.0, ca * cb, sb, cb * sa)
}
