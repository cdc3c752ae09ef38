//! Atmospheric check cases of NASA/TM-2015-218675 (Murri, Jackson, Shelton, Check-Cases for
//! Verification of 6-Degree-of-Freedom Flight Vehicle Simulations, volume II) that need the motion
//! of the centre of mass. The numbers are those of tool SIM 4 (`Atmos_03_sim_04.csv` and so on).

use crate::prelude::*;
use vehicle::Vehicle;
use vehicle::aerodynamics::FOOT;
use vehicle::atmosphere::air;
use vehicle::translation::{State, derivative};

/// Slug, kg.
const SLUG: f64 = 14.593_902_937_206_36;

/// Distance from the centre (m) and geocentric latitude (rad) of an altitude (m) and a geodetic
/// latitude (rad): on the ellipsoid of WGS 84 if the planet has an oblateness.
fn position(planet: &Planet, altitude: f64, latitude: f64) -> [f64; 2] {
    let flattening = if planet.oblateness > 0.0 { 1.0 / 298.257_223_563 } else { 0.0 };
    let eccentricity = flattening * (2.0 - flattening);
    let normal = planet.radius / (1.0 - eccentricity * latitude.sin().powi(2)).sqrt();
    let (out, up) = (
        (normal + altitude) * latitude.cos(),
        (normal * (1.0 - eccentricity) + altitude) * latitude.sin(),
    );
    [out.hypot(up), up.atan2(out)]
}

/// Cases 4, 5, 9 and 10: a sphere falls from 30,000 ft over a round Earth without and with
/// rotation, and is launched to the east and to the north from the equator of the ellipsoid,
/// through the standard atmosphere. The first two begin at 0.1 s, because the angles of the
/// velocity have no meaning at rest.
#[test]
fn published_a_sphere_falls_and_is_shot() {
    struct Case {
        planet: Planet,
        begin: f64,
        azimuth: f64,
        /// Altitude (ft), speed down and horizontally (ft/s), longitude and latitude (deg), at the
        /// beginning and after 30 s.
        first: [f64; 5],
        last: [f64; 5],
        /// Largest distance, m, and difference of speed, m/s.
        within: f64,
    }
    let round = Planet { radius: 6_371_007.181, oblateness: 0.0, ..Planet::EARTH };
    let cases = [
        Case {
            planet: Planet { rate: 0.0, ..round },
            begin: 0.1,
            azimuth: 90.0,
            first: [29_999.839_368_5, 3.212_628_215_16, 0.0, 0.0, 0.0],
            last: [16_231.305_924_3, 867.104_924_472, 0.0, 0.0, 0.0],
            within: 1e-3,
        },
        Case {
            planet: round,
            begin: 0.1,
            azimuth: 90.0,
            first: [
                29_999.839_925_1,
                3.201_497_522_79,
                2.334_568_299_09e-5,
                2.130_061_643_56e-12,
                0.0,
            ],
            last: [16_276.384_548_8, 864.480_181_529, 1.843_898_337_28, 5.346_998_237_28e-5, 0.0],
            within: 1e-3,
        },
        Case {
            planet: Planet::EARTH,
            begin: 0.0,
            azimuth: 90.0,
            first: [0.0, -1000.0, 1000.0, 0.0, 0.0],
            last: [10_160.989_764_5, 181.748_229_037, 610.746_581_927, 0.061_647_850_713_8, 0.0],
            within: 1e-2,
        },
        Case {
            planet: Planet::EARTH,
            begin: 0.0,
            azimuth: 0.0,
            first: [0.0, -1000.0, 1000.0, 0.0, 0.0],
            last: [
                10_114.805_511_4,
                184.446_484_675,
                611.535_615_912,
                -7.847_590_507_03e-5,
                0.062_135_626_697_2,
            ],
            within: 5e-2,
        },
    ];
    // One slug with a drag coefficient of 0.1 and an area of 0.1963495 ft².
    let drag_area = 0.1 * 0.196_349_540_849_362 * FOOT * FOOT / SLUG;
    for Case { planet, begin, azimuth, first, last, within } in cases {
        let [altitude, down, level, longitude, _] = first;
        let mut state = State::from(Motion {
            radius: planet.radius + altitude * FOOT,
            longitude: longitude.to_radians(),
            speed: down.hypot(level) * FOOT,
            flight_path_angle: (-down).atan2(level),
            azimuth: azimuth.to_radians(),
            ..Motion::default()
        });
        let mut f = |_: f64, state: &State| {
            let Motion { radius, speed, .. } = Motion::from(*state);
            let density = air((radius - planet.radius).max(0.0)).unwrap().density;
            let drag = 0.5 * density * speed * speed * drag_area;
            derivative(&planet, state, &AirAcceleration { drag, ..Default::default() })
        };
        let steps = ((30.0 - begin) / 0.01_f64).round() as u32;
        for k in 0..steps {
            state = rk4(&mut f, begin + f64::from(k) * 0.01, &state, 0.01);
        }
        let end = Motion::from(state);
        let (sin_path, cos_path) = end.flight_path_angle.sin_cos();
        let [radius, latitude] = position(&planet, last[0] * FOOT, last[4].to_radians());
        let off = [
            end.radius - radius,
            -end.speed * sin_path - last[1] * FOOT,
            end.speed * cos_path - last[2] * FOOT,
            (end.longitude - last[3].to_radians()) * end.radius,
            (end.latitude - latitude) * end.radius,
        ];
        assert!(off.iter().all(|off| off.abs() < within), "{planet:?}: {off:?}");
    }
}

