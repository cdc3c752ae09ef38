//! The variable table that every controller has. Each law adds its own variables.

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

/// Returns the names of the inputs on which a sampled output depends.
fn sampled_inputs() -> impl Iterator<Item = &'static str> {
    MEASURED.into_iter().chain(EXTERNAL)
}

/// Declares an output of a law, which changes at its ticks only.
#[inline(never)]
pub fn sampled_output(name: &str, description: &str) -> Common {
    discrete_output(name, description).depends_on(sampled_inputs())
}

/// Returns the description of a controller's FMU.
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
        "{meaning} moment achieved by the actuators; ignored by controllers without the parameter achievedMoment.used"
    );
    let common = input(&format!("achievedMoment.{axis}"), &capital(&text));
    common.real().unit(unit::moment()).nominal(1e5)
}

/// Declares inputs for a reference from outside.
fn external(
    name: &'static str,
    quantity: &'static str,
    unit: unit::Unit,
) -> impl Fn(&str, &str) -> Real {
    move |axis, meaning| {
        let text = format!("{quantity} {meaning}; used with reference.profile = external");
        input(&format!("reference.{name}.{axis}"), &text).real().unit(unit.clone()).nominal(0.1)
    }
}

fn inputs<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let table = vector(table, ANGLES, measured_angle, |m| &mut m.input.measured.angles);
    let table = vector(table, RATES, measured_rate, |m| &mut m.input.measured.rates);
    let table = vector(table, AXES, achieved, |m| &mut m.input.achieved_moment);

    let angles = external("external", "Reference", unit::angle());
    let rates = external("externalRate", FIRST_DERIVATIVE, unit::angular_rate());
    let accelerations =
        external("externalAcceleration", SECOND_DERIVATIVE, unit::angular_acceleration());
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
    quantity: &'static str,
    unit: unit::Unit,
) -> impl Fn(&str, &str) -> Real {
    move |axis, meaning| {
        let text = format!("{quantity} {meaning} at the present time");
        let source = format!("reference.{external}.{axis}");
        let common = output(&format!("{name}.{axis}"), &text).depends_on([source.as_str()]);
        common.real().unit(unit.clone()).nominal(0.1)
    }
}

fn outputs<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let table = vector(table, AXES, moment, |m| &mut m.output.moment);
    let angles = in_force("reference", "external", "Reference", unit::angle());
    let rates = in_force("referenceRate", "externalRate", FIRST_DERIVATIVE, unit::angular_rate());
    let accelerations = in_force(
        "referenceAcceleration",
        "externalAcceleration",
        SECOND_DERIVATIVE,
        unit::angular_acceleration(),
    );
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
        .real(estimate.real().unit(unit::time()).nominal(0.1), |m| &mut m.output.loop_delay)
        .boolean(differs, |m| &mut m.output.has_other_delay)
}

