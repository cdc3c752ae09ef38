//! Variable table of the FMU.

mod entry;
mod sensors;

use crate::parameters::TABLE_ROWS;
use crate::plant::{ATTITUDE, INDICATORS, ReentryPlant};
use crate::roles::{self, Known, Role, Unknown, Variables};
use fmi_export::table::{
    Description, Real, discrete_input, discrete_output, input, output, parameter,
};
use model_description::DefaultExperiment;
use nalgebra::Vector3;
use std::sync::LazyLock;
use vehicle::Scenario;
use vehicle::effectors::{Effectors, JETS, SURFACES};
use vehicle::trajectory::{self, Quantity};

const ANGLES: [(&str, &str); 3] =
    [("alpha", "angle of attack"), ("beta", "sideslip angle"), ("sigma", "bank angle")];
const RATES: [(&str, &str); 3] = [("p", "roll"), ("q", "pitch"), ("r", "yaw")];
const RATE_NAMES: [&str; 3] = ["rate.p", "rate.q", "rate.r"];
/// Condition under which the commands to the effectors are used.
const BY_SURFACES: &str = "actuation = surfacesAndJets";
const AXES: [(&str, &str); 3] = [("x", "roll"), ("y", "pitch"), ("z", "yaw")];

/// Returns the role of the variable at a position in the variable table.
pub(crate) fn role(position: usize) -> Role {
    static ROLES: LazyLock<Vec<Role>> = LazyLock::new(|| all_variables().roles);
    ROLES.get(position).copied().unwrap_or_default()
}

/// Returns all variables, in the order of the variable table.
fn all_variables() -> PlantVariables {
    let variables = trajectory_inputs(deflection_rates(commands(actuated(inputs(outputs(
        PlantVariables::new(),
    ))))));
    let variables = sensors::measured(variables.settings(|m| &mut m.parameters))
        .settings(|m| &mut m.parameters.sensing)
        .settings(|m| &mut m.parameters.converter)
        .settings(|m| &mut m.parameters.table);
    entry::entry(standard_pressure(disturbance_rows(variables)))
}

/// Returns the description of the FMU.
pub(crate) fn description() -> Description<ReentryPlant> {
    let scenario = Scenario::crmpc2022();
    Description {
        name: "ReentryPlant",
        description: "Attitude dynamics of a re-entry vehicle under control moments and bounded disturbances",
        documentation: include_str!("plant.html").into(),
        version: env!("CARGO_PKG_VERSION"),
        model_exchange: true,
        event_indicators: INDICATORS,
        default_experiment: DefaultExperiment {
            start: 0.0,
            stop: scenario.duration,
            tolerance: 1e-8,
            step: scenario.disturbance.period,
        },
        table: all_variables().table,
    }
}

type PlantVariables = Variables<ReentryPlant>;

/// Adds the three components of a vector; `declare` gets the name and the meaning of each axis, and
/// `role` its number.
fn vector(
    mut variables: PlantVariables,
    axes: [(&'static str, &'static str); 3],
    declare: impl Fn(&str, &str) -> Real,
    role: impl Fn(usize) -> Role,
    field: impl Fn(&mut ReentryPlant) -> &mut Vector3<f64> + Copy + Send + Sync + 'static,
) -> PlantVariables {
    for (i, (axis, meaning)) in axes.into_iter().enumerate() {
        variables = variables.real(declare(axis, meaning), move |m| &mut field(m)[i]).role(role(i));
    }
    variables
}

