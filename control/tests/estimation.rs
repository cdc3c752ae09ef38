//! The attitude estimator on the sensors of the vehicle crate.

mod harness;

use control::estimation::ellipsoid::Correction;
use control::estimation::{
    self, Alignment, CalibrationMode, CalibrationStatus, Estimate, Estimator, Health, Settings,
    angles, mems_corrections,
};
use harness::platform::{
    CALIBRATION_DURATION, CALIBRATION_SEED, PERIOD, Truth, calibrated, calibration, config, errors,
    estimates, lines, mems, rest, scenario,
};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use std::sync::LazyLock;
use vehicle::kinematics::Kinematics;
use vehicle::platform::body_from_velocity;
use vehicle::scenario::Scenario;
use vehicle::sensor_data::SensorData;
use vehicle::sensors::Config;
use vehicle::triad::Window;

/// Settings for the MEMS set, with the corrections of the data file.
static CALIBRATED: LazyLock<Settings> =
    LazyLock::new(|| Settings { corrections: mems_corrections(), ..Settings::default() });

fn ideal() -> Config {
    config(&SensorData::embedded().ideal, 1)
}

/// Returns settings without filter, and without delay except that of the line.
fn sharp() -> Settings {
    Settings { cutoff: 0.0, sensor_delay: 0.0, ..Settings::default() }
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

/// Required is ‖W A − I‖ ≤ 5e-3 at a noise of 0.5 %. The noise of the set is 0.6 %, without the
/// steps of its converter.
#[test]
fn oracle_the_calibration_flight_finds_the_magnetometers_errors() {
    for seed in 1..=5 {
        let Settings { corrections: [_, _, found], .. } = calibrated(&mems(seed), 120.0);
        let SensorData { mems: [_, _, magnetometer], surroundings, .. } = SensorData::embedded();
        let size = surroundings.field.norm();
        let left = found.matrix * size * magnetometer.matrix - Matrix3::identity();
        let error = left.singular_values().max();
        assert!(error < 5e-3, "seed {seed}: {error}");
        assert!((found.bias - magnetometer.bias).norm() < 1e-3 * size, "seed {seed}");
    }
}

/// The values agree except for rounding, which may differ from machine to machine.
#[test]
fn regress_the_corrections_in_the_data_file_are_those_of_the_flight() {
    let corrections = calibrated(&mems(CALIBRATION_SEED), CALIBRATION_DURATION).corrections;
    for (correction, file) in corrections.iter().zip(&CALIBRATED.corrections) {
        let size = file.matrix.norm();
        assert!(
            (correction.matrix - file.matrix).norm() < 1e-9 * size,
            "{} {}",
            correction.matrix,
            file.matrix
        );
        assert!(
            (correction.bias - file.bias).norm() < 1e-9 / size.min(1.0),
            "{} {}",
            correction.bias,
            file.bias
        );
    }
}

#[test]
fn a_calibration_flight_cut_short_is_refused() {
    let trajectory = calibration(10.0);
    let lines = lines(&trajectory, &mems(1));
    let settings = Settings {
        calibration: CalibrationMode::Fit,
        calibration_duration: 5.0,
        corrections: CALIBRATED.corrections,
        ..Settings::default()
    };
    let estimator = Estimator::new(settings).unwrap();
    let mut memory = estimator.memory();
    for (truth, line) in trajectory.iter().zip(&lines) {
        estimator.update(&mut memory, truth.time, line);
        let expected = match truth.time {
            time if time < 0.005 => Health::Waiting,
            time if time < 5.005 => Health::Calibrating,
            _ => Health::Uncalibrated,
        };
        assert_eq!(memory.estimate.health, expected, "t = {}", truth.time);
    }
    assert_eq!(memory.calibration.status, CalibrationStatus::Refused);
    assert_eq!(
        memory.calibration.correction, settings.corrections[2],
        "the given one stays in use"
    );
    let [estimated, actual] = [memory.estimate.angles, trajectory[trajectory.len() - 1].angles]
        .map(|angles| Rotation3::from_matrix_unchecked(body_from_velocity(&angles)));
    assert!(estimated.angle_to(&actual) < 2f64.to_radians(), "and the attitude is found with it");
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
    let turning = |time: f64| {
        let angles = Vector3::new(0.2, 0.1, rate * time);
        Truth {
            time,
            angles,
            rates: Kinematics::Printed.r_inverse(&angles) * Vector3::new(0.0, 0.0, rate),
        }
    };
    let trajectory: Vec<_> = (0..1000).map(|k| turning(f64::from(k) * PERIOD)).collect();
    let lines = lines(&trajectory, &ideal());
    for (name, settings, limit) in [
        ("without filter", sharp(), 1e-6),
        ("with filter and prediction", Settings { sensor_delay: 0.0, ..Settings::default() }, 2e-4),
    ] {
        let settings = Settings { frozen_samples: 0, ..settings };
        let estimates = estimates(&settings, &lines);
        let [angles, rates] = errors(&trajectory, &estimates, 5.0);
        assert!(angles.norm() < limit, "{name}: {angles} deg");
        assert!(rates.norm() < limit.min(1.1e-4), "{name}: {rates} deg/s");
    }
}

#[test]
fn without_prediction_the_angles_are_late_by_the_delays() {
    let rate = 5f64.to_radians();
    let turning = |time: f64| {
        let angles = Vector3::new(0.0, 0.0, rate * time);
        Truth {
            time,
            angles,
            rates: Kinematics::Printed.r_inverse(&angles) * Vector3::new(0.0, 0.0, rate),
        }
    };
    let trajectory: Vec<_> = (0..1000).map(|k| turning(f64::from(k) * PERIOD)).collect();
    let lines = lines(&trajectory, &ideal());
    let settings = Settings { prediction: false, ..sharp() };
    let estimate = estimates(&settings, &lines)[900];
    // A sample arrives one tick after it was taken.
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
fn dropped_samples_are_bridged_counted_and_flagged() {
    let trajectory = scenario(1);
    let mut config = mems(1);
    config.line.drop_probability = 0.3;
    let settings = *CALIBRATED;
    let lines = lines(&trajectory, &config);
    let estimates = estimates(&settings, &lines);
    let [angles, rates] = errors(&trajectory, &estimates, 0.0);
    assert!(angles.norm() < 0.17 && rates.max() < 0.15, "{angles} {rates}");
    let dropped = estimates[estimates.len() - 1].dropped;
    assert!((1400..1600).contains(&dropped), "{dropped}");
    let bridged = estimates.iter().filter(|estimate| estimate.health == Health::Bridging).count();
    assert!(bridged.abs_diff(usize::try_from(dropped).unwrap()) < 5, "{bridged} {dropped}");
}

#[test]
fn after_a_long_silence_the_attitude_is_lost_and_found_again() {
    let trajectory = scenario(1);
    let mut config = mems(1);
    config.line.drop_probability = 1.0;
    config.line.drop_window = Window { start: 10.0, end: 13.0 };
    let settings = *CALIBRATED;
    let estimates = estimates(&settings, &lines(&trajectory, &config));
    assert_eq!(health_at(&estimates, 9.99), Health::Ok);
    assert_eq!(health_at(&estimates, 10.2), Health::Bridging);
    assert_eq!(health_at(&estimates, 12.0), Health::Lost);
    assert_eq!(health_at(&estimates, 13.1), Health::Ok);
    let [angles, _] = errors(&trajectory[1300..1500], &estimates[1300..1500], 13.5);
    assert!(angles.norm() < 0.28, "{angles}");
    let bridged = |time: f64| {
        let k = (time / PERIOD).round() as usize;
        (estimates[k].angles - trajectory[k].angles).norm().to_degrees()
    };
    assert!(bridged(10.2) < 0.16, "{}", bridged(10.2));
}

#[test]
fn a_frozen_sensor_is_left_out() {
    let settings = *CALIBRATED;
    for sensor in 0..3 {
        let trajectory = scenario(1);
        let mut config = mems(1);
        config.triads[sensor].freeze = Window { start: 10.0, end: 10.4 };
        let estimates = estimates(&settings, &lines(&trajectory, &config));
        assert_eq!(health_at(&estimates, 10.02), Health::Ok, "one equal reading is no proof");
        assert_eq!(health_at(&estimates, 10.2), Health::Frozen);
        assert_eq!(health_at(&estimates, 10.5), Health::Ok);
        let [angles, _] = errors(&trajectory, &estimates, 10.0);
        assert!(angles.norm() < 0.15, "sensor {sensor}: {angles}");
    }
}

#[test]
fn the_gyroscopes_bias_is_learned_and_seen_at_rest() {
    let mut config = ideal();
    let bias = Vector3::new(0.3, -0.2, 0.1).map(f64::to_radians);
    config.triads[0].bias = bias;
    config.triads[0].noise = 1e-3;
    let settings = Settings { frozen_samples: 0, ..Settings::default() };
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
        Settings { initial: Vector3::new(0.3, 0.2, 0.1), frozen_samples: 0, ..Settings::default() };
    let measured = estimates(&elsewhere, &lines);
    assert_eq!((measured[0].health, measured[0].angles), (Health::Waiting, elsewhere.initial));
    assert!((measured[1].angles - trajectory[1].angles).amax() < 1e-12);
    let given = estimates(&Settings { alignment: Alignment::Given, ..elsewhere }, &lines);
    assert!((given[1].angles - elsewhere.initial).amax() < 0.01);
}

#[test]
fn settings_that_cannot_work_are_refused_by_name() {
    let s = Settings::default();
    let singular = Correction { matrix: Matrix3::zeros(), ..Correction::default() };
    let nan = Correction { matrix: Matrix3::repeat(f64::NAN), ..Correction::default() };
    for (name, settings) in [
        ("period", Settings { period: 0.0, ..s }),
        ("cutoff", Settings { cutoff: 50.0, ..s }),
        ("cutoff", Settings { cutoff: f64::NAN, ..s }),
        ("sensor_delay", Settings { sensor_delay: -0.1, ..s }),
        ("lost_after", Settings { lost_after: 0.0, ..s }),
        ("calibration_duration", Settings { calibration_duration: f64::INFINITY, ..s }),
        (
            "corrections[0].matrix",
            Settings { corrections: [singular, s.corrections[1], s.corrections[2]], ..s },
        ),
        (
            "corrections[2].matrix",
            Settings { corrections: [s.corrections[0], s.corrections[1], nan], ..s },
        ),
    ] {
        let text = Estimator::new(settings).unwrap_err().to_string();
        assert!(text.contains(name), "{name}: {text}");
    }
}

/// Returns the largest attitude error (deg) from 5 s after the sample with this number on, if
/// `change` is applied to that sample at rest.
fn error_after(
    settings: &Settings,
    good: &[estimation::Line],
    number: usize,
    change: impl Fn(&mut estimation::Line),
) -> f64 {
    let mut lines = good[..number + 550].to_vec();
    change(&mut lines[number]);
    let mut worst = 0.0_f64;
    let expected =
        Rotation3::from_matrix_unchecked(body_from_velocity(&Scenario::crmpc2022().initial_angles));
    for estimate in &estimates(settings, &lines)[number + 500..] {
        let estimated = Rotation3::from_matrix_unchecked(body_from_velocity(&estimate.angles));
        let error = estimated.angle_to(&expected).to_degrees();
        worst = if error.is_finite() { worst.max(error) } else { f64::INFINITY };
    }
    worst
}

#[test]
fn five_seconds_after_any_single_bad_sample_the_attitude_is_known_to_a_degree() {
    let settings = *CALIBRATED;
    let given = Settings { alignment: Alignment::Given, ..settings };
    let good = lines(&rest(10.0), &mems(1));
    // The samples are the first ones, from which the estimate begins, later ones, and one after the
    // mean of the first has ended.
    for (settings, number) in [1, 2, 3, 300].into_iter().flat_map(|n| [(settings, n), (given, n)]) {
        for sensor in 0..3 {
            let range = settings.gates[sensor].range;
            for value in
                [0.0, 0.01 * range, 0.3 * range, range, 1.1 * range, 100.0, 1e160, f64::MAX]
            {
                for sign in [1.0, -1.0] {
                    let directions =
                        [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::repeat(1.0)];
                    for direction in directions {
                        let bad = direction * (sign * value);
                        let error = error_after(&settings, &good, number, |line| {
                            line.readings[sensor] = bad;
                        });
                        assert!(
                            error < 1.0,
                            "sample {number}, sensor {sensor}, {bad:?}: {error} deg"
                        );
                    }
                }
            }
            let error = error_after(&settings, &good, number, |line| line.readings[sensor] *= -1.0);
            assert!(error < 1.0, "sample {number}, sensor {sensor} turned round: {error} deg");
        }
        for time in [-f64::MAX, -1e9, 0.0, 1e3, 1e9, f64::MAX] {
            let error = error_after(&settings, &good, number, |line| line.time = time);
            assert!(error < 1.0, "sample {number} at {time} s: {error} deg");
        }
    }
}

#[test]
fn a_sample_that_cannot_be_believed_is_left_out_and_shown() {
    let settings = *CALIBRATED;
    let trajectory = rest(10.0);
    let good = lines(&trajectory, &mems(1));
    for change in [
        |line: &mut estimation::Line| line.readings[0].x = 100.0,
        |line: &mut estimation::Line| line.readings[1] *= -1.0,
        |line: &mut estimation::Line| line.readings[2].z = 1e160,
        |line: &mut estimation::Line| line.time = 1e9,
    ] {
        let mut bad = good.clone();
        change(&mut bad[500]);
        let estimates = estimates(&settings, &bad);
        assert_eq!(estimates[499].health, Health::Ok);
        assert_eq!((estimates[500].health, estimates[500].rejected), (Health::Rejected, 1));
        assert_eq!(estimates[501].health, Health::Ok, "one bad sample is forgotten");
        assert_eq!(estimates[999].rejected, 1);
    }
}

#[test]
fn readings_that_confirm_each_other_are_believed() {
    let trajectory = rest(10.0);
    let mut lines = lines(&trajectory, &mems(1));
    let step = Vector3::new(0.5, 0.0, 0.0);
    lines[500..].iter_mut().for_each(|line| line.readings[0] += step);
    let estimates = estimates(&CALIBRATED, &lines);
    assert_eq!(estimates[500].health, Health::Rejected);
    assert_eq!(estimates[501].health, Health::Ok);
    assert_eq!(estimates[999].rejected, 1);
}

#[test]
fn a_sensor_that_stays_beyond_its_range_means_a_lost_attitude() {
    let trajectory = rest(10.0);
    let mut lines = lines(&trajectory, &mems(1));
    for (k, line) in lines.iter_mut().enumerate().skip(500) {
        line.readings[1].x = 1e3 + k as f64;
    }
    let estimates = estimates(&CALIBRATED, &lines);
    assert_eq!(health_at(&estimates, 5.4), Health::Rejected);
    assert_eq!(health_at(&estimates, 5.6), Health::Lost);
    assert!(estimates.iter().all(|estimate| estimate.angles.iter().all(|angle| angle.is_finite())));
}
