//! Error-state Kalman filter: P. D. Groves, "Principles of GNSS, Inertial, and Multisensor
//! Integrated Navigation Systems" (2013), chapters 3 and 14, in inertial axes.
//!
//! The error x is true less estimated: position, velocity, attitude as a rotation vector φ in
//! inertial axes (R = exp(φ) R̂), biases of gyroscope and accelerometer, wind to the north and
//! east, the relative errors of the models of the side force and of the drag, and the offset of the
//! receiver's clock.

use super::settings::{Drag, Errors, Wind};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use vehicle::math::exp;

/// Number of states of the error.
pub const STATES: usize = 20;
/// First state of the error of the position, velocity, attitude, both biases, the wind, the
/// models of the side force and of the drag, and the receiver's clock.
pub(super) const POSITION: usize = 0;
pub(super) const VELOCITY: usize = 3;
pub(super) const ATTITUDE: usize = 6;
pub(super) const GYROSCOPE: usize = 9;
pub(super) const ACCELEROMETER: usize = 12;
pub(super) const WIND: usize = 15;
pub(super) const SIDE: usize = 17;
pub(super) const DRAG: usize = 18;
pub(super) const CLOCK: usize = 19;

/// Error of the state.
pub type Error = SVector<f64, STATES>;
/// Covariance of the error.
pub type Covariance = SMatrix<f64, STATES, STATES>;

/// Least standard deviations, so that a perfect sensor leaves the covariance regular: noise of a
/// rate (rad/s/√Hz) and of a specific force (m/s²/√Hz).
const LEAST_NOISE: [f64; 2] = [3e-8, 3e-6];
/// Least deviations of the biases of gyroscope (rad/s) and accelerometer (m/s²).
pub(super) const LEAST_BIASES: [f64; 2] = [1e-12, 1e-9];
/// Standard deviations of angular rate (rad/s) and specific force (m/s²) that no sensor shows.
pub(super) const UNSEEN: [f64; 2] = [0.05, 5.0];

/// A way of the vehicle over which the covariance is propagated at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// Its duration, s.
    pub(super) time: f64,
    /// Change of the velocity by the specific force on it, inertial axes, m/s.
    pub(super) pushed: Vector3<f64>,
    /// Rotation from the body axes to the inertial ones.
    pub(super) attitude: Matrix3<f64>,
    /// Gradient of gravity, 1/s².
    pub(super) gradient: Matrix3<f64>,
    /// Change of the altitude, m.
    pub(super) climbed: f64,
    /// Part of its duration in which gyroscope and accelerometer showed nothing, s.
    pub(super) blind: [f64; 2],
    /// Time between two samples of it times that for which some are missing, in sum, s².
    pub(super) sparse: f64,
}

/// What the filter expects of the sensors and of the air.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected<'a> {
    /// Errors of gyroscope and accelerometer.
    pub(super) errors: &'a [Errors; 2],
    /// Period of the samples, s.
    pub(super) period: f64,
    pub(super) wind: &'a Wind,
    pub(super) drag: &'a Drag,
}

impl Expected<'_> {
    /// Returns how much is left of the wind with the error of the side force, and of the error of
    /// the drag, after a climb (m).
    pub(super) fn kept_in_climb(&self, climbed: f64) -> [f64; 2] {
        [self.wind.correlation, self.drag.correlation].map(|length| exp(-climbed.abs() / length))
    }
}

/// Returns the gradient of gravity at a position (m), 1/s²: that of a sphere.
pub(super) fn gravity_gradient(gravitation: f64, position: &Vector3<f64>) -> Matrix3<f64> {
    let radius = position.norm();
    let up = position / radius;
    (up * up.transpose() * 3.0 - Matrix3::identity()) * (gravitation / (radius * radius * radius))
}

/// Returns how much of a wandering bias is left after `elapsed` (s).
pub(super) fn kept(errors: &Errors, elapsed: f64) -> f64 {
    if errors.correlation > 0.0 { exp(-elapsed / errors.correlation) } else { 1.0 }
}

