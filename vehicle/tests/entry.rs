//! Entry flight of the centre of mass, against inertial vectors, conserved quantities, closed forms
//! and the published optima of the Space Shuttle.

use crate::prelude::*;
use proptest::prelude::*;
use vehicle::aerodynamics::{Aerodynamics, FOOT, LiftAndDrag};
use vehicle::kinematics::r;
use vehicle::translation::{State, derivative};

/// East, north and up at a position.
fn axes(motion: &Motion) -> [Vector3<f64>; 3] {
    let (sin_longitude, cos_longitude) = motion.longitude.sin_cos();
    let (sin_latitude, cos_latitude) = motion.latitude.sin_cos();
    [
        Vector3::new(-sin_longitude, cos_longitude, 0.0),
        Vector3::new(-sin_latitude * cos_longitude, -sin_latitude * sin_longitude, cos_latitude),
        Vector3::new(cos_latitude * cos_longitude, cos_latitude * sin_longitude, sin_latitude),
    ]
}

/// Position and velocity in axes that rotate with the planet.
fn vectors(state: &State) -> (Vector3<f64>, Vector3<f64>) {
    let motion = Motion::from(*state);
    let [east, north, up] = axes(&motion);
    let (sin_path, cos_path) = motion.flight_path_angle.sin_cos();
    let (sin_azimuth, cos_azimuth) = motion.azimuth.sin_cos();
    let along = (north * cos_azimuth + east * sin_azimuth) * cos_path + up * sin_path;
    (up * motion.radius, along * motion.speed)
}

/// Acceleration of gravity with J₂ in Cartesian coordinates, m/s².
fn gravity(planet: &Planet, position: &Vector3<f64>) -> Vector3<f64> {
    let r = position.norm();
    let bulge = 1.5 * planet.oblateness * (planet.radius / r).powi(2);
    let across = 5.0 * (position.z / r).powi(2);
    let scale =
        Vector3::new(1.0 - across, 1.0 - across, 3.0 - across).map(|part| 1.0 + bulge * part);
    -position.component_mul(&scale) * (planet.gravitation / r.powi(3))
}

/// Change of a function of the state along its derivative, by central differences of two widths.
fn along(function: impl Fn(&State) -> Vector3<f64>, state: &State, rates: &State) -> Vector3<f64> {
    let slope =
        |h: f64| (function(&(state + rates * h)) - function(&(state - rates * h))) / (2.0 * h);
    (slope(0.05) * 4.0 - slope(0.1)) / 3.0
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]
    #[test]
    fn oracle_the_motion_is_that_of_inertial_vectors(
        altitude in 2e4..1.5e5, longitude in -3.0..3.0, latitude in -1.3..1.3, speed in 500.0..8000.0,
        path in -1.2..1.2, azimuth in -3.0..3.0, lift in 0.0..30.0, drag in 0.0..30.0, bank in -3.0..3.0,
    ) {
        let planet = Planet::EARTH;
        let radius = planet.radius + altitude;
        let motion =
            Motion { radius, longitude, latitude, speed, flight_path_angle: path, azimuth };
        let state = State::from(motion);
        let rates = derivative(&planet, &state, &AirAcceleration { lift, drag, bank });
        let (position, velocity) = vectors(&state);
        let moved = along(|state| vectors(state).0, &state, &rates);
        prop_assert!((moved - velocity).norm() < 1e-8 * speed);

        let [east, north, up] = axes(&motion);
        let forward = velocity / speed;
        // Perpendicular to the velocity, in the vertical plane and to the right.
        let above = (up - forward * forward.dot(&up)).normalize();
        let right = east * azimuth.cos() - north * azimuth.sin();
        let force = above * (lift * bank.cos()) - right * (lift * bank.sin()) - forward * drag;
        let turn = Vector3::z() * planet.rate;
        let expected = force + gravity(&planet, &position)
            - turn.cross(&velocity) * 2.0 - turn.cross(&turn.cross(&position));
        let accelerated = along(|state| vectors(state).1, &state, &rates);
        prop_assert!((accelerated - expected).norm() < 1e-7, "{accelerated} {expected}");
    }
}

