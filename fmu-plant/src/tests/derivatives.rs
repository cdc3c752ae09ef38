//! Partial derivatives against differences and declared dependencies.

use super::entry::{entering, in_general_motion, prescribed};
use super::{
    CONTEXT, STATES, actuate, all_kinds, delayed, in_model_exchange, outputs, started, step,
};
use crate::plant::{MOTION, Output, ReentryPlant};
use crate::roles::{Known, role};
use fmi_export::{Model, describe};
use nalgebra::Vector3;
use vehicle::disturbance::DisturbanceKind;
use vehicle::kinematics::Kinematics;
use vehicle::trajectory::Trajectory;

/// Returns an instance with actuators in model exchange; its jets take a duty cycle or switch.
fn actuated_in_model_exchange(duty: bool) -> ReentryPlant {
    let mut instance = in_model_exchange(DisturbanceKind::None);
    instance.parameters.jet_duty = duty;
    actuate(&mut instance);
    instance.initialize(&CONTEXT).unwrap();
    instance.set_continuous_states(&STATES);
    instance.new_discrete_states(0.0).unwrap();
    instance
}

/// Returns an instance in model exchange on a trajectory that turns in every way.
fn along_a_trajectory(kind: DisturbanceKind, kinematics: Kinematics) -> ReentryPlant {
    let mut instance = in_model_exchange(kind);
    instance.parameters.kinematics = kinematics;
    instance.parameters.earth_rate = 7.2921e-5;
    instance.initialize(&CONTEXT).unwrap();
    instance.set_continuous_states(&STATES);
    instance.input.trajectory = Trajectory {
        flight_path_angle: -0.1,
        heading: 0.8,
        latitude: 0.4,
        flight_path_angle_rate: 0.01,
        heading_rate: -0.02,
        longitude_rate: 0.03,
        latitude_rate: 0.01,
    };
    instance.new_discrete_states(0.0).unwrap();
    instance
}

/// Returns an instance in co-simulation at a communication point, with jets that take a duty cycle.
fn at_a_communication_point() -> ReentryPlant {
    let mut instance = started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        instance.parameters.jet_duty = true;
        actuate(instance);
    });
    instance.set_continuous_states(&STATES);
    instance
}

/// Returns an instance in co-simulation on which a moment commanded earlier acts.
fn under_a_delayed_moment() -> ReentryPlant {
    let mut instance = delayed(0.01);
    instance.input.moment = Vector3::new(3e4, -2e4, 1e4);
    step(&mut instance, 0.0, 0.02).unwrap();
    instance
}

/// Outputs at 0.02 s with a state or an input changed by a number. Where the derivatives are
/// differences themselves, the input is found without them.
fn changed(instance: &ReentryPlant, known: Known, by: f64) -> Output {
    let mut instance = instance.clone();
    let t = &mut instance.input.trajectory;
    let trajectory = [
        &mut t.flight_path_angle,
        &mut t.heading,
        &mut t.latitude,
        &mut t.flight_path_angle_rate,
        &mut t.heading_rate,
        &mut t.longitude_rate,
        &mut t.latitude_rate,
    ];
    match known {
        Known::Trajectory(i) => *trajectory[i] += by,
        Known::Prescribed(i @ 0..3) => instance.input.prescribed.angles[i] += by,
        Known::Prescribed(i) => instance.input.prescribed.rates[i - 3] += by,
        Known::Trim => instance.input.trim += by,
        known => {
            instance.nudge(known, by);
        }
    }
    outputs(&mut instance, 0.02)
}

/// The derivatives are of closed form at a fixed flight condition, and differences in an entry.
#[test]
fn oracle_partial_derivatives_against_differences_and_declared_dependencies() {
    let given = all_kinds()
        .map(in_model_exchange)
        .chain([false, true].map(actuated_in_model_exchange))
        .chain([
            along_a_trajectory(DisturbanceKind::None, Kinematics::Printed),
            along_a_trajectory(DisturbanceKind::Constant, Kinematics::Exact),
            along_a_trajectory(DisturbanceKind::AgainstMoment, Kinematics::Exact),
        ])
        .chain([at_a_communication_point(), under_a_delayed_moment()]);
    let entries = [entering as fn(&mut ReentryPlant), prescribed].map(in_general_motion);
    let instances = given.map(|instance| (instance, false)).chain(entries.map(|e| (e, true)));
    let variables = describe::<ReentryPlant>().variables;
    for (case, (mut instance, enters)) in instances.enumerate() {
        for known_variable in &variables {
            let Some(known) = role(&known_variable.name).as_known else { continue };
            let by = match known {
                Known::Moment(_) | Known::DisturbanceMoment(_) => 1e3,
                Known::Jet(_) => 0.1,
                Known::Surface(_) => 1e-3,
                Known::State(MOTION) => 1.0,
                Known::State(i) if i == MOTION + 3 => 0.1,
                _ => 1e-5,
            };
            let [mut below, mut above] = [-by, by].map(|by| changed(&instance, known, by));
            for variable in &variables {
                if role(&variable.name).as_unknown.is_none() {
                    continue;
                }
                let exact = by_name(&mut instance, 0.02, &variable.name, &known_variable.name);
                let [above, below] =
                    [&mut above, &mut below].map(|output| output.value(&variable.name).unwrap());
                let numeric = (above - below) / (2.0 * by);
                let size = above.abs().max(1.0);
                let (bound, least) = if enters {
                    (1e-6 * (exact.abs() + size), 1e-9 * size)
                } else {
                    (1e-9 * exact.abs().max(1.0), 0.0)
                };
                let what = format!("{case}: {} by {}", variable.name, known_variable.name);
                assert!((numeric - exact).abs() < bound, "{what}: {exact}, not {numeric}");
                if exact.abs() > least && variable.name != known_variable.name {
                    assert!(variable.dependencies.contains(&known_variable.name), "{what}");
                }
            }
        }
    }
    let mut duty = at_a_communication_point();
    let yaw_by_jet = by_name(&mut duty, 0.0, "appliedMoment.z", "jet[1]");
    assert!((yaw_by_jet - 19897.0).abs() < 1e-9);
    let mut exact = along_a_trajectory(DisturbanceKind::None, Kinematics::Exact);
    let mut rate = |angle: &str, known: &str| {
        by_name(&mut exact, 0.0, &format!("attitudeRate.{angle}"), &format!("trajectory.{known}"))
    };
    assert!(rate("sigma", "heading") != 0.0);
    let expected = -0.5f64.cos() / 0.2f64.cos();
    assert!((rate("alpha", "flightPathAngleRate") - expected).abs() < 1e-15);
}

#[test]
fn derivatives_by_parameters_are_refused() {
    let mut instance = in_model_exchange(DisturbanceKind::None);
    for (unknown, known) in [
        ("attitudeRate.alpha", "inertia.ratio.Ixx"),
        ("attitudeRate.alpha", "attitudeRate.alpha"),
        ("attitudeRate.alpha", "flight.dynamicPressure"),
        ("inertia.ratio.Ixx", "attitude.alpha"),
        ("moment.x", "moment.x"),
        ("surface[1]", "surface[1]"),
        ("trajectory.flightPathAngle", "trajectory.flightPathAngle"),
    ] {
        assert!(instance.partial_derivative(0.0, unknown, known).is_err(), "{unknown} by {known}");
    }
}

fn by_name(instance: &mut ReentryPlant, time: f64, unknown: &str, known: &str) -> f64 {
    instance.partial_derivative(time, unknown, known).unwrap().unwrap()
}
