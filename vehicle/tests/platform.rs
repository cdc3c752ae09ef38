//! Tests of the platform's sensor readings against values computed by hand and numerically
//! differentiated rotations.

use crate::prelude::*;
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;
use vehicle::platform::{Surroundings, body_from_velocity, velocity_from_level};

const G: f64 = 9.80665;
/// Magnetic field to the north, to the east and down, T.
const FIELD: Vector3<f64> = Vector3::new(2e-5, -0.5e-5, 4.6e-5);
const AROUND: Surroundings = Surroundings { gravity: G, field: FIELD };

#[test]
fn oracle_static_readings_by_hand() {
    let [north, east, down] = [FIELD.x, FIELD.y, FIELD.z];
    for (degrees, force, field) in [
        // Level flight to the north.
        ([0.0, 0.0, 0.0], [0.0, 0.0, -G], [north, east, down]),
        // With the nose up, the belly looks north.
        ([90.0, 0.0, 0.0], [G, 0.0, 0.0], [-down, east, north]),
        // With sideslip the wind comes from the right, so the nose points left of north, to the
        // west.
        ([0.0, 90.0, 0.0], [0.0, 0.0, -G], [-east, north, down]),
        // The bank turns against the right-hand rule: the right wing is up.
        ([0.0, 0.0, 90.0], [0.0, G, 0.0], [north, -down, east]),
    ] {
        let [rate, found_force, found_field] =
            at_rest(Vector3::from(degrees).map(f64::to_radians)).felt(&AROUND);
        assert_eq!(rate, Vector3::zeros());
        assert!((found_force - Vector3::from(force)).amax() < 1e-14, "{degrees:?}: {found_force}");
        assert!((found_field - Vector3::from(field)).amax() < 1e-19, "{degrees:?}: {found_field}");
    }
}

#[test]
fn oracle_heading_and_climb_turn_what_is_felt() {
    let mut pose = at_rest(Vector3::zeros());
    pose.trajectory.heading = FRAC_PI_2;
    let [_, force, field] = pose.felt(&AROUND);
    // In flight to the east, north is on the left.
    assert!((force - Vector3::new(0.0, 0.0, -G)).amax() < 1e-14);
    assert!((field - Vector3::new(FIELD.y, -FIELD.x, FIELD.z)).amax() < 1e-19);
    pose.trajectory = Trajectory { flight_path_angle: FRAC_PI_2, ..Trajectory::default() };
    let [_, force, field] = pose.felt(&AROUND);
    // In flight straight up, the belly looks north.
    assert!((force - Vector3::new(G, 0.0, 0.0)).amax() < 1e-14);
    assert!((field - Vector3::new(-FIELD.z, FIELD.y, FIELD.x)).amax() < 1e-19);
}

/// Body rates ω from the rotation C and its derivative Ċ: Ċ Cᵀ = −ω^×.
fn rate_of(rotation: impl Fn(f64) -> Matrix3<f64>) -> Vector3<f64> {
    let h = 1e-3;
    let slope = (rotation(-2.0 * h) - rotation(-h) * 8.0 + rotation(h) * 8.0 - rotation(2.0 * h))
        / (12.0 * h);
    let turning = -slope * rotation(0.0).transpose();
    Vector3::new(turning[(2, 1)], turning[(0, 2)], turning[(1, 0)])
}

proptest! {

    /// The gyroscope measures the change of the orientation, whichever R the motion obeys.
    #[test]
    fn oracle_the_gyroscope_against_differences_of_the_orientation(
        angles in attitude(),
        rates in proptest::array::uniform3(-0.5..0.5),
        drawn in proptest::array::uniform4(-0.5..0.5),
    ) {
        let trajectory = Trajectory {
            flight_path_angle: drawn[0],
            heading: drawn[1],
            flight_path_angle_rate: drawn[2],
            heading_rate: drawn[3],
            ..Trajectory::default()
        };
        for kinematics in [Kinematics::Printed, Kinematics::Exact] {
            let rates = Vector3::from(rates);
            let turn_rate = trajectory.turn_rate(0.0);
            let angle_rates = kinematics.r(&angles) * rates + kinematics.turn(&angles) * turn_rate;
            let alpha_rate = angle_rates.x;
            let pose =
                Pose { kinematics, angles, rates, alpha_rate, trajectory, specific_force: None };
            // Over an Earth that neither turns nor curves, the level axes are inertial.
            let expected = rate_of(|t| {
                let later = Trajectory {
                    flight_path_angle: trajectory.flight_path_angle + t * trajectory.flight_path_angle_rate,
                    heading: trajectory.heading + t * trajectory.heading_rate,
                    ..Trajectory::default()
                };
                body_from_velocity(&(angles + angle_rates * t)) * velocity_from_level(&later)
            });
            let [found, ..] = pose.felt(&AROUND);
            let scale = 1.0 + angle_rates.amax().powi(5);
            prop_assert!((found - expected).amax() < 1e-9 * scale, "{kinematics:?}: {found} {expected}");
        }
    }
}
