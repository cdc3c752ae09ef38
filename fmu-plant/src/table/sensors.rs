//! Variables of the sensors and of their calibration.

use super::{AXES, PlantVariables, RATES, TRAJECTORY_INPUTS, none, vector};
use crate::parameters::{MEMS_SENSORS, NO_SENSORS};
use crate::roles::Unknown;
use fmi2_export::table::{Common, Real, discrete_output, output, parameter};

struct Sensor {
    name: &'static str,
    /// Name of the quantity that the sensor measures.
    quantity: &'static str,
    /// Whether the quantity is measured about or along an axis.
    along: &'static str,
    unit: &'static str,
    /// Unit of the quantity's rate of change.
    rate_unit: &'static str,
    nominal: f64,
    /// Effects that the sensor's matrix contains, as text for the description.
    matrix: &'static str,
    /// Effect that the sensor's bias contains besides, as text for the description.
    bias_part: &'static str,
}

const SENSORS: [Sensor; 3] = [
    Sensor {
        name: "gyroscope",
        quantity: "angular rate",
        along: "about",
        unit: "rad/s",
        rate_unit: "rad/s2",
        nominal: 0.05,
        matrix: "scale and misalignment",
        bias_part: "",
    },
    Sensor {
        name: "accelerometer",
        quantity: "specific force",
        along: "along",
        unit: "m/s2",
        rate_unit: "m/s3",
        nominal: 10.0,
        matrix: "scale and misalignment",
        bias_part: "",
    },
    Sensor {
        name: "magnetometer",
        quantity: "magnetic field",
        along: "along",
        unit: "T",
        rate_unit: "T/s",
        nominal: 5e-5,
        matrix: "scale, misalignment and soft iron",
        bias_part: ", including hard iron",
    },
];

pub(super) fn sensor_variables(variables: PlantVariables) -> PlantVariables {
    let variables = line(measured(variables));
    let variables = SENSORS
        .iter()
        .enumerate()
        .fold(variables, |variables, (i, sensor)| errors(variables, i, sensor));
    turntable(calibration(surroundings(variables)))
}

fn measured(mut variables: PlantVariables) -> PlantVariables {
    for (i, sensor) in SENSORS.iter().enumerate() {
        let declare = |axis: &str, meaning: &str| {
            let text = format!(
                "{} reading of the {} {} the {meaning} axis",
                sensor.name, sensor.quantity, sensor.along
            );
            let common =
                output(&format!("measured.{}.{axis}", sensor.name), &super::sentence(&text))
                    .depends_on(["attitude.alpha", "attitude.beta", "attitude.sigma"]);
            let common = if i == 0 {
                let rates = RATES.map(|(axis, _)| format!("rate.{axis}"));
                common
                    .depends_on(rates.iter().map(String::as_str))
                    .depends_on(TRAJECTORY_INPUTS.map(|(name, ..)| name))
            } else {
                common.depends_on(["trajectory.flightPathAngle", "trajectory.heading"])
            };
            common.real().unit(sensor.unit).nominal(sensor.nominal)
        };
        let axes =
            if i == 0 { AXES } else { [("x", "forward"), ("y", "right"), ("z", "downward")] };
        let role = |axis| Unknown::Measured(3 * i + axis).into();
        variables =
            vector(variables, axes, declare, role, move |m| &mut m.output.measured.readings[i]);
    }
    let time = output("measured.time", "Time at which the latest received sample was taken");
    let number = discrete_output(
        "measured.sample",
        "Number of the latest received sample, counted from 1; 0 before the first",
    );
    variables
        .real(seconds(time), |m| &mut m.output.measured.time)
        .role(Unknown::MeasuredTime)
        .integer(number, (Some(0), None), |m| &mut m.output.measured.number)
}

fn seconds(common: Common) -> Real {
    common.real().unit("s").nominal(1.0)
}

fn line(variables: PlantVariables) -> PlantVariables {
    let set = parameter(
        "sensor.set",
        "Sensor set: 0 for ideal continuous readings, 1 for samples without errors, 2 for samples with errors, which are those of a typical MEMS set by default",
    );
    let period = parameter("sensor.period", "Sampling period of the sensors");
    let delay = parameter("sensor.delay", "Delay between taking a sample and receiving it");
    let probability = parameter(
        "sensor.drop.probability",
        "Probability that a sample is dropped in transmission",
    );
    let start = parameter("sensor.drop.start", "Time from which samples can be dropped");
    let end = parameter("sensor.drop.end", "Time from which samples are no longer dropped");
    let seed = parameter(
        "sensor.seed",
        "Seed of sensor noise and dropped samples; the same seed gives the same samples",
    );
    variables
        .integer(set, (Some(NO_SENSORS), Some(MEMS_SENSORS)), |m| &mut m.parameters.sensor_set)
        .real(seconds(period).min(1e-4).nominal(0.01), |m| &mut m.parameters.line.period)
        .real(seconds(delay).min(0.0).max(10.0).nominal(0.01), |m| &mut m.parameters.line.delay)
        .real(probability.real().min(0.0).max(1.0).nominal(1.0), |m| {
            &mut m.parameters.line.drop_probability
        })
        .real(seconds(start), |m| &mut m.parameters.line.drop_window.start)
        .real(seconds(end), |m| &mut m.parameters.line.drop_window.end)
        .integer(seed, (Some(0), None), |m| &mut m.parameters.sensor_seed)
}

