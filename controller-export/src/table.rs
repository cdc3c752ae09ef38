//! The table of variables that every controller has; each law adds its own.

use crate::law::{ControllerFmu, Law};
use crate::reference::PROFILES;
use control::delay;
use fmi2_export::fields::Fields;
use fmi2_export::table::{
    Common, Description, Real, VariableTable, discrete_output, input, output, parameter,
};
use model_description::DefaultExperiment;
use model_description::unit;
use nalgebra::Vector3;
use vehicle::Scenario;

/// Names and meanings of the components of Θ.
pub const ANGLES: [(&str, &str); 3] =
    [("alpha", "angle of attack"), ("beta", "sideslip angle"), ("sigma", "bank angle")];
/// Names and meanings of the components of ω.
pub const RATES: [(&str, &str); 3] = [("p", "roll"), ("q", "pitch"), ("r", "yaw")];
/// Names and meanings of the components of a moment.
pub const AXES: [(&str, &str); 3] = [("x", "roll"), ("y", "pitch"), ("z", "yaw")];

/// Names of the variables that hold fields of a controller's settings, for messages.
pub const FIELDS: &Fields = &[
    ("limit_rate", "limit.rate"),
    ("limit_moment", "limit.moment"),
    ("latency.measurement", "measurement.age"),
    ("period", "period.feedback"),
    ("period_feedback", "period.feedback"),
    ("period_optimisation", "period.optimisation"),
    ("p", "weight.P"),
    ("q", "weight.Q"),
    ("threshold", "antiWindupThreshold"),
];

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

/// Returns the names of the inputs on which a sampled output depends.
fn sampled_inputs() -> impl Iterator<Item = &'static str> {
    MEASURED.into_iter().chain(EXTERNAL)
}

/// Declares an output of a law, which changes at its ticks only.
#[inline(never)]
pub fn sampled_output(name: &str, description: &str) -> Common {
    discrete_output(name, description).depends_on(sampled_inputs())
}

/// Returns the description of a controller's unit for FMI.
pub fn description<L: Law>() -> Description<ControllerFmu<L>> {
    let scenario = Scenario::crmpc2022();
    let table = L::declare(vehicle(reference(outputs(inputs(VariableTable::new())))));
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
        table,
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
    let text = format!("Measured {meaning}");
    input(&format!("attitude.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
}

fn measured_rate(axis: &str, meaning: &str) -> Real {
    let text = format!("Measured body {meaning} rate");
    input(&format!("rate.{axis}"), &text).real().unit(unit::angular_rate()).nominal(0.05)
}

fn achieved(axis: &str, meaning: &str) -> Real {
    let text = format!(
        "{meaning} moment that the actuators really give; for laws with an observer, others ignore it"
    );
    let common = input(&format!("achievedMoment.{axis}"), &capital(&text));
    common.real().unit(unit::moment()).nominal(1e5)
}

/// Declares inputs for a reference from outside.
fn external(
    name: &'static str,
    what: &'static str,
    unit: unit::Unit,
) -> impl Fn(&str, &str) -> Real {
    move |axis, meaning| {
        let text = format!("{what} of the {meaning}, used if reference.profile is 'external'");
        input(&format!("reference.{name}.{axis}"), &text).real().unit(unit.clone()).nominal(0.1)
    }
}

fn inputs<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let table = vector(table, ANGLES, measured_angle, |m| &mut m.input.measured.angles);
    let table = vector(table, RATES, measured_rate, |m| &mut m.input.measured.rates);
    let table = vector(table, AXES, achieved, |m| &mut m.input.achieved_moment);

    let angles = external("external", "Reference", unit::angle());
    let rates = external("externalRate", "First derivative of the reference", unit::angular_rate());
    let accelerations = external(
        "externalAcceleration",
        "Second derivative of the reference",
        unit::angular_acceleration(),
    );
    let table = vector(table, ANGLES, angles, |m| &mut m.input.reference.angles);
    let table = vector(table, ANGLES, rates, |m| &mut m.input.reference.rates);
    vector(table, ANGLES, accelerations, |m| &mut m.input.reference.accelerations)
}

fn moment(axis: &str, meaning: &str) -> Real {
    let text = format!("Commanded {meaning} moment, held between the ticks of period.feedback");
    let common = sampled_output(&format!("moment.{axis}"), &text);
    common.real().unit(unit::moment()).nominal(1e5)
}

/// Declares outputs of the reference, which may come from the inputs `external`.
fn in_force(
    name: &'static str,
    external: &'static str,
    what: &'static str,
    unit: unit::Unit,
) -> impl Fn(&str, &str) -> Real {
    move |axis, meaning| {
        let text = format!("{what} of the {meaning} in force");
        let source = format!("reference.{external}.{axis}");
        let common = output(&format!("{name}.{axis}"), &text).depends_on([source.as_str()]);
        common.real().unit(unit.clone()).nominal(0.1)
    }
}

fn outputs<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let table = vector(table, AXES, moment, |m| &mut m.output.moment);
    let angles = in_force("reference", "external", "Reference", unit::angle());
    let rates = in_force(
        "referenceRate",
        "externalRate",
        "First derivative of the reference",
        unit::angular_rate(),
    );
    let accelerations = in_force(
        "referenceAcceleration",
        "externalAcceleration",
        "Second derivative of the reference",
        unit::angular_acceleration(),
    );
    let table = vector(table, ANGLES, angles, |m| &mut m.output.reference.angles);
    let table = vector(table, ANGLES, rates, |m| &mut m.output.reference.rates);
    let table = vector(table, ANGLES, accelerations, |m| &mut m.output.reference.accelerations);
    let estimate = sampled_output(
        "loopDelay.estimate",
        "Delay from a measurement to the moment that results from it, estimated from the motion; delay + measurement.age until the motion tells it",
    );
    let differs = sampled_output(
        "loopDelay.differs",
        "Whether the estimated delay differs from delay + measurement.age by more than half a period",
    );
    table
        .real(estimate.real().unit(unit::time()).nominal(0.1), |m| &mut m.output.loop_delay)
        .boolean(differs, |m| &mut m.output.has_other_delay)
}

