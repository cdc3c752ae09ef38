//! `AttitudeEstimator`: attitude and rates from gyroscope, accelerometer and magnetometer.

use crate::table::{ANGLES, AXES, RATES, enumeration, item, number};
use crate::ticks::{self, Ticked};
use control::estimation::ellipsoid::Correction;
use control::estimation::{
    Alignment, CalibrationMode, CalibrationStatus, Estimate, Estimator, Health, LARGEST_RANGE, Line, Memory,
    Settings, mems_corrections,
};
use control::schedule::Sampled;
use fmi2_export::table::{Common, Real, discrete_input, discrete_output, input, parameter};
use fmi2_export::{Context, Description, Failure, Inputs, Model, Restoration, Table};
use model_description::DefaultExperiment;
use model_description::unit::{self, Unit};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::Scenario;
use vehicle::kinematics::{Kinematics, Trajectory};
use vehicle::platform::Pose;
use vehicle::sensor_data::SensorData;

const KINEMATICS: [(Kinematics, &str, &str); 2] = [
    (Kinematics::Printed, "printed", "rates that the matrix R as printed takes for those of the angles"),
    (Kinematics::Exact, "exact", "rates of the platform"),
];
const ALIGNMENTS: [(Alignment, &str, &str); 2] = [
    (Alignment::Measured, "measured", "from the first samples"),
    (Alignment::Given, "given", "initial.alpha, initial.beta, initial.sigma: the platform was put there"),
];
const MODES: [(CalibrationMode, &str, &str); 2] = [
    (CalibrationMode::Given, "given", "magnetometer.matrix and magnetometer.bias"),
    (CalibrationMode::Fit, "fit", "an ellipsoid fitted to the readings of the first calibration.duration"),
];
const STATUSES: [(CalibrationStatus, &str, &str); 4] = [
    (CalibrationStatus::Given, "given", "the parameters"),
    (CalibrationStatus::Collecting, "collecting", "readings are collected"),
    (CalibrationStatus::Fitted, "fitted", "the fitted ellipsoid"),
    (CalibrationStatus::Refused, "refused", "the parameters, as the readings determine no ellipsoid"),
];
const HEALTH: [(Health, &str, &str); 8] = [
    (Health::Waiting, "waiting", "nothing has arrived yet"),
    (Health::Ok, "ok", "all is well"),
    (Health::Bridging, "bridging", "a sample is missing: the last rate is held"),
    (Health::Frozen, "frozen", "a sensor repeats its value: it is left out"),
    (Health::Lost, "lost", "samples have been missing or frozen for longer than lost.after"),
    (Health::Calibrating, "calibrating", "readings are collected"),
    (Health::Uncalibrated, "uncalibrated", "the calibration was refused"),
    (Health::Rejected, "sampleRejected", "a reading of the newest sample cannot be believed: it is left out"),
];

/// The estimator as a unit.
#[derive(Serialize, Deserialize)]
pub struct AttitudeEstimator {
    parameters: Parameters,
    line: Line,
    output: Output,
    /// From initialization on.
    sampled: Option<Sampled<Memory, Line, ()>>,
    #[serde(skip)]
    estimator: Option<Estimator>,
}

/// The settings, and those of them that FMI sees in another form.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Parameters {
    settings: Settings,
    /// Number of the item of [`KINEMATICS`], from 1.
    kinematics: i32,
    /// Number of the item of [`ALIGNMENTS`], from 1.
    alignment: i32,
    /// Number of the item of [`MODES`], from 1.
    mode: i32,
    frozen_samples: i32,
    /// As the plant's: 0, 1 for sensors without errors, [`MEMS_SENSORS`] for those with errors.
    sensor_set: i32,
}

/// The corrections are used.
const MEMS_SENSORS: i32 = 2;

impl Default for Parameters {
    fn default() -> Self {
        let settings = Settings { corrections: mems_corrections(), ..Settings::default() };
        Self {
            sensor_set: 0,
            kinematics: number(&KINEMATICS, &settings.kinematics),
            alignment: number(&ALIGNMENTS, &settings.alignment),
            mode: number(&MODES, &settings.calibration),
            frozen_samples: settings.frozen_samples.cast_signed(),
            settings,
        }
    }
}

/// What the unit shows.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Output {
    angles: Vector3<f64>,
    rates: Vector3<f64>,
    health: i32,
    age: f64,
    dropped: i32,
    rejected: i32,
    gyroscope_bias: Vector3<f64>,
    filter_delay: f64,
    status: i32,
    calibration: Correction,
    residual: f64,
    condition: f64,
}

