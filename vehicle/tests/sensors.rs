//! Tests of the sensors and their line, effect by effect, against values computed by hand and the
//! statistics of the noise.

use crate::prelude::*;
use nalgebra::UnitQuaternion;
use vehicle::fault::{Fault, FaultKind};
use vehicle::fixes::Devices;
use vehicle::frames::Place;
use vehicle::platform::Readings;
use vehicle::sensors::{Config, Felt, Line, PerSensor, Sample, Sensors};
use vehicle::triad::{Triad, Window};

const PERIOD: f64 = 1.0 / 128.0;

/// Configuration of sensors without errors on a line without delay.
fn ideal() -> Config {
    Config {
        triads: PerSensor::default(),
        line: Line {
            period: PERIOD,
            delay: 0.0,
            drop_probability: 0.0,
            drop_window: Window { start: 0.0, end: 1e9 },
        },
        devices: Devices::default(),
        seed: 1,
    }
}

fn with(change: impl Fn(&mut Config)) -> Sensors {
    let mut config = ideal();
    change(&mut config);
    Sensors::new(&config, 0.0).unwrap()
}

/// Readings in which every sensor measures `value` along every axis.
fn uniform(value: f64) -> Readings {
    [Vector3::repeat(value); 3]
}

/// Samples output at `count` ticks while the sensors measure a signal of time.
fn run(sensors: &mut Sensors, count: u32, signal: impl Fn(f64) -> Readings) -> Vec<Sample> {
    (0..count)
        .map(|k| {
            let time = f64::from(k) * PERIOD;
            sensors.take(time, &signal(time));
            sensors.arrived()
        })
        .collect()
}

#[test]
fn oracle_the_bias_drifts_linearly_from_the_start() {
    let drift = Vector3::new(0.5, -0.25, 0.0);
    let mut sensors = with(|config| {
        config.triads[1].bias = Vector3::new(1.0, 2.0, 3.0);
        config.triads[1].drift = drift;
    });
    for (k, sample) in run(&mut sensors, 1000, |_| uniform(0.0)).iter().enumerate() {
        let expected = Vector3::new(1.0, 2.0, 3.0) + drift * (k as f64 * PERIOD);
        assert_eq!(sample.readings, [Vector3::zeros(), expected, Vector3::zeros()], "{k}");
    }
}

#[test]
fn published_data_sheet_values_of_the_mems_set() {
    // InvenSense DS-000189 1.3, sections 3.1 to 3.3
    let data = SensorData::embedded();
    let PerSensor([gyroscope, accelerometer, magnetometer]) = data.mems;
    let near = |value: f64, expected: f64| {
        assert!((value / expected - 1.0).abs() < 5e-3, "{value} {expected}");
    };
    near(gyroscope.noise.to_degrees(), 0.015 * 73.3f64.sqrt());
    near(1f64.to_radians() / gyroscope.resolution, 131.0);
    near(gyroscope.range.to_degrees(), 250.0);
    near(accelerometer.noise, 230e-6 * 9.80665 * 68.8f64.sqrt());
    near(9.80665 / accelerometer.resolution, 8192.0);
    near(accelerometer.range, 4.0 * 9.80665);
    near(magnetometer.resolution, 0.15e-6);
    near(magnetometer.range, 4900e-6);
    for (triad, scale, bias) in [
        (&gyroscope, 0.015, 5f64.to_radians()),
        (&accelerometer, 0.005, 0.05 * 9.80665),
        // The magnetometer's tolerance is that of the sensor alone; scale and soft iron are
        // assumed.
        (&magnetometer, 0.1, 300e-6),
    ] {
        let off = triad.matrix - Matrix3::identity();
        assert!(
            off.diagonal().amax() <= scale && triad.bias.amax() <= bias && triad.bias.amax() > 0.0
        );
    }
    // MathWorks, wrldmagm: F = 5.0940e4 nT, DEC = -13.6891, DIP = 65.9899
    let field = data.surroundings.field;
    near(field.norm(), 5.0940e-5);
    near(field.y.atan2(field.x).to_degrees(), -13.6891);
    near((field.z / field.norm()).asin().to_degrees(), 65.9899);
}

