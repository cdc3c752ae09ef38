//! Settings of the navigation.

use ::settings::Declared;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::axes::ANGLES;
use vehicle::entry::Start;
use vehicle::sensor_data::{LAST_SENSORS, SensorData};
use vehicle::translation::Planet;

/// All settings of the navigation. Units are SI, angles in rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings {
    /// The planet, as in the plant.
    pub planet: Planet,
    /// Sensor set, the same as in the plant: 1 without errors; 2 with the errors of the parameters
    /// gyroscope and accelerometer; 3, 4, 5 of navigation and tactical grade and calibrated MEMS.
    #[setting(name = "sensor.set", min = 1, max = LAST_SENSORS)]
    pub sensor_set: i32,
    /// Period of the navigation and of the samples of the inertial sensors.
    #[setting(unit = "s", min = 1e-3, max = 1.0, nominal = 0.01)]
    pub period: f64,
    /// Errors of the gyroscope, in rad/s.
    #[setting(unit = "rad/s", nominal = 1e-5, used_with = "sensor.set = 2", file)]
    pub gyroscope: Errors,
    /// Errors of the accelerometer, in m/s².
    #[setting(unit = "m/s2", nominal = 1e-2, used_with = "sensor.set = 2", file)]
    pub accelerometer: Errors,
    /// Initial state.
    pub initial: Initial,
    /// Alignment before the entry.
    pub alignment: Alignment,
    /// Fixes of satellite navigation and star tracker.
    #[setting(file)]
    pub fix: Fix,
    /// Wind by the side force.
    #[setting(file)]
    pub wind: Wind,
    /// Altitude by the drag.
    #[setting(file)]
    pub drag: Drag,
    /// Time in which the shown state follows a correction; 0 for at once.
    #[setting(name = "blend.time", unit = "s", min = 0.0, max = 1e3, nominal = 3.0, file)]
    pub blend: f64,
    /// Standard deviation of an attitude angle from which the navigation counts as degraded.
    #[setting(name = "health.deviation", unit = "rad", above = 0.0, nominal = 0.01, file)]
    pub degraded: f64,
    /// Time without a fix from which the navigation counts as bridging.
    #[setting(name = "health.after", unit = "s", above = 0.0, nominal = 5.0, file)]
    pub bridging: f64,
    /// Largest steps of the biases, beyond their instability.
    #[setting(name = "protection")]
    pub guarded: Guarded,
}

/// Errors of an inertial sensor that the filter expects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Errors {
    /// Standard deviation of the wandering bias.
    #[setting(part, min = 0.0)]
    pub instability: f64,
    /// Correlation time of the wandering bias; 0 for one that stays.
    #[setting(part, unit = "s", min = 0.0, nominal = 1e3)]
    pub correlation: f64,
    /// Standard deviation of the white noise on the samples.
    #[setting(part, min = 0.0)]
    pub noise: f64,
}

/// State at the first sample, as it is known before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Initial {
    /// Motion at the first sample.
    #[setting(name = "")]
    pub start: Start,
    /// Initial angle.
    #[setting(name = "", each = ANGLES, unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
}

/// How well the initial state is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Alignment {
    /// Standard deviation of the initial attitude, about each axis.
    #[setting(unit = "rad", above = 0.0, max = 1.0, nominal = 1e-3, file)]
    pub attitude: f64,
    /// Standard deviation of the initial position along each axis.
    #[setting(unit = "m", above = 0.0, nominal = 100.0, file)]
    pub position: f64,
    /// Standard deviation of the initial velocity along each axis.
    #[setting(unit = "m/s", above = 0.0, nominal = 1.0, file)]
    pub velocity: f64,
    /// Seed of the errors of the initial state, which have these deviations; 0 for none.
    #[setting(min = 0)]
    pub seed: u64,
}

/// Fixes of satellite navigation and star tracker.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Fix {
    /// Standard deviation of the position of satellite navigation, along each axis.
    #[setting(unit = "m", above = 0.0, nominal = 5.0)]
    pub position: f64,
    /// Standard deviation of the velocity of satellite navigation, along each axis.
    #[setting(unit = "m/s", above = 0.0, nominal = 0.1)]
    pub velocity: f64,
    /// Standard deviation of the attitude of the star tracker, about each axis.
    #[setting(unit = "rad", above = 0.0, nominal = 1e-4)]
    pub attitude: f64,
    /// Square of the standard deviations per component from which a fix is rejected; after five
    /// rejections in a row one is taken.
    #[setting(above = 1.0, nominal = 25.0)]
    pub gate: f64,
}

