//! Attitude kinematics: the matrix R of Chai 2022 (2), its inverse and its derivatives, and Wu 2015
//! (1), which includes the trajectory.
//!
//! The attitude angles `[alpha, beta, sigma]` are angle of attack, sideslip and bank in rad; the
//! body rates are `[p, q, r]` in rad/s. R does not depend on the bank angle. The papers print R
//! without the term α̇ sin β in its bank row; the free functions have it as printed, and
//! [`Kinematics`] offers both forms.

use crate::math::{sin, sin_cos};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::Choice;

/// Sines and cosines of the attitude angles.
pub type Sines = [(f64, f64); 3];

/// Returns the sines and cosines of the attitude angles.
pub fn sines(angles: &Vector3<f64>) -> Sines {
    [angles.x, angles.y, angles.z].map(sin_cos)
}

/// Matrix R(Θ) of Chai 2022 (2), with which Θ̇ = R ω. It is singular at β = ±π/2.
pub fn r(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = sin_cos(angles.x);
    let (sb, cb) = sin_cos(angles.y);
    r_of(sa, ca, sb, cb)
}

fn r_of(sa: f64, ca: f64, sb: f64, cb: f64) -> Matrix3<f64> {
    let tb = sb / cb;
    Matrix3::new(-ca * tb, 1.0, -sa * tb, sa, 0.0, -ca, -ca * cb, -sb, -cb * sa)
}

/// Inverse R⁻¹(Θ) of Chai 2022, proof of Lemma 1, with which ω = R⁻¹ Θ̇. It is regular for every Θ.
pub fn r_inverse(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = sin_cos(angles.x);
    let (sb, cb) = sin_cos(angles.y);
    r_inverse_of(sa, ca, sb, cb)
}

fn r_inverse_of(sa: f64, ca: f64, sb: f64, cb: f64) -> Matrix3<f64> {
    Matrix3::new(-sb * ca * cb, sa, -cb * ca, cb * cb, 0.0, -sb, -sa * cb * sb, -ca, -cb * sa)
}

/// Partial derivative ∂R/∂α of the printed R.
pub fn r_alpha(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = sin_cos(angles.x);
    let (sb, cb) = sin_cos(angles.y);
    let tb = sb / cb;
    Matrix3::new(sa * tb, 0.0, -ca * tb, ca, 0.0, sa, sa * cb, 0.0, -cb * ca)
}

/// Partial derivative ∂R/∂β of the printed R.
pub fn r_beta(angles: &Vector3<f64>) -> Matrix3<f64> {
    let (sa, ca) = sin_cos(angles.x);
    let (sb, cb) = sin_cos(angles.y);
    let sec2 = 1.0 / (cb * cb);
    Matrix3::new(-ca * sec2, 0.0, -sa * sec2, 0.0, 0.0, 0.0, ca * sb, -cb, sb * sa)
}

/// Time derivative Ṙ = R_α α̇ + R_β β̇ of the printed R. It corrects two entries of the print (Chai
/// 2022, proof of Lemma 1): (1,3) is −α̇ cos α **tan β** − β̇ sin α / cos² β, and (3,1) has the
/// term **+ β̇ cos α sin β**.
pub fn r_dot(angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Matrix3<f64> {
    r_alpha(angles) * angle_rates.x + r_beta(angles) * angle_rates.y
}

/// Form of the matrix R in the attitude kinematics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "lowercase")]
pub enum Kinematics {
    /// R is as printed in (2) of Chai 2022 and (4) of Wu 2015.
    #[default]
    Printed,
    /// R includes the derivative of alpha times sin beta in the row of the bank angle, as in (1)
    /// of Wu 2015.
    Exact,
}

impl Kinematics {
    /// Adds `factor` times the alpha row to the bank row, which gives + α̇ sin β with `factor` =
    /// sin β.
    fn with_alpha_rate(mut matrix: Matrix3<f64>, factor: f64) -> Matrix3<f64> {
        for j in 0..3 {
            matrix[(2, j)] += factor * matrix[(0, j)];
        }
        matrix
    }

    /// Returns the derivative of `matrix` plus sin β times its alpha row in the bank row, given the
    /// derivatives `slope` of `matrix` and `sb_slope` of sin β. The printed form has no such term.
    fn complete(
        self,
        slope: Matrix3<f64>,
        matrix: &Matrix3<f64>,
        sb: f64,
        sb_slope: f64,
    ) -> Matrix3<f64> {
        match self {
            Self::Printed => slope,
            Self::Exact => {
                let mut complete = Self::with_alpha_rate(slope, sb);
                for j in 0..3 {
                    complete[(2, j)] += sb_slope * matrix[(0, j)];
                }
                complete
            }
        }
    }

    /// Matrix R in use, with which Θ̇ = R ω if the trajectory does not turn.
    pub fn r(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Printed => r(angles),
            Self::Exact => Self::with_alpha_rate(r(angles), sin(angles.y)),
        }
    }

    /// Inverse R⁻¹ of the matrix R in use.
    pub fn r_inverse(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Printed => r_inverse(angles),
            Self::Exact => Self::inverse_with_alpha_rate(r_inverse(angles), sin(angles.y)),
        }
    }

    /// Inverse of the matrix that [`Self::with_alpha_rate`] makes, given the inverse of R: (E R)⁻¹
    /// = R⁻¹ E⁻¹ with E = 1 + `factor` e₃ e₁ᵀ.
    fn inverse_with_alpha_rate(mut inverse: Matrix3<f64>, factor: f64) -> Matrix3<f64> {
        let bank = inverse.column(2) * factor;
        inverse.set_column(0, &(inverse.column(0) - bank));
        inverse
    }

    /// Matrix R in use and its inverse.
    pub fn r_and_inverse(self, sines: &Sines) -> (Matrix3<f64>, Matrix3<f64>) {
        let [(sa, ca), (sb, cb), _] = *sines;
        let (matrix, inverse) = (r_of(sa, ca, sb, cb), r_inverse_of(sa, ca, sb, cb));
        match self {
            Self::Printed => (matrix, inverse),
            Self::Exact => {
                (Self::with_alpha_rate(matrix, sb), Self::inverse_with_alpha_rate(inverse, sb))
            }
        }
    }

    /// Partial derivative ∂R/∂α of the matrix R in use.
    pub fn r_alpha(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        self.complete(r_alpha(angles), &Matrix3::zeros(), sin(angles.y), 0.0)
    }

    /// Partial derivative ∂R/∂β of the matrix R in use.
    pub fn r_beta(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        let (sb, cb) = sin_cos(angles.y);
        self.complete(r_beta(angles), &r(angles), sb, cb)
    }

    /// Matrix that maps [`crate::trajectory::Trajectory::turn_rate`] to the part of Θ̇ that a
    /// turning trajectory adds to R ω, Wu 2015 (1).
    pub fn turn(self, angles: &Vector3<f64>) -> Matrix3<f64> {
        self.turn_at(&sines(angles))
    }

    /// Matrix of [`Kinematics::turn`], given the sines and cosines of the angles.
    pub(crate) fn turn_at(self, sines: &Sines) -> Matrix3<f64> {
        let matrix = turn(sines);
        match self {
            Self::Printed => matrix,
            Self::Exact => Self::with_alpha_rate(matrix, sines[1].0),
        }
    }
}

/// Terms of the trajectory in Wu 2015 (1), without those of α̇ sin β.
fn turn(&[_, (_, cb), (ss, cs)]: &Sines) -> Matrix3<f64> {
    Matrix3::new(0.0, -cs / cb, ss / cb, 0.0, ss, cs, 1.0, 0.0, 0.0)
}