/// Returns the covariance after a way, P ← Φ P Φᵀ + Q.
pub(super) fn propagated(
    covariance: &Covariance,
    way: &Way,
    expected: &Expected<'_>,
) -> Covariance {
    let Way { time, pushed, attitude, gradient, climbed, blind, sparse } = way;
    let Expected { errors, period, wind, drag } = expected;
    let cross = pushed.cross_matrix();
    let kept_biases = errors.map(|errors| kept(&errors, *time));
    let [kept_wind, kept_drag] = expected.kept_in_climb(*climbed);
    let mut transition = Covariance::identity();
    let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
        transition.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    };
    let identity = Matrix3::identity();
    set(POSITION, VELOCITY, identity * *time);
    set(POSITION, ATTITUDE, cross * (-time / 2.0));
    set(POSITION, ACCELEROMETER, attitude * (-time * time / 2.0));
    set(VELOCITY, POSITION, gradient * *time);
    set(VELOCITY, ATTITUDE, -cross);
    set(VELOCITY, GYROSCOPE, cross * attitude * (time / 2.0));
    set(VELOCITY, ACCELEROMETER, attitude * -*time);
    set(ATTITUDE, GYROSCOPE, attitude * -*time);
    set(GYROSCOPE, GYROSCOPE, identity * kept_biases[0]);
    set(ACCELEROMETER, ACCELEROMETER, identity * kept_biases[1]);
    for i in WIND..DRAG {
        transition[(i, i)] = kept_wind;
    }
    transition[(DRAG, DRAG)] = kept_drag;
    let mut next = transition * covariance * transition.transpose();
    // The spectral density of the noise follows from its deviation at the samples.
    let density = |i: usize| {
        let noise = errors[i].noise * period.sqrt();
        noise * noise + LEAST_NOISE[i] * LEAST_NOISE[i]
    };
    // What is not seen stays what it is for about a second. A sample counts until the next one.
    let added = |i: usize| {
        let noise = errors[i].noise;
        density(i) * time + UNSEEN[i] * UNSEEN[i] * blind[i] + noise * noise * sparse
    };
    let (by_rate, by_force) = (added(0), added(1));
    let wandered = |i: usize| {
        let deviation = errors[i].instability;
        deviation * deviation * (1.0 - kept_biases[i] * kept_biases[i])
    };
    let [blown, renewed] = [kept_wind, kept_drag].map(|kept| 1.0 - kept * kept);
    let added = [
        (POSITION..VELOCITY, by_force * time * time / 3.0),
        (VELOCITY..ATTITUDE, by_force),
        (ATTITUDE..GYROSCOPE, by_rate),
        (GYROSCOPE..ACCELEROMETER, wandered(0)),
        (ACCELEROMETER..WIND, wandered(1)),
        (WIND..SIDE, wind.deviation * wind.deviation * blown),
        (SIDE..DRAG, wind.model * wind.model * blown),
        (DRAG..CLOCK, drag.model * drag.model * renewed),
    ];
    for (states, variance) in added {
        for i in states {
            next[(i, i)] += variance;
        }
    }
    symmetric(&next)
}

fn symmetric(covariance: &Covariance) -> Covariance {
    (covariance + covariance.transpose()) * 0.5
}

/// Measurement of a linear form of the error, with independent noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    /// The form.
    pub(super) row: Error,
    /// Measured less predicted value.
    pub(super) residual: f64,
    /// Variance of the noise.
    pub(super) variance: f64,
}

impl Measured {
    /// Returns the measurement of one state.
    pub(super) fn state(state: usize, residual: f64, deviation: f64) -> Self {
        let mut row = Error::zeros();
        row[state] = 1.0;
        Self { row, residual, variance: deviation * deviation }
    }

    /// Returns whether all of it are numbers: at rest, or without air, a force shows nothing.
    pub(super) fn is_finite(&self) -> bool {
        self.row.iter().chain([&self.residual, &self.variance]).all(|value| value.is_finite())
    }
}

/// Returns the error that follows from measurements, its covariance, and the square of the
/// normalised innovations per measurement, which is 1 on average.
pub(super) fn updated(covariance: &Covariance, all: &[Measured]) -> (Error, Covariance, f64) {
    let (mut error, mut after, mut squares) = (Error::zeros(), *covariance, 0.0);
    for Measured { row, residual, variance } in all {
        let column = after * row;
        let total = row.dot(&column) + variance;
        let innovation = residual - row.dot(&error);
        squares += innovation * innovation / total;
        error += column * (innovation / total);
        after -= column * column.transpose() / total;
    }
    (error, symmetric(&after), squares / all.len() as f64)
}

/// Returns the form of the error that is its part along a direction, from a state on.
pub(super) fn along(from: usize, direction: &Vector3<f64>) -> Error {
    let mut row = Error::zeros();
    row.fixed_rows_mut::<3>(from).copy_from(direction);
    row
}

/// Returns the standard deviation of a linear form of the error.
pub(super) fn deviation(covariance: &Covariance, row: &Error) -> f64 {
    row.dot(&(covariance * row)).max(0.0).sqrt()
}
