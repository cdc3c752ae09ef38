//! Variables of the readings of the sensors.

use super::{AXES, PlantVariables, RATES, vector};
use crate::roles::Unknown;
use fmi_export::table::{Common, Real, discrete_output, output};
use vehicle::trajectory;

struct Sensor {
    name: &'static str,
    /// Name of the quantity that the sensor measures.
    quantity: &'static str,
    /// Whether the quantity is measured about or along an axis.
    along: &'static str,
    unit: &'static str,
    nominal: f64,
}

const SENSORS: [Sensor; 3] = [
    Sensor {
        name: "gyroscope",
        quantity: "angular rate",
        along: "about",
        unit: "rad/s",
        nominal: 0.05,
    },
    Sensor {
        name: "accelerometer",
        quantity: "specific force",
        along: "along",
        unit: "m/s2",
        nominal: 10.0,
    },
    Sensor {
        name: "magnetometer",
        quantity: "magnetic field",
        along: "along",
        unit: "T",
        nominal: 5e-5,
    },
];

/// Adds the readings of the sensors.
pub(super) fn measured(mut variables: PlantVariables) -> PlantVariables {
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
                common.depends_on(rates.iter().map(String::as_str)).depends_on(trajectory::NAMES)
            } else {
                common.depends_on(["trajectory.flightPathAngle", "trajectory.heading"])
            };
            let common = common.depends_on(super::entry::MOTION_NAMES);
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
    let variables = variables
        .real(seconds(time), |m| &mut m.output.measured.time)
        .role(Unknown::MeasuredTime)
        .integer(number, (Some(0), None), |m| &mut m.output.measured.number);
    fixes(variables)
}

/// Planet-fixed axes.
const FIXED: [(&str, &str); 3] =
    [("x", "axis through longitude 0"), ("y", "axis through 90 deg east"), ("z", "polar axis")];

/// Adds the fixes of satellite navigation and star tracker.
fn fixes(variables: PlantVariables) -> PlantVariables {
    let component = |name: &'static str, quantity: &'static str, unit: &'static str, nominal| {
        move |axis: &str, meaning: &str| {
            let text = format!("{quantity} along the {meaning}, of the latest fix");
            discrete_output(&format!("{name}.{axis}"), &text).real().unit(unit).nominal(nominal)
        }
    };
    let position = component("gnss.position", "Position", "m", 1e6);
    let velocity = component("gnss.velocity", "Velocity relative to the planet", "m/s", 1e3);
    let role = |_| Unknown::MeasuredTime.into();
    let variables =
        vector(variables, FIXED, position, role, |m| &mut m.output.measured.fixes.gnss.position);
    let variables =
        vector(variables, FIXED, velocity, role, |m| &mut m.output.measured.fixes.gnss.velocity);
    let taken = |name: &str| {
        seconds(discrete_output(&format!("{name}.time"), "Time at which the latest fix was taken"))
    };
    let number = |name: &str| {
        let text = "Number of the latest fix, counted from 1; 0 before the first";
        discrete_output(&format!("{name}.fix"), text)
    };
    let mut variables = variables
        .real(taken("gnss"), |m| &mut m.output.measured.fixes.gnss.time)
        .role(Unknown::MeasuredTime)
        .integer(number("gnss"), (Some(0), None), |m| &mut m.output.measured.fixes.gnss.number);
    for (i, part) in ["w", "x", "y", "z"].into_iter().enumerate() {
        let text = format!(
            "Part {part} of the quaternion from inertial to body axes, of the latest fix; the inertial axes are the planet's at time 0"
        );
        let real = discrete_output(&format!("star.attitude.{part}"), &text).real().nominal(1.0);
        variables = variables
            .real(real, move |m| &mut m.output.measured.fixes.star.attitude[i])
            .role(Unknown::MeasuredTime);
    }
    variables
        .real(taken("star"), |m| &mut m.output.measured.fixes.star.time)
        .role(Unknown::MeasuredTime)
        .integer(number("star"), (Some(0), None), |m| &mut m.output.measured.fixes.star.number)
}

fn seconds(common: Common) -> Real {
    common.real().unit("s").nominal(1.0)
}
