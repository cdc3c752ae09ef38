//! The motion of the centre of mass as six numbers, and the range in which they are defined.

use crate::axes::Entry;
use crate::error::Error;
use crate::math::{atan2, hypot, sin_cos};
use crate::translation::{self, Planet, derivative_at};
use nalgebra::{SVector, Vector3};

/// Motion of the centre of mass `[altitude, longitude, latitude, speed, flight path angle,
/// heading]`, relative to the rotating planet, in m, rad and m/s.
pub type Motion = SVector<f64, 6>;

/// Largest flight path angle and latitude (rad), up and down, at which the motion's angles are
/// used: they have no meaning in vertical flight and at the poles.
pub const STEEPEST: f64 = std::f64::consts::FRAC_PI_2 - 1e-4;

/// Endings of the names of the components of [`Motion`], and their descriptions.
pub const MOTION: [Entry; 6] = [
    (".altitude", "Altitude above the planet's ellipsoid"),
    (".longitude", "Longitude, positive to the east"),
    (".latitude", "Latitude, positive to the north"),
    (".speed", "Speed relative to the rotating planet"),
    (".flightPathAngle", "Flight path angle, positive above the horizon"),
    (".heading", "Heading of the velocity, measured from north towards east"),
];
/// Units of the components of [`Motion`].
pub const UNITS: [&str; 6] = ["m", "rad", "rad", "m/s", "rad", "rad"];
/// Units of their rates.
pub const RATE_UNITS: [&str; 6] = ["m/s", "rad/s", "rad/s", "m/s2", "rad/s", "rad/s"];
/// Typical magnitudes of the components of [`Motion`].
pub const NOMINALS: [f64; 6] = [1e5, 1.0, 1.0, 1e3, 0.1, 1.0];

/// Checks that the motion's angles have a meaning at `time` (s).
///
/// # Errors
/// Reports a motion that is not finite, stands still, is vertical or is over a pole.
pub fn check(motion: &Motion, time: f64) -> Result<(), Error> {
    if !motion.iter().all(|value| value.is_finite()) {
        return Err(Error::NotFinite { time, what: "motion of the centre of mass" });
    }
    let [_, _, latitude, speed, path, _] = (*motion).into();
    let problem = if path.abs() > STEEPEST {
        "is vertical"
    } else if latitude.abs() > STEEPEST {
        "is over a pole"
    } else if speed <= 0.0 {
        "stands still"
    } else {
        return Ok(());
    };
    Err(Error::NoCourse { time, problem })
}

/// Returns the time derivative of a motion under a specific force (m/s²) along the trajectory's
/// axes, given the sines and cosines of flight path angle, heading and latitude.
pub fn motion_rate(
    planet: &Planet,
    motion: &Motion,
    sines: &[(f64, f64); 3],
    force: &Vector3<f64>,
) -> Motion {
    let (sine, cosine) = sines[2];
    let [surface, slope] = planet.surface(sine);
    let mut from_centre: translation::State = *motion;
    from_centre[0] += surface;
    let mut derivative = derivative_at(planet, &from_centre, sines, force);
    // The surface rises or falls below the vehicle.
    derivative[0] -= slope * cosine * derivative[2];
    derivative
}

/// Returns the great circle from one position to another, given as longitude and latitude (rad):
/// its length over ground (m, at the planet's radius), and its direction at the first position from
/// north to east, rad.
pub fn great_circle(planet: &Planet, from: [f64; 2], to: [f64; 2]) -> (f64, f64) {
    let (sin_from, cos_from) = sin_cos(from[1]);
    let (sin_to, cos_to) = sin_cos(to[1]);
    let (sine, cosine) = sin_cos(to[0] - from[0]);
    let (east, north) = (cos_to * sine, cos_from * sin_to - sin_from * cos_to * cosine);
    let ahead = sin_from * sin_to + cos_from * cos_to * cosine;
    (planet.radius * atan2(hypot(east, north), ahead), atan2(east, north))
}
