//! Outputs between steps and events.

use super::entry::entering;
use super::prelude::*;
use super::sensors::mems;
use super::{delayed, in_model_exchange, outputs, started, step};

#[test]
fn outputs_are_right_from_initialization_on() {
    let mut instance = started(|_| {});
    let scenario = Scenario::crmpc2022();
    let output = outputs(&mut instance, 0.0);
    assert_eq!((output.angles, output.rates), (scenario.initial_angles, scenario.initial_rates));
    assert!(output.delta.amax() > 0.0 && output.delta.amax() <= scenario.disturbance.bound);
    // At rest ω̇ = R⁻¹ Δ holds.
    let expected = vehicle::kinematics::r_inverse(&output.angles) * output.delta;
    assert!((output.angular_acceleration - expected).amax() < 1e-15);
}

#[test]
fn oracle_what_neither_the_control_moment_nor_inertia_explains_is_the_total_disturbance() {
    for enters in [false, true] {
        let mut instance = started(|instance| {
            if enters {
                entering(instance);
            }
            instance.parameters.kind = DisturbanceKind::Constant;
            instance.parameters.inertia_ratios = [0.9, 1.1, 1.0, 1.3, 1.0, 1.0];
            instance.parameters.initial.rates = Vector3::new(0.02, -0.03, 0.01);
        });
        instance.input.moment = Vector3::new(3e4, -2e4, 1e4);
        instance.input.disturbance_moment = Vector3::new(4e3, 5e3, -6e3);
        let output = outputs(&mut instance, 0.0);
        let explained = instance
            .ready()
            .unwrap()
            .body()
            .angular_acceleration(&output.rates, &output.applied_moment);
        let kinematics = instance.parameters.kinematics.r(&output.angles);
        let rest = kinematics * (output.angular_acceleration - explained);
        assert!((output.total_disturbance - rest).amax() < 1e-12, "{}", output.total_disturbance);
        assert!((output.total_disturbance - output.delta).amax() > 1e-3, "enters: {enters}");
    }
}

#[test]
fn oracle_the_error_of_the_inertia_is_the_one_that_made_it() {
    let errors = |product, scale| {
        let mut instance = started(|instance| {
            instance.parameters.inertia_ratios[3] = product;
            instance.parameters.inertia_scale = scale;
        });
        outputs(&mut instance, 0.0).inertia_errors
    };
    let [common, rest] = errors(1.0, 1.05);
    assert!((common - 0.05).abs() < 1e-15 && rest == 0.0, "{common} {rest}");
    // The nominal tensor has a product of inertia, which the ratio 0 removes.
    let inertia = Scenario::crmpc2022().inertia;
    let [common, rest] = errors(0.0, 1.0);
    let product = inertia.Ixz / (inertia.Ixx * inertia.Izz).sqrt();
    // The eigenvalues 1/(1 ± p) of the pencil and 1.
    let (least, largest) = (1.0 / (1.0 + product.abs()), 1.0 / (1.0 - product.abs()));
    assert!((common - (f64::midpoint(least, largest) - 1.0)).abs() < 1e-12, "{common}");
    assert!((rest - (largest - least) / (largest + least)).abs() < 1e-12, "{rest}");
    assert!(rest > 0.01);
}

#[test]
fn at_a_tick_the_outputs_show_the_disturbance_of_the_step_to_come() {
    for kind in [DisturbanceKind::White, DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment]
    {
        let mut instance = started(|instance| instance.parameters.kind = kind);
        instance.input.moment = Vector3::new(1e4, -1e4, 1e4);
        step(&mut instance, 0.0, 0.04).unwrap();
        instance.input.moment *= -1.0;
        let announced = outputs(&mut instance, 0.04).delta;
        step(&mut instance, 0.04, 0.08 - 1e-6).unwrap();
        assert_eq!(outputs(&mut instance, 0.08 - 1e-6).delta, announced, "kind {kind:?}");
    }
}

#[test]
fn between_events_the_disturbance_is_held_even_beyond_a_tick() {
    let mut instance = in_model_exchange(DisturbanceKind::White);
    let held = outputs(&mut instance, 0.0).delta;
    for time in [0.01, 0.04, 0.041] {
        assert_eq!(outputs(&mut instance, time).delta, held);
    }
    assert_eq!(instance.new_discrete_states(0.04).unwrap().next_event_time, Some(0.08));
    assert_ne!(outputs(&mut instance, 0.04).delta, held);
}

#[test]
fn an_event_iteration_sees_the_latest_moment() {
    let mut instance =
        started(|instance| instance.parameters.kind = DisturbanceKind::AgainstMoment);
    instance.new_discrete_states(0.0).unwrap();
    let before = outputs(&mut instance, 0.0).delta;
    instance.input.moment = vehicle::kinematics::r_inverse(&instance.output.angles) * before * 1e7;
    instance.new_discrete_states(0.0).unwrap();
    assert_ne!(outputs(&mut instance, 0.0).delta, before);
    instance.input.moment = Vector3::zeros();
    instance.new_discrete_states(0.02).unwrap();
    assert_ne!(outputs(&mut instance, 0.02).delta, before, "between ticks the value is kept");
}

#[test]
fn oracle_a_delayed_moment_is_shown_when_it_acts() {
    let mut instance = delayed(0.1);
    let pitch = |k: u32| Vector3::new(0.0, 1e4 * f64::from(k + 1), 0.0);
    for k in 0..20_u32 {
        let time = 0.04 * f64::from(k);
        instance.input.moment = pitch(k);
        // The delay of 0.1 s is two and a half steps.
        let acts = if k < 3 { Vector3::zeros() } else { pitch(k - 3) };
        assert_eq!(outputs(&mut instance, time).applied_moment, acts, "{k}");
        step(&mut instance, time, time + 0.04).unwrap();
    }
}

#[test]
fn looking_changes_nothing() {
    let [mut looked_at, mut left_alone] = [0, 1].map(|_| {
        started(|instance| {
            mems(instance);
            instance.parameters.kind = DisturbanceKind::AgainstMoment;
        })
    });
    for k in 0..64 {
        let [from, to] = [f64::from(k), f64::from(k + 1)].map(|tick| tick / 50.0);
        looked_at.input.moment = Vector3::repeat(-1e4);
        for _ in 0..3 {
            outputs(&mut looked_at, from);
        }
        for instance in [&mut looked_at, &mut left_alone] {
            instance.input.moment = Vector3::new(1e4 * from.sin(), 0.0, 1e4);
            step(instance, from, to).unwrap();
        }
    }
    assert_eq!(outputs(&mut looked_at, 1.28), outputs(&mut left_alone, 1.28));
}
