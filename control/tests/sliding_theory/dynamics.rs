//! (3), (12) and (13): the dynamics with their uncertainties.

use crate::prelude::*;
use proptest::prelude::*;
use vehicle::kinematics::r;

/// Returns F of (13), as it is printed or as the dynamics require.
fn f_of_13(angles: &Vector3<f64>, rates: &Vector3<f64>, printed: bool) -> Matrix3<f64> {
    let ((sa, ca), (sb, cb)) = (angles.x.sin_cos(), angles.y.sin_cos());
    let (p, q, r) = (rates.x, rates.y, rates.z);
    let sec2 = 1.0 / (cb * cb);
    let right = Matrix3::new(
        (p * sa - r * ca) * sb / cb,
        -(p * ca + r * sa) * sec2,
        0.0,
        p * ca + r * sa,
        0.0,
        0.0,
        (p * sa - r * ca) * cb,
        (p * ca + r * sa) * sb - q * cb,
        0.0,
    );
    if !printed {
        return right;
    }
    let mut misprint = Matrix3::identity();
    misprint[(1, 0)] = r * (ca - sa);
    right + misprint
}

/// Returns Θ̈ of (3) by a difference along the motion, with Δf = a sin(w t) and Δd constant.
fn differenced_acceleration(
    body: &RigidBody,
    [angles, rates, moment, delta_d]: [Vector3<f64>; 4],
    delta_f: impl Fn(f64) -> Vector3<f64>,
) -> Vector3<f64> {
    let angle_rates =
        |angles: &Vector3<f64>, rates: &Vector3<f64>, t: f64| r(angles) * rates + delta_f(t);
    let (now, acceleration) =
        (angle_rates(&angles, &rates, 0.0), body.angular_acceleration(&rates, &moment) + delta_d);
    let h = 1e-5;
    let at = |t: f64| angle_rates(&(angles + now * t), &(rates + acceleration * t), t);
    (at(h) - at(-h)) / (2.0 * h)
}

proptest! {
    #[test]
    fn oracle_12_and_13_against_differences_of_the_dynamics(
        angles in (-1.0..1.0, -1.2..1.2, -3.0..3.0),
        rates in proptest::array::uniform3(-0.5..0.5),
        moment in proptest::array::uniform3(-1e5..1e5),
        delta_d in proptest::array::uniform3(-0.1..0.1),
        amplitude in proptest::array::uniform3(0.01..0.1),
        phase in 0.2..1.3,
    ) {
        let body = Scenario::tvsmc2015().inertia.body(1.0).unwrap();
        let angles = Vector3::new(angles.0, angles.1, angles.2);
        let [rates, moment, delta_d, amplitude] =
            [rates, moment, delta_d, amplitude].map(Vector3::from);
        let delta_f = |t: f64| amplitude * f64::sin(phase + 2.0 * t);
        let delta_f_dot = amplitude * (2.0 * f64::cos(phase));
        let acceleration = differenced_acceleration(&body, [angles, rates, moment, delta_d], delta_f);
        let matrix = r(&angles);
        let modelled = matrix * body.inverse * moment + body.drift(&angles, &(matrix * rates));
        let f = f_of_13(&angles, &rates, false) * delta_f(0.0);
        let scale = 1.0 / angles.y.cos().powi(3);
        let right = modelled + matrix * delta_d + f + delta_f_dot;
        prop_assert!((acceleration - right).amax() < 5e-11 * scale, "{}", acceleration - right);
        // Each of the three misprints by itself makes the sum wrong: Δd, which (8) has already
        // divided by the inertia, is divided again, the derivative of Δf is missing, and F is wrong
        // in four entries.
        let divided = modelled + matrix * body.inverse * delta_d + f + delta_f_dot;
        let without = modelled + matrix * delta_d + f;
        let other = modelled + matrix * delta_d + f_of_13(&angles, &rates, true) * delta_f(0.0) + delta_f_dot;
        let off = |sum: Vector3<f64>| (acceleration - sum).norm();
        prop_assert!(off(divided) > 0.999 * (matrix * delta_d).norm() - 5e-11 * scale);
        prop_assert!(off(without) > 0.999 * delta_f_dot.norm());
        // Of F, (1,1), (2,2) and (3,3) carry a 1 too many, which in α and σ adds Δf itself.
        prop_assert!((other - acceleration).x > 0.999 * delta_f(0.0).x && (other - acceleration).z > 0.999 * delta_f(0.0).z);
    }
}
