//! `AttitudeEstimator`: attitude and rates from gyroscope, accelerometer and magnetometer.

use control::estimation::{
    Calibration, Estimate, Estimator, Health, Line, Memory, Settings, mems_corrections,
};
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use fmi_export::{Context, Description, Failure, SettingsFile, VariableTable};
use model_description::DefaultExperiment;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::Scenario;
use vehicle::axes::LETTERS;
use vehicle::error::rounded_time;
use vehicle::kinematics::Kinematics;
use vehicle::platform::Pose;
use vehicle::sensor_data::SensorData;
use vehicle::trajectory::Trajectory;

/// The estimator as an FMU.
pub type AttitudeEstimator = SampledFmu<EstimatorInstance>;

/// An instance of the estimator: its inputs, outputs and parameters.
#[derive(Serialize, Deserialize, Declared)]
pub struct EstimatorInstance {
    #[setting(name = "", input)]
    line: Line,
    #[setting(name = "", output, discrete, depends_on = ["*"])]
    output: Output,
    #[setting(name = "")]
    pub(crate) settings: Settings,
    #[setting(name = "")]
    pub(crate) file: SettingsFile,
}

/// Outputs of the estimator.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, Declared)]
struct Output {
    #[setting(name = "")]
    estimate: Estimate,
    /// Phase delay of the sensors and the low-pass filter at low frequencies.
    #[setting(name = "filter.delay", unit = "s", nominal = 0.01)]
    filter_delay: f64,
    calibration: Calibration,
    /// Magnetometer bias along {} in force, including hard iron.
    #[setting(name = "calibration.bias", each = LETTERS, unit = "T", nominal = 5e-5)]
    bias: Vector3<f64>,
    /// Correction matrix of the magnetometer in force, entry ({}, {}); its unit is 1/T after a fit.
    #[setting(name = "calibration.matrix", each = LETTERS, columns = LETTERS)]
    matrix: Matrix3<f64>,
}

impl SampledInstance for EstimatorInstance {
    type Device = Estimator;
    type Memory = Memory;
    type Input = Line;
    type Output = ();

    fn description() -> Description<AttitudeEstimator> {
        let table = VariableTable::new(|m: &mut AttitudeEstimator| &mut **m);
        Description {
            documentation: include_str!("estimator.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            default_experiment: DefaultExperiment {
                stop: Scenario::crmpc2022().duration,
                step: Settings::ours().period,
                ..DefaultExperiment::default()
            },
            ..Description::new(
                "AttitudeEstimator",
                "Attitude and rates from gyroscope, accelerometer and magnetometer, as on the platform of Chai et al. (2022)",
                table,
            )
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings {
                sensor_set: 0,
                corrections: mems_corrections(),
                ..Settings::ours()
            },
            file: SettingsFile::default(),
            line: at_rest(),
            output: Output::default(),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.file.clone().read(self, context)
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

    fn evaluate(
        &self,
        estimator: &mut Estimator,
        ticks: &mut Ticks<Self>,
        _is_stale: bool,
    ) -> Result<(), Failure> {
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
            bias: memory.calibration.correction.bias,
            matrix: memory.calibration.correction.matrix,
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
