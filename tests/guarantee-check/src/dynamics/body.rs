//! The dynamics of the vehicle with formulas of this crate, for angles and rates that are series.

use super::series::Series;
use crate::dual::Number;
use crate::kinematics::{Turn, Vector, cross, sum, times, turned};
use control::crmpc::Settings;
use std::ops::Neg;

/// Rigid body whose matrices are series, for use with angles and rates that are series.
pub(super) struct Body {
    inertia: [Vector<Series>; 3],
    inverse: [Vector<Series>; 3],
}

impl Body {
    pub(super) fn new(s: &Settings) -> Self {
        let rows = |m: &nalgebra::Matrix3<f64>| {
            std::array::from_fn(|i| std::array::from_fn(|j| Series::constant(m[(i, j)])))
        };
        Self { inertia: rows(&s.body.inertia), inverse: rows(&s.body.inverse) }
    }

    /// Body rates ω of the angles and x.
    pub(super) fn rates(angles: &[Series; 2], x: &Vector<Series>) -> Vector<Series> {
        let ((sa, ca), (sb, cb)) = (angles[0].sin_cos(), angles[1].sin_cos());
        turned(sa, ca, &Turn::new(sb, cb).along(&[], x))
    }

    /// Acceleration F(Θ, x, m) of the attitude angles.
    pub(super) fn acceleration(
        &self,
        angles: &[Series; 2],
        x: &Vector<Series>,
        m: &Vector<Series>,
    ) -> Vector<Series> {
        let ((sa, ca), (sb, cb)) = (angles[0].sin_cos(), angles[1].sin_cos());
        let turn = Turn::new(sb, cb);
        let rates = Self::rates(angles, x);
        let spin = cross(&rates, &times(&self.inertia, &rates));
        let driven = times(&self.inverse, &sum(*m, spin.map(Neg::neg)));
        // T is its own inverse.
        turn.r(&sum(turned(sa, ca, &driven), turn.drift(x).map(Neg::neg)))
    }

    /// Moment m(Θ, x, a) that gives the acceleration a.
    pub(super) fn moment(
        &self,
        angles: &[Series; 2],
        x: &Vector<Series>,
        a: &Vector<Series>,
    ) -> Vector<Series> {
        let ((sa, ca), (sb, cb)) = (angles[0].sin_cos(), angles[1].sin_cos());
        let turn = Turn::new(sb, cb);
        let rates = Self::rates(angles, x);
        let spin = cross(&rates, &times(&self.inertia, &rates));
        sum(times(&self.inertia, &turned(sa, ca, &sum(turn.along(&[], a), turn.drift(x)))), spin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::series::{coefficient, vector};
    use nalgebra::Vector3;

    #[test]
    fn oracle_the_same_dynamics_as_those_of_the_vehicle() {
        let s = Settings::new(control::crmpc::Constraints::Robust);
        let body = Body::new(&s);
        let (angles, x, m) = ([0.3, -0.2], [0.05, -0.07, 0.04], [1e5, -5e4, 7e4]);
        let held = angles.map(Series::constant);
        let acceleration = coefficient(&body.acceleration(&held, &vector(&x), &vector(&m)), 0);
        let attitude = Vector3::new(angles[0], angles[1], 0.4);
        let r =
            control::linearise::InverseKinematics::at(&attitude).matrix().try_inverse().unwrap();
        let expected = s.body.drift(&attitude, &x.into()) + r * s.body.inverse * Vector3::from(m);
        assert!((Vector3::from(acceleration) - expected).norm() < 1e-14);
        let moment = coefficient(&body.moment(&held, &vector(&x), &vector(&acceleration)), 0);
        assert!((Vector3::from(moment) - Vector3::from(m)).norm() < 1e-8);
    }
}
