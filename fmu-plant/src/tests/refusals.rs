//! Values that the instance refuses, and the names in its messages.

use super::{
    CONTEXT, Ramp, STATE_COUNT, actuate, delayed, in_model_exchange, started, step, tabulate,
};
use crate::parameters::Actuation;
use crate::parameters::Initial;
use crate::plant::ReentryPlant;
use fmi_export::{Failure, LastEvent, Model};
use nalgebra::Vector3;
use vehicle::disturbance::DisturbanceKind;

#[test]
fn refusals_name_variables() {
    let changes: [fn(&mut ReentryPlant); 46] = [
        |instance| instance.parameters.inertia.Ixx = 0.0,
        |instance| instance.parameters.inertia.Ixz = 2e6,
        |instance| instance.parameters.inertia.Iyy = 1e7,
        |instance| instance.parameters.inertia_scale = 0.0,
        |instance| instance.parameters.initial.alpha = f64::NAN,
        |instance| instance.parameters.initial.beta = 1.6,
        |instance| instance.parameters.step = 0.0,
        |instance| instance.parameters.earth_rate = f64::NAN,
        |instance| instance.parameters.converter.delay = -1.0,
        |instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.converter.delay = 0.1;
        },
        |instance| instance.parameters.converter.resolution = -1.0,
        |instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.converter.resolution = 8.0;
        },
        |instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.aerodynamics_scale = -1.0;
        },
        |instance| instance.parameters.flight.altitude = 2e5,
        |instance| instance.parameters.flight.mach = -1.0,
        |instance| instance.parameters.bound = -1.0,
        |instance| instance.parameters.period = 0.0,
        |instance| instance.parameters.square_period = 0.0,
        |instance| instance.parameters.direction.x = 2.0,
        |instance| instance.parameters.end = -1.0,
        |instance| instance.parameters.waves[0].phase = f64::NAN,
        |instance| instance.parameters.table.used = 9,
        |instance| instance.parameters.table.period = -1.0,
        |instance| tabulate(instance, 0.0, &[(-1.0, [0.0; 3])]),
        |instance| tabulate(instance, 0.0, &[(1.0, [0.0; 3]), (1.0, [0.0; 3])]),
        |instance| tabulate(instance, 2.0, &[(0.0, [0.0; 3]), (1.0, [0.0; 3]), (2.0, [0.0; 3])]),
        |instance| tabulate(instance, 0.0, &[(0.0, [0.0; 3]), (1.0, [2.0, 0.0, 0.0])]),
        |instance| tabulate(instance, 0.0, &[(0.0, [0.0, -2.0, 0.0])]),
        |instance| tabulate(instance, 0.0, &[(0.0, [0.0, 0.0, f64::NAN])]),
        |instance| instance.parameters.sensing.surroundings.gravity = -1.0,
        |instance| instance.parameters.sensing.surroundings.field.x = f64::NAN,
        |instance| {
            instance.parameters.sensing.calibrates = true;
            instance.parameters.sensing.sequence.beta_amplitude = 1.5;
        },
        |instance| {
            instance.parameters.sensing.calibrates = true;
            instance.parameters.sensing.sequence.alpha_rate = f64::NAN;
        },
        |instance| instance.parameters.sensing.line.period = 0.0,
        |instance| instance.parameters.sensing.line.delay = 1e3,
        |instance| instance.parameters.sensing.line.drop_probability = 2.0,
        |instance| instance.parameters.sensing.triads[0].noise = -1.0,
        |instance| instance.parameters.sensing.triads[1].bandwidth = -1.0,
        |instance| instance.parameters.sensing.triads[2].range = -1.0,
        |instance| instance.parameters.sensing.triads[2].resolution = -1.0,
        |instance| instance.parameters.sensing.triads[0].matrix.fill(f64::NAN),
        |instance| instance.parameters.sensing.triads[1].bias.fill(f64::NAN),
        |instance| instance.parameters.sensing.triads[1].drift.fill(f64::NAN),
        |instance| instance.parameters.sensing.turntable.bandwidth = -1.0,
        |instance| instance.parameters.sensing.turntable.rate = -1.0,
        |instance| {
            instance.parameters.sensing.sensor_set = 0;
            instance.parameters.sensing.turntable.bandwidth = 10.0;
        },
    ];
    let refusal = |set: &fn(&mut ReentryPlant)| {
        let mut instance = ReentryPlant::new();
        instance.parameters.sensing.sensor_set = 2;
        set(&mut instance);
        instance.initialize(&CONTEXT).unwrap_err().to_string()
    };
    let actual: Vec<String> = changes.iter().map(refusal).collect();
    let expected: Vec<&str> = include_str!("messages.txt").lines().collect();
    assert_eq!(actual, expected);
}

