//! Attitude from gyroscope, accelerometer and magnetometer, as on the platform of Chai 2022,
//! section 5.1: low-pass filter, calibration by an ellipsoid, nine-axis fusion. Lost and frozen
//! samples are bridged, and delays are compensated by prediction.
//!
//! The specific force is interpreted as that of gravity, because the platform turns on the spot.
//! The angles are those relative to a velocity that points north and level; `declination` rotates
//! it.

pub mod ellipsoid;
pub mod fusion;
pub mod lowpass;

mod estimate;
mod settings;

pub use estimate::{Calibration, CalibrationStatus, Estimate, Health, Line, Memory};
pub use settings::{
    Alignment, CalibrationMode, Gate, LARGEST_RANGE, MEMS_SENSORS, Settings, mems_corrections,
};

use crate::error::{DesignError, invalid};
use estimate::{Nine, Running};
use fusion::{Fusion, triad};
use lowpass::LowPass;
use nalgebra::{Rotation3, Vector3};
use vehicle::axes::nearest;
use vehicle::kinematics::{self, Kinematics};
use vehicle::math::{asin, atan2};
use vehicle::platform::body_from_velocity;
use vehicle::sensors::PerSensor;
use vehicle::time::tick_tolerance;

/// Largest number of steps that are interpolated between two samples that arrived.
const MOST_STEPS: f64 = 1000.0;

/// Verdict on a sensor's reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// The reading is near the last one that was accepted.
    Believed,
    /// The reading is near the one before, which was not accepted: the two confirm each other.
    Confirmed,
    /// The reading is left out; the last accepted one is held in its place.
    Rejected,
}

/// The attitude estimator: settings and low-pass filter.
///
/// ```
/// use control::estimation::{Estimator, Health, Line, Settings};
///
/// let mut estimator = Estimator::new(Settings::ours())?;
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

/// Returns Θ from the rotation of body axes relative to those of the velocity; see
/// [`body_from_velocity`]. The bank angle grows against the right-hand rule about the velocity.
pub fn angles(rotation: &Rotation3<f64>) -> Vector3<f64> {
    let c = rotation.matrix();
    let beta = asin(c[(1, 0)].clamp(-1.0, 1.0));
    Vector3::new(atan2(c[(2, 0)], c[(0, 0)]), beta, atan2(-c[(1, 2)], c[(1, 1)]))
}

