//! Dependencies of the outputs on states and inputs against those that are declared.

use super::entry::{entering, in_general_motion, prescribed};
use super::prelude::*;
use super::{
    CONTEXT, STATE_COUNT, STATES, actuate, all_kinds, delayed, in_model_exchange, outputs, started,
    step,
};
use model_description::variable::Variable;
use settings::{Field, Settings};
use std::sync::LazyLock;
use vehicle::trajectory::Trajectory;

fn is_real(variable: &Variable) -> bool {
    matches!(variable.kind, VariableKind::Real { .. })
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

/// Numbers of the instance, by the names of their variables.
fn number<'a>(instance: &'a mut ReentryPlant, name: &str) -> &'a mut f64 {
    static NUMBERS: LazyLock<Settings<ReentryPlant>> = LazyLock::new(settings::settings);
    let index = NUMBERS.iter().position(|number| number.place.name == name).unwrap();
    let Field::Real(number) = NUMBERS.field(instance, index) else { panic!("{name}") };
    number
}

/// Instance at 0.02 s with an input or the state with this number changed by a number.
fn changed(instance: &ReentryPlant, known: &str, state: Option<usize>, by: f64) -> ReentryPlant {
    let mut instance = instance.clone();
    if let Some(state) = state {
        let mut states = [0.0; STATE_COUNT];
        instance.continuous_states(&mut states);
        states[state] += by;
        instance.set_continuous_states(&states);
    } else {
        *number(&mut instance, known) += by;
    }
    outputs(&mut instance, 0.02);
    instance
}

#[test]
fn outputs_change_with_declared_states_and_inputs_only() {
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
    let variables = describe::<ReentryPlant>().variables;
    let states: Vec<&str> = variables.iter().filter_map(Variable::derivative_of).collect();
    let calculated: Vec<&Variable> =
        variables.iter().filter(|v| v.is_calculated() && is_real(v)).collect();
    let mut seen = 0;
    for (case, instance) in given.chain(entries).enumerate() {
        for known in variables.iter().map(|known| known.name.as_str()) {
            let state = states.iter().position(|state| *state == known);
            let is_input = variables
                .iter()
                .any(|v| v.name == known && v.causality == Causality::Input && is_real(v));
            if state.is_none() && !is_input {
                continue;
            }
            let by = match known {
                "motion.altitude" => 1.0,
                "motion.speed" => 0.1,
                _ if known.starts_with("moment.") || known.starts_with("disturbanceM") => 1e3,
                _ if known.starts_with("jet[") => 0.1,
                _ => 1e-5,
            };
            let [mut below, mut above] = [-by, by].map(|by| changed(&instance, known, state, by));
            for unknown in calculated.iter().filter(|unknown| unknown.name != known) {
                let [above, below] = [&mut above, &mut below].map(|of| *number(of, &unknown.name));
                let slope = (above - below) / (2.0 * by);
                if slope.abs() > 1e-9 * above.abs().max(1.0) {
                    let is_declared = unknown.dependencies.iter().any(|other| other == known);
                    assert!(is_declared, "{case}: {} by {known}: {slope}", unknown.name);
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 1000, "{seen} dependencies");
}
