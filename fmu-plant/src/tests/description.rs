//! The description of the FMU, and the places of its variables.

use crate::plant::ReentryPlant;
use fmi_export::describe;
use model_description::variable::{Causality, Variability, VariableKind};
use vehicle::Scenario;

#[test]
fn the_description_holds() {
    let description = describe::<ReentryPlant>();
    description.check().unwrap();
    let motion = (0..6).map(|i| (i, i + 6));
    let [deflection, rate, altitude] = ["deflection[1]", "deflectionRate[1]", "motion.altitude"]
        .map(|name| description.position(name).unwrap());
    let deflections = (0..8).map(|i| (deflection + i, rate + i));
    let travel = (altitude..altitude + 6).map(|i| (i, i + 6));
    let expected: Vec<_> = motion.chain(deflections).chain(travel).collect();
    assert_eq!(description.states(), expected);
    assert_eq!(description.event_indicators, 10);
    for variable in
        description.variables.iter().filter(|variable| variable.causality == Causality::Input)
    {
        let discrete = ["surface[", "jet["].iter().any(|name| variable.name.starts_with(name));
        let expected = if discrete { Variability::Discrete } else { Variability::Continuous };
        assert_eq!(variable.variability, expected, "{}", variable.name);
    }
    let scenario = Scenario::crmpc2022();
    let start = |name: &str| match &description.variables[description.position(name).unwrap()].kind
    {
        VariableKind::Real { start, .. } => start.unwrap(),
        VariableKind::Integer { start, .. } | VariableKind::Enumeration { start, .. } => {
            f64::from(start.unwrap())
        }
        _ => f64::NAN,
    };
    for (name, value) in [
        ("inertia.ratio.Ixx", 1.0),
        ("inertia.scale", scenario.inertia_scale),
        ("initial.beta", scenario.initial_angles.y),
        ("disturbance.bound", scenario.disturbance.bound),
        ("disturbance.period", scenario.disturbance.period),
        ("disturbance.kind", 2.0),
        ("moment.x", 0.0),
        ("integrator.step", 0.01),
        ("actuation", 1.0),
        ("kinematics", 1.0),
        ("trajectory.earthRate", 0.0),
        ("trajectory.latitude", 0.0),
        ("flight.altitude", 55e3),
        ("flight.mach", 9.8),
        ("aerodynamics.scale", 1.0),
    ] {
        assert_eq!(start(name), value, "{name}");
    }
    let described =
        |text: &str| text.len() > 8 && text.starts_with(|c: char| c.is_ascii_uppercase());
    for variable in &description.variables {
        assert!(described(&variable.description), "{}: {}", variable.name, variable.description);
    }
}
