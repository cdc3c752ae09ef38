//! Samples that are dropped, frozen, out of range or wrong.

use super::{CALIBRATED, health_at};
use crate::harness::platform::{PERIOD, errors, estimates, lines, mems, rest, scenario};
use crate::prelude::*;
use control::estimation::{self, Health, Settings};
use vehicle::triad::Window;

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