#[test]
fn impossible_parameters_are_refused_by_name() {
    let refusal = |set: fn(&mut ReentryPlant)| {
        let mut instance = ReentryPlant::new();
        set(&mut instance);
        instance.initialize(&CONTEXT).unwrap_err().to_string()
    };
    for (message, name) in [
        (refusal(|instance| instance.parameters.inertia.Ixx = 0.0), "inertia.Ixx"),
        (refusal(|instance| instance.parameters.inertia.Ixz = 2e6), "inertia.Ixz"),
        (refusal(|instance| instance.parameters.inertia.Iyy = 1e7), "inertia.Iyy"),
        (refusal(|instance| instance.parameters.end = -1.0), "disturbance.end"),
        (refusal(|instance| instance.parameters.flight.altitude = 2e5), "flight.altitude"),
    ] {
        assert!(message.contains(name), "{message}");
    }
}

#[test]
fn a_singular_attitude_is_an_error_in_co_simulation_and_discarded_in_model_exchange() {
    let mut singular = [0.0; STATE_COUNT];
    singular[1] = 1.6;
    let mut instance = in_model_exchange(DisturbanceKind::None);
    instance.set_continuous_states(&singular);
    assert!(
        matches!(instance.calculate(0.1, LastEvent::InputSet), Err(Failure::Discard(text)) if text.contains("singular"))
    );
    let mut instance = started(|_| {});
    instance.set_continuous_states(&singular);
    assert!(
        matches!(instance.calculate(0.0, LastEvent::InputSet), Err(Failure::Error(text)) if text.contains("singular"))
    );
    let mut instance = started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        instance.parameters.inertia.Ixz = 0.0;
        instance.parameters.initial =
            Initial::new(Vector3::new(0.0, 1.5, 0.0), instance.parameters.initial.rates);
        instance.parameters.initial.rates = Vector3::new(0.0, 0.0, -0.5);
    });
    assert!(
        matches!(step(&mut instance, 0.0, 1.0), Err(Failure::Error(text)) if text.contains("beta"))
    );
}

#[test]
fn a_wrong_moment_is_an_error_and_the_instance_starts_again() {
    let mut instance = started(|_| {});
    instance.input.moment.x = f64::NAN;
    assert!(
        matches!(instance.calculate(0.0, LastEvent::InputSet), Err(Failure::Error(text)) if text.contains("moment"))
    );
    assert!(
        matches!(step(&mut instance, 0.0, 0.04), Err(Failure::Error(text)) if text.contains("moment"))
    );
    instance.input.moment.x = 0.0;
    instance.initialize(&CONTEXT).unwrap();
    step(&mut instance, 0.0, 0.04).unwrap();
}

#[test]
fn before_initialization_it_says_so() {
    let mut instance = ReentryPlant::new();
    assert!(
        instance
            .calculate(0.0, LastEvent::InputSet)
            .unwrap_err()
            .to_string()
            .contains("initialized")
    );
    assert!(step(&mut instance, 0.0, 1.0).is_err());
    assert!(instance.new_discrete_states(0.0).is_err());
}

#[test]
fn a_delay_is_refused_by_name_where_it_cannot_work() {
    let text = |failure: Failure| failure.to_string();
    let in_model_exchange = text(delayed(0.1).new_discrete_states(0.0).unwrap_err());
    assert!(
        in_model_exchange.contains("actuation.delay")
            && in_model_exchange.contains("co-simulation")
    );
    assert!(delayed(0.0).new_discrete_states(0.0).is_ok());
    let ramp = text(delayed(0.1).step(0.0, 0.04, &Ramp(1e5), &mut |_| {}).unwrap_err());
    assert!(ramp.contains("actuation.delay") && ramp.contains("derivatives"), "{ramp}");
    let mut converted = started(|instance| instance.parameters.converter.resolution = 8.0);
    let in_model_exchange = text(converted.new_discrete_states(0.0).unwrap_err());
    assert!(in_model_exchange.contains("actuation.resolution = 8 N m"), "{in_model_exchange}");
    let mut actuated = ReentryPlant::new();
    actuated.parameters.converter.delay = 0.1;
    actuate(&mut actuated);
    let actuated = text(actuated.initialize(&CONTEXT).unwrap_err());
    assert!(actuated.contains("actuation.delay"), "{actuated}");
}