fn outputs(variables: PlantVariables) -> PlantVariables {
    let motion = ["attitude.alpha", "attitude.beta", "rate.p", "rate.q", "rate.r"];
    let moment = ["moment.x", "moment.y", "moment.z"];
    let external = ["disturbanceMoment.x", "disturbanceMoment.y", "disturbanceMoment.z"];
    let jets: Vec<String> = (1..=JETS).map(|j| format!("jet[{j}]")).collect();
    let deflections: Vec<String> = (1..=SURFACES).map(|i| format!("deflection[{i}]")).collect();
    let actuators: Vec<&str> = jets.iter().chain(&deflections).map(String::as_str).collect();
    let angle = |axis: &str, meaning: &str| {
        // In a wind the angles relative to the air are others: flow.alpha and flow.beta.
        let text = format!("{} relative to the ground velocity", sentence(meaning));
        output(&format!("attitude.{axis}"), &text).real().unit("rad").nominal(0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let text = format!("Body {meaning} rate");
        output(&format!("rate.{axis}"), &text).real().unit("rad/s").nominal(0.05)
    };
    // An entry flight computes the trajectory from the motion and from the air's forces, which
    // depend on the attitude.
    let turning = entry::MOTION_NAMES.into_iter().chain([
        "attitude.alpha",
        "attitude.beta",
        "attitude.sigma",
    ]);
    let angle_rate = |axis: &str, meaning: &str| {
        // The rates of the angles follow Wu 2015 (1); they depend on sigma through the trajectory.
        let depends = if axis == "beta" { vec!["rate.p", "rate.r"] } else { RATE_NAMES.to_vec() };
        let common =
            output(&format!("attitudeRate.{axis}"), &format!("Time derivative of the {meaning}"))
                .depends_on(turning.clone())
                .depends_on(trajectory::NAMES);
        let real = common.depends_on(depends).real().unit("rad/s").nominal(0.05);
        real.derivative_of(&format!("attitude.{axis}"))
    };
    let acceleration = |axis: &str, meaning: &str| {
        let text = format!("Time derivative of the body {meaning} rate");
        let common = output(&format!("angularAcceleration.{axis}"), &text);
        let real = common
            .depends_on(motion)
            .depends_on(moment)
            .depends_on(external)
            .depends_on(actuators.clone())
            .depends_on(turning.clone())
            .depends_on(entry::INPUT_NAMES)
            .real();
        real.unit("rad/s2").nominal(0.05).derivative_of(&format!("rate.{axis}"))
    };
    let applied = |axis: &str, meaning: &str| {
        let text = format!("Control moment that acts on the vehicle about the {meaning} axis");
        let common = output(&format!("appliedMoment.{axis}"), &text);
        let common =
            common.depends_on([format!("moment.{axis}").as_str()]).depends_on(actuators.clone());
        let common = common.depends_on(turning.clone());
        common.real().unit("N.m").nominal(1e5)
    };
    let delta = |axis: &str, meaning: &str| {
        let text = format!("Disturbance that acts on the second time derivative of the {meaning}");
        let common = discrete_output(&format!("disturbance.delta.{axis}"), &text)
            .depends_on(motion)
            .depends_on(moment)
            .depends_on(actuators.clone())
            .depends_on(turning.clone());
        common.real().unit("rad/s2").nominal(0.03)
    };
    let disturbing = |axis: &str, meaning: &str| {
        let text = format!("Disturbance moment about the {meaning} axis: external input plus sine");
        let common = output(&format!("disturbance.moment.{axis}"), &text);
        common
            .depends_on([format!("disturbanceMoment.{axis}").as_str()])
            .real()
            .unit("N.m")
            .nominal(1e4)
    };
    let variables = vector(variables, ANGLES, angle, Role::state, |m| &mut m.output.angles);
    let variables = vector(variables, RATES, rate, |i| Role::state(3 + i), |m| &mut m.output.rates);
    let variables = vector(
        variables,
        ANGLES,
        angle_rate,
        |i| Unknown::Derivative(i).into(),
        |m| &mut m.output.angle_rates,
    );
    let variables = vector(
        variables,
        RATES,
        acceleration,
        |i| Unknown::Derivative(3 + i).into(),
        |m| &mut m.output.angular_acceleration,
    );
    let variables = vector(
        variables,
        AXES,
        applied,
        |i| Unknown::AppliedMoment(i).into(),
        |m| &mut m.output.applied_moment,
    );
    let variables =
        vector(variables, ANGLES, delta, |i| Unknown::Delta(i).into(), |m| &mut m.output.delta);
    vector(
        variables,
        AXES,
        disturbing,
        |i| Unknown::DisturbanceMoment(i).into(),
        |m| &mut m.output.disturbance_moment,
    )
}

fn inputs(variables: PlantVariables) -> PlantVariables {
    let control = |axis: &str, meaning: &str| {
        let common =
            input(&format!("moment.{axis}"), &format!("Control moment about the {meaning} axis"));
        common.used_with("actuation = moment").real().unit("N.m").nominal(1e5)
    };
    let external = |axis: &str, meaning: &str| {
        let common = input(
            &format!("disturbanceMoment.{axis}"),
            &format!("External disturbance moment about the {meaning} axis"),
        );
        common.real().unit("N.m").nominal(1e4)
    };
    let variables =
        vector(variables, AXES, control, |i| Known::Moment(i).into(), |m| &mut m.input.moment);
    vector(
        variables,
        AXES,
        external,
        |i| Known::DisturbanceMoment(i).into(),
        |m| &mut m.input.disturbance_moment,
    )
}

/// Adds the deflections of the surfaces and the flight condition.
fn actuated(mut variables: PlantVariables) -> PlantVariables {
    for (i, name) in Effectors::published().names.iter().enumerate() {
        let common = output(
            &format!("deflection[{}]", i + 1),
            &format!("Deflection of the {name}, trailing edge down positive"),
        );
        let real = common.real().unit("rad").nominal(0.1);
        let role = Role::state(ATTITUDE + i);
        variables = variables.real(real, move |m| &mut m.output.deflections[i]).role(role);
    }
    let pressure =
        output("flight.dynamicPressure", "Actual dynamic pressure, with density.scale applied")
            .depends_on(entry::MOTION_NAMES);
    variables
        .real(pressure.real().unit("Pa").nominal(1e3), |m| &mut m.output.passage.dynamic_pressure)
        .role(Unknown::Flight(roles::Quantity::DynamicPressure))
}

/// Adds the dynamic pressure that an on-board computer knows.
fn standard_pressure(variables: PlantVariables) -> PlantVariables {
    let pressure = output(
        "flight.standardDynamicPressure",
        "Dynamic pressure without density.scale, the air's profile and wind",
    )
    .depends_on(entry::MOTION_NAMES);
    variables
        .real(pressure.real().unit("Pa").nominal(1e3), |m| &mut m.output.passage.known_pressure)
        .role(Unknown::Flight(roles::Quantity::KnownPressure))
}

fn commands(mut variables: PlantVariables) -> PlantVariables {
    for (i, name) in Effectors::published().names.iter().enumerate() {
        let text = format!("Commanded deflection of the {name}, trailing edge down positive");
        let common = discrete_input(&format!("surface[{}]", i + 1), &text);
        let real = common.used_with(BY_SURFACES).real().unit("rad").nominal(0.1);
        variables =
            variables.real(real, move |m| &mut m.command.surfaces[i]).role(Known::Surface(i));
    }
    for j in 0..JETS {
        let text = format!("Command to jet {}: 0 for off, 1 for full thrust", j + 1);
        let common = discrete_input(&format!("jet[{}]", j + 1), &text);
        let real = common.used_with(BY_SURFACES).real().nominal(1.0);
        variables = variables.real(real, move |m| &mut m.command.jets[j]).role(Known::Jet(j));
    }
    variables
}

fn deflection_rates(mut variables: PlantVariables) -> PlantVariables {
    for (i, name) in Effectors::published().names.iter().enumerate() {
        let (command, deflection) =
            (format!("surface[{}]", i + 1), format!("deflection[{}]", i + 1));
        let text = format!(
            "Deflection rate of the {name}: its positive or negative limit while moving, 0 at rest"
        );
        let common = output(&format!("deflectionRate[{}]", i + 1), &text)
            .depends_on([command.as_str(), deflection.as_str()]);
        let real = common.real().unit("rad/s").nominal(0.1).derivative_of(&deflection);
        let role = Unknown::Derivative(ATTITUDE + i);
        variables = variables.real(real, move |m| &mut m.output.deflection_rates[i]).role(role);
    }
    variables
}

fn trajectory_inputs(mut variables: PlantVariables) -> PlantVariables {
    for (i, Quantity { name, meaning, unit, nominal, field }) in
        trajectory::QUANTITIES.into_iter().enumerate()
    {
        let common = input(name, meaning).used_with("translation = given");
        let real = common.real().unit(unit).nominal(nominal);
        variables = variables
            .real(real, move |m| field(&mut m.input.trajectory))
            .role(Known::Trajectory(i));
    }
    variables
}

/// Returns the condition under which a row of the disturbance's lookup table is used.
fn used_row(index: usize) -> String {
    format!("disturbance.kind = table and disturbance.table.rows >= {}", index + 1)
}

/// Adds the rows of the disturbance's lookup table column by column, as FMI wants the elements of
/// an array one after the other.
fn disturbance_rows(mut variables: PlantVariables) -> PlantVariables {
    for i in 0..TABLE_ROWS {
        let name = format!("disturbance.table.time[{}]", i + 1);
        let text =
            format!("Time after disturbance.start at which a row takes effect (row {})", i + 1);
        let common = parameter(&name, &text).used_with(&used_row(i));
        let real = common.real().unit("s").min(0.0).nominal(10.0);
        variables = variables.real(real, move |m| &mut m.parameters.table.rows[i].time);
    }
    for (component, (axis, meaning)) in ANGLES.into_iter().enumerate() {
        for i in 0..TABLE_ROWS {
            let name = format!("disturbance.table.{axis}[{}]", i + 1);
            let text = format!("Factor on disturbance.bound for the {meaning} (row {})", i + 1);
            let common = parameter(&name, &text).used_with(&used_row(i));
            let real = common.real().min(-1.0).max(1.0).nominal(1.0);
            variables =
                variables.real(real, move |m| &mut m.parameters.table.rows[i].direction[component]);
        }
    }
    variables
}

/// Returns the text with a capital letter at its beginning.
fn sentence(text: &str) -> String {
    let mut characters = text.chars();
    characters
        .next()
        .map(|first| first.to_ascii_uppercase())
        .into_iter()
        .chain(characters)
        .collect()
}
