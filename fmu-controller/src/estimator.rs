//! `AttitudeEstimator`: attitude and rates from gyroscope, accelerometer and magnetometer.

use control::estimation::{
    Calibration, CalibrationStatus, Estimate, Estimator, Health, Line, Memory, Settings,
    mems_corrections,
};
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use controller_export::table::{ANGLES, AXES, RATES, vector};
use fmi_export::table::{Common, Real, discrete_input, discrete_output, input};
use fmi_export::{Description, Failure, VariableTable};
use model_description::DefaultExperiment;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;
use vehicle::Scenario;
use vehicle::error::rounded_time;
use vehicle::kinematics::Kinematics;
use vehicle::platform::Pose;
use vehicle::sensor_data::SensorData;
use vehicle::trajectory::Trajectory;

/// The estimator as an FMU.
pub type AttitudeEstimator = SampledFmu<EstimatorInstance>;

/// An instance of the estimator: its parameters, inputs and outputs.
#[derive(Serialize, Deserialize)]
pub struct EstimatorInstance {
    pub(crate) settings: Settings,
    /// Sensor set as in the plant: 0, 1 for sensors without errors, [`MEMS_SENSORS`] for those with
    /// errors.
    line: Line,
    output: Output,
}

/// Outputs of the estimator.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Output {
    estimate: Estimate,
    filter_delay: f64,
    calibration: Calibration,
}

impl SampledInstance for EstimatorInstance {
    type Device = Estimator;
    type Memory = Memory;
    type Input = Line;
    type Output = ();

    fn description() -> Description<AttitudeEstimator> {
        Description {
            name: "AttitudeEstimator",
            description: "Attitude and rates from gyroscope, accelerometer and magnetometer, as on the platform of Chai et al. (2022)",
            documentation: include_str!("estimator.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: Scenario::crmpc2022().duration,
                tolerance: 1e-6,
                step: Settings::ours().period,
            },
            table: outputs(inputs(VariableTable::new()))
                .settings(|m: &mut AttitudeEstimator| &mut m.settings),
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings {
                sensor_set: 0,
                corrections: mems_corrections(),
                ..Settings::ours()
            },
            line: at_rest(),
            output: Output::default(),
        }
    }

    fn design(&self) -> Result<Estimator, Failure> {
        Estimator::new(self.settings).map_err(|error| Failure::Error(error.to_string()))
    }

    fn period(estimator: &Estimator) -> f64 {
        estimator.period()
    }

    fn memory(estimator: &Estimator) -> Memory {
        estimator.memory()
    }

    fn evaluate(&self, estimator: &mut Estimator, ticks: &mut Ticks<Self>) -> Result<(), Failure> {
        let line = self.line;
        if !(line.time.is_finite() && line.readings.iter().flatten().all(|value| value.is_finite()))
        {
            return Err(Failure::Error("an input measured.* is not a finite number".into()));
        }
        let time = ticks.next_time();
        ticks.evaluate_with(line, |memory, _| estimator.update(memory, time, &line));
        let Estimate { angles, rates, gyroscope_bias, .. } = ticks.in_force().1.estimate;
        if [angles, rates, gyroscope_bias].iter().flatten().all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(Failure::Error(format!(
            "the estimate at t = {} s is not finite; check the inputs measured.*",
            rounded_time(time)
        )))
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        warning(before, after)
    }

    fn show(&mut self, _time: f64, estimator: &Estimator, ((), memory): ((), &Memory)) {
        self.output = Output {
            estimate: memory.estimate,
            filter_delay: estimator.filter_delay(),
            calibration: memory.calibration,
        };
    }
}

/// Returns the readings of sensors without errors at the scenario's start, where the platform
/// rests. The sample has no number.
fn at_rest() -> Line {
    let pose = Pose {
        specific_force: None,
        kinematics: Kinematics::Printed,
        angles: Scenario::crmpc2022().initial_angles,
        rates: Vector3::zeros(),
        alpha_rate: 0.0,
        trajectory: Trajectory::default(),
    };
    Line { readings: pose.felt(&SensorData::embedded().surroundings), ..Line::default() }
}

/// Returns the warning of a tick for the log of the importer.
fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
    let becomes =
        |health: Health| after.estimate.health == health && before.estimate.health != health;
    if becomes(Health::Lost) {
        Some(
            "no usable sample has arrived for longer than lost.after: the attitude is lost (see health)",
        )
    } else if becomes(Health::Frozen) {
        Some("a sensor repeats its value and is ignored (see health)")
    } else if becomes(Health::Rejected) && before.estimate.rejected == 0 {
        // The warning is given the first time only; `rejectedSamples` counts the later ones.
        Some(
            "a sample was ignored because it is outside the sensor's range or too far from the last one (see health and rejectedSamples)",
        )
    } else if becomes(Health::Uncalibrated) {
        Some(
            "the readings do not determine an ellipsoid: the given calibration stays in force (see calibration.status)",
        )
    } else {
        None
    }
}

type Variables = VariableTable<AttitudeEstimator>;

struct Sensor {
    name: &'static str,
    quantity: &'static str,
    unit: &'static str,
    nominal: f64,
}

