//! Tests of the formulas against the printed equations, differences and their bounds.

use super::*;
use vehicle::dynamics::Inertia;
use vehicle::kinematics as kin;

fn body() -> RigidBody {
    let inertia = Inertia {
        Ixx: 588791.0,
        Iyy: 1303212.0,
        Izz: 1534163.0,
        Ixz: 24242.0,
        ..Inertia::default()
    };
    RigidBody::new(inertia.matrix()).unwrap()
}

#[test]
fn oracle_moment_is_that_of_the_printed_equations() {
    // Chai 2022, (4) and (7): m = I R⁻¹ (a − f).
    let body = body();
    let angles = Vector3::new(0.17, 0.12, -0.5);
    let (x, a) = (Vector3::new(0.05, -0.06, 0.04), Vector3::new(0.1, -0.08, 0.05));
    let u = a - body.drift(&angles, &x);
    assert!((InverseKinematics::at(&angles).input(&body, &x, &a) - u).norm() < 1e-13 * u.norm());
    let printed = body.inertia * kin::r_inverse(&angles) * (a - body.drift(&angles, &x));
    let ours = moment(&body, &angles, &x, &a);
    assert!((ours - printed).norm() < 1e-13 * printed.norm(), "{ours} {printed}");
}

#[test]
fn oracle_slopes_of_the_moment_and_the_input_stay_within_their_bounds() {
    let body = body();
    let inertia = body.inertia.symmetric_eigenvalues();
    // The directions and sizes form a lattice from a low-discrepancy sequence.
    let at = |i: usize, j: usize| {
        let irrational = [
            0.754_877_7,
            0.569_840_3,
            0.430_159_7,
            0.324_717_9,
            0.245_122_3,
            0.185_037_6,
            0.139_680_6,
        ];
        (0.5 + i as f64 * irrational[j]).fract() * 2.0 - 1.0
    };
    let mut tightest = [0.0_f64; 4];
    for i in 1..20_000 {
        let angles = Vector3::new(3.1 * at(i, 0), 1.5 * at(i, 1), 0.0);
        let x = Vector3::new(at(i, 2), at(i, 3), at(i, 4)) * 10.0_f64.powf(2.0 * at(i, 5) - 1.0);
        let a = Vector3::new(at(i, 4), at(i, 2), at(i, 6)) * 10.0_f64.powf(2.0 * at(i, 6) - 1.0);
        let exact = InverseKinematics::at(&angles).linearise(&body, &x, &a);
        let ratio = inertia.max() / inertia.min();
        let bounds = MomentSlopeBounds::new(x.norm(), a.norm(), ratio);
        let u = InverseKinematics::at(&angles).input(&body, &x, &a).norm();
        let input_bound = input_bound(angles.y, x.norm(), a.norm(), ratio);
        let shares = [
            exact.moment.by_angles.norm() / (inertia.max() * bounds.by_angles),
            exact.moment.by_rates.norm() / (inertia.max() * bounds.by_rates),
            u / input_bound,
            exact.rates.by_angles.norm() / (TURN_BY_ANGLES * x.norm()),
        ];
        for (share, tightest) in shares.iter().zip(&mut tightest) {
            assert!(*share <= 1.0 + 1e-12, "{shares:?} at {angles} {x} {a}");
            *tightest = tightest.max(*share);
        }
    }
    let [by_angles, by_rates, ..] = tightest;
    assert!(by_angles.max(by_rates) > 0.5, "{tightest:?}");
    assert!(tightest.iter().all(|share| *share > 0.2), "{tightest:?}");
}

#[test]
fn oracle_derivatives_agree_with_central_differences() {
    let body = body();
    let point = [0.17, 0.12, -0.5, 0.05, -0.06, 0.04, 0.1, -0.08, 0.05];
    let split = |z: &[f64; 9]| {
        let at = |i: usize| Vector3::new(z[i], z[i + 1], z[i + 2]);
        (at(0), at(3), at(6))
    };
    let quantities = |z: &[f64; 9]| {
        let (angles, rates, a) = split(z);
        [
            body_rates(&angles, &rates),
            moment(&body, &angles, &rates, &a),
            InverseKinematics::at(&angles).input(&body, &rates, &a),
        ]
    };
    let (angles, rates, a) = split(&point);
    let exact = InverseKinematics::at(&angles).linearise(&body, &rates, &a);
    let exact_input = InverseKinematics::at(&angles).input_of_moment(&body, &exact.moment);
    for (y, linear) in [exact.rates, exact.moment, exact_input].iter().enumerate() {
        assert!((linear.value - quantities(&point)[y]).norm() <= 1e-12 * linear.value.norm());
        let motion = InverseKinematics::at(&angles).motion(&body, &rates);
        assert!(
            (motion.moment(&a) - exact.moment.value).norm() <= 1e-12 * exact.moment.value.norm()
        );
        for i in 0..9 {
            let step = 1e-5;
            let (mut plus, mut minus) = (point, point);
            plus[i] += step;
            minus[i] -= step;
            let numeric = (quantities(&plus)[y] - quantities(&minus)[y]) / (2.0 * step);
            let analytic = match i {
                0 | 1 => linear.by_angles.column(i).into_owned(),
                2 => Vector3::zeros(),
                3..6 => linear.by_rates.column(i - 3).into_owned(),
                _ => linear.by_acceleration.column(i - 6).into_owned(),
            };
            let scale = [1.0, 2e6, 1.0][y];
            assert!((numeric - analytic).norm() < 1e-8 * scale, "quantity {y}, argument {i}");
        }
    }
}