#[test]
fn oracle_noise_has_the_standard_deviation_that_is_set_and_no_memory() {
    const COUNT: u32 = 20_000;
    let sigma = [0.1, 2.0, 1e-6];
    let noisy = |seed, count| {
        let mut sensors = with(|config| {
            config.seed = seed;
            for (triad, sigma) in config.triads.iter_mut().zip(sigma) {
                triad.noise = sigma;
            }
        });
        run(&mut sensors, count, |_| uniform(0.0))
    };
    let samples = noisy(1, COUNT);
    assert_eq!(noisy(1, 10), samples[..10]);
    assert_ne!(noisy(2, 1)[0].readings, samples[0].readings);
    let n = f64::from(COUNT);
    // All nine noise values have variance 1.
    let values = |sample: &Sample| -> [f64; 9] {
        std::array::from_fn(|i| sample.readings[i / 3][i % 3] / sigma[i / 3])
    };
    let mean = |product: &dyn Fn(usize) -> f64| (0..samples.len()).map(product).sum::<f64>() / n;
    for i in 0..9 {
        // The bounds are five standard deviations of each estimate.
        assert!(mean(&|k| values(&samples[k])[i]).abs() < 5.0 / n.sqrt(), "{i}");
        let variance = mean(&|k| values(&samples[k])[i].powi(2));
        assert!((variance - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{i}: {variance}");
        for j in 0..9 {
            let next =
                mean(&|k| values(&samples[k])[i] * values(&samples[(k + 1) % samples.len()])[j]);
            assert!(next.abs() < 5.0 / n.sqrt(), "{i} {j}: {next}");
            if i != j {
                let across = mean(&|k| values(&samples[k])[i] * values(&samples[k])[j]);
                assert!(across.abs() < 5.0 / n.sqrt(), "{i} {j}: {across}");
            }
        }
    }
}

/// The oracle for the first-order lag integrates the filter in small steps, with the signal held
/// and growing.
#[test]
fn oracle_bandwidth_against_integration_of_the_filter() {
    let bandwidth = 5.0;
    let mut sensors = with(|config| config.triads[1].bandwidth = bandwidth);
    // A step at tick 0 would be measured from the start, because the first sample finds the filter
    // at rest.
    let signal = |time: f64| (3.0 * time).sin() + 20.0 * time;
    let samples = run(&mut sensors, 200, |time| uniform(signal(time)));
    let (mut y, fine) = (signal(0.0), 2000);
    for (k, sample) in (0u32..).zip(&samples) {
        let begin = f64::from(k) * PERIOD;
        assert!((sample.readings[1].x - y).abs() < 2e-4, "{k}: {} {y}", sample.readings[1].x);
        assert_eq!(sample.readings[0].x, signal(begin), "no bandwidth");
        for i in 0..fine {
            let h = PERIOD / f64::from(fine);
            let middle = begin + (f64::from(i) + 0.5) * h;
            y += (signal(middle) - y) * (1.0 - (-std::f64::consts::TAU * bandwidth * h).exp());
        }
    }
}

#[test]
fn oracle_range_is_applied_before_resolution_and_after_noise() {
    let shown = |value: f64, change: fn(&mut Triad)| {
        let mut sensors = with(|config| change(&mut config.triads[0]));
        sensors.take(0.0, &uniform(value));
        sensors.arrived().readings[0].x
    };
    let limited: fn(&mut Triad) = |triad| triad.range = 4.0;
    assert_eq!([shown(5.0, limited), shown(-5.0, limited), shown(3.9, limited)], [4.0, -4.0, 3.9]);
    let steps: fn(&mut Triad) = |triad| triad.resolution = 0.25;
    assert_eq!([shown(0.12, steps), shown(0.13, steps), shown(-0.4, steps)], [0.0, 0.25, -0.5]);
    // The value 4.1 is limited to 4.0, whose nearest multiple of 0.3 is 3.9.
    let both: fn(&mut Triad) = |triad| (triad.range, triad.resolution) = (4.0, 0.3);
    assert!((shown(4.1, both) - 3.9).abs() < 1e-15);
    // Noise leaves neither the range nor the converter's steps.
    let mut sensors = with(|config| {
        config.triads[0] = Triad { noise: 3.0, range: 2.0, resolution: 0.5, ..Triad::default() };
    });
    let samples = run(&mut sensors, 1000, |_| uniform(0.0));
    let values: Vec<f64> = samples.iter().map(|sample| sample.readings[0].y).collect();
    assert!(values.iter().all(|value| value.abs() <= 2.0 && (value / 0.5).fract() == 0.0));
    assert!(values.contains(&2.0) && values.contains(&-2.0) && values.contains(&0.5));
}

#[test]
fn oracle_samples_arrive_late_by_any_delay() {
    for ticks in [0.0, 0.4, 1.0, 2.5, 7.0] {
        let mut sensors = with(|config| config.line.delay = ticks * PERIOD);
        assert_eq!((sensors.arrived().number, sensors.arrived().readings), (0, uniform(0.0)));
        for quarter in 0..400 {
            let time = f64::from(quarter) * PERIOD / 4.0;
            sensors.take(time, &uniform(1.0 + time));
            let newest = (f64::from(quarter) / 4.0 - ticks).floor();
            let arrived = sensors.arrived();
            if newest < 0.0 {
                assert_eq!(
                    (arrived.number, arrived.readings),
                    (0, uniform(0.0)),
                    "{ticks} {quarter}"
                );
            } else {
                let taken = newest * PERIOD;
                assert_eq!(
                    (f64::from(arrived.number), arrived.time),
                    (newest + 1.0, taken),
                    "{ticks} {quarter}"
                );
                assert_eq!(arrived.readings, uniform(1.0 + taken));
            }
        }
    }
}

#[test]
fn events_are_where_samples_are_taken_and_where_they_arrive() {
    for (ticks, expected) in [
        (0.0, [1.0, 2.0, 3.0, 4.0, 5.0]),
        (0.25, [0.25, 1.0, 1.25, 2.0, 2.25]),
        (2.5, [1.0, 2.0, 2.5, 3.0, 3.5]),
        (1.0, [1.0, 2.0, 3.0, 4.0, 5.0]),
    ] {
        let sensors = with(|config| config.line.delay = ticks * PERIOD);
        let mut time = 0.0;
        let events = [0; 5].map(|_| {
            time = sensors.next_event(time);
            time / PERIOD
        });
        assert_eq!(events, expected, "delay of {ticks}");
    }
}

#[test]
fn a_dropped_sample_leaves_a_gap_in_the_numbers_and_the_one_before_in_place() {
    let window = Window { start: 10.0 * PERIOD, end: 13.0 * PERIOD };
    for delay in [0.0, 2.5 * PERIOD] {
        let mut sensors = with(|config| {
            config.line.delay = delay;
            config.line.drop_probability = 1.0;
            config.line.drop_window = window;
        });
        let samples = run(&mut sensors, 30, uniform);
        let mut numbers: Vec<i32> =
            samples.iter().map(|sample| sample.number).filter(|&number| number > 0).collect();
        numbers.dedup();
        // Ticks 10, 11 and 12 have the numbers 11, 12 and 13.
        assert_eq!(
            numbers,
            (1..=*numbers.last().unwrap()).filter(|k| !(11..14).contains(k)).collect::<Vec<_>>()
        );
        for sample in samples.iter().filter(|sample| sample.number > 0) {
            assert_eq!(
                sample.readings,
                uniform(f64::from(sample.number - 1) * PERIOD),
                "consistent"
            );
        }
    }
}

#[test]
fn a_frozen_sensor_repeats_its_value_while_the_samples_count_on() {
    let mut sensors = with(|config| {
        config.triads[2].noise = 1.0;
        config.triads[2].freeze = Window { start: 5.0 * PERIOD, end: 8.0 * PERIOD };
    });
    let samples = run(&mut sensors, 12, uniform);
    for (k, sample) in samples.iter().enumerate() {
        assert_eq!(sample.number as usize, k + 1);
        assert_eq!(sample.readings[0].x, k as f64 * PERIOD, "the others go on");
        let repeats = k > 0 && sample.readings[2] == samples[k - 1].readings[2];
        assert_eq!(repeats, (5..8).contains(&k), "{k}");
    }
    // A window from the start on repeats the first sample.
    let mut sensors = with(|config| config.triads[0].freeze = Window { start: 0.0, end: 1.0 });
    let samples = run(&mut sensors, 4, |time| uniform(1.0 + time));
    assert!(samples.iter().all(|sample| sample.readings[0] == Vector3::repeat(1.0)));
}

/// Sensors with a fix a second of a receiver and a star tracker, of which one or the inertial unit
/// has a fault from 3 s to 5 s.
fn with_fault(device: usize, kind: FaultKind, size: f64) -> Config {
    let mut config = ideal();
    let devices = &mut config.devices;
    (devices.gnss.position_noise, devices.gnss.velocity_noise) = (0.0, 0.0);
    (devices.star.noise, devices.star.period) = (0.0, 1.0);
    let fault = Fault { kind, window: Window { start: 3.0, end: 5.0 }, size };
    *[&mut devices.gnss.fault, &mut devices.star.fault, &mut devices.inertial][device] = fault;
    config
}

/// Their samples at 1024 ticks, 8 s, while they move.
fn faulty(device: usize, kind: FaultKind, size: f64) -> Vec<Sample> {
    let mut sensors = Sensors::new(&with_fault(device, kind, size), 0.0).unwrap();
    let take = |k: u32| {
        let time = f64::from(k) * PERIOD;
        let position = Vector3::new(7e6 + time, 0.0, 0.0);
        let attitude = UnitQuaternion::from_scaled_axis(Vector3::x() * (0.01 * time));
        let place = Place { position, velocity: Vector3::x(), attitude };
        sensors.take(time, Felt { readings: uniform(time), place: Some((place, 1e5)) });
        sensors.arrived()
    };
    (0..1024).map(take).collect()
}

#[test]
fn oracle_each_fault_acts_in_its_window() {
    use FaultKind::{Accelerometer, Attitude, Clock, Dropout, Frozen, Gyroscope, Late, Position};
    let at = |samples: &[Sample], time: f64| samples[(time / PERIOD) as usize];
    let good = faulty(0, FaultKind::None, 1.0);
    let number = |device: usize, sample: &Sample| {
        [sample.fixes.gnss.number, sample.fixes.star.number, sample.number][device]
    };
    for device in 0..3 {
        for kind in [Frozen, Dropout, Late, Clock, FaultKind::Restart] {
            let bad = faulty(device, kind, 1.0);
            let name = format!("{kind:?} of device {device}");
            assert_eq!(at(&bad, 2.99), at(&good, 2.99), "{name}");
            if !(kind == FaultKind::Restart || device < 2 && kind == Dropout) {
                assert_eq!(at(&bad, 6.5), at(&good, 6.5), "{name}");
            }
            let (now, sound) = (at(&bad, 4.1), at(&good, 4.1));
            let [arrived, due] = [&now, &sound].map(|sample| number(device, sample));
            let missing = match (kind, device) {
                (Dropout, 2) => (1.1 / PERIOD) as i32,
                (Dropout, _) => 2,
                (Late, 2) => (0.2 / PERIOD) as i32,
                (Late, _) => 1,
                (FaultKind::Restart, 2) => 384,
                (FaultKind::Restart, _) => 3,
                _ => 0,
            };
            assert!((due - arrived - missing).abs() <= i32::from(device == 2), "{name}: {arrived}");
            assert_ne!(now, sound, "{name}");
        }
    }
    let off =
        |bad: &[Sample]| at(bad, 4.1).fixes.gnss.position - at(&good, 4.1).fixes.gnss.position;
    let moved = off(&faulty(0, Position, 2.0)).map(f64::abs);
    assert!((moved - Vector3::repeat(1000.0)).norm() < 1e-6, "{moved}");
    let seen = |samples: &[Sample]| at(samples, 4.1).fixes.star.rotation().unwrap();
    let turned = seen(&faulty(1, Attitude, 1.0)).angle_to(&seen(&good));
    assert!((turned.to_degrees() - 0.5 * 3_f64.sqrt()).abs() < 1e-9, "{turned}");
    for (i, kind, unit) in [(0, Gyroscope, 100_f64.to_radians() / 3600.0), (1, Accelerometer, 0.5)]
    {
        let change = at(&faulty(2, kind, 2.0), 4.1).readings[i] - at(&good, 4.1).readings[i];
        assert!((change - Vector3::repeat(2.0 * unit)).norm() < 1e-12, "{change}");
    }
    for (device, kind, size) in
        [(0, Attitude, 1.0), (1, Gyroscope, 1.0), (0, Late, 6.0), (2, Clock, f64::NAN)]
    {
        let config = with_fault(device, kind, size);
        assert!(Sensors::new(&config, 0.0).is_err(), "{kind:?} of device {device}");
    }
}

#[test]
fn a_sample_is_taken_again_when_asked_again_at_its_tick_and_looking_takes_none() {
    let change = |config: &mut Config| {
        config.triads[0] = Triad { bandwidth: 5.0, noise: 0.1, ..Triad::default() };
    };
    let [mut once, mut often] = [0, 1].map(|_| with(change));
    for k in 0..20 {
        let time = f64::from(k) * PERIOD;
        assert_eq!(often.shown(time, &uniform(9.0)).number, k + 1);
        often.take(time, &uniform(9.0));
        often.take(time + 1e-10, &uniform(time));
        once.take(time, &uniform(time));
        assert_eq!(once.shown(time, &uniform(time)), once.arrived());
        assert_eq!(once.arrived(), often.arrived(), "{k}");
        // Between ticks no sample is taken.
        often.take(time + PERIOD / 3.0, &uniform(7.0));
        assert_eq!(often.shown(time + PERIOD / 2.0, &uniform(8.0)), once.arrived());
    }
}

#[test]
fn a_sample_whose_tick_was_missed_is_taken_late_and_says_so() {
    let mut sensors = with(|_| {});
    sensors.take(0.0, &uniform(0.0));
    sensors.take(3.25 * PERIOD, &uniform(3.25));
    let late = sensors.arrived();
    assert_eq!((late.number, late.time, late.readings), (4, 3.25 * PERIOD, uniform(3.25)));
}
