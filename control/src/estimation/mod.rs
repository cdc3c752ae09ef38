//! Attitude from gyroscope, accelerometer and magnetometer, as on the platform of Chai 2022, section 5.1: low-pass filter,
//! calibration by an ellipsoid, nine-axis fusion. Lost and frozen samples are bridged, delays are predicted away.
//!
//! The specific force is taken for that of gravity: the platform turns on the spot. The angles are those towards a velocity
//! that points north and level; `declination` turns it.

pub mod ellipsoid;
pub mod fusion;
pub mod lowpass;

use crate::error::DesignError;
use ellipsoid::{Correction, Scatter};
use fusion::{Fusion, Gains, triad};
use lowpass::LowPass;
use nalgebra::{Matrix3, Rotation3, SVector, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use vehicle::kinematics::{self, Kinematics};
use vehicle::platform::body_from_velocity;
use vehicle::scenario::Scenario;
use vehicle::sensor_data::SensorData;
use vehicle::time::tick_tolerance;

/// Where the magnetometer's calibration comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CalibrationMode {
    /// The settings.
    Given,
    /// A fit to the readings of the first seconds, while the platform turns.
    Fit,
}

/// Where the attitude comes from at the beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Alignment {
    /// The first samples.
    Measured,
    /// The settings: the platform was put there.
    Given,
}

/// Everything the estimator is built from. Units SI, angles rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Time between samples and between ticks, s.
    pub period: f64,
    /// Cut-off frequency of the low-pass filter, Hz; 0 for none.
    pub cutoff: f64,
    /// Gains of the fusion.
    pub gains: Gains,
    /// Whether delays are made up for.
    pub prediction: bool,
    /// By how much the sensors' own filters are late, s.
    pub sensor_delay: f64,
    /// The kinematics whose body rates are wanted.
    pub kinematics: Kinematics,
    /// Direction of the magnetic field's horizontal part from north, east positive, rad.
    pub declination: f64,
    /// Where the attitude comes from at the beginning.
    pub alignment: Alignment,
    /// Θ before the first sample, and at it with [`Alignment::Given`].
    pub initial: Vector3<f64>,
    /// Corrections of gyroscope, accelerometer and magnetometer.
    pub corrections: [Correction; 3],
    /// Where the magnetometer's calibration comes from.
    pub calibration: CalibrationMode,
    /// How long readings are collected for a fit, s.
    pub calibration_duration: f64,
    /// For how long the platform rests at the beginning, so that the gyroscope shows its bias, s.
    pub rest_duration: f64,
    /// Time without a usable sample after which the attitude counts as lost, s.
    pub lost_after: f64,
    /// Equal samples in a row from which a sensor counts as frozen; 0 for never.
    pub frozen_samples: u32,
    /// Which readings of gyroscope (rad/s), accelerometer (m/s²) and magnetometer (T) are believed.
    pub gates: [Gate; 3],
}

/// Which readings of a sensor are believed. What a sensor cannot show, and what no motion can bring about, is left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gate {
    /// Largest reading along an axis, either way.
    pub range: f64,
    /// Largest change from one sample to the next, as a norm. Readings that lie further away are believed when a second one
    /// confirms them.
    pub jump: f64,
}

/// Largest range that can be set: squares and products of readings within it are far from overflow.
pub const LARGEST_RANGE: f64 = 1e9;

impl Gate {
    /// Rounding of a converter may take a reading at the end of the range beyond it by a part of a step.
    const ROUNDING: f64 = 1e-3;

    fn shows(&self, reading: &Vector3<f64>) -> bool {
        reading.iter().all(|value| value.abs() <= self.range * (1.0 + Self::ROUNDING))
    }

    fn holds(&self, reading: &Vector3<f64>, before: &Vector3<f64>) -> bool {
        (reading - before).norm() <= self.jump
    }
}

