//! Tests of R of Chai 2022 (2) against its properties and numerical differentiation, and of Wu 2015
//! (1) against a composition of rotations.

use crate::prelude::*;
use proptest::prelude::*;
use vehicle::kinematics::{r, r_dot, r_inverse, sines};

proptest! {
    #[test]
    fn oracle_r_times_its_inverse_is_the_identity(angles in attitude()) {
        prop_assert!((r(&angles) * r_inverse(&angles) - Matrix3::identity()).amax() < 1e-14 / angles.y.cos().powi(2));
    }

    #[test]
    fn r_and_its_inverse_together_are_the_same_bits_as_each_by_itself(angles in attitude()) {
        for kinematics in [Kinematics::Printed, Kinematics::Exact] {
            let apart = (kinematics.r(&angles), kinematics.r_inverse(&angles));
            prop_assert_eq!(kinematics.r_and_inverse(&sines(&angles)), apart);
        }
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
}

/// A path on which all angles and rates are of order one.
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

/// Ṙ as Chai 2022 prints it (proof of Lemma 1) differs from the derivative in the entries (1,3) and
/// (3,1) only.
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

// Wu 2015, (1)

/// Rotation from body axes to north, east, down at the meridian θ = 0, as a product of rotations.
/// The bank angle grows against the right-hand rule about the velocity, as the signs of R require.
fn attitude_in_space(
    trajectory: &Trajectory,
    longitude: f64,
    angles: &Vector3<f64>,
) -> Rotation3<f64> {
    let [x, y, z] = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let about = Rotation3::from_axis_angle;
    // Inertial axes: z to the north pole, x to the meridian θ = 0 on the equator.
    let to_the_vehicle = about(&z, longitude) * about(&y, -trajectory.latitude);
    let to_north_east_down = about(&y, -std::f64::consts::FRAC_PI_2);
    let to_the_velocity = about(&z, trajectory.heading) * about(&y, trajectory.flight_path_angle);
    let to_the_body = about(&x, -angles.z) * about(&z, -angles.y) * about(&y, angles.x);
    to_the_vehicle * to_north_east_down * to_the_velocity * to_the_body
}

/// Body rates ω from the change of the attitude, by a central difference.
fn body_rates(
    trajectory: &Trajectory,
    earth_rate: f64,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
) -> Vector3<f64> {
    let h = 1e-5;
    let at = |t: f64| {
        let moved = Trajectory {
            flight_path_angle: trajectory.flight_path_angle + t * trajectory.flight_path_angle_rate,
            heading: trajectory.heading + t * trajectory.heading_rate,
            latitude: trajectory.latitude + t * trajectory.latitude_rate,
            ..*trajectory
        };
        let longitude = t * (trajectory.longitude_rate + earth_rate);
        attitude_in_space(&moved, longitude, &(angles + angle_rates * t))
    };
    // Cᵀ Ċ = ω^×
    let turning = at(0.0).transpose().matrix() * (at(h).matrix() - at(-h).matrix()) / (2.0 * h);
    Vector3::new(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)])
}

fn trajectory() -> impl Strategy<Value = Trajectory> {
    let rates = proptest::array::uniform4(-0.5..0.5);
    (-1.5..1.5, -3.0..3.0, -1.5..1.5, rates).prop_map(|(gamma, psi, phi, rates)| Trajectory {
        flight_path_angle: gamma,
        heading: psi,
        latitude: phi,
        flight_path_angle_rate: rates[0],
        heading_rate: rates[1],
        longitude_rate: rates[2],
        latitude_rate: rates[3],
    })
}

/// Wu 2015 (1) as printed, with `sign` before sin φ sin γ in the bank row.
fn printed_1(
    trajectory: &Trajectory,
    earth_rate: f64,
    angles: &Vector3<f64>,
    rates: &Vector3<f64>,
    sign: f64,
) -> Vector3<f64> {
    let (sa, ca) = angles.x.sin_cos();
    let (sb, cb) = angles.y.sin_cos();
    let (ss, cs) = angles.z.sin_cos();
    let (sg, cg) = trajectory.flight_path_angle.sin_cos();
    let (sp, cp) = trajectory.heading.sin_cos();
    let (sl, cl) = trajectory.latitude.sin_cos();
    let [gamma_rate, psi_rate, theta_rate, phi_rate] = [
        trajectory.flight_path_angle_rate,
        trajectory.heading_rate,
        trajectory.longitude_rate + earth_rate,
        trajectory.latitude_rate,
    ];
    let (p, q, r) = (rates.x, rates.y, rates.z);
    let first = psi_rate * cg - phi_rate * sp * sg + theta_rate * (cl * cp * sg - sl * cg);
    let second = gamma_rate - phi_rate * cp - theta_rate * cl * sp;
    let alpha_rate = -p * ca * sb / cb + q - r * sa * sb / cb + ss / cb * first - cs / cb * second;
    let beta_rate = p * sa - r * ca + ss * second + cs * first;
    let sigma_rate =
        -p * ca * cb - q * sb - r * sa * cb + alpha_rate * sb - psi_rate * sg - phi_rate * sp * cg
            + theta_rate * (cl * cp * cg + sign * sl * sg);
    Vector3::new(alpha_rate, beta_rate, sigma_rate)
}

