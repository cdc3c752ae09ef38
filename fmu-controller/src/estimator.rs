//! `AttitudeEstimator`: attitude and rates from gyroscope, accelerometer and magnetometer.

use control::estimation::{
    Alignment, Calibration, CalibrationMode, CalibrationStatus, Estimate, Estimator, Health,
    LARGEST_RANGE, Line, Memory, Settings, mems_corrections,
};
use controller_export::sampled::{SampledFmu, SampledUnit, Ticks};
use controller_export::table::{ANGLES, AXES, RATES, vector};
use fmi2_export::fields::{Fields, by_variable};
use fmi2_export::table::{Common, Real, discrete_input, discrete_output, input, parameter};
use fmi2_export::{Description, Enumeration, Failure, VariableTable};
use model_description::DefaultExperiment;
use model_description::unit::{self, Unit};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::Scenario;
use vehicle::kinematics::{Kinematics, Trajectory};
use vehicle::platform::Pose;
use vehicle::sensor_data::SensorData;

static KINEMATICS: Enumeration<Kinematics> = Enumeration {
    name: "EstimatorKinematics",
    description: "Which body rates are shown",
    items: &[
        (
            Kinematics::Printed,
            "printed",
            "rates that the matrix R as printed takes for those of the angles",
        ),
        (Kinematics::Exact, "exact", "rates of the platform"),
    ],
};
static ALIGNMENTS: Enumeration<Alignment> = Enumeration {
    name: "Alignment",
    description: "Where the attitude comes from at the beginning",
    items: &[
        (Alignment::Measured, "measured", "from the first samples"),
        (
            Alignment::Given,
            "given",
            "initial.alpha, initial.beta, initial.sigma: the platform was put there",
        ),
    ],
};
static MODES: Enumeration<CalibrationMode> = Enumeration {
    name: "CalibrationMode",
    description: "Where the magnetometer's calibration comes from",
    items: &[
        (CalibrationMode::Given, "given", "magnetometer.matrix and magnetometer.bias"),
        (
            CalibrationMode::Fit,
            "fit",
            "an ellipsoid fitted to the readings of the first calibration.duration",
        ),
    ],
};
static STATUSES: Enumeration<CalibrationStatus> = Enumeration {
    name: "CalibrationStatus",
    description: "Where a calibration comes from",
    items: &[
        (CalibrationStatus::Given, "given", "the parameters"),
        (CalibrationStatus::Collecting, "collecting", "readings are collected"),
        (CalibrationStatus::Fitted, "fitted", "the fitted ellipsoid"),
        (
            CalibrationStatus::Refused,
            "refused",
            "the parameters, as the readings determine no ellipsoid",
        ),
    ],
};
static HEALTH: Enumeration<Health> = Enumeration {
    name: "EstimatorHealth",
    description: "How far an estimate can be trusted",
    items: &[
        (Health::Waiting, "waiting", "nothing has arrived yet"),
        (Health::Ok, "ok", "all is well"),
        (Health::Bridging, "bridging", "a sample is missing: the last rate is held"),
        (Health::Frozen, "frozen", "a sensor repeats its value: it is left out"),
        (Health::Lost, "lost", "samples have been missing or frozen for longer than lost.after"),
        (Health::Calibrating, "calibrating", "readings are collected"),
        (Health::Uncalibrated, "uncalibrated", "the calibration was refused"),
        (
            Health::Rejected,
            "sampleRejected",
            "a reading of the newest sample cannot be believed: it is left out",
        ),
    ],
};

/// The estimator as an FMI unit.
pub type AttitudeEstimator = SampledFmu<EstimatorUnit>;

/// Parameters, inputs and outputs of the estimator's unit.
#[derive(Serialize, Deserialize)]
pub struct EstimatorUnit {
    pub(crate) settings: Settings,
    /// Sensor set as in the plant: 0, 1 for sensors without errors, [`MEMS_SENSORS`] for those with
    /// errors.
    pub(crate) sensor_set: i32,
    line: Line,
    output: Output,
}

/// Sensor set for which the corrections are used.
const MEMS_SENSORS: i32 = 2;

/// Outputs of the estimator's unit.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Output {
    estimate: Estimate,
    filter_delay: f64,
    calibration: Calibration,
}

