//! The attitude estimator on the sensors of the vehicle crate.

mod calibration_flight;
mod faults;

use crate::harness::platform::{
    PERIOD, Truth, config, errors, estimates, lines, mems, rest, scenario,
};
use crate::prelude::*;
use control::estimation::{Estimate, Health, Settings, angles, mems_corrections};
use proptest::prelude::*;
use std::sync::LazyLock;
use vehicle::sensors::Config;

/// Settings for the MEMS set, with the corrections of the data file.
static CALIBRATED: LazyLock<Settings> =
    LazyLock::new(|| Settings { corrections: mems_corrections(), ..Settings::ours() });

fn ideal() -> Config {
    config(&SensorData::embedded().ideal, 1)
}

/// Returns settings without filter, and without delay except that of the line.
fn sharp() -> Settings {
    Settings { cutoff: 0.0, sensor_delay: 0.0, ..Settings::ours() }
}

fn health_at(estimates: &[Estimate], time: f64) -> Health {
    estimates[(time / PERIOD).round() as usize].health
}

proptest! {
    #[test]
    fn oracle_angles_come_back_from_the_rotation(alpha in -3.1..3.1, beta in -1.5..1.5, sigma in -3.1..3.1) {
        let expected = Vector3::new(alpha, beta, sigma);
        let rotation = Rotation3::from_matrix_unchecked(body_from_velocity(&expected));
        prop_assert!((angles(&rotation) - expected).amax() < 1e-12);
    }
}

/// With the MEMS set the errors are within 0.15 deg and 0.1 deg/s, for the norm of the three angles
/// and for each rate, at rest and in motion. The seeds are not those that set the filter.
#[test]
fn oracle_errors_with_the_mems_set_are_within_what_is_required() {
    let settings = *CALIBRATED;
    for seed in 101..=105 {
        for (name, trajectory) in [("rest", rest(50.0)), ("motion", scenario(seed))] {
            let lines = lines(&trajectory, &mems(seed));
            let estimates = estimates(&settings, &lines);
            let [angles, rates] = errors(&trajectory, &estimates, 0.0);
            assert!(angles.norm() < 0.15, "{name}, seed {seed}: {angles}");
            assert!(rates.max() < 0.1, "{name}, seed {seed}: {rates}");
            assert!(estimates[1..].iter().all(|estimate| estimate.health == Health::Ok));
        }
    }
}

#[test]
fn oracle_without_errors_a_steady_turn_is_followed_exactly() {
    // σ turns about the velocity with α and β held, so that the platform's rate is constant about a
    // fixed axis.
    let rate = 5f64.to_radians();
    let turning = |k: u32| {
        let time = f64::from(k) * PERIOD;
        let angles = Vector3::new(0.2, 0.1, rate * time);
        let rates = Kinematics::Printed.r_inverse(&angles) * Vector3::new(0.0, 0.0, rate);
        Truth { time, angles, rates }
    };
    let trajectory: Vec<_> = (0..1000).map(turning).collect();
    let lines = lines(&trajectory, &ideal());
    for (name, settings, limit) in [
        ("without filter", sharp(), 1e-6),
        ("with filter and prediction", Settings { sensor_delay: 0.0, ..Settings::ours() }, 2e-4),
    ] {
        let settings = Settings { frozen_samples: 0, ..settings };
        let estimates = estimates(&settings, &lines);
        let [angles, rates] = errors(&trajectory, &estimates, 5.0);
        assert!(angles.norm() < limit, "{name}: {angles} deg");
        assert!(rates.norm() < limit.min(1.1e-4), "{name}: {rates} deg/s");
    }
    // Without prediction the angles are late: a sample arrives one tick after it was taken.
    let settings = Settings { prediction: false, frozen_samples: 0, ..sharp() };
    let estimate = estimates(&settings, &lines)[900];
    assert!((trajectory[900].angles.z - estimate.angles.z - rate * PERIOD).abs() < 1e-6);
}

#[test]
fn the_printed_kinematics_get_the_rates_that_they_take() {
    let trajectory = scenario(1);
    let lines = lines(&trajectory, &ideal());
    let rms_of = |kinematics| {
        errors(&trajectory, &estimates(&Settings { kinematics, ..sharp() }, &lines), 0.02)[1]
    };
    let (printed, exact) = (rms_of(Kinematics::Printed), rms_of(Kinematics::Exact));
    assert!(printed.norm() < 0.03, "one tick late: {printed}");
    assert!(exact.norm() > 1.5 * printed.norm(), "what the printed R lacks: {exact}");
}

#[test]
fn the_gyroscopes_bias_is_learned_and_seen_at_rest() {
    let mut config = ideal();
    let bias = Vector3::new(0.3, -0.2, 0.1).map(f64::to_radians);
    config.triads[0].bias = bias;
    config.triads[0].noise = 1e-3;
    let settings = Settings { frozen_samples: 0, ..Settings::ours() };
    let seen = Settings { rest_duration: 5.0, ..settings };
    let trajectory = rest(120.0);
    let lines = lines(&trajectory, &config);
    let learned = estimates(&settings, &lines)[trajectory.len() - 1].gyroscope_bias;
    assert!((learned - bias).amax() < 0.0017f64.to_radians(), "{}", learned.map(f64::to_degrees));
    let estimates = estimates(&seen, &lines);
    let at_rest = estimates[600].gyroscope_bias;
    assert!((at_rest - bias).amax() < 0.007f64.to_radians(), "{}", at_rest.map(f64::to_degrees));
}

#[test]
fn the_first_estimate_is_the_given_attitude_or_the_measured_one() {
    let trajectory = rest(1.0);
    let lines = lines(&trajectory, &ideal());
    let elsewhere =
        Settings { initial: Vector3::new(0.3, 0.2, 0.1), frozen_samples: 0, ..Settings::ours() };
    let measured = estimates(&elsewhere, &lines);
    assert_eq!((measured[0].health, measured[0].angles), (Health::Waiting, elsewhere.initial));
    assert!((measured[1].angles - trajectory[1].angles).amax() < 1e-12);
    let given = estimates(&Settings { alignment: Alignment::Given, ..elsewhere }, &lines);
    assert!((given[1].angles - elsewhere.initial).amax() < 0.01);
}
