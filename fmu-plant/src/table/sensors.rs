//! Variables of the sensors and of their calibration.

use super::{AXES, Plant, RATES, TRAJECTORY_INPUTS, none, vector};
use crate::parameters::{MEMS_SENSORS, NO_SENSORS};
use crate::roles::Unknown;
use fmi2_export::table::{Common, Real, discrete_output, output, parameter};
use model_description::unit::{self, Unit};

struct Sensor {
    name: &'static str,
    /// Name of the quantity that the sensor measures.
    quantity: &'static str,
    unit: fn() -> Unit,
    /// Unit of the quantity's rate of change.
    rate_unit: fn() -> Unit,
    nominal: f64,
    /// Effects that the sensor's matrix contains, as text for the description.
    matrix: &'static str,
    bias: &'static str,
}

const SENSORS: [Sensor; 3] = [
    Sensor {
        name: "gyroscope",
        quantity: "angular rate",
        unit: unit::angular_rate,
        rate_unit: unit::angular_acceleration,
        nominal: 0.05,
        matrix: "scale and misalignment",
        bias: "bias",
    },
    Sensor {
        name: "accelerometer",
        quantity: "specific force",
        unit: unit::acceleration,
        rate_unit: unit::acceleration_rate,
        nominal: 10.0,
        matrix: "scale and misalignment",
        bias: "bias",
    },
    Sensor {
        name: "magnetometer",
        quantity: "magnetic field",
        unit: unit::flux_density,
        rate_unit: unit::flux_density_rate,
        nominal: 5e-5,
        matrix: "scale, misalignment and soft iron",
        bias: "bias and hard iron",
    },
];

pub(super) fn all(table: Plant) -> Plant {
    let table = line(measured(table));
    let table =
        SENSORS.iter().enumerate().fold(table, |table, (i, sensor)| errors(table, i, sensor));
    turntable(calibration(surroundings(table)))
}

fn measured(mut table: Plant) -> Plant {
    for (i, sensor) in SENSORS.iter().enumerate() {
        let declare = |axis: &str, meaning: &str| {
            let text = format!("The {}'s {meaning} {}", sensor.name, sensor.quantity);
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
            common.real().unit((sensor.unit)()).nominal(sensor.nominal)
        };
        let axes =
            if i == 0 { AXES } else { [("x", "forward"), ("y", "right"), ("z", "downward")] };
        let role = |axis| Unknown::Measured(3 * i + axis).into();
        table = vector(table, axes, declare, role, move |m| &mut m.output.measured.readings[i]);
    }
    let time = output("measured.time", "Time at which the newest sample was taken");
    let number = discrete_output(
        "measured.sample",
        "Number of the newest sample, from 1; 0 before the first",
    );
    table.real(seconds(time), |m| &mut m.output.measured.time).role(Unknown::MeasuredTime).integer(
        number,
        (Some(0), None),
        |m| &mut m.output.measured.number,
    )
}

fn seconds(common: Common) -> Real {
    common.real().unit(unit::time()).nominal(1.0)
}

