//! The description of the FMU, and the places of its variables.

use super::MEASURED;
use crate::plant::ReentryPlant;
use crate::roles::{Known, Quantity, Unknown};
use crate::table::role;
use fmi_export::describe;
use model_description::variable::{Causality, Variability, VariableKind};
use vehicle::Scenario;

#[test]
fn positions_and_names_agree() {
    let names: Vec<String> =
        describe::<ReentryPlant>().variables.into_iter().map(|variable| variable.name).collect();
    for (position, name) in names.iter().enumerate() {
        let group = name.split(['.', '[']).next().unwrap();
        let unknown = match role(position).as_unknown {
            Some(Unknown::State(0..3)) => "attitude",
            Some(Unknown::State(3..6)) => "rate",
            Some(Unknown::State(6..14)) => "deflection",
            Some(Unknown::Derivative(0..3)) => "attitudeRate",
            Some(Unknown::Derivative(3..6)) => "angularAcceleration",
            Some(Unknown::Derivative(6..14)) => "deflectionRate",
            Some(Unknown::AppliedMoment(_)) => "appliedMoment",
            Some(Unknown::Delta(_) | Unknown::DisturbanceMoment(_)) => "disturbance",
            Some(Unknown::Flight(Quantity::DynamicPressure | Quantity::KnownPressure)) => "flight",
            Some(Unknown::State(_)) => "motion",
            Some(Unknown::Derivative(_)) => "motionRate",
            Some(Unknown::Flight(_)) => continue,
            Some(Unknown::MeasuredTime) if group == "gnss" || group == "star" => continue,
            Some(Unknown::Measured(_) | Unknown::MeasuredTime) => "measured",
            None => match role(position).as_known {
                Some(Known::Moment(_)) => "moment",
                Some(Known::DisturbanceMoment(_)) => "disturbanceMoment",
                Some(Known::Surface(_)) => "surface",
                Some(Known::Jet(_)) => "jet",
                Some(Known::Trajectory(_)) => "trajectory",
                _ => continue,
            },
        };
        assert_eq!(group, unknown, "{name} at {position}");
    }
    assert_eq!(
        names[0..6],
        ["attitude.alpha", "attitude.beta", "attitude.sigma", "rate.p", "rate.q", "rate.r"]
    );
    assert_eq!((names[22].as_str(), names[25].as_str()), ("moment.y", "disturbanceMoment.y"));
    assert_eq!((names[27].as_str(), names[34].as_str()), ("deflection[1]", "deflection[8]"));
    assert_eq!((names[36].as_str(), names[43].as_str()), ("surface[1]", "surface[8]"));
    assert_eq!((names[44].as_str(), names[53].as_str()), ("jet[1]", "jet[10]"));
    assert_eq!(
        (names[54].as_str(), names[61].as_str()),
        ("deflectionRate[1]", "deflectionRate[8]")
    );
    assert_eq!(
        (names[62].as_str(), names[68].as_str()),
        ("trajectory.flightPathAngle", "trajectory.latitudeRate")
    );
    assert_eq!(
        names[MEASURED..MEASURED + 11].iter().map(String::as_str).collect::<Vec<_>>(),
        [
            "measured.gyroscope.x",
            "measured.gyroscope.y",
            "measured.gyroscope.z",
            "measured.accelerometer.x",
            "measured.accelerometer.y",
            "measured.accelerometer.z",
            "measured.magnetometer.x",
            "measured.magnetometer.y",
            "measured.magnetometer.z",
            "measured.time",
            "measured.sample",
        ]
    );
    assert_eq!(role(MEASURED).as_unknown, Some(Unknown::Measured(0)));
    assert_eq!(role(MEASURED + 9).as_unknown, Some(Unknown::MeasuredTime));
    assert_eq!(role(MEASURED + 10).as_unknown, None, "an integer");
}

#[test]
fn the_description_holds() {
    let description = describe::<ReentryPlant>();
    description.check().unwrap();
    let motion = (0..6).map(|i| (i, i + 6));
    let deflections = (27..35).map(|i| (i, i + 27));
    let altitude = description.position("motion.altitude").unwrap();
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
        ("inertia.Ixx", scenario.inertia.Ixx),
        ("inertia.Ixz", scenario.inertia.Ixz),
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

#[test]
fn outputs_need_no_start_and_inputs_have_one() {
    for variable in describe::<ReentryPlant>().variables {
        let VariableKind::Real { start, unit, .. } = &variable.kind else { continue };
        assert_eq!(start.is_none(), variable.causality == Causality::Output, "{}", variable.name);
        let plain = [
            "inertia.scale",
            "disturbance.direction.alpha",
            "disturbance.direction.beta",
            "disturbance.direction.sigma",
            "flight.mach",
            "density.scale",
            "aerodynamics.scale",
            "sensor.drop.probability",
            "flow.mach",
            "loadFactor",
            "planet.flattening",
            "planet.oblateness",
            "star.attitude.w",
            "star.attitude.x",
            "star.attitude.y",
            "star.attitude.z",
            "aerodynamics.lift.scale",
            "aerodynamics.drag.scale",
            "aerodynamics.side.scale",
            "aerodynamics.moment.scale",
            "aerodynamics.pitch.offset",
        ];
        let group = variable.name.split('[').next().unwrap();
        let plain_group = [
            "jet",
            "air.densityRatio",
            "disturbance.table.alpha",
            "disturbance.table.beta",
            "disturbance.table.sigma",
        ]
        .contains(&group)
            || group.ends_with(".matrix");
        assert_eq!(
            unit.is_none(),
            plain_group || plain.contains(&variable.name.as_str()),
            "{}",
            variable.name
        );
    }
}