impl Estimator {
    /// Checks the settings and sets up the filter.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        ::settings::check(&settings)?;
        let mut settings = settings;
        if settings.sensor_set < MEMS_SENSORS {
            (settings.corrections, settings.sensor_delay) = (PerSensor::default(), 0.0);
        }
        let s = &settings;
        let limits = [
            ("filter.cutoff", s.cutoff, 0.5 / s.period),
            ("fusion.proportional", s.gains.proportional, 1.0 / s.period),
            ("fusion.integral", s.gains.integral, 1.0 / (s.period * s.period)),
            ("sensor.delay", s.sensor_delay, 1.0),
        ];
        for (name, value, high) in limits {
            if value >= high {
                return Err(invalid(name, value, format!("must be below {high}")));
            }
        }
        for (name, correction) in s.corrections.named() {
            let determinant = correction.matrix.determinant();
            if !(determinant.abs() > 0.0 && determinant.is_finite()) {
                return Err(DesignError::Singular { name: format!("{name}.matrix") });
            }
        }
        Ok(Self { settings, filter: LowPass::new(s.cutoff, s.period) })
    }

    /// Returns the time between ticks, s.
    pub fn period(&self) -> f64 {
        self.settings.period
    }

    /// Returns the delay of slow signals by the sensors' own filters and by the low-pass filter, s.
    pub fn filter_delay(&self) -> f64 {
        self.settings.sensor_delay + self.filter.delay()
    }

    /// Returns the memory before the first tick.
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

    /// Evaluates the tick at `time` (s).
    pub fn update(&self, memory: &mut Memory, time: f64, line: &Line) {
        // Samples without numbers count as taken at the ticks.
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

    /// Returns whether the time stamp of the sample is plausible. The first sample must also have
    /// plausible readings, as there are no others to compare with.
    fn is_usable(&self, memory: &Memory, time: f64, line: &Line) -> bool {
        let oldest = memory.running.map_or(f64::NEG_INFINITY, |running| running.last.time);
        let taken = line.time <= time + tick_tolerance(time, self.settings.period)
            && line.time >= oldest
            && line.time >= time - self.settings.lost_after;
        let shown = || {
            self.settings.gates.iter().zip(&line.readings).all(|(gate, value)| gate.shows(value))
        };
        taken && (memory.running.is_some() || shown())
    }

    /// Judges the readings of a sample that follows that of `before`.
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

    /// Returns whether the readings of this sensor have been equal for too long.
    fn is_frozen(&self, running: &Running, sensor: usize) -> bool {
        let limit = self.settings.frozen_samples;
        limit > 0 && running.last.sample != 0 && running.equal[sensor] + 1 >= limit
    }

    /// Returns corrected angular rate (rad/s), specific force and field. The rate still contains
    /// the bias that only the fusion knows.
    fn corrected(&self, memory: &Memory, filtered: &Nine) -> [Vector3<f64>; 3] {
        let PerSensor([rate, force, _]) = self.settings.corrections;
        let corrections = [rate, force, memory.calibration.correction];
        std::array::from_fn(|i| corrections[i].apply(&filtered.fixed_rows::<3>(3 * i).into()))
    }

    /// Returns the rotation from magnetic north to the north of the angles.
    fn magnetic_to_north(&self) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Vector3::z_axis(), -self.settings.declination)
    }

    /// Returns the state after the first sample; `None` if the sample shows no attitude.
    fn begin(&self, memory: &Memory, line: &Line) -> Option<Running> {
        let filtered = stacked(&line.readings);
        let [_, force, field] = self.corrected(memory, &filtered);
        let fusion = match self.settings.alignment {
            Alignment::Measured => Fusion::new(&triad(&force, &field)?, 1.0),
            Alignment::Given => {
                let attitude =
                    Rotation3::from_matrix_unchecked(body_from_velocity(&self.settings.initial))
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

    /// Returns the state after the next sample. Readings between the samples are interpolated; a
    /// rejected reading is replaced by the last accepted one.
    fn take(&self, memory: &mut Memory, before: &Running, line: &Line) -> Running {
        let s = &self.settings;
        let verdicts = self.judge(before, line);
        let rejected = verdicts.map(|verdict| verdict == Verdict::Rejected);
        let left_out = rejected.contains(&true);
        if !before.confirmed && !left_out && verdicts.contains(&Verdict::Confirmed) {
            // Two samples agree with each other but not with the first one, from which the estimate
            // began.
            let again = self.begin(memory, line);
            return again.map_or(*before, |again| Running { start: before.start, ..again });
        }
        let readings = std::array::from_fn(|i| {
            if rejected[i] { before.last.readings[i] } else { line.readings[i] }
        });
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
        let elapsed =
            if line.time > before.last.time { line.time - before.last.time } else { s.period };
        let steps = (elapsed / s.period).round().clamp(1.0, MOST_STEPS);
        let missing = line.sample.saturating_sub(before.last.sample).saturating_sub(1);
        memory.estimate.dropped =
            memory.estimate.dropped.saturating_add(missing.clamp(0, steps as i32));
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

    /// Returns the state aligned by these readings, with the previous biases.
    fn again(&self, memory: &Memory, running: &Running, filtered: Nine) -> Running {
        let [_, force, field] = self.corrected(memory, &filtered);
        let aligned = triad(&force, &field).map(|attitude| Fusion::new(&attitude, 1.0));
        Running {
            filter: self.filter.settled(&filtered),
            filtered,
            fusion: aligned
                .map_or(running.fusion, |fusion| fusion.with_bias(running.fusion.bias())),
            alive: running.last.time,
            ..*running
        }
    }

    /// Collects a reading for the fit, and computes the fit when the time has come.
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

    /// Computes the estimate that is shown at `time` (s).
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
        let attitude =
            Rotation3::new(rate * -ahead) * running.fusion.attitude() * self.magnetic_to_north();
        let mut angles = angles(&attitude);
        for (angle, before) in angles.iter_mut().zip(&memory.estimate.angles) {
            *angle = nearest(*angle, *before);
        }
        let rates = match s.kinematics {
            Kinematics::Exact => rate,
            Kinematics::Printed => {
                kinematics::r_inverse(&angles) * (Kinematics::Exact.r(&angles) * rate)
            }
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

    fn health(
        &self,
        memory: &Memory,
        running: &Running,
        time: f64,
        arrived: bool,
        rejected: bool,
    ) -> Health {
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