fn errors(mut variables: PlantVariables, i: usize, sensor: &Sensor) -> PlantVariables {
    let name = |part: &str| format!("sensor.{}.{part}", sensor.name);
    let declare = |part: &str, text: &str| parameter(&name(part), &super::sentence(text));
    let in_sensor_unit = |part: &str, text: &str| {
        declare(part, text).real().unit(sensor.unit).nominal(sensor.nominal)
    };
    let device = sensor.name;
    for (row, (axis, _)) in AXES.into_iter().enumerate() {
        for (column, (from, _)) in AXES.into_iter().enumerate() {
            let text = format!(
                "{device} matrix of {}: response of axis {axis} to axis {from}",
                sensor.matrix
            );
            let real =
                declare(&format!("matrix[{},{}]", row + 1, column + 1), &text).real().nominal(1.0);
            variables =
                variables.real(real, move |m| &mut m.parameters.triads[i].matrix[(row, column)]);
        }
    }
    let bias = |axis: &str, _: &str| {
        in_sensor_unit(
            &format!("bias.{axis}"),
            &format!("{device} bias of axis {axis}{}", sensor.bias_part),
        )
    };
    let drift = |axis: &str, _: &str| {
        let text = format!("rate of change of the {device} bias of axis {axis}");
        let real = declare(&format!("drift.{axis}"), &text).real();
        real.unit(sensor.rate_unit).nominal(1e-3 * sensor.nominal)
    };
    let noise = in_sensor_unit(
        "noise",
        &format!("standard deviation of the white noise on the samples of the {device}"),
    );
    let bandwidth = declare(
        "bandwidth",
        &format!(
            "bandwidth (3 dB) of the first-order low-pass filter in the {device}; 0 for no filter"
        ),
    )
    .real();
    let range = in_sensor_unit(
        "range",
        &format!("largest magnitude that the {device} can output; 0 for no limit"),
    );
    let resolution = in_sensor_unit(
        "resolution",
        &format!("quantization step of the {device} reading; 0 for none"),
    );
    let start = declare(
        "freeze.start",
        &format!("time at which the {device} starts to repeat its last value"),
    );
    let end = declare(
        "freeze.end",
        &format!("time at which the {device} stops repeating its last value"),
    );
    let variables = vector(variables, AXES, bias, none, move |m| &mut m.parameters.triads[i].bias);
    vector(variables, AXES, drift, none, move |m| &mut m.parameters.triads[i].drift)
        .real(noise.min(0.0), move |m| &mut m.parameters.triads[i].noise)
        .real(bandwidth.unit("Hz").min(0.0).nominal(50.0), move |m| {
            &mut m.parameters.triads[i].bandwidth
        })
        .real(range.min(0.0), move |m| &mut m.parameters.triads[i].range)
        .real(resolution.min(0.0), move |m| &mut m.parameters.triads[i].resolution)
        .real(seconds(start), move |m| &mut m.parameters.triads[i].freeze.start)
        .real(seconds(end), move |m| &mut m.parameters.triads[i].freeze.end)
}

fn surroundings(variables: PlantVariables) -> PlantVariables {
    let gravity = parameter(
        "sensor.gravity",
        "Gravitational acceleration at the accelerometer, directed down",
    );
    let field = |axis: &str, meaning: &str| {
        let text = format!("{meaning} component of the Earth's magnetic field at the magnetometer");
        parameter(&format!("sensor.field.{axis}"), &text).real().unit("T").nominal(5e-5)
    };
    let axes = [("north", "North"), ("east", "East"), ("down", "Downward")];
    let gravity = gravity.real().unit("m/s2").min(0.0).nominal(10.0);
    let variables = variables.real(gravity, |m| &mut m.parameters.surroundings.gravity);
    vector(variables, axes, field, none, |m| &mut m.parameters.surroundings.field)
}

fn calibration(variables: PlantVariables) -> PlantVariables {
    let rate = |name: &str, text: &str| parameter(name, text).real().unit("rad/s").nominal(0.1);
    let active = parameter(
        "calibration.active",
        "If true, the attitude follows a prescribed calibration sequence instead of the dynamics",
    );
    let amplitude = parameter(
        "calibration.beta.amplitude",
        "Amplitude of the sideslip angle in the calibration sequence",
    );
    variables
        .boolean(active, |m| &mut m.parameters.calibrates)
        .real(
            rate(
                "calibration.rate.alpha",
                "Rate of the angle of attack in the calibration sequence",
            ),
            |m| &mut m.parameters.sequence.alpha_rate,
        )
        .real(
            rate("calibration.rate.sigma", "Rate of the bank angle in the calibration sequence"),
            |m| &mut m.parameters.sequence.sigma_rate,
        )
        .real(amplitude.real().unit("rad").min(0.0).nominal(0.5), |m| {
            &mut m.parameters.sequence.beta_amplitude
        })
        .real(
            rate(
                "calibration.beta.frequency",
                "Angular frequency of the sideslip angle in the calibration sequence",
            ),
            |m| &mut m.parameters.sequence.beta_frequency,
        )
}

fn turntable(variables: PlantVariables) -> PlantVariables {
    let bandwidth = parameter(
        "turntable.bandwidth",
        "Bandwidth of the first-order servo of a turntable that carries the sampled sensors; 0 for sensors on the vehicle",
    );
    let rate =
        parameter("turntable.rate", "Maximum rate of the turntable's angles; 0 for no limit");
    let resolution = parameter(
        "turntable.resolution",
        "Quantization step of the angles commanded to the turntable; 0 for none",
    );
    variables
        .real(bandwidth.real().unit("Hz").min(0.0).nominal(10.0), |m| {
            &mut m.parameters.turntable.bandwidth
        })
        .real(rate.real().unit("rad/s").min(0.0).nominal(1.0), |m| &mut m.parameters.turntable.rate)
        .real(resolution.real().unit("rad").min(0.0).nominal(1e-3), |m| {
            &mut m.parameters.turntable.resolution
        })
}
