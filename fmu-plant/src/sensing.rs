//! Parameters of the sensors.

use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::fixes::Devices;
use vehicle::platform::Surroundings;
use vehicle::sensor_data::{LAST_SENSORS, SensorData};
use vehicle::sensors::{self, Line, PerSensor};
use vehicle::triad::Triad;
use vehicle::turntable;

/// Time (s) that no simulation reaches. It replaces an infinite number, which not all FMI importers
/// can read.
pub(crate) const NEVER: f64 = 1e15;
/// Value of `sensor.set` without sampling: the FMU outputs the readings of ideal sensors.
const NO_SENSORS: i32 = 0;
/// Value of `sensor.set` for sampled sensors without errors.
const IDEAL_SENSORS: i32 = 1;
/// Value of `sensor.set` for sampled sensors with the errors given by the parameters.
const GIVEN_SENSORS: i32 = 2;

/// Parameters of the sensors and of their surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct Sensing {
    /// Sensor set: 0 for ideal continuous readings, 1 for samples without errors, 2 for samples
    /// with errors, which are those of a typical MEMS set by default; 3, 4, 5 for inertial sensors
    /// of navigation and tactical grade and calibrated MEMS sensors.
    #[setting(name = "sensor.set", min = NO_SENSORS, max = LAST_SENSORS)]
    pub(crate) sensor_set: i32,
    #[setting(name = "sensor")]
    pub(crate) line: Line,
    /// Seed of sensor noise and dropped samples; the same seed gives the same samples.
    #[setting(name = "sensor.seed", min = 0)]
    #[setting(
        used_with = "sensor.set >= 1 and (sensor.set >= 2 or sensor.drop.probability > 0 or translation = entry)"
    )]
    pub(crate) sensor_seed: u64,
    #[setting(name = "sensor", used_with = "sensor.set >= 1")]
    pub(crate) devices: Devices,
    #[setting(name = "sensor")]
    pub(crate) triads: PerSensor<Triad>,
    #[setting(name = "sensor")]
    pub(crate) surroundings: Surroundings,
    pub(crate) turntable: turntable::Config,
}

impl Default for Sensing {
    fn default() -> Self {
        let sensors = SensorData::embedded();
        let mut line = sensors.line;
        line.drop_window.end = line.drop_window.end.min(NEVER);
        Self {
            sensor_set: NO_SENSORS,
            line,
            sensor_seed: 1,
            devices: Devices::default(),
            triads: sensors.mems,
            surroundings: sensors.surroundings,
            turntable: turntable::Config::default(),
        }
    }
}

impl Sensing {
    /// Configuration of the sampled sensors, or `None` if the FMU outputs the readings of ideal
    /// sensors.
    pub(crate) fn sensors(&self) -> Option<sensors::Config> {
        let Self { sensor_set, line, sensor_seed: seed, devices, triads: given, .. } = *self;
        let data = SensorData::embedded();
        let errors = match sensor_set {
            NO_SENSORS => return None,
            IDEAL_SENSORS => data.ideal,
            GIVEN_SENSORS => given,
            _ => data.inertial(sensor_set, line.period),
        };
        // Freezing is not an error of the sensor set, so every set keeps it.
        let triads =
            PerSensor(std::array::from_fn(|i| Triad { freeze: given[i].freeze, ..errors[i] }));
        Some(sensors::Config { triads, line, devices, seed })
    }
}