fn reference_angle(axis: &str, meaning: &str) -> Real {
    let text = format!(
        "Constant part of the reference {meaning}; used with reference.profile = constant or sine"
    );
    parameter(&format!("reference.angle.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
}

fn amplitude(axis: &str, meaning: &str) -> Real {
    let text = format!(
        "Amplitude of the sine in the reference {meaning}; used with reference.profile = sine"
    );
    parameter(&format!("reference.amplitude.{axis}"), &text).real().unit(unit::angle()).nominal(0.1)
}

fn reference<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let profile = parameter("reference.profile", PROFILES.description);
    let file = parameter(
        "reference.file",
        "Path of a CSV file with time and angles, or name of a file in the resources of the FMU; used with reference.profile = table",
    );
    let frequency = parameter(
        "reference.frequency",
        "Angular frequency of the reference sine; used with reference.profile = sine",
    );
    let phase = parameter(
        "reference.phase",
        "Phase of the reference sine at t = 0; used with reference.profile = sine",
    );
    let table = table
        .enumeration(profile, &PROFILES, |m| &mut m.parameters.reference.profile)
        .string(file, |m| &mut m.parameters.reference.file);
    let table = vector(table, ANGLES, reference_angle, |m| &mut m.parameters.reference.angle);
    vector(table, ANGLES, amplitude, |m| &mut m.parameters.reference.amplitude)
        .real(frequency.real().unit(unit::angular_rate()).min(0.0).nominal(1.0), |m| {
            &mut m.parameters.reference.frequency
        })
        .real(phase.real().unit(unit::angle()), |m| &mut m.parameters.reference.phase)
}

fn moment_of_inertia(name: &str, meaning: &str) -> Real {
    let text = format!("{meaning} assumed by the controller");
    parameter(name, &text).real().unit(unit::inertia()).nominal(1e6)
}

fn vehicle<L: Law>(table: VariableTable<ControllerFmu<L>>) -> VariableTable<ControllerFmu<L>> {
    let rate = parameter("limit.rate", "Upper limit on the norm of the body rates").real();
    let moment = parameter("limit.moment", "Upper limit on the norm of the control moment").real();
    let saturation = parameter(
        "saturation",
        "Whether the commanded moment is scaled down to a norm of at most limit.moment",
    );
    let delay = parameter(
        "delay",
        "Time from a tick until the resulting moment acts on the vehicle; the law uses the state predicted over this time",
    );
    let age = parameter(
        "measurement.age",
        "Age of a measurement when it arrives, for example because of an estimator's filter; the law uses the state predicted over this time",
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
                "Product of inertia (entry -Ixz of the inertia tensor)",
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
        "Whether the inputs achievedMoment are connected; otherwise the law assumes that the commanded moment acts",
    );
    table.boolean(used, |m| &mut m.parameters.achieved_moment_used)
}

/// Declares the threshold of the actuators' saturation, which all laws with anti-windup have.
pub fn anti_windup_threshold() -> Real {
    let text =
        "Norm of the missing angular acceleration above which the actuators count as saturated";
    let common = parameter("antiWindupThreshold", text);
    common.real().unit(unit::angular_acceleration()).min(0.0).nominal(0.01)
}

/// Declares a component of the disturbance that a law's observer estimates.
pub fn disturbance_estimate(axis: &str, meaning: &str) -> Real {
    let text =
        format!("Observer's estimate of the disturbance of the second derivative of the {meaning}");
    let common = sampled_output(&format!("disturbanceEstimate.{axis}"), &text);
    common.real().unit(unit::angular_acceleration())
}

/// Adds the parameter period.feedback, the sampling period of `part`, such as "control law".
pub fn period<L: Law>(
    table: VariableTable<ControllerFmu<L>>,
    part: &str,
) -> VariableTable<ControllerFmu<L>> {
    let text = format!("Sampling period of the {part}");
    let period = parameter("period.feedback", &text).real().unit(unit::time());
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
        let real = parameter(&format!("{name}[{}]", i + 1), &format!("{text} for the {meaning}"))
            .real()
            .min(0.0);
        let real = match unit {
            Some(unit) => real.unit(unit.clone()),
            None => real,
        };
        table = table.real(real, move |m| &mut field(&mut m.law)[i]);
    }
    table
}

/// Name of Θ − Θ_r in descriptions.
pub const TRACKING_ERROR: &str = "tracking error";
/// Name of the first derivative of Θ − Θ_r in descriptions.
pub const ERROR_RATE: &str = "derivative of the tracking error";

/// Returns the description of the weight on a `quantity` of an angle, the diagonal entry with this
/// index of this matrix.
pub fn weight_text(quantity: &str, angle: &str, (matrix, index): (&str, usize)) -> String {
    format!("Weight on the {quantity} of the {angle} (diagonal entry {} of {matrix})", index + 1)
}

/// Adds the weights P and Q on the tracking error and the input.
pub fn weights<L: Law>(
    mut table: VariableTable<ControllerFmu<L>>,
    p: impl Fn(&mut L) -> &mut [f64; 6] + Copy + Send + Sync + 'static,
    q: impl Fn(&mut L) -> &mut [f64; 3] + Copy + Send + Sync + 'static,
) -> VariableTable<ControllerFmu<L>> {
    for i in 0..6 {
        let (_, meaning) = ANGLES[i % 3];
        let quantity = if i < 3 { TRACKING_ERROR } else { ERROR_RATE };
        let text = weight_text(quantity, meaning, ("P", i));
        let real = parameter(&format!("weight.P[{}]", i + 1), &text).real().min(0.0).nominal(50.0);
        table = table.real(real, move |m| &mut p(&mut m.law)[i]);
    }
    for (i, (_, meaning)) in ANGLES.into_iter().enumerate() {
        let text = weight_text("second derivative of the tracking error", meaning, ("Q", i));
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

/// Returns the text with a capital first letter.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