#[test]
fn oracle_without_air_energy_and_angular_momentum_stay() {
    let planet = Planet { rate: 0.0, oblateness: 0.0, ..Planet::EARTH };
    let start = Motion {
        radius: planet.radius + 1e5,
        latitude: 0.3,
        speed: 7600.0,
        flight_path_angle: -0.01,
        azimuth: 0.8,
        ..Motion::default()
    };
    let conserved = |state: &State| {
        let (position, velocity) = vectors(state);
        let energy = velocity.norm_squared() / 2.0 - planet.gravitation / position.norm();
        (energy, position.cross(&velocity))
    };
    let mut state = State::from(start);
    let (energy, momentum) = conserved(&state);
    let mut f = |_: f64, state: &State| derivative(&planet, state, &AirAcceleration::default());
    for k in 0..50_000 {
        state = rk4(&mut f, f64::from(k) * 0.04, &state, 0.04);
    }
    let (last_energy, last_momentum) = conserved(&state);
    assert!((last_energy / energy - 1.0).abs() < 1e-12);
    assert!((last_momentum - momentum).norm() < 1e-12 * momentum.norm());
}

/// The controls of an optimum: time (s), angle of attack and bank angle (deg) in Betts' sign.
fn controls(text: &str) -> Vec<[f64; 3]> {
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        [numbers[0], numbers[1], numbers[2]]
    };
    text.lines().skip(1).map(row).collect()
}

/// Flies the controls of an optimum, with straight lines between the rows. Returns the end and the
/// largest heat flux, W/m².
fn fly(rows: &[[f64; 3]]) -> (Motion, f64) {
    let shuttle = Aerodynamics::shuttle();
    let planet = Planet {
        radius: 20_902_900.0 * FOOT,
        flattening: 0.0,
        gravitation: 1.407_653_9e16 * FOOT.powi(3),
        oblateness: 0.0,
        rate: 0.0,
    };
    let start = Motion {
        radius: planet.radius + 260_000.0 * FOOT,
        speed: 25_600.0 * FOOT,
        flight_path_angle: -1_f64.to_radians(),
        azimuth: 90_f64.to_radians(),
        ..Motion::default()
    };
    let control = |time: f64| {
        let next = rows.partition_point(|row| row[0] <= time).clamp(1, rows.len() - 1);
        let ([from, to], [a, b]) =
            ([rows[next - 1][0], rows[next][0]], [rows[next - 1], rows[next]]);
        let share = (time - from) / (to - from);
        let at = |column: usize| (a[column] + share * (b[column] - a[column])).to_radians();
        // The papers' bank angle has the other sign.
        (at(1), -at(2))
    };
    let mut hottest = 0.0_f64;
    let mut f = |time: f64, state: &State| {
        let (alpha, bank) = control(time);
        let Motion { radius, speed, .. } = Motion::from(*state);
        let altitude = radius - planet.radius;
        hottest = hottest.max(shuttle.heating(altitude, speed, alpha));
        let LiftAndDrag { lift, drag } = shuttle.accelerations(altitude, speed, alpha);
        derivative(&planet, state, &AirAcceleration { lift, drag, bank })
    };
    let duration = rows[rows.len() - 1][0];
    let steps = (duration / 0.1).ceil();
    let h = duration / steps;
    let mut state = State::from(start);
    for k in 0..steps as u32 {
        state = rk4(&mut f, f64::from(k) * h, &state, h);
    }
    (state.into(), hottest)
}

/// Betts, chapter 6: the greatest cross-range, without a bound on the heating and with 70
/// BTU/(ft² s). The controls are of a computation of our own: Hermite-Simpson, 200 intervals.
#[test]
fn published_the_shuttle_reaches_its_greatest_cross_range() {
    let optima = [
        (include_str!("data/shuttle-free.csv"), 2008.59, 34.1412, f64::INFINITY),
        (include_str!("data/shuttle-heating-70.csv"), 2198.66, 30.6255, 70.0),
    ];
    for (text, duration, latitude, heating) in optima {
        let rows = controls(text);
        assert!((rows[rows.len() - 1][0] - duration).abs() < 0.01);
        let (end, hottest) = fly(&rows);
        // The terminal area begins at 80,000 ft, 2,500 ft/s and -5 deg.
        assert!((end.latitude.to_degrees() - latitude).abs() < 2e-3, "{end:?}");
        assert!((end.radius / FOOT - 20_902_900.0 - 80_000.0).abs() < 40.0, "{end:?}");
        assert!((end.speed / FOOT - 2500.0).abs() < 3.0, "{}", end.speed / FOOT);
        assert!((end.flight_path_angle.to_degrees() + 5.0).abs() < 0.01);
        // 1 BTU/(ft² s) is 11356.5 W/m². Between the nodes the bound is exceeded a little.
        assert!(hottest / 11_356.5 < 1.005 * heating, "{}", hottest / 11_356.5);
    }
}

