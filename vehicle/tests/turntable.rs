//! Tests of the turntable against a servo that is integrated in small steps, and against values
//! computed by hand.

use crate::prelude::*;
use proptest::prelude::*;
use std::f64::consts::TAU;
use vehicle::sensors::Instant;
use vehicle::turntable::{Config, Turntable};

const PERIOD: f64 = 0.01;
const SERVO: Config = Config { bandwidth: 10.0, rate: 1.0, resolution: 0.0 };

fn table(config: Config) -> Turntable {
    Turntable::new(&config).unwrap().unwrap()
}

fn tick(k: u32) -> Instant {
    Instant { tick: k.into(), time: f64::from(k) * PERIOD }
}

/// Pose of a turntable after samples of the vehicle's angles.
fn followed(config: Config, samples: &[Vector3<f64>]) -> Pose {
    let mut table = table(config);
    let mut pose = at_rest(samples[0]);
    for (k, &angles) in (0..).zip(samples) {
        let at = tick(k);
        pose = table.pose(at, &at_rest(angles), &Vector3::zeros());
        table.follow(at, &at_rest(angles));
    }
    pose
}

/// Angle of one axis in a thousand small steps per period, from midpoint to midpoint.
fn integrated(config: Config, samples: &[f64]) -> f64 {
    let steps = 1000;
    let h = PERIOD / f64::from(steps);
    let limit = if config.rate == 0.0 { f64::INFINITY } else { config.rate };
    let rate = |command: f64, angle: f64| {
        (TAU * config.bandwidth * (command - angle)).clamp(-limit, limit)
    };
    let mut angle = samples[0];
    for pair in samples.windows(2) {
        let command = |k: f64| pair[0] + (pair[1] - pair[0]) * k / f64::from(steps);
        for k in 0..steps {
            let half = angle + 0.5 * h * rate(command(f64::from(k)), angle);
            angle += h * rate(command(f64::from(k) + 0.5), half);
        }
    }
    angle
}

proptest! {
    /// Commands of all kinds: slow ones, and ones faster than the servo, in both directions.
    #[test]
    fn oracle_the_closed_form_against_an_integrated_servo(
        changes in proptest::collection::vec(-0.06..0.06, 3..12),
        bandwidth in 1.0..30.0,
        rate in prop_oneof![Just(0.0), 0.1..4.0],
    ) {
        let config = Config { bandwidth, rate, resolution: 0.0 };
        let samples: Vec<f64> = changes.iter().scan(0.0, |angle, change| {
            *angle += change;
            Some(*angle)
        }).collect();
        let vectors: Vec<_> = samples.iter().map(|&angle| Vector3::new(angle, -angle, 0.5 * angle)).collect();
        let poses = followed(config, &vectors);
        let halves: Vec<f64> = samples.iter().map(|angle| 0.5 * angle).collect();
        let expected = integrated(config, &samples);
        prop_assert!((poses.angles.x - expected).abs() < 2e-7, "{poses:?} {expected}");
        prop_assert!((poses.angles.y + expected).abs() < 2e-7);
        prop_assert!((poses.angles.z - integrated(config, &halves)).abs() < 2e-7);
    }
}

#[test]
fn oracle_a_ramp_is_followed_at_its_rate_a_time_constant_behind() {
    let rates = Vector3::new(0.2, -0.1, 0.3);
    let samples: Vec<_> = (0..200).map(|k| rates * (PERIOD * f64::from(k))).collect();
    let pose = followed(SERVO, &samples);
    let behind = samples[199] - pose.angles;
    assert!((behind - rates / (TAU * SERVO.bandwidth)).amax() < 1e-12, "{behind}");
    let angle_rates = Kinematics::Exact.r(&pose.angles) * pose.rates;
    assert!((angle_rates - rates).amax() < 1e-12, "{angle_rates}");
    assert!((pose.alpha_rate - rates.x).abs() < 1e-12);
}

#[test]
fn oracle_a_fast_servo_stands_where_the_vehicle_does() {
    let rates = Vector3::new(0.2, -0.1, 0.3);
    let samples: Vec<_> = (0..200).map(|k| rates * (PERIOD * f64::from(k))).collect();
    for bandwidth in [1e4, 1e8, 1e12, 1e200] {
        let pose = followed(Config { bandwidth, rate: 0.0, resolution: 0.0 }, &samples);
        assert!((pose.angles - samples[199]).amax() < 1e-5, "{bandwidth} Hz: {pose:?}");
        let angle_rates = Kinematics::Exact.r(&pose.angles) * pose.rates;
        assert!((angle_rates - rates).amax() < 1e-12, "{bandwidth} Hz: {angle_rates}");
    }
}

#[test]
fn the_command_is_rounded_to_the_converters_step() {
    let config = Config { resolution: 0.01, ..SERVO };
    let held = [Vector3::new(0.0149, -0.0151, 1.0)];
    let pose = followed(config, &held);
    assert!((pose.angles - Vector3::new(0.01, -0.02, 1.0)).amax() < 1e-15);
    assert_eq!(pose.rates, Vector3::zeros());
}

#[test]
fn a_sample_that_is_taken_again_replaces_the_last_one() {
    let mut once = table(SERVO);
    let mut again = table(SERVO);
    for k in 0..20 {
        let pose = at_rest(Vector3::repeat(0.02 * f64::from(k * k)));
        again.follow(tick(k), &at_rest(Vector3::repeat(9.0)));
        for table in [&mut once, &mut again] {
            table.follow(tick(k), &pose);
        }
    }
    assert_eq!(once, again);
}

#[test]
fn oracle_the_turn_of_the_trajectory_is_felt_as_on_the_vehicle() {
    let turn = Vector3::new(0.01, -0.02, 0.03);
    let pose = at_rest(Vector3::new(0.2, -0.3, 0.5));
    let shown = table(SERVO).pose(tick(0), &pose, &turn);
    // The angles rest: R ω = -T times the turn.
    let exact = Kinematics::Exact;
    let rest = exact.r(&pose.angles) * shown.rates + exact.turn(&pose.angles) * turn;
    assert!(rest.amax() < 1e-16, "{rest}");
}
