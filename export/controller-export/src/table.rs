//! The variable table that every controller has. Each law adds its own variables.

use crate::law::{ControllerFmu, Law};
use fmi_export::table::{Common, Description, Real, VariableTable, discrete_output, input, output};
use model_description::DefaultExperiment;
use model_description::condition::NEVER;
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::trajectory;

/// Names and meanings of the components of Θ.
pub const ANGLES: [(&str, &str); 3] =
    [("alpha", "angle of attack"), ("beta", "sideslip angle"), ("sigma", "bank angle")];
/// Names and meanings of the components of ω.
pub const RATES: [(&str, &str); 3] = [("p", "roll"), ("q", "pitch"), ("r", "yaw")];
/// Names and meanings of the components of a moment.
pub const AXES: [(&str, &str); 3] = [("x", "roll"), ("y", "pitch"), ("z", "yaw")];

/// Beginnings of the descriptions of the reference's derivatives; the angle's name follows.
const FIRST_DERIVATIVE: &str = "First derivative of the reference";
const SECOND_DERIVATIVE: &str = "Second derivative of the reference";

/// Names of the inputs on which the outputs of a tick depend.
const MEASURED: [&str; 6] =
    ["attitude.alpha", "attitude.beta", "attitude.sigma", "rate.p", "rate.q", "rate.r"];
const EXTERNAL: [&str; 9] = [
    "reference.external.alpha",
    "reference.external.beta",
    "reference.external.sigma",
    "reference.externalRate.alpha",
    "reference.externalRate.beta",
    "reference.externalRate.sigma",
    "reference.externalAcceleration.alpha",
    "reference.externalAcceleration.beta",
    "reference.externalAcceleration.sigma",
];

const KNOWN_MOMENT: [&str; 3] = ["knownMoment.x", "knownMoment.y", "knownMoment.z"];
const SCHEDULED: [&str; 2] = ["scheduled.limitMoment", "scheduled.disturbanceBound"];

/// Returns the names of the inputs on which a sampled output depends.
fn sampled_inputs() -> impl Iterator<Item = &'static str> {
    let known = trajectory::NAMES.into_iter().chain(KNOWN_MOMENT).chain(SCHEDULED);
    MEASURED.into_iter().chain(EXTERNAL).chain(known)
}

/// Declares an output of a law, which changes at its ticks only.
#[inline(never)]
pub fn sampled_output(name: &str, description: &str) -> Common {
    discrete_output(name, description).depends_on(sampled_inputs())
}

/// Returns the description of a controller's FMU.
pub fn description<L: Law>() -> Description<ControllerFmu<L>> {
    let scenario = Scenario::crmpc2022();
    let table = outputs(inputs(VariableTable::new()))
        .settings(|model: &mut ControllerFmu<L>| &mut model.parameters)
        .settings(|model: &mut ControllerFmu<L>| &mut model.settings);
    // Other laws ask for no later reference than that of the instant at which their moment acts.
    let table = if L::PLANS { table } else { table.without("reference.preview") };
    Description {
        name: L::NAME,
        description: L::DESCRIPTION,
        documentation: format!("{}{}", L::DOCUMENTATION, include_str!("wiring.html")),
        version: L::VERSION,
        model_exchange: false,
        event_indicators: 0,
        default_experiment: DefaultExperiment {
            start: 0.0,
            stop: scenario.duration,
            tolerance: 1e-6,
            step: scenario.disturbance.period,
        },
        table: L::outputs(table),
    }
}

/// Adds the three components of a vector; `declare` receives name and meaning of each axis.
pub fn vector<M: 'static>(
    mut table: VariableTable<M>,
    axes: [(&'static str, &'static str); 3],
    declare: impl Fn(&str, &str) -> Real,
    field: impl Fn(&mut M) -> &mut Vector3<f64> + Copy + Send + Sync + 'static,
) -> VariableTable<M> {
    for (i, real) in declared(axes, &declare).into_iter().enumerate() {
        table = table.real(real, move |m| &mut field(m)[i]);
    }
    table
}