/// What becomes of a sensor's reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// It lies near the last one that was believed.
    Believed,
    /// It lies near the one before, which was not believed: the two confirm each other.
    Confirmed,
    /// It is left out; the last one that was believed is held in its place.
    Rejected,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    period: f64,
    cutoff: f64,
    sensor_delay: f64,
    proportional: f64,
    integral: f64,
    lost_after: f64,
    frozen_samples: u32,
    calibration_duration: f64,
    jump_gyroscope: f64,
    jump_accelerometer: f64,
    jump_magnetometer: f64,
}

impl Default for Settings {
    /// Of `data/estimator.toml`, for the start of Chai 2022 and sensors without errors in the field of the vehicle's data.
    fn default() -> Self {
        static READ: LazyLock<File> = LazyLock::new(|| embedded(include_str!("../../data/estimator.toml")));
        let file = &*READ;
        let SensorData { surroundings, mems, .. } = SensorData::embedded();
        let field = surroundings.field;
        let jumps = [file.jump_gyroscope, file.jump_accelerometer, file.jump_magnetometer];
        Self {
            period: file.period,
            cutoff: file.cutoff,
            gains: Gains { proportional: file.proportional, integral: file.integral },
            prediction: true,
            sensor_delay: file.sensor_delay,
            kinematics: Kinematics::Printed,
            declination: field.y.atan2(field.x),
            alignment: Alignment::Measured,
            initial: Scenario::crmpc2022().initial_angles,
            corrections: [Correction::default(); 3],
            calibration: CalibrationMode::Given,
            calibration_duration: file.calibration_duration,
            rest_duration: 0.0,
            lost_after: file.lost_after,
            frozen_samples: file.frozen_samples,
            gates: std::array::from_fn(|i| Gate { range: mems[i].range, jump: jumps[i] }),
        }
    }
}

fn embedded<T: for<'a> Deserialize<'a>>(text: &str) -> T {
    // Cannot fail: tests read every embedded file.
    toml::from_str(text).unwrap_or_else(|error| panic!("{error}"))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationFile {
    gyroscope: CorrectionFile,
    accelerometer: CorrectionFile,
    magnetometer: CorrectionFile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CorrectionFile {
    matrix: [[f64; 3]; 3],
    bias: Vector3<f64>,
}

/// Corrections of gyroscope, accelerometer and magnetometer of the MEMS set, from `data/sensor-calibration.toml`.
pub fn mems_corrections() -> [Correction; 3] {
    static READ: LazyLock<CalibrationFile> =
        LazyLock::new(|| embedded(include_str!("../../data/sensor-calibration.toml")));
    [&READ.gyroscope, &READ.accelerometer, &READ.magnetometer]
        .map(|each| Correction { matrix: Matrix3::from(each.matrix).transpose(), bias: each.bias })
}

/// What the line shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of the sample, from 1; 0 before the first. A line without numbers shows 0 throughout.
    pub sample: i32,
    /// When the sample was taken, s.
    pub time: f64,
    /// Gyroscope (rad/s), accelerometer (specific force, m/s²), magnetometer (T).
    pub readings: [Vector3<f64>; 3],
}

/// How far the estimate can be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Health {
    /// Nothing has arrived yet.
    #[default]
    Waiting,
    /// All is well.
    Ok,
    /// A sample is missing: the last rate is held.
    Bridging,
    /// A sensor repeats its value: it is left out.
    Frozen,
    /// Samples have been missing or frozen for too long.
    Lost,
    /// Readings are collected.
    Calibrating,
    /// The fit was refused: the given calibration is in use.
    Uncalibrated,
    /// A reading of the newest sample, or the sample as a whole, cannot be believed: it is left out.
    Rejected,
}

/// State of the magnetometer's calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CalibrationStatus {
    /// That of the settings.
    #[default]
    Given,
    /// Readings are collected.
    Collecting,
    /// That of the fit.
    Fitted,
    /// The fit was refused, that of the settings is in use.
    Refused,
}

/// The calibration of the magnetometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// How it came about.
    pub status: CalibrationStatus,
    /// In force.
    pub correction: Correction,
    /// Of the fit, see [`ellipsoid::Fit`].
    pub residual: f64,
    /// Of the fit, see [`ellipsoid::Fit`].
    pub condition: f64,
}

