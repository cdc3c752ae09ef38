//! Partial derivatives against differences and declared dependencies.

use super::{
    CONTEXT, MEASURED, STATE_COUNT, STATES, actuate, all_kinds, delayed, in_model_exchange,
    outputs, started, step,
};
use crate::plant::ReentryPlant;
use crate::roles::Known;
use crate::table::role;
use fmi_export::{Model, describe};
use nalgebra::Vector3;
use vehicle::disturbance::DisturbanceKind;
use vehicle::kinematics::Kinematics;
use vehicle::trajectory::Trajectory;

/// Calculated variables with their positions in the table.
fn calculated(instance: &mut ReentryPlant, time: f64) -> Vec<(usize, f64)> {
    let o = outputs(instance, time);
    let vectors = [
        o.angles,
        o.rates,
        o.angle_rates,
        o.angular_acceleration,
        o.applied_moment,
        o.delta,
        o.disturbance_moment,
    ];
    let rest = o.deflections.iter().copied().chain([o.passage.dynamic_pressure]);
    let last = o.deflection_rates.iter().copied();
    let readings = o.measured.readings;
    let measured = readings.iter().flatten().copied().chain([o.measured.time]);
    let groups = (0..21)
        .zip(vectors.iter().flatten().copied())
        .chain((27..36).zip(rest))
        .chain((54..62).zip(last));
    groups.chain((MEASURED..).zip(measured)).collect()
}

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

fn positions_of_knowns() -> impl Iterator<Item = usize> {
    (0..69).filter(|&position| role(position).as_known.is_some())
}

/// Adds a number to the state or input at a position in the table.
fn nudge(instance: &mut ReentryPlant, known_position: usize, by: f64) {
    match role(known_position).as_known.unwrap() {
        Known::State(i) => {
            let mut states = [0.0; STATE_COUNT];
            instance.continuous_states(&mut states);
            states[i] += by;
            instance.set_continuous_states(&states);
        }
        Known::Moment(i) => instance.input.moment[i] += by,
        Known::DisturbanceMoment(i) => instance.input.disturbance_moment[i] += by,
        Known::Surface(i) => instance.command.surfaces[i] += by,
        Known::Jet(j) => instance.command.jets[j] += by,
        Known::Trajectory(i) => {
            let t = &mut instance.input.trajectory;
            *[
                &mut t.flight_path_angle,
                &mut t.heading,
                &mut t.latitude,
                &mut t.flight_path_angle_rate,
                &mut t.heading_rate,
                &mut t.longitude_rate,
                &mut t.latitude_rate,
            ][i] += by;
        }
        Known::Prescribed(_) | Known::Trim => panic!("only an entry flight has these"),
    }
}

#[test]
fn oracle_partial_derivatives_against_differences_and_declared_dependencies() {
    let description = describe::<ReentryPlant>();
    let instances = all_kinds()
        .map(in_model_exchange)
        .chain([false, true].map(actuated_in_model_exchange))
        .chain([
            along_a_trajectory(DisturbanceKind::None, Kinematics::Printed),
            along_a_trajectory(DisturbanceKind::Constant, Kinematics::Exact),
            along_a_trajectory(DisturbanceKind::AgainstMoment, Kinematics::Exact),
        ])
        .chain([at_a_communication_point(), under_a_delayed_moment()]);
    for (case, mut instance) in instances.enumerate() {
        for known_position in positions_of_knowns() {
            let by = match known_position {
                21..27 => 1e3,
                36..44 => 1e-3,
                44..54 => 0.1,
                _ => 1e-5,
            };
            nudge(&mut instance, known_position, by);
            let above = calculated(&mut instance, 0.02);
            nudge(&mut instance, known_position, -2.0 * by);
            let below = calculated(&mut instance, 0.02);
            nudge(&mut instance, known_position, by);
            let known_name = &description.variables[known_position].name;
            for ((unknown, above), (_, below)) in above.iter().zip(&below) {
                let exact = instance.partial_derivative(0.02, *unknown, known_position).unwrap();
                let numeric = (above - below) / (2.0 * by);
                let variable = &description.variables[*unknown];
                assert!(
                    (numeric - exact).abs() < 1e-9 * exact.abs().max(1.0),
                    "{case}: {} by {known_name}: {exact}, not {numeric}",
                    variable.name
                );
                if exact != 0.0 && *unknown != known_position {
                    assert!(
                        variable.dependencies.contains(known_name),
                        "{} depends on {known_name}",
                        variable.name
                    );
                }
            }
        }
    }
    let mut duty = at_a_communication_point();
    assert!((duty.partial_derivative(0.0, 14, 44).unwrap() - 19897.0).abs() < 1e-9, "yaw by jet 1");
    let mut exact = along_a_trajectory(DisturbanceKind::None, Kinematics::Exact);
    assert!(exact.partial_derivative(0.0, 8, 63).unwrap() != 0.0, "bank rate by heading");
    assert!(
        (exact.partial_derivative(0.0, 6, 65).unwrap() + 0.5f64.cos() / 0.2f64.cos()).abs() < 1e-15
    );
}

#[test]
fn derivatives_by_parameters_are_refused() {
    let mut instance = in_model_exchange(DisturbanceKind::None);
    for (unknown, known_position) in
        [(6, 69), (6, 6), (6, 35), (69, 0), (21, 21), (36, 36), (62, 62)]
    {
        assert!(
            instance.partial_derivative(0.0, unknown, known_position).is_err(),
            "{unknown} by {known_position}"
        );
    }
}
