//! Where an entry flight begins.

use super::motion::{Motion, STEEPEST};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Largest initial longitude and heading, rad.
const TURN: f64 = 2.0 * std::f64::consts::PI;

/// Motion of the centre of mass at the start of an entry flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Start {
    /// Initial altitude of an entry flight.
    #[setting(unit = "m", min = 0.0, max = 1e6, nominal = 1e5)]
    pub altitude: f64,
    /// Initial longitude of an entry flight.
    #[setting(unit = "rad", min = -TURN, max = TURN, nominal = 1.0)]
    pub longitude: f64,
    /// Initial latitude of an entry flight.
    #[setting(unit = "rad", min = -STEEPEST, max = STEEPEST, nominal = 1.0)]
    pub latitude: f64,
    /// Initial speed of an entry flight, relative to the rotating planet.
    #[setting(unit = "m/s", above = 0.0, max = 2e4, nominal = 1e3)]
    pub speed: f64,
    /// Initial flight path angle of an entry flight, positive above the horizon.
    #[setting(unit = "rad", min = -STEEPEST, max = STEEPEST, nominal = 0.1)]
    pub flight_path_angle: f64,
    /// Initial heading of an entry flight, measured from north towards east.
    #[setting(unit = "rad", min = -TURN, max = TURN, nominal = 1.0)]
    pub heading: f64,
}

impl Start {
    /// Returns the initial motion.
    pub fn motion(&self) -> Motion {
        let Self { altitude, longitude, latitude, speed, flight_path_angle, heading } = *self;
        Motion::new(altitude, longitude, latitude, speed, flight_path_angle, heading)
    }
}

impl Default for Start {
    /// Returns the start of the guided flight from 120 km in docs/entry.md.
    fn default() -> Self {
        Self {
            altitude: 120e3,
            longitude: 0.0,
            latitude: -10_f64.to_radians(),
            speed: 7450.0,
            flight_path_angle: -1.2_f64.to_radians(),
            heading: 60_f64.to_radians(),
        }
    }
}