/// What is shown at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Θ, rad.
    pub angles: Vector3<f64>,
    /// ω in the sense of the kinematics that are set, rad/s.
    pub rates: Vector3<f64>,
    /// How far it can be trusted.
    pub health: Health,
    /// Time since the newest sample was taken, s.
    pub age: f64,
    /// Samples that never arrived, so far.
    pub dropped: i32,
    /// Samples that were left out as a whole or in part, so far.
    pub rejected: i32,
    /// Bias of the gyroscope: given, of the rest, and learned, rad/s.
    pub gyroscope_bias: Vector3<f64>,
}

type Nine = SVector<f64, 9>;

const SENSORS: [&str; 3] = ["gyroscope", "accelerometer", "magnetometer"];

/// Most samples that are put between two that arrived.
const MOST_STEPS: f64 = 1000.0;

/// What is carried from tick to tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// What is shown.
    pub estimate: Estimate,
    /// The magnetometer's calibration.
    pub calibration: Calibration,
    scatter: Scatter,
    running: Option<Running>,
    /// Number of the last sample that was left out as a whole; 0 for none.
    refused: i32,
}

/// From the first sample on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Running {
    /// When the first sample was taken, s.
    start: f64,
    /// The last sample, with the readings that were believed last.
    last: Line,
    /// Its readings as they came.
    raw: [Vector3<f64>; 3],
    /// Whether a reading of it was left out.
    rejected: bool,
    /// Whether a second sample has confirmed the first.
    confirmed: bool,
    /// When it was seen, s.
    arrived: f64,
    filter: lowpass::State<9>,
    /// Readings behind the filter.
    filtered: Nine,
    fusion: Fusion,
    /// Sum and number of the rates at rest.
    rest: (Vector3<f64>, f64),
    /// Equal readings in a row, of each sensor.
    equal: [u32; 3],
    /// When a sample with all sensors alive was taken last, s.
    alive: f64,
}

impl Running {
    /// Bias that the rest shows, rad/s.
    fn rest_bias(&self) -> Vector3<f64> {
        self.rest.0 / self.rest.1.max(1.0)
    }
}

/// The estimator.
///
/// ```
/// use control::estimation::{Estimator, Health, Line, Settings};
///
/// let mut estimator = Estimator::new(Settings::default())?;
/// let mut memory = estimator.memory();
/// // Nothing has arrived on the line yet.
/// estimator.update(&mut memory, 0.0, &Line::default());
/// assert_eq!(memory.estimate.health, Health::Waiting);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Estimator {
    settings: Settings,
    filter: LowPass,
}

/// Θ from the rotation of body axes from those of the velocity; see [`body_from_velocity`]. The bank angle grows against
/// the right-hand rule about the velocity.
pub fn angles(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let c = rotation.matrix();
    let beta = c[(1, 0)].clamp(-1.0, 1.0).asin();
    Vector3::new(c[(2, 0)].atan2(c[(0, 0)]), beta, (-c[(1, 2)]).atan2(c[(1, 1)]))
}