fn reference_angle(axis: &str, meaning: &str) -> Real {
    let text = format!("Reference {meaning} if reference.profile is 'constant' or 'sine'");
    parameter(&format!("reference.angle.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
}

fn amplitude(axis: &str, meaning: &str) -> Real {
    let text = format!("Amplitude of the {meaning} if reference.profile is 'sine'");
    parameter(&format!("reference.amplitude.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
}

fn reference<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let profile = parameter("reference.profile", "Where the reference attitude comes from");
    let file = parameter(
        "reference.file",
        "CSV file with time and angles, if reference.profile is 'table'; a path, or a name inside the unit's resources",
    );
    let frequency =
        parameter("reference.frequency", "Angular frequency if reference.profile is 'sine'").real();
    let phase =
        parameter("reference.phase", "Phase at t = 0 if reference.profile is 'sine'").real();
    let table = table
        .enumeration(profile, &PROFILES, |m| &mut m.parameters.reference.profile)
        .string(file, |m| &mut m.parameters.reference.file);
    let table = vector(table, ANGLES, reference_angle, |m| &mut m.parameters.reference.angle);
    vector(table, ANGLES, amplitude, |m| &mut m.parameters.reference.amplitude)
        .real(frequency.unit(unit::angular_rate()).min(0.0).nominal(1.0), |m| {
            &mut m.parameters.reference.frequency
        })
        .real(phase.unit(unit::angle()), |m| &mut m.parameters.reference.phase)
}

fn moment_of_inertia(name: &str, meaning: &str) -> Real {
    let text = format!("{meaning} as the controller believes it to be");
    parameter(name, &text).real().unit(unit::inertia()).nominal(1e6)
}

fn vehicle<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let rate = parameter("limit.rate", "Limit on the norm of the body rates").real();
    let moment = parameter("limit.moment", "Limit on the norm of the control moment").real();
    let saturation =
        parameter("saturation", "Whether the commanded moment is scaled into limit.moment");
    let delay = parameter(
        "delay",
        "Time from a tick until the moment that it leads to acts on the vehicle; the law predicts the state over it",
    );
    let age = parameter(
        "measurement.age",
        "How old a measurement is when it arrives, by the delay of an estimator's filter for instance; the law predicts the state over it",
    );
    table
        .real(moment_of_inertia("inertia.Ixx", "Roll moment of inertia").min(1.0), |m| {
            &mut m.parameters.inertia.Ixx
        })
        .real(moment_of_inertia("inertia.Iyy", "Pitch moment of inertia").min(1.0), |m| {
            &mut m.parameters.inertia.Iyy
        })
        .real(moment_of_inertia("inertia.Izz", "Yaw moment of inertia").min(1.0), |m| {
            &mut m.parameters.inertia.Izz
        })
        .real(
            moment_of_inertia(
                "inertia.Ixz",
                "Product of inertia, which stands in the tensor as -Ixz,",
            ),
            |m| &mut m.parameters.inertia.Ixz,
        )
        .real(rate.unit(unit::angular_rate()).min(1e-6).nominal(0.1), |m| {
            &mut m.parameters.limit_rate
        })
        .real(moment.unit(unit::moment()).min(1e-3).nominal(1e5), |m| {
            &mut m.parameters.limit_moment
        })
        .boolean(saturation, |m| &mut m.parameters.saturation)
        .real(delay.real().unit(unit::time()).min(0.0).max(delay::LONGEST).nominal(0.1), |m| {
            &mut m.parameters.latency.action
        })
        .real(age.real().unit(unit::time()).min(0.0).max(delay::LONGEST).nominal(0.1), |m| {
            &mut m.parameters.latency.measurement
        })
}

/// Adds the parameter of laws that use the moment of the actuators.
pub fn achieved_moment<L: Law>(
    table: VariableTable<ControllerFmu<L>>,
) -> VariableTable<ControllerFmu<L>> {
    let used = parameter(
        "achievedMoment.used",
        "Whether the inputs achievedMoment are fed; if not, the commanded moment is taken to act",
    );
    table.boolean(used, |m| &mut m.parameters.achieved_moment_used)
}

/// Adds the parameter period.feedback, the time between two evaluations of what `text` says.
pub fn period<L: Law>(
    table: VariableTable<ControllerFmu<L>>,
    text: &str,
) -> VariableTable<ControllerFmu<L>> {
    let period = parameter("period.feedback", text).real().unit(unit::time());
    table.real(period.min(1e-4).max(10.0).nominal(L::period()), |m| &mut m.parameters.period)
}

/// Adds the gains of the three angles, `name[1]` to `name[3]`, in the order of [`ANGLES`].
pub fn gains<L: Law>(
    mut table: VariableTable<ControllerFmu<L>>,
    (name, text): (&str, &str),
    unit: Option<&unit::Unit>,
    field: impl Fn(&mut L) -> &mut [f64; 3] + Copy + Send + Sync + 'static,
) -> VariableTable<ControllerFmu<L>> {
    for (i, (_, meaning)) in ANGLES.into_iter().enumerate() {
        let real =
            parameter(&format!("{name}[{}]", i + 1), &format!("{text}: {meaning}")).real().min(0.0);
        let real = match unit {
            Some(unit) => real.unit(unit.clone()),
            None => real,
        };
        table = table.real(real, move |m| &mut field(&mut m.law)[i]);
    }
    table
}

/// Adds the weights P and Q on the tracking error and the input.
pub fn weights<L: Law>(
    mut table: VariableTable<ControllerFmu<L>>,
    p: impl Fn(&mut L) -> &mut [f64; 6] + Copy + Send + Sync + 'static,
    q: impl Fn(&mut L) -> &mut [f64; 3] + Copy + Send + Sync + 'static,
) -> VariableTable<ControllerFmu<L>> {
    for i in 0..6 {
        let (_, meaning) = ANGLES[i % 3];
        let of = if i < 3 { "error" } else { "error rate" };
        let text = format!("Diagonal entry {} of P: weight on the {of} of the {meaning}", i + 1);
        let real = parameter(&format!("weight.P[{}]", i + 1), &text).real().min(0.0).nominal(50.0);
        table = table.real(real, move |m| &mut p(&mut m.law)[i]);
    }
    for (i, (_, meaning)) in ANGLES.into_iter().enumerate() {
        let text = format!(
            "Diagonal entry {} of Q: weight on the second derivative of the {meaning}'s error",
            i + 1
        );
        let real = parameter(&format!("weight.Q[{}]", i + 1), &text).real().min(0.0).nominal(10.0);
        table = table.real(real, move |m| &mut q(&mut m.law)[i]);
    }
    table
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

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