impl Output {
    fn new(memory: &Memory, filter_delay: f64) -> Self {
        let Memory { estimate, calibration, .. } = memory;
        Self {
            angles: estimate.angles,
            rates: estimate.rates,
            health: number(&HEALTH, &estimate.health),
            age: estimate.age,
            dropped: estimate.dropped,
            rejected: estimate.rejected,
            gyroscope_bias: estimate.gyroscope_bias,
            filter_delay,
            status: number(&STATUSES, &calibration.status),
            calibration: calibration.correction,
            residual: calibration.residual,
            condition: calibration.condition,
        }
    }
}

impl AttitudeEstimator {
    fn design(&self) -> Result<Estimator, Failure> {
        let Parameters { settings, kinematics, alignment, mode, frozen_samples, sensor_set } =
            &self.parameters;
        let mut settings = Settings {
            kinematics: item(&KINEMATICS, *kinematics),
            alignment: item(&ALIGNMENTS, *alignment),
            calibration: item(&MODES, *mode),
            frozen_samples: (*frozen_samples).max(0).cast_unsigned(),
            ..*settings
        };
        if *sensor_set < MEMS_SENSORS {
            settings.corrections = Default::default();
            settings.sensor_delay = 0.0;
        }
        Estimator::new(settings).map_err(|error| Failure::Error(error.to_string()))
    }

    /// The estimator and its schedule; there from initialization on.
    fn parts(&mut self) -> Result<(&Estimator, &mut Sampled<Memory, Line, ()>), Failure> {
        match (&self.estimator, &mut self.sampled) {
            (Some(estimator), Some(sampled)) => Ok((estimator, sampled)),
            _ => Err(Failure::Error("the unit is not initialized".into())),
        }
    }
}

impl Ticked for AttitudeEstimator {
    fn tick_before(&mut self, to: f64) -> Result<Option<f64>, Failure> {
        let (estimator, sampled) = self.parts()?;
        Ok(sampled.next_before(to, estimator.period()))
    }

    fn evaluate(&mut self) -> Result<(), Failure> {
        let line = self.line;
        if !(line.time.is_finite() && line.readings.iter().flatten().all(|value| value.is_finite())) {
            return Err(Failure::Error("an input 'measured' is not a finite number".into()));
        }
        let (estimator, sampled) = self.parts()?;
        let time = sampled.next_time(estimator.period());
        sampled.evaluate_with(line, |memory, _| estimator.update(memory, time, &line));
        let Estimate { angles, rates, gyroscope_bias, .. } = sampled.in_force().1.estimate;
        if [angles, rates, gyroscope_bias].iter().flatten().all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(Failure::Error(format!("the estimate at t = {time} s is not finite; see the inputs 'measured'")))
    }

    fn commit(&mut self) -> Result<Option<&'static str>, Failure> {
        let (_, sampled) = self.parts()?;
        sampled.commit();
        Ok(sampled.last_change(warning))
    }
}

impl Model for AttitudeEstimator {
    fn description() -> Description<Self> {
        Description {
            name: "AttitudeEstimator",
            description: "Attitude and rates from gyroscope, accelerometer and magnetometer, as on the platform of Chai et al. (2022)",
            documentation: include_str!("estimator.html"),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: Scenario::crmpc2022().duration,
                tolerance: 1e-6,
                step: Settings::default().period,
            },
            table: corrections(calibration(gates(stages(start(outputs(inputs(Table::new()))))))),
        }
    }

    fn new() -> Self {
        Self {
            parameters: Parameters::default(),
            line: at_rest(),
            output: Output::new(&Memory::default(), 0.0),
            sampled: None,
            estimator: None,
        }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        let estimator = self.design()?;
        ticks::check_resolution(context.start_time, estimator.period())?;
        self.sampled = Some(Sampled::new(context.start_time, estimator.memory()));
        self.estimator = Some(estimator);
        Ok(())
    }

    fn calculate(&mut self, time: f64) -> Result<(), Failure> {
        let (estimator, sampled) = self.parts()?;
        if sampled.is_due(time, estimator.period()) {
            self.evaluate()?;
        }
        let (estimator, sampled) = self.parts()?;
        self.output = Output::new(sampled.in_force().1, estimator.filter_delay());
        Ok(())
    }

    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        ticks::step(self, from, to, inputs, log)
    }

    fn restored(&mut self, from: Restoration<'_, Self>) -> Result<(), Failure> {
        let Some(sampled) = self.sampled.as_ref().filter(|_| from.initialized) else { return Ok(()) };
        let estimator = self.design()?;
        if !sampled.fits((from.start_time, from.time), estimator.period(), from.failed, |_| true) {
            return ticks::misfit("its ticks are not those of its time");
        }
        self.estimator = Some(estimator);
        Ok(())
    }
}