/// Declares the components of a vector. It is not inlined, so that the libraries stay small.
#[inline(never)]
fn declared(axes: [(&str, &str); 3], declare: &dyn Fn(&str, &str) -> Real) -> Vec<Real> {
    axes.into_iter().map(|(axis, meaning)| declare(axis, meaning)).collect()
}

fn measured_angle(axis: &str, meaning: &str) -> Real {
    let relative = if axis == "sigma" { "ground velocity" } else { "air" };
    let text = format!("Measured {meaning} relative to the {relative}");
    input(&format!("attitude.{axis}"), &text).real().unit("rad").nominal(0.1)
}

fn measured_rate(axis: &str, meaning: &str) -> Real {
    let text = format!("Measured body {meaning} rate");
    input(&format!("rate.{axis}"), &text).real().unit("rad/s").nominal(0.05)
}

/// Declares the achieved moment. All controllers have it, so that they can be exchanged.
fn achieved<L: Law>(axis: &str, meaning: &str) -> Real {
    let text = format!("{meaning} moment achieved by the actuators");
    let common = input(&format!("achievedMoment.{axis}"), &capital(&text));
    let settings = settings::settings::<L::Settings>();
    let is_used = settings.iter().any(|setting| setting.place.name == "achievedMoment.used");
    let condition = if is_used { "achievedMoment.used = true" } else { NEVER };
    common.used_with(condition).real().unit("N.m").nominal(1e5)
}

fn known_moment(axis: &str, meaning: &str) -> Real {
    let text = format!(
        "{meaning} moment that is known to act besides that of the actuators, such as the air's; the command is the remainder"
    );
    input(&format!("knownMoment.{axis}"), &capital(&text)).real().unit("N.m").nominal(1e5)
}

fn scheduled_limit() -> Real {
    let text = "Limit on the norm of the control moment that holds at present; the command is scaled down to it";
    input(SCHEDULED[0], text).optional().real().unit("N.m").min(0.0).nominal(1e5)
}

/// Declares the bound on the disturbance. All controllers have it, so that they can be exchanged.
fn scheduled_bound<L: Law>() -> Real {
    let text = "Bound on each component of the disturbance of the angles' second derivatives that holds at present, if it is smaller than disturbance.bound";
    let parts = "scheduled.disturbanceParts";
    let settings = settings::settings::<L::Settings>();
    let is_used = settings.iter().any(|setting| setting.place.name == parts);
    let condition = "constraints = robust and scheduled.disturbanceParts > 1";
    let common =
        input(SCHEDULED[1], text).optional().used_with(if is_used { condition } else { NEVER });
    common.real().unit("rad/s2").min(0.0).nominal(0.03)
}

/// Declares inputs for a reference from outside.
fn external(
    name: &'static str,
    quantity: &'static str,
    unit: &'static str,
) -> impl Fn(&str, &str) -> Real {
    move |axis, meaning| {
        let text = format!("{quantity} {meaning}");
        let common = input(&format!("reference.{name}.{axis}"), &text);
        common.used_with("reference.profile = external").real().unit(unit).nominal(0.1)
    }
}

fn inputs<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let table = vector(table, ANGLES, measured_angle, |m| &mut m.input.measured.angles);
    let table = vector(table, RATES, measured_rate, |m| &mut m.input.measured.rates);
    let table = vector(table, AXES, achieved::<L>, |m| &mut m.input.achieved_moment);

    let angles = external("external", "Reference", "rad");
    let rates = external("externalRate", FIRST_DERIVATIVE, "rad/s");
    let accelerations = external("externalAcceleration", SECOND_DERIVATIVE, "rad/s2");
    let table = vector(table, ANGLES, angles, |m| &mut m.input.reference.angles);
    let table = vector(table, ANGLES, rates, |m| &mut m.input.reference.rates);
    let table = vector(table, ANGLES, accelerations, |m| &mut m.input.reference.accelerations);
    let table = vector(table, AXES, known_moment, |m| &mut m.input.known_moment)
        .real(scheduled_limit(), |m| &mut m.input.measured.scheduled.limit_moment)
        .real(scheduled_bound::<L>(), |m| &mut m.input.measured.scheduled.disturbance_bound);
    known_trajectory().into_iter().zip(trajectory::QUANTITIES).fold(
        table,
        |table, (real, quantity)| {
            table.real(real, move |m| (quantity.field)(&mut m.input.trajectory))
        },
    )
}