proptest! {
    #[test]
    fn oracle_kinematics_1_are_the_composition_of_rotations(
        angles in attitude(),
        angle_rates in proptest::array::uniform3(-0.5..0.5),
        trajectory in trajectory(),
        earth_rate in -0.5..0.5,
    ) {
        let angle_rates = Vector3::from(angle_rates);
        let rates = body_rates(&trajectory, earth_rate, &angles, &angle_rates);
        let exact = Kinematics::Exact;
        let turn_rate = trajectory.turn_rate(earth_rate);
        let computed = exact.r(&angles) * rates + exact.turn(&angles) * turn_rate;
        let scale = 1.0 / angles.y.cos();
        prop_assert!((computed - angle_rates).amax() < 1e-9 * scale, "{}", computed - angle_rates);
        // The printed kinematics lack α̇ sin β and nothing else.
        let printed = Kinematics::Printed;
        let mut computed = printed.r(&angles) * rates + printed.turn(&angles) * turn_rate;
        computed.z += angle_rates.x * angles.y.sin();
        prop_assert!((computed - angle_rates).amax() < 1e-9 * scale, "{}", computed - angle_rates);
    }

    /// Wu 2015 (1) as printed differs from the true kinematics in one sign, that of sin φ sin γ in
    /// the bank row.
    #[test]
    fn published_kinematics_1_are_wrong_in_one_sign(
        angles in attitude(),
        rates in proptest::array::uniform3(-0.5..0.5),
        trajectory in trajectory(),
        earth_rate in -0.5..0.5,
    ) {
        let rates = Vector3::from(rates);
        let exact = Kinematics::Exact;
        let ours = exact.r(&angles) * rates + exact.turn(&angles) * trajectory.turn_rate(earth_rate);
        let scale = 1.0 / angles.y.cos();
        let printed = |sign| printed_1(&trajectory, earth_rate, &angles, &rates, sign);
        prop_assert!((printed(1.0) - ours).amax() < 1e-14 * scale);
        let misprint = Vector3::new(
            0.0,
            0.0,
            -2.0 * (trajectory.longitude_rate + earth_rate)
                * trajectory.latitude.sin() * trajectory.flight_path_angle.sin(),
        );
        prop_assert!((printed(-1.0) - ours - misprint).amax() < 1e-14 * scale);
    }

    #[test]
    fn oracle_exact_r_its_inverse_and_slopes(angles in attitude(), turn_rate in proptest::array::uniform3(-0.5..0.5)) {
        let scale = 1.0 / angles.y.cos().powi(4);
        let turn_rate = Vector3::from(turn_rate);
        for kinematics in [Kinematics::Printed, Kinematics::Exact] {
            let product = kinematics.r(&angles) * kinematics.r_inverse(&angles);
            prop_assert!((product - Matrix3::identity()).amax() < 1e-14 * scale);
            let h = 1e-5;
            let slope = |matrix: &dyn Fn(&Vector3<f64>) -> Matrix3<f64>, axis: usize| {
                let mut shift = Vector3::zeros();
                shift[axis] = h;
                (matrix(&(angles + shift)) - matrix(&(angles - shift))) / (2.0 * h)
            };
            for (numeric, exact) in [
                (slope(&|angles| kinematics.r(angles), 0), kinematics.r_alpha(&angles)),
                (slope(&|angles| kinematics.r(angles), 1), kinematics.r_beta(&angles)),
            ] {
                prop_assert!((numeric - exact).amax() < 1e-8 * scale, "{kinematics:?}: {}", numeric - exact);
            }
            prop_assert_eq!(kinematics.turn(&angles) * Vector3::zeros(), Vector3::zeros());
            prop_assert!((kinematics.turn(&angles) * turn_rate).amax() > 0.0);
        }
    }
}
