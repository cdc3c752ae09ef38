//! Readings of the sensors of a platform that rests, follows the scenario of Chai 2022, or turns
//! for calibration.
#![allow(dead_code, unreachable_pub)] // Each user needs a part of it.

use control::Measurement;
use control::controller::Controller;
use control::crmpc::{Constraints, Crmpc, Memory};
use control::estimation::ellipsoid::Correction;
use control::estimation::{
    self, CalibrationMode, CalibrationStatus, Estimate, Estimator, Settings,
};
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3};
use vehicle::fixes::Devices;
use vehicle::kinematics::{self, Kinematics};
use vehicle::math::sin_cos;
use vehicle::plant::{Plant, angles, rates};
use vehicle::platform::{Pose, Readings};
use vehicle::scenario::Scenario;
use vehicle::sensor_data::SensorData;
use vehicle::sensors::{Config, PerSensor, Sensors};
use vehicle::triad::Triad;

/// Time between samples and ticks, s.
pub const PERIOD: f64 = 0.01;

/// Length of the flight with which the MEMS set is calibrated, s.
pub const CALIBRATION_DURATION: f64 = 120.0;
/// Seed of the calibration flight.
pub const CALIBRATION_SEED: u64 = 100;

/// True state of the platform at a tick.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Time of the tick, s.
    pub time: f64,
    /// Angles Θ of the platform, rad.
    pub angles: Vector3<f64>,
    /// Body rates ω of the model, rad/s.
    pub rates: Vector3<f64>,
}

fn times(duration: f64) -> impl Iterator<Item = f64> {
    (0..(duration / PERIOD).round() as u32).map(|k| f64::from(k) * PERIOD)
}

/// Returns the true states at rest in the scenario's initial attitude.
pub fn rest(duration: f64) -> Vec<Truth> {
    let angles = Scenario::crmpc2022().initial_angles;
    times(duration).map(|time| Truth { time, angles, rates: Vector3::zeros() }).collect()
}

/// Returns the true states under CRMPC with exact measurements and the noise of this seed.
pub fn scenario(seed: u64) -> Vec<Truth> {
    let scenario = Scenario::crmpc2022();
    let mut config = scenario.config(PERIOD);
    config.inertia_scale = 1.05;
    config.disturbance.seed = seed;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let mut controller = Crmpc::new(super::settings(Constraints::Robust)).unwrap();
    let mut memory = Memory::default();
    let mut moment = Vector3::zeros();
    let every = (super::FEEDBACK / PERIOD).round() as u64;
    (0..)
        .zip(times(scenario.duration))
        .map(|(k, time)| {
            let truth = Truth { time, angles: plant.angles(), rates: plant.rates() };
            if k % every == 0 {
                let Truth { angles, rates, .. } = truth;
                let measured = Measurement { angles, rates, ..Measurement::default() };
                let reference = |time: f64| scenario.reference.at(time);
                moment = controller.update(&mut memory, k / every, time, &measured, &reference);
            }
            plant.advance(time, time + PERIOD, moment).unwrap();
            truth
        })
        .collect()
}

/// Returns the attitude angles Θ and Θ̇ (rad, rad/s) of the calibration sequence at `time` (s) after
/// a start at the angles `initial`: α and σ turn at constant rates, and β swings.
///
/// Together α, β and σ repeat after an hour only. β swings far enough for the y axis to meet the
/// field, which is 23° short of lying in the plane that the y axis sweeps as σ turns.
pub fn calibration_angles(initial: &Vector3<f64>, time: f64) -> [Vector3<f64>; 2] {
    let [alpha_rate, sigma_rate, amplitude, frequency] =
        [37.0, 60.0, 40.0, 11.3].map(f64::to_radians);
    let (sine, cosine) = sin_cos(frequency * time);
    let swing = Vector3::new(alpha_rate * time, amplitude * sine, sigma_rate * time);
    [initial + swing, Vector3::new(alpha_rate, amplitude * frequency * cosine, sigma_rate)]
}

/// Returns the true states along the calibration sequence.
pub fn calibration(duration: f64) -> Vec<Truth> {
    let start = Scenario::crmpc2022().initial_angles;
    let at = |time: f64| {
        let [angles, angle_rates] = calibration_angles(&start, time);
        Truth { time, angles, rates: kinematics::r_inverse(&angles) * angle_rates }
    };
    times(duration).map(at).collect()
}

/// Returns the readings of sensors without errors in this state.
pub fn felt(truth: &Truth) -> Readings {
    let pose = Pose {
        specific_force: None,
        kinematics: Kinematics::Printed,
        angles: truth.angles,
        rates: truth.rates,
        alpha_rate: (kinematics::r(&truth.angles) * truth.rates).x,
        trajectory: vehicle::trajectory::Trajectory::default(),
    };
    pose.felt(&SensorData::embedded().surroundings)
}

