//! Tests of the sensors through the instance's interface.

use super::model_exchange::{assert_same_motion, exchange, integrate};
use super::prelude::*;
use super::{outputs, started, step};
use vehicle::kinematics::r_inverse;
use vehicle::sensors::Sample;
use vehicle::triad::Window;

/// Selects a typical MEMS set with every effect that samples can have, on ticks that are exact
/// numbers.
pub(super) fn mems(instance: &mut ReentryPlant) {
    let p = &mut instance.parameters;
    p.kind = DisturbanceKind::None;
    p.step = 1.0 / 128.0;
    p.sensing.sensor_set = 2;
    p.sensing.line.period = 1.0 / 64.0;
    p.sensing.line.delay = 2.5 / 64.0;
    p.sensing.line.drop_probability = 0.2;
    p.sensing.triads[1].freeze = Window { start: 0.5, end: 0.75 };
    instance.input.moment = Vector3::new(2e4, -1e4, 1e4);
}

fn sample(instance: &mut ReentryPlant, time: f64) -> Sample {
    outputs(instance, time).measured
}

/// Returns the sample shown at every 1/16 s until 2 s, in communication steps of `length` s.
fn stepped(instance: &mut ReentryPlant, length: f64) -> Vec<Sample> {
    let mut shown = vec![sample(instance, 0.0)];
    let mut time = 0.0;
    while time < 2.0 {
        step(instance, time, time + length).unwrap();
        time += length;
        if (16.0 * time).fract() == 0.0 {
            shown.push(sample(instance, time));
        }
    }
    shown
}

#[test]
fn without_sensors_what_they_would_feel_is_shown_at_all_times() {
    let mut instance = started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        instance.input.moment = Vector3::new(1e5, 2e5, -1e5);
    });
    step(&mut instance, 0.0, 0.37).unwrap();
    let output = outputs(&mut instance, 0.37);
    let [rate, force, field] = output.measured.readings;
    assert_eq!((output.measured.number, output.measured.time), (0, 0.37));
    // The gyroscope shows ω less α̇ sin β about the bank axis, which is the R⁻¹ column of σ.
    let expected = output.rates
        - r_inverse(&output.angles).column(2) * (output.angle_rates.x * output.angles.y.sin());
    assert!((rate - expected).amax() < 1e-16 && (rate - output.rates).amax() > 1e-4);
    assert!((force.norm() - 9.80665).abs() < 1e-14 && (field.norm() - 5.094e-5).abs() < 1e-9);
    let mut exact = started(|instance| instance.parameters.kinematics = Kinematics::Exact);
    step(&mut exact, 0.0, 0.5).unwrap();
    let output = outputs(&mut exact, 0.5);
    assert_eq!(output.measured.readings[0], output.rates, "with the exact kinematics the same");
}

#[test]
fn ideal_sensors_show_the_truth_of_their_ticks_and_leave_the_line_as_it_is() {
    let mut instance = started(|instance| {
        mems(instance);
        instance.parameters.sensing.sensor_set = 1;
        instance.parameters.sensing.line.drop_probability = 0.0;
        instance.parameters.sensing.triads[1].freeze = Window::default();
    });
    let mut truth = started(|instance| {
        mems(instance);
        instance.parameters.sensing.sensor_set = 0;
    });
    let mut felt = vec![sample(&mut truth, 0.0)];
    for k in 0..40 {
        let [from, to] = [f64::from(k), f64::from(k + 1)].map(|tick| tick / 64.0);
        for instance in [&mut truth, &mut instance] {
            step(instance, from, to).unwrap();
        }
        felt.push(sample(&mut truth, to));
        let shown = sample(&mut instance, to);
        // The sample shown was taken two and a half ticks before.
        let Some(number) = (k + 1i32).checked_sub(2).filter(|&number| number > 0) else {
            assert_eq!((shown.number, shown.readings), (0, Sample::default().readings));
            continue;
        };
        assert_eq!(shown.number, number);
        let expected = felt[number as usize - 1];
        assert_eq!((shown.time, shown.readings), (expected.time, expected.readings));
    }
}

#[test]
fn samples_are_the_same_bits_whatever_the_communication_step() {
    let expected = stepped(&mut started(mems), 1.0 / 64.0);
    assert!(expected.last().unwrap().number > 100);
    for length in [1.0 / 256.0, 1.0 / 128.0, 1.0 / 32.0, 1.0 / 16.0] {
        // A step shorter than that of the integration changes the trajectory's last bits, but not
        // the samples, which are coarser.
        assert_eq!(stepped(&mut started(mems), length), expected, "{length}");
    }
}

#[test]
fn oracle_model_exchange_takes_the_samples_of_co_simulation_at_time_events() {
    let [mut cs, mut me] = [0, 1].map(|_| started(mems));
    let mut events = Vec::new();
    for k in 0..32 {
        let [from, to] = [f64::from(k), f64::from(k + 1)].map(|interval| interval / 16.0);
        step(&mut cs, from, to).unwrap();
        events.extend(exchange(&mut me, from, to));
        me.new_discrete_states(to).unwrap();
        let [cs, me] = [&mut cs, &mut me].map(|instance| outputs(instance, to));
        assert_same_motion(&cs, &me, &format!("{to}"));
        assert_eq!(
            (cs.measured.number, cs.measured.time),
            (me.measured.number, me.measured.time),
            "{to}"
        );
        for (i, step) in [1.4e-4, 1.2e-3, 1.6e-7].into_iter().enumerate() {
            let difference = cs.measured.readings[i] - me.measured.readings[i];
            assert!(difference.amax() < step, "{to}: at most a step of the converter");
        }
    }
    // Samples are taken at each tick and arrive half a tick after one: up to 128 events of either
    // kind in 2 s.
    events.sort_by(f64::total_cmp);
    events.dedup();
    let on_ticks = events.iter().filter(|&&time| (64.0 * time).fract() == 0.0).count();
    assert_eq!(
        (on_ticks, events.len() - on_ticks),
        (128, 126),
        "the first two have nothing to arrive"
    );
}

#[test]
fn in_model_exchange_what_is_shown_changes_at_events_only() {
    let mut instance = started(|instance| {
        mems(instance);
        instance.parameters.sensing.line.delay = 0.0;
    });
    instance.new_discrete_states(0.0).unwrap();
    let first = sample(&mut instance, 0.0);
    assert_eq!(first.number, 1);
    integrate(&mut instance, 0.0, 0.05);
    assert_eq!(sample(&mut instance, 0.05), first);
    instance.new_discrete_states(0.05).unwrap();
    assert_eq!(sample(&mut instance, 0.05).number, 4);
}

#[test]
fn initializing_again_starts_the_samples_again() {
    let mut instance = started(mems);
    let first = stepped(&mut instance, 1.0 / 16.0);
    instance.initialize(&super::CONTEXT).unwrap();
    assert_eq!(stepped(&mut instance, 1.0 / 16.0), first);
}

#[test]
fn a_wrong_trajectory_is_an_error_while_samples_are_taken() {
    let mut instance = started(mems);
    instance.input.trajectory.heading_rate = f64::NAN;
    assert!(step(&mut instance, 0.0, 0.5).is_err());
}