/// What sensors without errors show at the scenario's start, where the platform rests; not counted.
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

/// What a tick must say to the importer.
fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
    let comes = |health: Health| after.estimate.health == health && before.estimate.health != health;
    if comes(Health::Lost) {
        Some("no usable samples for longer than lost.after: the attitude is lost (health)")
    } else if comes(Health::Frozen) {
        Some("a sensor repeats its value and is left out (health)")
    } else if comes(Health::Rejected) && before.estimate.rejected == 0 {
        // Said the first time only; `rejectedSamples` counts on.
        Some(
            "a sample was left out, beyond the sensor's range or too far from the last one (health, rejectedSamples)",
        )
    } else if comes(Health::Uncalibrated) {
        Some("the readings determine no ellipsoid: the given calibration stays in use (calibration.status)")
    } else {
        None
    }
}

type Variables = Table<AttitudeEstimator>;

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

fn vector(
    mut table: Variables,
    axes: [(&'static str, &'static str); 3],
    declare: impl Fn(&str, &str) -> Real,
    field: impl Fn(&mut AttitudeEstimator) -> &mut Vector3<f64> + Copy + Send + Sync + 'static,
) -> Variables {
    for (i, (axis, meaning)) in axes.into_iter().enumerate() {
        table = table.real(declare(axis, meaning), move |m| &mut field(m)[i]);
    }
    table
}

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
    table
        .real(seconds(time).nominal(1.0), |m| &mut m.line.time)
        .integer(sample, (Some(0), None), |m| &mut m.line.sample)
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
        let text = format!("Estimated bias of the gyroscope along {axis}: given, seen at rest, and learned");
        let common = sampled(&format!("estimatedBias.{axis}"), &text);
        common.real().unit(unit::angular_rate()).nominal(0.01)
    };
    let hard_iron = |axis: &str, _: &str| {
        let text = format!("Bias and hard iron of the magnetometer along {axis}, in force");
        let common = sampled(&format!("calibration.bias.{axis}"), &text);
        common.real().unit(unit::flux_density()).nominal(5e-5)
    };
    let table = vector(table, ANGLES, angle, |m| &mut m.output.angles);
    let table = vector(table, RATES, rate, |m| &mut m.output.rates);
    let health = sampled("health", "How far the estimate can be trusted");
    let age = sampled("age", "Time since the newest sample was taken");
    let dropped = sampled("droppedSamples", "Samples so far that never arrived");
    let rejected = sampled(
        "rejectedSamples",
        "Samples so far of which a reading, or the time, could not be believed and was left out",
    );
    let delay = sampled("filter.delay", "Phase delay of sensors and low-pass filter at low frequencies");
    let status = sampled("calibration.status", "Where the magnetometer's calibration in force comes from");
    let residual = sampled(
        "calibration.residual",
        "Root mean square of the fitted readings' distance from the ellipsoid, as a share of its size",
    );
    let condition = sampled(
        "calibration.condition",
        "How badly the readings tell ellipsoids apart; 16 if all directions are seen alike, more than 1000 is refused",
    );
    let healths = enumeration("EstimatorHealth", "How far an estimate can be trusted", &HEALTH);
    let statuses = enumeration("CalibrationStatus", "Where a calibration comes from", &STATUSES);
    let table = table
        .enumeration(health, healths, |m| &mut m.output.health)
        .real(seconds(age).nominal(0.01), |m| &mut m.output.age)
        .integer(dropped, (None, None), |m| &mut m.output.dropped)
        .integer(rejected, (None, None), |m| &mut m.output.rejected)
        .real(seconds(delay).nominal(0.01), |m| &mut m.output.filter_delay);
    let table = vector(table, AXES, bias, |m| &mut m.output.gyroscope_bias)
        .enumeration(status, statuses, |m| &mut m.output.status)
        .real(residual.real(), |m| &mut m.output.residual)
        .real(condition.real(), |m| &mut m.output.condition);
    let mut table = vector(table, AXES, hard_iron, |m| &mut m.output.calibration.bias);
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        let name = format!("calibration.matrix[{},{}]", row + 1, column + 1);
        let text = format!(
            "Matrix that corrects the magnetometer, in force: {} by {}; of a fit in 1/T",
            AXES[row].0, AXES[column].0
        );
        table = table
            .real(sampled(&name, &text).real(), move |m| &mut m.output.calibration.matrix[(row, column)]);
    }
    table
}