/// Wind, which is seen by the side force: the vehicle flies sideways through it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Wind {
    /// Standard deviation of the wind to the north and to the east; 0 if there is none.
    #[setting(unit = "m/s", min = 0.0, max = 300.0, nominal = 30.0)]
    pub deviation: f64,
    /// Change of the altitude over which the wind becomes another one.
    #[setting(unit = "m", above = 0.0, nominal = 1e4, used_with = "wind.deviation > 0")]
    pub correlation: f64,
    /// Relative standard deviation of the ratio of side force to lift and drag.
    #[setting(name = "model", min = 0.0, max = 1.0, nominal = 0.1)]
    #[setting(used_with = "wind.deviation > 0")]
    pub model: f64,
}

/// Altitude, which is seen by lift and drag: the air thins with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Drag {
    /// Relative standard deviation of the product of the air's density and the coefficients of lift
    /// and drag; 0 leaves the altitude to the other sensors.
    #[setting(name = "model", min = 0.0, max = 1.0, nominal = 0.1)]
    pub model: f64,
    /// Change of the altitude over which the error of this product becomes another one.
    #[setting(unit = "m", above = 0.0, nominal = 1e4, used_with = "drag.model > 0")]
    pub correlation: f64,
}

/// Largest steps of the biases of the inertial sensors that are to be covered: `deviation.*` and
/// `protection.*` allow for them, and the filter finds them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Guarded {
    /// Largest step of the gyroscope's bias that the filter expects.
    #[setting(unit = "rad/s", min = 0.0, max = 0.1, nominal = 1e-5)]
    pub gyroscope: f64,
    /// Largest step of the accelerometer's bias that the filter expects.
    #[setting(unit = "m/s2", min = 0.0, max = 10.0, nominal = 1e-2)]
    pub accelerometer: f64,
    /// Largest offset of the clocks of star tracker and receiver that the filter expects, the latter
    /// after half a minute without fixes.
    #[setting(unit = "s", min = 0.0, max = 0.25, nominal = 0.1)]
    pub clock: f64,
}

/// A bias may step at any time. The filter takes it as one that wanders: with a standard deviation of
/// this share of the step, and a correlation time (s) as long as other sensors do not show it. Drag
/// and fixes soon show that of the accelerometer.
const STEPS: [(f64, f64); 2] = [(0.5, 900.0), (0.9, 60.0)];

impl Default for Settings {
    /// Returns the settings for tactical sensors, from the start of the plant's entry flight.
    fn default() -> Self {
        Self {
            planet: Planet::EARTH,
            sensor_set: 4,
            period: 0.04,
            gyroscope: Errors::default(),
            accelerometer: Errors::default(),
            initial: Initial {
                start: Start::default(),
                angles: Vector3::new(40_f64.to_radians(), 0.0, 64_f64.to_radians()),
            },
            alignment: Alignment {
                attitude: 0.1_f64.to_radians(),
                position: 50.0,
                velocity: 0.5,
                seed: 1,
            },
            fix: Fix { position: 5.0, velocity: 0.1, attitude: 5e-5, gate: 25.0 },
            wind: Wind { deviation: 40.0, correlation: 1e4, model: 0.1 },
            drag: Drag { model: 0.15, correlation: 2e4 },
            blend: 3.0,
            degraded: 1_f64.to_radians(),
            bridging: 5.0,
            guarded: Guarded::default(),
        }
    }
}

impl Settings {
    /// Returns the errors of gyroscope and accelerometer that the filter expects.
    pub(super) fn errors(&self) -> [Errors; 2] {
        let mut errors = match self.sensor_set {
            1 => [Errors::default(); 2],
            2 => [self.gyroscope, self.accelerometer],
            set => {
                let triads = SensorData::embedded().inertial(set, self.period);
                [triads[0], triads[1]].map(|triad| Errors {
                    instability: triad.instability,
                    correlation: triad.correlation,
                    noise: triad.noise,
                })
            }
        };
        let Guarded { gyroscope, accelerometer, .. } = self.guarded;
        for ((errors, step), (share, time)) in
            errors.iter_mut().zip([gyroscope, accelerometer]).zip(STEPS)
        {
            if step * share > errors.instability {
                errors.instability = step * share;
                errors.correlation = time;
            }
        }
        errors
    }
}