/// H. J. Allen, A. J. Eggers, NACA TR 1381 (1958): in a steep ballistic entry the greatest
/// deceleration is V² sin γ/(2 e H), at the speed V e^(-1/2), whatever the vehicle.
#[test]
fn oracle_a_steep_ballistic_entry_by_allen_and_eggers() {
    // A flat planet without gravity, as in the closed form.
    let planet =
        Planet { radius: 1e12, flattening: 0.0, gravitation: 0.0, oblateness: 0.0, rate: 0.0 };
    let (height, speed, path) = (7254.24, 7000.0, -40_f64.to_radians());
    for ballistic in [1000.0, 5000.0] {
        // Air of 1.225 kg/m³ at the ground; mass over drag area in kg/m².
        let drag = |altitude: f64, speed: f64| {
            0.5 * 1.225 * (-altitude / height).exp() * speed * speed / ballistic
        };
        let mut f = |_: f64, state: &SVector<f64, 6>| {
            let Motion { radius, speed, .. } = Motion::from(*state);
            let air =
                AirAcceleration { drag: drag(radius - planet.radius, speed), ..Default::default() };
            derivative(&planet, state, &air)
        };
        let start = Motion {
            radius: planet.radius + 1.5e5,
            speed,
            flight_path_angle: path,
            ..Default::default()
        };
        let mut state = State::from(start);
        let (mut greatest, mut at) = (0.0, 0.0);
        for k in 0..4000 {
            state = rk4(&mut f, f64::from(k) * 0.01, &state, 0.01);
            let Motion { radius, speed, .. } = Motion::from(state);
            let deceleration = drag(radius - planet.radius, speed);
            if deceleration > greatest {
                (greatest, at) = (deceleration, speed);
            }
        }
        let e = std::f64::consts::E;
        let expected = speed * speed * path.sin().abs() / (2.0 * e * height);
        assert!((greatest / expected - 1.0).abs() < 1e-3, "{greatest} {expected}");
        assert!((at / (speed * (-0.5_f64).exp()) - 1.0).abs() < 2e-3, "{at}");
    }
}

/// Bound on the disturbance that docs/entry.md states: the largest acceleration of an angle by
/// uncertainties of the air.
#[test]
fn oracle_what_is_unknown_of_the_air_takes_of_the_disturbance_bound() {
    let papers = Aerodynamics::papers();
    let body = Scenario::crmpc2022().inertia.body(1.0).unwrap();
    let alpha = 17.3_f64.to_radians();
    let flow = |beta: f64| Flow { dynamic_pressure: 12.5e3, speed: 762.0, alpha, beta, mach: 2.5 };
    let rest = Vector3::zeros();
    let acceleration = |moment: &Vector3<f64>| {
        let angles = Vector3::new(alpha, 0.0, 0.0);
        (r(&angles) * body.angular_acceleration(&rest, moment)).map(f64::to_degrees).amax()
    };
    let sideslip = |beta: f64| papers.moment(&flow(beta), &rest, alpha);
    let trim = Vector3::new(0.0, papers.pitch_moment(&flow(0.0), 0.001), 0.0);
    for (what, found, told) in [
        ("a tenth of the derivatives", acceleration(&(sideslip(2_f64.to_radians()) * 0.1)), 0.76),
        ("trim", acceleration(&trim), 1.58),
        ("crosswind", acceleration(&sideslip((5.0_f64 / 762.0).atan())), 1.43),
    ] {
        assert!((found - told).abs() <= 0.005, "{what}: {found} deg/s2");
    }
}