/// A brick with one degree of freedom less than the vehicle's: no forces, but damping moments.
const BRICK: &str = r#"
title = "The brick of NASA/TM-2015-218675"

[reference]
source = "NASA/TM-2015-218675, volume II, B.3"
mass = { weight = { pounds = 5.0, gravity_ft_s2 = 32.174 } }
area = { square_feet = 0.222222222222222 }
span = { feet = 0.333333333333333 }
chord = { feet = 0.666666666666667 }

[inertia]
source = "NASA/TM-2015-218675, volume II, B.3, in kg m2"
Ixx = 0.002568217
Iyy = 0.008421011
Izz = 0.009754656

[forces]
lift = { source = "none, as in the case", polynomial = [0.0] }
drag = { source = "none, as in the case", polynomial = [0.0] }

[moments]
roll_damping = { source = "NASA/TM-2015-218675, volume II, B.3", polynomial = [-1.0] }
pitch_damping = { source = "NASA/TM-2015-218675, volume II, B.3", polynomial = [-1.0] }
yaw_damping = { source = "NASA/TM-2015-218675, volume II, B.3", polynomial = [-1.0] }
"#;

/// Case 3: a brick tumbles while it falls from 30,000 ft, and the air damps its rates.
#[test]
fn published_a_brick_tumbles_and_is_damped() {
    let brick = Vehicle::from_toml("brick.toml", BRICK).unwrap().aerodynamics;
    let slug_ft2 = SLUG * FOOT * FOOT;
    let inertia = Inertia {
        Ixx: 0.001_894_220 * slug_ft2,
        Iyy: 0.006_211_019 * slug_ft2,
        Izz: 0.007_194_665 * slug_ft2,
        ..Inertia::default()
    };
    let body = inertia.body(1.0).unwrap();
    let planet = Planet::EARTH;
    let start = Motion {
        radius: planet.radius + 29_999.840_024_5 * FOOT,
        speed: 3.199_510_458_86 * FOOT,
        flight_path_angle: -89.9995_f64.to_radians(),
        azimuth: 90_f64.to_radians(),
        ..Motion::default()
    };
    let mut state = SVector::<f64, 9>::zeros();
    state.fixed_rows_mut::<6>(0).copy_from(&State::from(start));
    let rates = Vector3::new(9.447_809_532_23, 20.421_566_188_2, 29.790_494_559_9);
    state.fixed_rows_mut::<3>(6).copy_from(&rates.map(f64::to_radians));
    let mut f = |_: f64, state: &SVector<f64, 9>| {
        let motion: State = state.fixed_rows::<6>(0).into();
        let Motion { radius, speed, .. } = motion.into();
        let dynamic_pressure = 0.5 * air(radius - planet.radius).unwrap().density * speed * speed;
        let flow = Flow { dynamic_pressure, speed, ..Flow::default() };
        let rates: Vector3<f64> = state.fixed_rows::<3>(6).into();
        let acceleration = body.angular_acceleration(&rates, &brick.moment(&flow, &rates, 0.0));
        let mut slope = SVector::<f64, 9>::zeros();
        let fall = derivative(&planet, &motion, &AirAcceleration::default());
        slope.fixed_rows_mut::<6>(0).copy_from(&fall);
        slope.fixed_rows_mut::<3>(6).copy_from(&acceleration);
        slope
    };
    let expected = [
        (1.0, [4.104_876_154_1, 21.849_796_346_2, 28.071_862_252_6]),
        (10.0, [-0.119_673_377_375, -0.045_808_553_117_7, 8.425_541_745_43]),
        (30.0, [0.0, 0.0, 1.755_982_038_07e-5]),
    ];
    let mut tick = 10;
    for (until, rates) in expected {
        while f64::from(tick) * 0.01 < until - 1e-9 {
            state = rk4(&mut f, f64::from(tick) * 0.01, &state, 0.01);
            tick += 1;
        }
        let off = state.fixed_rows::<3>(6).map(f64::to_degrees) - Vector3::from(rates);
        assert!(off.amax() < 1e-5, "{until} s: {off}");
    }
}