impl SampledUnit for EstimatorUnit {
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
                step: Settings::default().period,
            },
            table: corrections(calibration(gates(stages(start(outputs(inputs(
                VariableTable::new(),
            ))))))),
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings { corrections: mems_corrections(), ..Settings::default() },
            sensor_set: 0,
            line: at_rest(),
            output: Output::default(),
        }
    }

    fn design(&self) -> Result<Estimator, Failure> {
        let mut settings = self.settings;
        if self.sensor_set < MEMS_SENSORS {
            settings.corrections = Default::default();
            settings.sensor_delay = 0.0;
        }
        Estimator::new(settings).map_err(|error| Failure::Error(by_variable(&error, FIELDS)))
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
            return Err(Failure::Error("an input 'measured' is not a finite number".into()));
        }
        let time = ticks.next_time();
        ticks.evaluate_with(line, |memory, _| estimator.update(memory, time, &line));
        let Estimate { angles, rates, gyroscope_bias, .. } = ticks.in_force().1.estimate;
        if [angles, rates, gyroscope_bias].iter().flatten().all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(Failure::Error(format!(
            "the estimate at t = {time} s is not finite; see the inputs 'measured'"
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
    let comes =
        |health: Health| after.estimate.health == health && before.estimate.health != health;
    if comes(Health::Lost) {
        Some("no usable samples for longer than lost.after: the attitude is lost (health)")
    } else if comes(Health::Frozen) {
        Some("a sensor repeats its value and is left out (health)")
    } else if comes(Health::Rejected) && before.estimate.rejected == 0 {
        // The warning is given the first time only; `rejectedSamples` counts the later ones.
        Some(
            "a sample was left out, beyond the sensor's range or too far from the last one (health, rejectedSamples)",
        )
    } else if comes(Health::Uncalibrated) {
        Some(
            "the readings determine no ellipsoid: the given calibration stays in use (calibration.status)",
        )
    } else {
        None
    }
}

/// Names of the variables that hold fields of the settings, for messages.
const FIELDS: &Fields = &[
    ("lost_after", "lost.after"),
    ("calibration_duration", "calibration.duration"),
    ("cutoff", "filter.cutoff"),
    ("gains", "fusion"),
    ("sensor_delay", "sensor.delay"),
    ("rest_duration", "rest.duration"),
    ("gates[0]", "gyroscope"),
    ("corrections[0]", "gyroscope"),
    ("gates[1]", "accelerometer"),
    ("corrections[1]", "accelerometer"),
    ("gates[2]", "magnetometer"),
    ("corrections[2]", "magnetometer"),
];

type Variables = VariableTable<AttitudeEstimator>;

struct Sensor {
    name: &'static str,
    quantity: &'static str,
    unit: fn() -> Unit,
    nominal: f64,
    corrected: &'static str,
}

const SENSORS: [Sensor; 3] = [
    Sensor {
        name: "gyroscope",
        quantity: "angular rate",
        unit: unit::angular_rate,
        nominal: 0.05,
        corrected: "inverse of scale and misalignment",
    },
    Sensor {
        name: "accelerometer",
        quantity: "specific force",
        unit: unit::acceleration,
        nominal: 10.0,
        corrected: "inverse of scale and misalignment, up to a factor",
    },
    Sensor {
        name: "magnetometer",
        quantity: "magnetic field",
        unit: unit::flux_density,
        nominal: 5e-5,
        corrected: "inverse of scale, misalignment and soft iron, up to a factor",
    },
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
    common.real().unit(unit::time())
}

fn inputs(mut table: Variables) -> Variables {
    for (i, sensor) in SENSORS.iter().enumerate() {
        let declare = |axis: &str, _: &str| {
            let text = format!("Reading of the {}: {} along {axis}", sensor.name, sensor.quantity);
            let common = input(&format!("measured.{}.{axis}", sensor.name), &text);
            common.real().unit((sensor.unit)()).nominal(sensor.nominal)
        };
        table = vector(table, AXES, declare, move |m| &mut m.line.readings[i]);
    }
    let time = input("measured.time", "Time at which the newest sample was taken");
    let sample = discrete_input(
        "measured.sample",
        "Number of the newest sample, from 1; 0 before the first, and throughout if samples are not counted",
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
        common.real().unit(unit::angle()).nominal(0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let common = sampled(&format!("rate.{axis}"), &format!("Estimated body {meaning} rate"));
        common.real().unit(unit::angular_rate()).nominal(0.05)
    };
    let bias = |axis: &str, _: &str| {
        let text = format!(
            "Estimated bias of the gyroscope along {axis}: given, seen at rest, and learned"
        );
        let common = sampled(&format!("estimatedBias.{axis}"), &text);
        common.real().unit(unit::angular_rate()).nominal(0.01)
    };
    let hard_iron = |axis: &str, _: &str| {
        let text = format!("Bias and hard iron of the magnetometer along {axis}, in force");
        let common = sampled(&format!("calibration.bias.{axis}"), &text);
        common.real().unit(unit::flux_density()).nominal(5e-5)
    };
    let table = vector(table, ANGLES, angle, |m| &mut m.output.estimate.angles);
    let table = vector(table, RATES, rate, |m| &mut m.output.estimate.rates);
    let health = sampled("health", "How far the estimate can be trusted");
    let age = sampled("age", "Time since the newest sample was taken");
    let dropped = sampled("droppedSamples", "Samples so far that never arrived");
    let rejected = sampled(
        "rejectedSamples",
        "Samples so far of which a reading, or the time, could not be believed and was left out",
    );
    let delay =
        sampled("filter.delay", "Phase delay of sensors and low-pass filter at low frequencies");
    let status =
        sampled("calibration.status", "Where the magnetometer's calibration in force comes from");
    let residual = sampled(
        "calibration.residual",
        "Root mean square of the fitted readings' distance from the ellipsoid, as a share of its size",
    );
    let condition = sampled(
        "calibration.condition",
        "How badly the readings tell ellipsoids apart; 16 if all directions are seen alike, more than 1000 is refused",
    );
    let table = table
        .enumeration(health, &HEALTH, |m| &mut m.output.estimate.health)
        .real(seconds(age).nominal(0.01), |m| &mut m.output.estimate.age)
        .integer(dropped, (None, None), |m| &mut m.output.estimate.dropped)
        .integer(rejected, (None, None), |m| &mut m.output.estimate.rejected)
        .real(seconds(delay).nominal(0.01), |m| &mut m.output.filter_delay);
    let table = vector(table, AXES, bias, |m| &mut m.output.estimate.gyroscope_bias)
        .enumeration(status, &STATUSES, |m| &mut m.output.calibration.status)
        .real(residual.real(), |m| &mut m.output.calibration.residual)
        .real(condition.real(), |m| &mut m.output.calibration.condition);
    let mut table = vector(table, AXES, hard_iron, |m| &mut m.output.calibration.correction.bias);
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        let name = format!("calibration.matrix[{},{}]", row + 1, column + 1);
        let text = format!(
            "Matrix that corrects the magnetometer, in force: {} by {}; of a fit in 1/T",
            AXES[row].0, AXES[column].0
        );
        table = table.real(sampled(&name, &text).real(), move |m| {
            &mut m.output.calibration.correction.matrix[(row, column)]
        });
    }
    table
}

fn start(table: Variables) -> Variables {
    let alignment = parameter("alignment", "Where the attitude comes from at the beginning");
    let angle = |axis: &str, meaning: &str| {
        let text = format!(
            "The {meaning} shown before the first sample, and begun with if alignment is 'given'"
        );
        let common = parameter(&format!("initial.{axis}"), &text);
        common.real().unit(unit::angle()).nominal(0.1)
    };
    let kinematics = parameter("kinematics", "Which body rates are shown; as the plant's");
    let declination = parameter(
        "field.declination",
        "Direction of the magnetic field's horizontal part, from the velocity's and east positive",
    );
    let rest = parameter(
        "rest.duration",
        "Time from the first sample on for which the platform rests, so that the gyroscope shows its bias; 0 for none",
    );
    let table = table.enumeration(alignment, &ALIGNMENTS, |m| &mut m.settings.alignment);
    vector(table, ANGLES, angle, |m| &mut m.settings.initial)
        .enumeration(kinematics, &KINEMATICS, |m| &mut m.settings.kinematics)
        .real(declination.real().unit(unit::angle()).nominal(0.1), |m| &mut m.settings.declination)
        .real(seconds(rest).min(0.0).nominal(1.0), |m| &mut m.settings.rest_duration)
}

fn stages(table: Variables) -> Variables {
    let period = parameter("period", "Time between ticks, and between samples");
    let cutoff = parameter(
        "filter.cutoff",
        "Cut-off frequency of the low-pass filter on all readings; 0 for none",
    );
    let prediction =
        parameter("prediction", "Whether the delays of line, sensors and filter are made up for");
    let delay = parameter(
        "sensor.delay",
        "Delay of the sensors' own filters at low frequencies, used with sensor.set = 2",
    );
    let proportional = parameter(
        "fusion.proportional",
        "Proportional gain: errors of attitude fall with this rate",
    );
    let integral = parameter(
        "fusion.integral",
        "Integral gain, with which the gyroscope's bias is learned; 0 for never",
    );
    let lost = parameter(
        "lost.after",
        "Time without a usable sample after which the attitude counts as lost",
    );
    let frozen = parameter(
        "frozen.samples",
        "Equal readings in a row from which a sensor counts as frozen; 0 for never, as for sensors without noise",
    );
    table
        .real(seconds(period).min(1e-4).max(10.0).nominal(0.01), |m| &mut m.settings.period)
        .real(cutoff.real().unit(unit::frequency()).min(0.0).nominal(10.0), |m| {
            &mut m.settings.cutoff
        })
        .boolean(prediction, |m| &mut m.settings.prediction)
        .real(seconds(delay).min(0.0).nominal(0.01), |m| &mut m.settings.sensor_delay)
        .real(proportional.real().unit(unit::gain_rate()).min(0.0).nominal(1.0), |m| {
            &mut m.settings.gains.proportional
        })
        .real(integral.real().unit(unit::gain_angle()).min(0.0).nominal(0.1), |m| {
            &mut m.settings.gains.integral
        })
        .real(seconds(lost).min(0.0).nominal(0.5), |m| &mut m.settings.lost_after)
        .integer(frozen, (Some(0), None), |m| &mut m.settings.frozen_samples)
}

fn gates(mut table: Variables) -> Variables {
    for (i, sensor) in SENSORS.iter().enumerate() {
        let range = parameter(
            &format!("{}.range", sensor.name),
            &format!(
                "Largest reading of the {} along an axis; a larger one is left out",
                sensor.name
            ),
        );
        let jump = parameter(
            &format!("{}.jump", sensor.name),
            &format!(
                "Largest change of the {}'s reading from one sample to the next; after a larger one it is left out until a second confirms it",
                sensor.name
            ),
        );
        let real = |common: Common| {
            common.real().unit((sensor.unit)()).min(0.0).max(LARGEST_RANGE).nominal(sensor.nominal)
        };
        table = table
            .real(real(range), move |m| &mut m.settings.gates[i].range)
            .real(real(jump), move |m| &mut m.settings.gates[i].jump);
    }
    table
}

fn calibration(table: Variables) -> Variables {
    let set = parameter(
        "sensor.set",
        "Sensors, as the plant's: 0 and 1 are without errors; 2 uses sensor.delay and the corrections that are set, from the start those of the MEMS set",
    );
    let mode = parameter("calibration.mode", "Where the magnetometer's calibration comes from");
    let duration = parameter("calibration.duration", "How long readings are collected for a fit");
    table
        .integer(set, (Some(0), Some(MEMS_SENSORS)), |m| &mut m.sensor_set)
        .enumeration(mode, &MODES, |m| &mut m.settings.calibration)
        .real(seconds(duration).min(0.0).nominal(10.0), |m| &mut m.settings.calibration_duration)
}

fn corrections(mut table: Variables) -> Variables {
    for (i, sensor) in SENSORS.iter().enumerate() {
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let name = format!("{}.matrix[{},{}]", sensor.name, row + 1, column + 1);
            let text = format!(
                "Matrix that corrects the {}, {}: {} by {}",
                sensor.name, sensor.corrected, AXES[row].0, AXES[column].0
            );
            let real = parameter(&name, &text).real().nominal(1.0);
            table = table.real(real, move |m| &mut m.settings.corrections[i].matrix[(row, column)]);
        }
        let bias = |axis: &str, _: &str| {
            let text = format!("Bias of the {}'s reading along {axis}", sensor.name);
            let common = parameter(&format!("{}.bias.{axis}", sensor.name), &text);
            common.real().unit((sensor.unit)()).nominal(sensor.nominal)
        };
        table = vector(table, AXES, bias, move |m| &mut m.settings.corrections[i].bias);
    }
    table
}