/// Returns the output of the line at each tick.
pub fn lines(trajectory: &[Truth], config: &Config) -> Vec<estimation::Line> {
    let mut sensors = Sensors::new(config, 0.0).unwrap();
    let show = |truth: &Truth| {
        sensors.take(truth.time, &felt(truth));
        let sample = sensors.arrived();
        estimation::Line { sample: sample.number, time: sample.time, readings: sample.readings }
    };
    trajectory.iter().map(show).collect()
}

/// Returns sensors on the line of the data file.
pub fn config(triads: &PerSensor<Triad>, seed: u64) -> Config {
    Config { triads: *triads, line: SensorData::embedded().line, devices: Devices::default(), seed }
}

/// Returns the typical MEMS set.
pub fn mems(seed: u64) -> Config {
    config(&SensorData::embedded().mems, seed)
}

/// Returns the estimates at each tick.
pub fn estimates(settings: &Settings, lines: &[estimation::Line]) -> Vec<Estimate> {
    let estimator = Estimator::new(*settings).unwrap();
    let mut memory = estimator.memory();
    let mut update = |(k, line): (u32, &estimation::Line)| {
        estimator.update(&mut memory, f64::from(k) * PERIOD, line);
        memory.estimate
    };
    (0..).zip(lines).map(&mut update).collect()
}

/// Returns the correction that recovers the true values from the readings: least squares of y = A
/// x + b.
fn regression(felt: &[Vector3<f64>], readings: &[Vector3<f64>]) -> Correction {
    let mut normal = Matrix4::zeros();
    let mut right = SMatrix::<f64, 4, 3>::zeros();
    for (x, y) in felt.iter().zip(readings) {
        let x = x.push(1.0);
        normal += x * x.transpose();
        right += x * y.transpose();
    }
    let solution = (normal.try_inverse().unwrap() * right).transpose();
    let matrix: Matrix3<f64> = solution.fixed_view::<3, 3>(0, 0).into();
    Correction { matrix: matrix.try_inverse().unwrap(), bias: solution.column(3).into() }
}

/// Calibrates all sensors from one flight of the sequence: gyroscope and accelerometer against the
/// platform's own angles, the magnetometer by the estimator's ellipsoid.
pub fn calibrated(config: &Config, duration: f64) -> Settings {
    let trajectory = calibration(duration + 2.0 * PERIOD);
    let lines = lines(&trajectory, config);
    let fit = Settings {
        calibration: CalibrationMode::Fit,
        calibration_duration: duration - PERIOD,
        ..Settings::ours()
    };
    let estimator = Estimator::new(fit).unwrap();
    let mut memory = estimator.memory();
    for (truth, line) in trajectory.iter().zip(&lines) {
        estimator.update(&mut memory, truth.time, line);
    }
    assert_eq!(memory.calibration.status, CalibrationStatus::Fitted);

    let arrived: Vec<_> = lines.iter().filter(|line| line.sample > 0).collect();
    let corrections = [0, 1].map(|i| {
        let felt: Vec<_> = arrived
            .iter()
            .map(|line| felt(&trajectory[usize::try_from(line.sample - 1).unwrap()])[i])
            .collect();
        let readings: Vec<_> = arrived.iter().map(|line| line.readings[i]).collect();
        regression(&felt, &readings)
    });
    let [gyroscope, accelerometer] = corrections;
    Settings {
        corrections: PerSensor([gyroscope, accelerometer, memory.calibration.correction]),
        ..Settings::ours()
    }
}

/// Returns the root mean square of each component (deg or deg/s) from `from` (s) on.
pub fn rms(from: f64, errors: impl Iterator<Item = (f64, Vector3<f64>)>) -> Vector3<f64> {
    let later: Vec<_> = errors.filter(|(time, _)| *time >= from).map(|(_, error)| error).collect();
    let sum: Vector3<f64> = later.iter().map(|error| error.component_mul(error)).sum();
    (sum / later.len() as f64).map(|mean| mean.sqrt().to_degrees())
}

/// Returns the root mean square errors of angles and rates.
pub fn errors(trajectory: &[Truth], estimates: &[Estimate], from: f64) -> [Vector3<f64>; 2] {
    let pairs = || trajectory.iter().zip(estimates);
    [
        rms(from, pairs().map(|(truth, estimate)| (truth.time, estimate.angles - truth.angles))),
        rms(from, pairs().map(|(truth, estimate)| (truth.time, estimate.rates - truth.rates))),
    ]
}
