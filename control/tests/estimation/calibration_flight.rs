//! The calibration flight and the corrections that it gives.

use super::CALIBRATED;
use crate::harness::platform::{
    CALIBRATION_DURATION, CALIBRATION_SEED, calibrated, calibration, calibration_angles, lines,
    mems,
};
use crate::prelude::*;
use control::estimation::{CalibrationMode, CalibrationStatus, Estimator, Health, Settings};
use vehicle::platform::body_from_velocity;
use vehicle::sensors::PerSensor;

/// Required is ‖W A − I‖ ≤ 5e-3 at a noise of 0.5 %. The noise of the set is 0.6 %, without the
/// steps of its converter.
#[test]
fn oracle_the_calibration_flight_finds_the_magnetometers_errors() {
    for seed in 1..=5 {
        let found = calibrated(&mems(seed), 120.0).corrections[2];
        let SensorData { mems: PerSensor([_, _, magnetometer]), surroundings, .. } =
            SensorData::embedded();
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
    for (correction, file) in corrections.iter().zip(CALIBRATED.corrections.iter()) {
        let size = file.matrix.norm();
        assert!((correction.matrix - file.matrix).norm() < 1e-9 * size, "{correction:?}");
        assert!((correction.bias - file.bias).norm() < 1e-9 / size.min(1.0), "{correction:?}");
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
        ..Settings::ours()
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

/// Returns `count` directions spread evenly over the sphere.
fn directions(count: u32) -> impl Iterator<Item = Vector3<f64>> {
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
        let (sine, cosine) = (f64::from(k) * std::f64::consts::PI * (3.0 - 5f64.sqrt())).sin_cos();
        Vector3::new(cosine, sine, 0.0) * (1.0 - z * z).sqrt() + Vector3::new(0.0, 0.0, z)
    })
}

#[test]
fn in_two_minutes_the_calibration_sequence_sees_every_direction_within_13_degrees() {
    let data = SensorData::embedded();
    let initial = Scenario::crmpc2022().initial_angles;
    for fixed in [data.surroundings.field.normalize(), Vector3::z()] {
        let seen: Vec<_> = (0..1200)
            .map(|k| {
                let [angles, _] = calibration_angles(&initial, 0.1 * f64::from(k));
                body_from_velocity(&angles) * fixed
            })
            .collect();
        let farthest = directions(1000)
            .map(|axis| seen.iter().map(|seen| seen.dot(&axis)).fold(-1.0, f64::max))
            .fold(1.0, f64::min);
        assert!(farthest > 13f64.to_radians().cos(), "{} deg", farthest.acos().to_degrees());
    }
}