fn start(table: Variables) -> Variables {
    let alignment = parameter("alignment", "Where the attitude comes from at the beginning");
    let angle = |axis: &str, meaning: &str| {
        let text =
            format!("The {meaning} shown before the first sample, and begun with if alignment is 'given'");
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
    let alignments = enumeration("Alignment", "Where the attitude comes from at the beginning", &ALIGNMENTS);
    let table = table.enumeration(alignment, alignments, |m| &mut m.parameters.alignment);
    vector(table, ANGLES, angle, |m| &mut m.parameters.settings.initial)
        .enumeration(
            kinematics,
            enumeration("EstimatorKinematics", "Which body rates are shown", &KINEMATICS),
            |m| &mut m.parameters.kinematics,
        )
        .real(declination.real().unit(unit::angle()).nominal(0.1), |m| &mut m.parameters.settings.declination)
        .real(seconds(rest).min(0.0).nominal(1.0), |m| &mut m.parameters.settings.rest_duration)
}

fn stages(table: Variables) -> Variables {
    let period = parameter("period", "Time between ticks, and between samples");
    let cutoff =
        parameter("filter.cutoff", "Cut-off frequency of the low-pass filter on all readings; 0 for none");
    let prediction =
        parameter("prediction", "Whether the delays of line, sensors and filter are made up for");
    let delay = parameter(
        "sensor.delay",
        "Delay of the sensors' own filters at low frequencies, used with sensor.set = 2",
    );
    let proportional =
        parameter("fusion.proportional", "Proportional gain: errors of attitude fall with this rate");
    let integral = parameter(
        "fusion.integral",
        "Integral gain, with which the gyroscope's bias is learned; 0 for never",
    );
    let lost =
        parameter("lost.after", "Time without a usable sample after which the attitude counts as lost");
    let frozen = parameter(
        "frozen.samples",
        "Equal readings in a row from which a sensor counts as frozen; 0 for never, as for sensors without noise",
    );
    table
        .real(seconds(period).min(1e-4).max(10.0).nominal(0.01), |m| &mut m.parameters.settings.period)
        .real(cutoff.real().unit(unit::frequency()).min(0.0).nominal(10.0), |m| {
            &mut m.parameters.settings.cutoff
        })
        .boolean(prediction, |m| &mut m.parameters.settings.prediction)
        .real(seconds(delay).min(0.0).nominal(0.01), |m| &mut m.parameters.settings.sensor_delay)
        .real(proportional.real().unit(unit::gain_rate()).min(0.0).nominal(1.0), |m| {
            &mut m.parameters.settings.gains.proportional
        })
        .real(integral.real().unit(unit::gain_angle()).min(0.0).nominal(0.1), |m| {
            &mut m.parameters.settings.gains.integral
        })
        .real(seconds(lost).min(0.0).nominal(0.5), |m| &mut m.parameters.settings.lost_after)
        .integer(frozen, (Some(0), None), |m| &mut m.parameters.frozen_samples)
}

fn gates(mut table: Variables) -> Variables {
    for (i, sensor) in SENSORS.iter().enumerate() {
        let range = parameter(
            &format!("{}.range", sensor.name),
            &format!("Largest reading of the {} along an axis; a larger one is left out", sensor.name),
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
            .real(real(range), move |m| &mut m.parameters.settings.gates[i].range)
            .real(real(jump), move |m| &mut m.parameters.settings.gates[i].jump);
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
        .integer(set, (Some(0), Some(MEMS_SENSORS)), |m| &mut m.parameters.sensor_set)
        .enumeration(
            mode,
            enumeration("CalibrationMode", "Where the magnetometer's calibration comes from", &MODES),
            |m| &mut m.parameters.mode,
        )
        .real(seconds(duration).min(0.0).nominal(10.0), |m| &mut m.parameters.settings.calibration_duration)
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
            table =
                table.real(real, move |m| &mut m.parameters.settings.corrections[i].matrix[(row, column)]);
        }
        let bias = |axis: &str, _: &str| {
            let text = format!("Bias of the {}'s reading along {axis}", sensor.name);
            let common = parameter(&format!("{}.bias.{axis}", sensor.name), &text);
            common.real().unit((sensor.unit)()).nominal(sensor.nominal)
        };
        table = vector(table, AXES, bias, move |m| &mut m.parameters.settings.corrections[i].bias);
    }
    table
}
