//! A rigid body in axes that turn with the angle of attack, with formulas of this crate.
//!
//! W y = T(α) V(β) y ([`crate::kinematics`]). T is a reflection, T T = 1, so that T a × T b = −T (a
//! × b). With J = T I T the moment that an acceleration a requires is, up to T,
//!
//! m = J (V a + D) − ω × J ω,  ω = V x,  D = T Ẇ x.
//!
//! Its norm is that in the body's axes. J depends on 2α through U and P alone.

use crate::dual::Real;
use crate::interval::Interval;
use crate::kinematics::{Turn, Vector, cross, sum, unit};
use control::crmpc::Settings;
use std::ops::Neg;

/// Inertia of a body that is symmetric about its x–z plane, kg m².
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    /// Mean ½ (I_xx + I_zz).
    mean: Interval,
    /// Half of the difference, ½ (I_xx − I_zz).
    half: Interval,
    /// Entry (1, 3) of the tensor.
    product: Interval,
    /// Moment of inertia about the pitch axis.
    pitch: Interval,
}

impl Body {
    /// Reads the tensor of the settings; `None` if it is not symmetric about the x–z plane.
    pub(crate) fn new(s: &Settings) -> Option<Self> {
        let tensor = &s.body.inertia;
        let [xx, yy, zz, xz] =
            [(0, 0), (1, 1), (2, 2), (0, 2)].map(|at| Interval::from(tensor[at]));
        let half = Interval::from(0.5);
        let symmetric = tensor[(0, 1)] == 0.0 && tensor[(1, 2)] == 0.0;
        (symmetric && *tensor == tensor.transpose()).then_some(Self {
            mean: half * (xx + zz),
            half: half * (xx - zz),
            product: xz,
            pitch: yy,
        })
    }

    /// Returns the principal moments: two in the plane of symmetry, then that of the pitch axis.
    pub(crate) fn principal(&self) -> [Interval; 3] {
        let radius = (self.half.square() + self.product.square()).sqrt();
        [self.mean - radius, self.mean + radius, self.pitch]
    }

    /// Returns the body at these angles.
    pub(crate) fn at<T: Real>(&self, [alpha, beta]: [T; 2]) -> Attitude<T> {
        let (sine, cosine) = beta.sin_cos();
        let (s, c) = (alpha + alpha).sin_cos();
        let [mean, half, product, pitch] =
            [self.mean, self.half, self.product, self.pitch].map(T::fixed);
        // The determinant in the plane does not depend on α.
        let determinant = self.mean.square() - self.half.square() - self.product.square();
        Attitude {
            turn: Turn::new(sine, cosine),
            u: half * c + product * s,
            p: half * s - product * c,
            mean,
            pitch,
            scale: T::fixed(Interval::ONE / determinant),
        }
    }
}

/// Attitude and inertia, as far as the moment depends on them: J = [[mean + U, 0, P], [0, pitch,
/// 0], [P, 0, mean − U]].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attitude<T> {
    pub(crate) turn: Turn<T>,
    u: T,
    p: T,
    mean: T,
    pitch: T,
    /// Inverse of the determinant of J in the plane.
    scale: T,
}

impl<T: Real> Attitude<T> {
    /// Returns J y.
    pub(crate) fn inertia(&self, [p, t, q]: Vector<T>) -> Vector<T> {
        let Self { u, mean, pitch, .. } = *self;
        [(mean + u) * p + self.p * q, pitch * t, self.p * p + (mean - u) * q]
    }

    /// Returns J⁻¹ y.
    pub(crate) fn inverse(&self, [p, t, q]: Vector<T>) -> Vector<T> {
        let Self { u, mean, pitch, scale, .. } = *self;
        let in_plane = [(mean - u) * p - self.p * q, (mean + u) * q - self.p * p];
        [in_plane[0] * scale, t / pitch, in_plane[1] * scale]
    }

    /// Returns the column J V e_i of the moment by the acceleration, kg m².
    pub(crate) fn column(&self, i: usize) -> Vector<T> {
        self.inertia(self.turn.by_sideslip(0, &unit(i)))
    }

    /// Returns the gyroscopic term ω × J ω at the rates `x` (rad/s), N m.
    fn spin(&self, x: &Vector<T>) -> Vector<T> {
        let rates = self.turn.by_sideslip(0, x);
        cross(&rates, &self.inertia(rates))
    }

    /// Returns the moment at the rates `x` (rad/s) and the acceleration `a` (rad/s²), N m.
    pub(crate) fn moment(&self, x: &Vector<T>, a: &Vector<T>) -> Vector<T> {
        let driven = self.inertia(sum(self.turn.by_sideslip(0, a), self.turn.drift(x)));
        sum(driven, self.spin(x).map(Neg::neg))
    }

    /// Returns the acceleration at the rates `x` (rad/s) under the moment `m` (N m), rad/s².
    pub(crate) fn acceleration(&self, x: &Vector<T>, m: &Vector<T>) -> Vector<T> {
        let driven = self.inverse(sum(*m, self.spin(x)));
        self.turn.r(&sum(driven, self.turn.drift(x).map(Neg::neg)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::turned;
    use control::crmpc::Constraints;
    use control::linearise;
    use nalgebra::Vector3;

    #[test]
    fn oracle_the_same_dynamics_as_those_of_the_controller_and_of_the_vehicle() {
        let s = Settings::new(Constraints::Robust);
        let body = Body::new(&s).unwrap();
        let (x, a) = ([0.05, -0.07, 0.04], [0.02, 0.06, -0.05]);
        for (alpha, beta) in [(0.3_f64, -0.2), (-2.5, 0.3), (6.0, 0.1)] {
            let angles = Vector3::new(alpha, beta, 0.4);
            let theirs = linearise::moment(&s.body, &angles, &x.into(), &a.into());
            let at = body.at([alpha, beta]);
            let mine = at.moment(&x, &a);
            let (sine, cosine) = alpha.sin_cos();
            let difference = theirs - Vector3::from(turned(sine, cosine, &mine));
            assert!(difference.norm() < 1e-12 * theirs.norm(), "{difference}");
            // The columns are the derivatives by the acceleration.
            let rest = Vector3::from(at.moment(&x, &[0.0; 3]));
            let columns = (0..3).map(|i| Vector3::from(at.column(i)) * a[i]);
            let by_columns = columns.sum::<Vector3<f64>>() + rest;
            assert!((by_columns - Vector3::from(mine)).norm() < 1e-8);
            let r = linearise::InverseKinematics::at(&angles).matrix().try_inverse().unwrap();
            let expected = s.body.drift(&angles, &x.into()) + r * s.body.inverse * theirs;
            let acceleration = Vector3::from(at.acceleration(&x, &mine));
            assert!((acceleration - expected).norm() < 1e-14);
            assert!((acceleration - Vector3::from(a)).norm() < 1e-14);
            // Intervals enclose the same values.
            let enclosed = body.at([alpha, beta].map(Interval::from));
            let enclosed = enclosed.moment(&x.map(Interval::from), &a.map(Interval::from));
            for (enclosed, mine) in enclosed.iter().zip(mine) {
                assert!((enclosed.middle() - mine).abs() < 1e-8 && enclosed.width() < 1e-8);
            }
        }
    }
}