const SENSORS: [Sensor; 3] = [
    Sensor { name: "gyroscope", quantity: "Angular rate about", unit: "rad/s", nominal: 0.05 },
    Sensor { name: "accelerometer", quantity: "Specific force along", unit: "m/s2", nominal: 10.0 },
    Sensor { name: "magnetometer", quantity: "Magnetic field along", unit: "T", nominal: 5e-5 },
];

const MEASURED: [&str; 11] = [
    "measured.gyroscope.x",
    "measured.gyroscope.y",
    "measured.gyroscope.z",
    "measured.accelerometer.x",
    "measured.accelerometer.y",
    "measured.accelerometer.z",
    "measured.magnetometer.x",
    "measured.magnetometer.y",
    "measured.magnetometer.z",
    "measured.time",
    "measured.sample",
];

fn seconds(common: Common) -> Real {
    common.real().unit("s")
}

fn inputs(mut table: Variables) -> Variables {
    for (i, sensor) in SENSORS.iter().enumerate() {
        let declare = |axis: &str, _: &str| {
            let text = format!("{} {axis}, measured by the {}", sensor.quantity, sensor.name);
            let common = input(&format!("measured.{}.{axis}", sensor.name), &text);
            common.real().unit(sensor.unit).nominal(sensor.nominal)
        };
        table = vector(table, AXES, declare, move |m| &mut m.line.readings[i]);
    }
    let time = input("measured.time", "Time at which the newest sample was taken");
    let sample = discrete_input(
        "measured.sample",
        "Number of the newest sample, counted from 1; 0 before the first sample, or always if samples are not counted",
    );
    table.real(seconds(time).nominal(1.0), |m| &mut m.line.time).integer(
        sample,
        (Some(0), None),
        |m| &mut m.line.sample,
    )
}

fn sampled(name: &str, text: &str) -> Common {
    discrete_output(name, text).depends_on(MEASURED)
}

fn outputs(table: Variables) -> Variables {
    let angle = |axis: &str, meaning: &str| {
        let common = sampled(&format!("attitude.{axis}"), &format!("Estimated {meaning}"));
        common.real().unit("rad").nominal(0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let common = sampled(&format!("rate.{axis}"), &format!("Estimated body {meaning} rate"));
        common.real().unit("rad/s").nominal(0.05)
    };
    let bias = |axis: &str, _: &str| {
        let text = format!(
            "Estimated gyroscope bias about {axis}: sum of the given bias, the one measured at rest and the learned one"
        );
        let common = sampled(&format!("estimatedBias.{axis}"), &text);
        common.real().unit("rad/s").nominal(0.01)
    };
    let hard_iron = |axis: &str, _: &str| {
        let text = format!("Magnetometer bias along {axis} in force, including hard iron");
        let common = sampled(&format!("calibration.bias.{axis}"), &text);
        common.real().unit("T").nominal(5e-5)
    };
    let table = vector(table, ANGLES, angle, |m| &mut m.output.estimate.angles);
    let table = vector(table, RATES, rate, |m| &mut m.output.estimate.rates);
    let health = sampled("health", Health::TEXT);
    let age = sampled("age", "Time since the newest sample was taken");
    let dropped = sampled("droppedSamples", "Number of samples so far that never arrived");
    let rejected = sampled(
        "rejectedSamples",
        "Number of samples so far that were ignored in whole or in part because a reading or the time was implausible",
    );
    let delay = sampled(
        "filter.delay",
        "Phase delay of the sensors and the low-pass filter at low frequencies",
    );
    let status = sampled("calibration.status", CalibrationStatus::TEXT);
    let residual = sampled(
        "calibration.residual",
        "Root mean square distance of the readings from the fitted ellipsoid, relative to its size",
    );
    let condition = sampled(
        "calibration.condition",
        "Condition number of the ellipsoid fit; 16 for uniform coverage, above 1000 rejected",
    );
    let table = table
        .choice(health, |m| &mut m.output.estimate.health)
        .real(seconds(age).nominal(0.01), |m| &mut m.output.estimate.age)
        .integer(dropped, (None, None), |m| &mut m.output.estimate.dropped)
        .integer(rejected, (None, None), |m| &mut m.output.estimate.rejected)
        .real(seconds(delay).nominal(0.01), |m| &mut m.output.filter_delay);
    let table = vector(table, AXES, bias, |m| &mut m.output.estimate.gyroscope_bias)
        .choice(status, |m| &mut m.output.calibration.status)
        .real(residual.real(), |m| &mut m.output.calibration.residual)
        .real(condition.real(), |m| &mut m.output.calibration.condition);
    let mut table = vector(table, AXES, hard_iron, |m| &mut m.output.calibration.correction.bias);
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        let name = format!("calibration.matrix[{},{}]", row + 1, column + 1);
        let text = format!(
            "Correction matrix of the magnetometer in force, entry ({}, {}); its unit is 1/T after a fit",
            AXES[row].0, AXES[column].0
        );
        table = table.real(sampled(&name, &text).real(), move |m| {
            &mut m.output.calibration.correction.matrix[(row, column)]
        });
    }
    table
}