impl Estimator {
    /// Refuses settings that cannot work.
    ///
    /// # Errors
    /// Names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let s = &settings;
        let positive = [
            ("period", s.period),
            ("lost.after", s.lost_after),
            ("calibration.duration", s.calibration_duration),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DesignError::NotPositive { name, value });
            }
        }
        let nyquist = 0.5 / s.period;
        let limits = [
            ("filter.cutoff", s.cutoff, nyquist),
            ("fusion.proportional", s.gains.proportional, 1.0 / s.period),
            ("fusion.integral", s.gains.integral, 1.0 / (s.period * s.period)),
            ("sensor.delay", s.sensor_delay, 1.0),
            ("rest.duration", s.rest_duration, f64::MAX),
        ];
        for (sensor, gate) in SENSORS.iter().zip(&s.gates) {
            for (what, value) in [("range", gate.range), ("jump", gate.jump)] {
                if !(value > 0.0 && value <= LARGEST_RANGE) {
                    let name = format!("{sensor}.{what}");
                    return Err(DesignError::Setting { name, value });
                }
            }
        }
        for (name, value, high) in limits {
            if !(0.0..high).contains(&value) {
                return Err(DesignError::OutOfRange { name, value, low: 0.0, high });
            }
        }
        for (sensor, correction) in SENSORS.iter().zip(&s.corrections) {
            let determinant = correction.matrix.determinant();
            if !(determinant.abs() > 0.0 && determinant.is_finite()) {
                return Err(DesignError::Singular { name: format!("{sensor}.matrix") });
            }
        }
        Ok(Self { settings, filter: LowPass::new(s.cutoff, s.period) })
    }

    /// Time between ticks, s.
    pub fn period(&self) -> f64 {
        self.settings.period
    }

    /// By how much filters make slow signals late, s: the sensors' own and the low-pass filter's.
    pub fn filter_delay(&self) -> f64 {
        self.settings.sensor_delay + self.filter.delay()
    }

    /// The memory before the first tick.
    pub fn memory(&self) -> Memory {
        let status = match self.settings.calibration {
            CalibrationMode::Given => CalibrationStatus::Given,
            CalibrationMode::Fit => CalibrationStatus::Collecting,
        };
        Memory {
            estimate: Estimate { angles: self.settings.initial, ..Estimate::default() },
            calibration: Calibration {
                status,
                correction: self.settings.corrections[2],
                ..Calibration::default()
            },
            ..Memory::default()
        }
    }

    /// The tick at `time` (s).
    pub fn update(&self, memory: &mut Memory, time: f64, line: &Line) {
        // Samples that are not counted are taken at the ticks.
        let line = if line.sample == 0 { Line { time, ..*line } } else { *line };
        let arrived = memory.running.map_or(line.readings[1] != Vector3::zeros(), |running| {
            line.sample == 0 || line.sample != running.last.sample
        });
        let usable = arrived && self.is_usable(memory, time, &line);
        if usable {
            memory.running = match memory.running {
                Some(running) => Some(self.take(memory, &running, &line)),
                None => self.begin(memory, &line),
            };
            if let Some(running) = &mut memory.running {
                running.arrived = time;
            }
            self.calibrate(memory);
        }
        let refused = arrived && !usable && (line.sample == 0 || line.sample != memory.refused);
        if refused {
            memory.refused = line.sample;
        }
        let rejected = refused || usable && memory.running.is_some_and(|running| running.rejected);
        if rejected {
            memory.estimate.rejected = memory.estimate.rejected.saturating_add(1);
        }
        self.show(memory, time, usable, rejected);
    }

    /// Whether the sample was taken at a time at which it can have been taken; of the first one, whether its readings can be
    /// believed, as there are no others.
    fn is_usable(&self, memory: &Memory, time: f64, line: &Line) -> bool {
        let oldest = memory.running.map_or(f64::NEG_INFINITY, |running| running.last.time);
        let taken = line.time <= time + tick_tolerance(time, self.settings.period)
            && line.time >= oldest
            && line.time >= time - self.settings.lost_after;
        let shown = || self.settings.gates.iter().zip(&line.readings).all(|(gate, value)| gate.shows(value));
        taken && (memory.running.is_some() || shown())
    }

    /// What becomes of the readings of a sample that follows that of `before`.
    fn judge(&self, before: &Running, line: &Line) -> [Verdict; 3] {
        std::array::from_fn(|i| {
            let (gate, reading) = (&self.settings.gates[i], &line.readings[i]);
            if !gate.shows(reading) {
                Verdict::Rejected
            } else if gate.holds(reading, &before.last.readings[i]) {
                Verdict::Believed
            } else if gate.holds(reading, &before.raw[i]) {
                Verdict::Confirmed
            } else {
                Verdict::Rejected
            }
        })
    }

    /// Whether readings of this sensor have been the same for too long.
    fn is_frozen(&self, running: &Running, sensor: usize) -> bool {
        let limit = self.settings.frozen_samples;
        limit > 0 && running.last.sample != 0 && running.equal[sensor] + 1 >= limit
    }

    /// Angular rate (rad/s) with the bias that only the fusion knows, specific force and field, corrected.
    fn corrected(&self, memory: &Memory, filtered: &Nine) -> [Vector3<f64>; 3] {
        let [rate, force, _] = self.settings.corrections;
        let corrections = [rate, force, memory.calibration.correction];
        std::array::from_fn(|i| corrections[i].apply(&filtered.fixed_rows::<3>(3 * i).into()))
    }

    /// Rotation from magnetic north to that of the angles.
    fn magnetic_to_north(&self) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Vector3::z_axis(), -self.settings.declination)
    }

    /// From a sample alone; `None` if it shows no attitude.
    fn begin(&self, memory: &Memory, line: &Line) -> Option<Running> {
        let filtered = stacked(&line.readings);
        let [_, force, field] = self.corrected(memory, &filtered);
        let fusion = match self.settings.alignment {
            Alignment::Measured => Fusion::new(&triad(&force, &field)?, 1.0),
            Alignment::Given => {
                let attitude = Rotation3::from_matrix_unchecked(body_from_velocity(&self.settings.initial))
                    * self.magnetic_to_north().inverse();
                Fusion::new(&attitude, f64::INFINITY)
            }
        };
        Some(Running {
            start: line.time,
            last: *line,
            raw: line.readings,
            rejected: false,
            confirmed: false,
            arrived: line.time,
            filter: self.filter.settled(&filtered),
            filtered,
            fusion,
            rest: (Vector3::zeros(), 0.0),
            equal: [0; 3],
            alive: line.time,
        })
    }

    /// With the next sample. What lies between the samples is interpolated; in place of a reading that is not believed the last
    /// one is held.
    fn take(&self, memory: &mut Memory, before: &Running, line: &Line) -> Running {
        let s = &self.settings;
        let verdicts = self.judge(before, line);
        let rejected = verdicts.map(|verdict| verdict == Verdict::Rejected);
        let left_out = rejected.contains(&true);
        if !before.confirmed && !left_out && verdicts.contains(&Verdict::Confirmed) {
            // Two samples agree against the first one, from which all began.
            let again = self.begin(memory, line);
            return again.map_or(*before, |again| Running { start: before.start, ..again });
        }
        let readings =
            std::array::from_fn(|i| if rejected[i] { before.last.readings[i] } else { line.readings[i] });
        let mut running = Running {
            last: Line { readings, ..*line },
            raw: line.readings,
            rejected: left_out,
            confirmed: before.confirmed || !left_out,
            ..*before
        };
        for (i, equal) in running.equal.iter_mut().enumerate() {
            *equal = if line.readings[i] == before.raw[i] { equal.saturating_add(1) } else { 0 };
        }
        let elapsed = if line.time > before.last.time { line.time - before.last.time } else { s.period };
        let steps = (elapsed / s.period).round().clamp(1.0, MOST_STEPS);
        let missing = line.sample.saturating_sub(before.last.sample).saturating_sub(1);
        memory.estimate.dropped = memory.estimate.dropped.saturating_add(missing.clamp(0, steps as i32));
        let frozen = [0, 1, 2].map(|i| self.is_frozen(&running, i));
        let alive = !left_out && !frozen.contains(&true);
        if line.time - before.alive > s.lost_after && alive {
            return self.again(memory, &running, stacked(&readings));
        }
        if alive {
            running.alive = line.time;
        }

        let (from, to) = (stacked(&before.last.readings), stacked(&readings));
        let resting = line.time - running.start < s.rest_duration;
        let collecting = memory.calibration.status == CalibrationStatus::Collecting;
        for k in 1..=steps as u32 {
            let reading = from + (to - from) * (f64::from(k) / steps);
            running.filtered = self.filter.step(&mut running.filter, &reading);
            let [rate, force, field] = self.corrected(memory, &running.filtered);
            if resting {
                running.rest = (running.rest.0 + rate, running.rest.1 + 1.0);
                running.fusion = running.fusion.with_bias(Vector3::zeros());
            }
            let left_out = frozen[1] || frozen[2] || rejected[1] || rejected[2];
            let seen = (!(collecting || left_out)).then_some((&force, &field));
            running.fusion.step(&s.gains, elapsed / steps, &(rate - running.rest_bias()), seen);
        }
        running
    }

    /// Aligned by these readings, with the biases of before.
    fn again(&self, memory: &Memory, running: &Running, filtered: Nine) -> Running {
        let [_, force, field] = self.corrected(memory, &filtered);
        let aligned = triad(&force, &field).map(|attitude| Fusion::new(&attitude, 1.0));
        Running {
            filter: self.filter.settled(&filtered),
            filtered,
            fusion: aligned.map_or(running.fusion, |fusion| fusion.with_bias(running.fusion.bias())),
            alive: running.last.time,
            ..*running
        }
    }

    /// Collects a reading for the fit, and fits when it is time.
    fn calibrate(&self, memory: &mut Memory) {
        let Some(running) = memory.running else { return };
        if memory.calibration.status != CalibrationStatus::Collecting {
            return;
        }
        if running.last.time - running.start < self.settings.calibration_duration {
            memory.scatter.add(&running.filtered.fixed_rows::<3>(6).into());
            return;
        }
        memory.calibration = match memory.scatter.fit() {
            Ok(fit) => Calibration {
                status: CalibrationStatus::Fitted,
                correction: fit.correction,
                residual: fit.residual,
                condition: fit.condition,
            },
            Err(_) => Calibration { status: CalibrationStatus::Refused, ..memory.calibration },
        };
        memory.running = Some(self.again(memory, &running, running.filtered));
    }

    /// What is shown at `time` (s).
    fn show(&self, memory: &mut Memory, time: f64, arrived: bool, rejected: bool) {
        let Some(running) = memory.running else {
            memory.estimate.health = if rejected { Health::Rejected } else { Health::Waiting };
            return;
        };
        let s = &self.settings;
        let [rate, ..] = self.corrected(memory, &running.filtered);
        let bias = running.rest_bias() + running.fusion.bias();
        let rate = rate - bias;
        let age = time - running.last.time;
        let ahead = if s.prediction { age + self.filter_delay() } else { time - running.arrived };
        // A field at rest turns against the body.
        let attitude = Rotation3::new(rate * -ahead) * running.fusion.attitude() * self.magnetic_to_north();
        let angles = angles(&attitude);
        let rates = match s.kinematics {
            Kinematics::Exact => rate,
            Kinematics::Printed => kinematics::r_inverse(&angles) * (Kinematics::Exact.r(&angles) * rate),
        };
        memory.estimate = Estimate {
            angles,
            rates,
            health: self.health(memory, &running, time, arrived, rejected),
            age,
            dropped: memory.estimate.dropped,
            rejected: memory.estimate.rejected,
            gyroscope_bias: s.corrections[0].bias
                + s.corrections[0].matrix.try_inverse().unwrap_or_default() * bias,
        };
    }

    fn health(&self, memory: &Memory, running: &Running, time: f64, arrived: bool, rejected: bool) -> Health {
        if time - running.alive > self.settings.lost_after {
            Health::Lost
        } else if (0..3).any(|i| self.is_frozen(running, i)) {
            Health::Frozen
        } else if rejected {
            Health::Rejected
        } else if !arrived && time > running.arrived {
            Health::Bridging
        } else {
            match memory.calibration.status {
                CalibrationStatus::Collecting => Health::Calibrating,
                CalibrationStatus::Refused => Health::Uncalibrated,
                CalibrationStatus::Given | CalibrationStatus::Fitted => Health::Ok,
            }
        }
    }
}

fn stacked([rate, force, field]: &[Vector3<f64>; 3]) -> Nine {
    Nine::from_fn(|i, _| [rate, force, field][i / 3][i % 3])
}