fn line(table: Plant) -> Plant {
    let set = parameter(
        "sensor.set",
        "Sensors: 0 shows what they feel as it is; 1 samples it without errors; 2 with the errors that are set, from the start a typical MEMS set",
    );
    let period = parameter("sensor.period", "Time between samples");
    let delay = parameter("sensor.delay", "Time from taking a sample to its arrival");
    let probability =
        parameter("sensor.drop.probability", "Probability that a sample is dropped on its way");
    let start = parameter("sensor.drop.start", "Time from which samples can be dropped");
    let end = parameter("sensor.drop.end", "Time at which no more samples are dropped");
    let seed =
        parameter("sensor.seed", "Seed of noise and drops: the same seed gives the same samples");
    table
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

fn errors(mut table: Plant, i: usize, sensor: &Sensor) -> Plant {
    let name = |part: &str| format!("sensor.{}.{part}", sensor.name);
    let declare =
        |part: &str, text: &str| parameter(&name(part), &format!("The {}'s {text}", sensor.name));
    let own = |part: &str, text: &str| {
        declare(part, text).real().unit((sensor.unit)()).nominal(sensor.nominal)
    };
    for (row, (axis, _)) in AXES.into_iter().enumerate() {
        for (column, (from, _)) in AXES.into_iter().enumerate() {
            let text = format!("{}: {axis} by {from}", sensor.matrix);
            let real =
                declare(&format!("matrix[{},{}]", row + 1, column + 1), &text).real().nominal(1.0);
            table = table.real(real, move |m| &mut m.parameters.triads[i].matrix[(row, column)]);
        }
    }
    let bias = |axis: &str, _: &str| {
        own(&format!("bias.{axis}"), &format!("{} along {axis}", sensor.bias))
    };
    let drift = |axis: &str, _: &str| {
        let text = format!("change of the bias along {axis} in a second");
        let real = declare(&format!("drift.{axis}"), &text).real();
        real.unit((sensor.rate_unit)()).nominal(1e-3 * sensor.nominal)
    };
    let noise = own("noise", "standard deviation of white noise on a sample");
    let bandwidth = declare("bandwidth", "bandwidth of first order, 3 dB; 0 for none").real();
    let range = own("range", "range either way; 0 for no limit");
    let resolution = own("resolution", "step of the converter; 0 for none");
    let start = declare("freeze.start", "time from which it repeats its last value");
    let end = declare("freeze.end", "time at which it no longer repeats its last value");
    let table = vector(table, AXES, bias, none, move |m| &mut m.parameters.triads[i].bias);
    vector(table, AXES, drift, none, move |m| &mut m.parameters.triads[i].drift)
        .real(noise.min(0.0), move |m| &mut m.parameters.triads[i].noise)
        .real(bandwidth.unit(unit::frequency()).min(0.0).nominal(50.0), move |m| {
            &mut m.parameters.triads[i].bandwidth
        })
        .real(range.min(0.0), move |m| &mut m.parameters.triads[i].range)
        .real(resolution.min(0.0), move |m| &mut m.parameters.triads[i].resolution)
        .real(seconds(start), move |m| &mut m.parameters.triads[i].freeze.start)
        .real(seconds(end), move |m| &mut m.parameters.triads[i].freeze.end)
}

fn surroundings(table: Plant) -> Plant {
    let gravity = parameter("sensor.gravity", "Gravity that the accelerometer feels, down");
    let field = |axis: &str, _: &str| {
        let text =
            format!("The Earth's magnetic field that the magnetometer feels, component {axis}");
        parameter(&format!("sensor.field.{axis}"), &text)
            .real()
            .unit(unit::flux_density())
            .nominal(5e-5)
    };
    let axes = [("north", ""), ("east", ""), ("down", "")];
    let gravity = gravity.real().unit(unit::acceleration()).min(0.0).nominal(10.0);
    let table = table.real(gravity, |m| &mut m.parameters.surroundings.gravity);
    vector(table, axes, field, none, |m| &mut m.parameters.surroundings.field)
}

fn calibration(table: Plant) -> Plant {
    let rate = |name: &str, text: &str| {
        parameter(name, text).real().unit(unit::angular_rate()).nominal(0.1)
    };
    let active = parameter(
        "calibration.active",
        "The platform flies a sequence of rotations, not its dynamics",
    );
    let amplitude =
        parameter("calibration.beta.amplitude", "Amplitude of the sideslip in the sequence");
    table
        .boolean(active, |m| &mut m.parameters.calibrates)
        .real(rate("calibration.rate.alpha", "Rate of the angle of attack in the sequence"), |m| {
            &mut m.parameters.sequence.alpha_rate
        })
        .real(rate("calibration.rate.sigma", "Rate of the bank angle in the sequence"), |m| {
            &mut m.parameters.sequence.sigma_rate
        })
        .real(amplitude.real().unit(unit::angle()).min(0.0).nominal(0.5), |m| {
            &mut m.parameters.sequence.beta_amplitude
        })
        .real(
            rate("calibration.beta.frequency", "Angular frequency of the sideslip in the sequence"),
            |m| &mut m.parameters.sequence.beta_frequency,
        )
}

fn turntable(table: Plant) -> Plant {
    let bandwidth = parameter(
        "turntable.bandwidth",
        "Bandwidth of first order of the turntable that carries the sampled sensors; 0 for sensors on the vehicle",
    );
    let rate =
        parameter("turntable.rate", "Largest rate of the turntable's angles; 0 for no limit");
    let resolution = parameter(
        "turntable.resolution",
        "Step of the converter that commands the turntable's angles; 0 for none",
    );
    table
        .real(bandwidth.real().unit(unit::frequency()).min(0.0).nominal(10.0), |m| {
            &mut m.parameters.turntable.bandwidth
        })
        .real(rate.real().unit(unit::angular_rate()).min(0.0).nominal(1.0), |m| {
            &mut m.parameters.turntable.rate
        })
        .real(resolution.real().unit(unit::angle()).min(0.0).nominal(1e-3), |m| {
            &mut m.parameters.turntable.resolution
        })
}
