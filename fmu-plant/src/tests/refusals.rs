//! Values that the instance refuses, and the names in its messages.

use super::prelude::*;
use super::{CONTEXT, STATE_COUNT, delayed, in_model_exchange, started, step, tabulate};

#[test]
fn refusals_name_variables() {
    let changes: [fn(&mut Parameters); 46] = [
        |p| p.inertia_ratios[0] = 0.0,
        |p| p.inertia_ratios[3] = 82.0,
        |p| p.inertia_ratios[1] = 7.0,
        |p| p.inertia_scale = 0.0,
        |p| p.initial.alpha = f64::NAN,
        |p| p.initial.beta = 1.6,
        |p| p.step = 0.0,
        |p| p.earth_rate = f64::NAN,
        |p| p.converter.delay = -1.0,
        |p| (p.actuation, p.converter.delay) = (Actuation::SurfacesAndJets, 0.1),
        |p| p.converter.resolution = -1.0,
        |p| (p.actuation, p.converter.resolution) = (Actuation::SurfacesAndJets, 8.0),
        |p| (p.actuation, p.aerodynamics_scale) = (Actuation::SurfacesAndJets, -1.0),
        |p| p.flight.altitude = 2e5,
        |p| p.flight.mach = -1.0,
        |p| p.bound = -1.0,
        |p| p.period = 0.0,
        |p| p.square_period = 0.0,
        |p| p.direction.x = 2.0,
        |p| p.end = -1.0,
        |p| p.waves[0].phase = f64::NAN,
        |p| p.table.used = 9,
        |p| p.table.period = -1.0,
        |p| p.table.period = 1e-4,
        |p| tabulate(p, 0.0, &[(-1.0, [0.0; 3])]),
        |p| tabulate(p, 0.0, &[(1.0, [0.0; 3]), (1.0, [0.0; 3])]),
        |p| tabulate(p, 2.0, &[(0.0, [0.0; 3]), (1.0, [0.0; 3]), (2.0, [0.0; 3])]),
        |p| tabulate(p, 0.0, &[(0.0, [0.0; 3]), (1.0, [2.0, 0.0, 0.0])]),
        |p| tabulate(p, 0.0, &[(0.0, [0.0, -2.0, 0.0])]),
        |p| tabulate(p, 0.0, &[(0.0, [0.0, 0.0, f64::NAN])]),
        |p| p.sensing.surroundings.gravity = -1.0,
        |p| p.sensing.surroundings.field.x = f64::NAN,
        |p| p.sensing.line.period = 0.0,
        |p| p.sensing.line.delay = 1e3,
        |p| p.sensing.line.drop_probability = 2.0,
        |p| p.sensing.triads[0].noise = -1.0,
        |p| p.sensing.triads[1].bandwidth = -1.0,
        |p| p.sensing.triads[2].range = -1.0,
        |p| p.sensing.triads[2].resolution = -1.0,
        |p| p.sensing.triads[0].matrix.fill(f64::NAN),
        |p| p.sensing.triads[1].bias.fill(f64::NAN),
        |p| p.sensing.triads[1].drift.fill(f64::NAN),
        |p| p.sensing.turntable.bandwidth = -1.0,
        |p| p.sensing.turntable.rate = -1.0,
        |p| p.sensing.turntable.resolution = -1.0,
        |p| (p.sensing.sensor_set, p.sensing.turntable.bandwidth) = (0, 10.0),
    ];
    let refusal = |set: &fn(&mut Parameters)| {
        let mut instance = ReentryPlant::new();
        instance.parameters.sensing.sensor_set = 2;
        set(&mut instance.parameters);
        instance.initialize(&CONTEXT).unwrap_err().to_string()
    };
    let actual: Vec<String> = changes.iter().map(refusal).collect();
    let expected: Vec<&str> = include_str!("messages.txt").lines().collect();
    assert_eq!(actual, expected);
}

#[test]
fn a_singular_attitude_is_an_error_in_co_simulation_and_discarded_in_model_exchange() {
    let mut singular = [0.0; STATE_COUNT];
    singular[1] = 1.6;
    let mut instance = in_model_exchange(DisturbanceKind::None);
    instance.set_continuous_states(&singular);
    let failure = instance.calculate(0.1, LastEvent::InputSet).unwrap_err();
    assert!(matches!(failure, Failure::Discard(text) if text.contains("singular")));
    let mut instance = started(|_| {});
    instance.set_continuous_states(&singular);
    let failure = instance.calculate(0.0, LastEvent::InputSet).unwrap_err();
    assert!(matches!(failure, Failure::Error(text) if text.contains("singular")));
}

#[test]
fn a_wrong_moment_is_an_error_and_the_instance_starts_again() {
    let mut instance = started(|_| {});
    instance.input.moment.x = f64::NAN;
    let failure = instance.calculate(0.0, LastEvent::InputSet).unwrap_err();
    assert!(matches!(failure, Failure::Error(text) if text.contains("moment")));
    let failure = step(&mut instance, 0.0, 0.04).unwrap_err();
    assert!(matches!(failure, Failure::Error(text) if text.contains("moment")));
    instance.input.moment.x = 0.0;
    instance.initialize(&CONTEXT).unwrap();
    step(&mut instance, 0.0, 0.04).unwrap();
}

#[test]
fn model_exchange_refuses_a_delay_and_a_resolution_by_name() {
    let refusal = |mut instance: ReentryPlant| {
        instance.new_discrete_states(0.0).err().map(|failure| failure.to_string())
    };
    assert_eq!(refusal(delayed(0.0)), None);
    let text = refusal(delayed(0.1)).unwrap();
    assert!(text.contains("actuation.delay") && text.contains("co-simulation"), "{text}");
    let converted = started(|instance| instance.parameters.converter.resolution = 8.0);
    assert!(refusal(converted).unwrap().contains("actuation.resolution = 8 N m"));
}
