//! Atmospheric check case 2, the tumbling brick, of NASA/TM-2015-218675 (Murri, Jackson, Shelton,
//! Check-Cases for Verification of 6-Degree-of-Freedom Flight Vehicle Simulations, volume II): a
//! brick with three different moments of inertia falls over the rotating Earth without any moment.
//! The numbers are those of tool SIM 4, published with the report (`Atmos_02_sim_04.csv`).

use crate::prelude::*;
use vehicle::plant;

/// Unit of the inertia, kg m². As no moment acts it does not change the motion.
const SLUG_FT2: f64 = 1.3558179483;

/// Angular rate of the Earth in WGS 84, rad/s.
const EARTH_RATE: f64 = 7.292115e-5;

/// Longitude of the brick after 30 s, deg. It falls freely, so its longitude grows with t³.
const LONGITUDE_AT_30_S: f64 = 5.74552213287e-5;

/// Rows of time (s), yaw, pitch, roll from north, east, down (deg), and the inertial body rates
/// p, q, r (deg/s).
#[rustfmt::skip]
const ROWS: [(f64, [f64; 3], [f64; 3]); 5] = [
    (1.0, [31.776473202, 18.689409988, 12.5899948471], [4.25884189866, 23.1199428975, 28.3798177751]),
    (5.0, [-177.786288441, 2.22437921439, 43.8792390909], [-16.9394851494, 9.63193937745, 33.4066280795]),
    (10.0, [-4.32133636889, 3.74133747365, -66.0190032425], [-2.41890222177, -23.5525695195, 28.12859263]),
    (20.0, [-6.36969382585, 4.05982976745, 4.13831799799], [-5.42273467991, 22.7159305765, 28.6082817473]),
    (30.0, [-4.28935504226, -3.81965492189, -56.1513075938], [12.6183907757, -17.3974747619, 31.1195888868]),
];

/// Returns the plant with the brick, level and facing north over the equator. North, east, down are
/// the trajectory's axes of a level flight to the north. `angles` are those of the axes in which
/// its tensor is given, from its own.
fn brick(angles: &Vector3<f64>) -> Plant {
    let own = attitude(angles).inverse();
    let rates = own * Vector3::new(10f64, 20.0, 30.0).map(f64::to_radians);
    let principal = Vector3::new(0.001894220, 0.006211019, 0.007194665) * SLUG_FT2;
    let tensor = own * Matrix3::from_diagonal(&principal) * own.inverse();
    let inertia = Inertia {
        Ixx: tensor[(0, 0)],
        Iyy: tensor[(1, 1)],
        Izz: tensor[(2, 2)],
        Ixz: -tensor[(0, 2)],
        Ixy: -tensor[(0, 1)],
        Iyz: -tensor[(1, 2)],
    };
    let config = Config {
        inertia,
        inertia_scale: 1.0,
        initial: plant::state(angles, &rates),
        disturbance: Disturbance::default(),
        kinematics: Kinematics::Exact,
        earth_rate: EARTH_RATE,
        ..Scenario::crmpc2022().config(0.01)
    };
    Plant::new(&config, 0.0).unwrap()
}

/// Returns the attitude from north, east, down, of which the angles are three rotations.
fn attitude(angles: &Vector3<f64>) -> Rotation3<f64> {
    let [x, y, z] = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let about = Rotation3::from_axis_angle;
    about(&x, -angles.z) * about(&z, -angles.y) * about(&y, angles.x)
}

#[test]
fn published_tumbling_brick() {
    tumble(&Vector3::zeros(), 7e-8);
}

#[test]
fn published_tumbling_brick_in_axes_that_are_not_its_own() {
    // Their sideslip comes near 90°, where errors of the integration grow.
    tumble(&Vector3::new(0.3, 0.4, -0.5), 2e-6);
}

/// Compares the brick, given in axes that are turned from its own by these angles, with the rows;
/// its attitude may be off by `bound` (deg).
fn tumble(angles: &Vector3<f64>, bound: f64) {
    let mut plant = brick(angles);
    let axes = attitude(angles);
    let mut from = 0.0;
    let (mut rates_off, mut attitude_off) = (0.0_f64, 0.0_f64);
    for (to, [yaw, pitch, roll], rates) in ROWS {
        plant
            .advance_with(from, to, &Command::default(), |t| {
                let longitude_rate = LONGITUDE_AT_30_S.to_radians() * 3.0 * t * t / 30f64.powi(3);
                Input {
                    trajectory: Trajectory { longitude_rate, ..Trajectory::default() },
                    ..Input::default()
                }
            })
            .unwrap();
        from = to;
        let own_rates = axes * plant.rates();
        rates_off = rates_off.max((own_rates.map(f64::to_degrees) - Vector3::from(rates)).amax());
        let expected =
            Rotation3::from_euler_angles(roll.to_radians(), pitch.to_radians(), yaw.to_radians());
        let own = attitude(&plant.angles()) * axes.inverse();
        let turned = (own.matrix() - expected.matrix()).amax();
        attitude_off = attitude_off.max(turned.to_degrees());
    }
    assert!(rates_off < 1e-10, "rates {rates_off} deg/s");
    assert!(attitude_off < bound, "attitude {attitude_off} deg");
}