/// Declares the inputs of the known trajectory. It is not inlined, so that the libraries stay
/// small.
#[inline(never)]
fn known_trajectory() -> Vec<Real> {
    let declare = |quantity: trajectory::Quantity| {
        let trajectory::Quantity { name, meaning, unit, nominal, .. } = quantity;
        let text = format!("{meaning}, as it is known");
        input(name, &text).real().unit(unit).nominal(nominal)
    };
    trajectory::QUANTITIES.into_iter().map(declare).collect()
}

fn moment(axis: &str, meaning: &str) -> Real {
    let text = format!("Commanded {meaning} moment, held between the ticks of period.feedback");
    let common = sampled_output(&format!("moment.{axis}"), &text);
    common.real().unit("N.m").nominal(1e5)
}

/// Declares outputs of the reference, which may come from the inputs `external`.
fn in_force(
    name: &'static str,
    external: &'static str,
    quantity: &'static str,
    unit: &'static str,
) -> impl Fn(&str, &str) -> Real {
    move |axis, meaning| {
        let text = format!("{quantity} {meaning} at the present time");
        let source = format!("reference.{external}.{axis}");
        let common = output(&format!("{name}.{axis}"), &text).depends_on([source.as_str()]);
        common.real().unit(unit).nominal(0.1)
    }
}

fn outputs<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let table = vector(table, AXES, moment, |m| &mut m.output.moment);
    let angles = in_force("reference", "external", "Reference", "rad");
    let rates = in_force("referenceRate", "externalRate", FIRST_DERIVATIVE, "rad/s");
    let accelerations =
        in_force("referenceAcceleration", "externalAcceleration", SECOND_DERIVATIVE, "rad/s2");
    let table = vector(table, ANGLES, angles, |m| &mut m.output.reference.angles);
    let table = vector(table, ANGLES, rates, |m| &mut m.output.reference.rates);
    let table = vector(table, ANGLES, accelerations, |m| &mut m.output.reference.accelerations);
    let estimate = sampled_output(
        "loopDelay.estimate",
        "Estimated delay from a measurement to the resulting moment; equals delay + measurement.age until the response of the vehicle allows an estimate",
    );
    let differs = sampled_output(
        "loopDelay.differs",
        "Whether loopDelay.estimate differs from delay + measurement.age by more than half of period.feedback",
    );
    table
        .real(estimate.real().unit("s").nominal(0.1), |m| &mut m.output.loop_delay)
        .boolean(differs, |m| &mut m.output.has_other_delay)
}

/// Declares a component of the disturbance that a law's observer estimates.
pub fn disturbance_estimate(axis: &str, meaning: &str) -> Real {
    let text =
        format!("Observer's estimate of the disturbance of the second derivative of the {meaning}");
    let common = sampled_output(&format!("disturbanceEstimate.{axis}"), &text);
    common.real().unit("rad/s2")
}

/// Returns a finite number for a value that is only shown and on which no controller depends.
/// Infinite values become the largest number of their sign, and values that are not a number become
/// the largest number.
pub fn shown(value: f64) -> f64 {
    if value.is_nan() { f64::MAX } else { value.clamp(-f64::MAX, f64::MAX) }
}

/// Returns the vector with [`shown`] applied to each component.
pub fn shown_vector(value: &Vector3<f64>) -> Vector3<f64> {
    value.map(shown)
}

/// Returns the text with a capital first letter.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
