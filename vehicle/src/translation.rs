//! Motion of the centre of mass over a rotating planet, after N. X. Vinh, A. Busemann, R. D. Culp,
//! "Hypersonic and Planetary Entry Flight Mechanics" (1980), chapter 2, with J₂ in addition.
//!
//! The bank angle σ has the sign of the papers: it grows against the right-hand rule about the
//! velocity, so that a positive one turns the vehicle to the left.
//!
//! ```
//! use vehicle::translation::{AirAcceleration, Motion, Planet, derivative};
//!
//! let start = Motion { radius: 6.45e6, speed: 7500.0, ..Motion::default() };
//! let none = AirAcceleration::default();
//! let rates = derivative(&Planet::EARTH, &start.into(), &none);
//! // It falls as fast as gravity pulls it and the curvature of the orbit does not hold it.
//! assert!(Motion::from(rates).flight_path_angle < 0.0);
//! ```

use crate::math::{cos, sin_cos, tan};
use nalgebra::SVector;

/// A planet that rotates about its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planet {
    /// Radius of its surface at the equator, m.
    pub radius: f64,
    /// Gravitational parameter μ, m³/s².
    pub gravitation: f64,
    /// Second zonal harmonic J₂ of its gravity, which is 0 for a sphere.
    pub oblateness: f64,
    /// Angular rate ω of its rotation, rad/s.
    pub rate: f64,
}

impl Planet {
    /// The Earth by WGS 84.
    pub const EARTH: Self = Self {
        radius: 6_378_137.0,
        gravitation: 3.986_004_418e14,
        oblateness: 1.082_629_82e-3,
        rate: 7.292_115e-5,
    };

    /// Returns the acceleration of gravity at a distance from the centre (m) and a latitude (rad):
    /// downward and to the north, m/s².
    pub fn gravity(&self, radius: f64, latitude: f64) -> [f64; 2] {
        let (sine, cosine) = sin_cos(latitude);
        let sphere = self.gravitation / (radius * radius);
        let bulge = 1.5 * self.oblateness * (self.radius / radius) * (self.radius / radius);
        [sphere * (1.0 + bulge * (1.0 - 3.0 * sine * sine)), -2.0 * sphere * bulge * sine * cosine]
    }
}

/// Position and velocity, in this order, as a vector; or their time derivatives.
pub type State = SVector<f64, 6>;

/// Position and velocity relative to the rotating planet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Distance r from the centre of the planet, m.
    pub radius: f64,
    /// Longitude θ, positive to the east, rad.
    pub longitude: f64,
    /// Latitude φ, positive to the north, rad.
    pub latitude: f64,
    /// Speed V relative to the planet, m/s.
    pub speed: f64,
    /// Flight path angle γ, positive above the horizon, rad.
    pub flight_path_angle: f64,
    /// Azimuth ψ of the velocity from north, positive to the east, rad.
    pub azimuth: f64,
}

impl From<State> for Motion {
    fn from(state: State) -> Self {
        let [radius, longitude, latitude, speed, flight_path_angle, azimuth] = state.into();
        Self { radius, longitude, latitude, speed, flight_path_angle, azimuth }
    }
}

impl From<Motion> for State {
    fn from(motion: Motion) -> Self {
        let Motion { radius, longitude, latitude, speed, flight_path_angle, azimuth } = motion;
        Self::from([radius, longitude, latitude, speed, flight_path_angle, azimuth])
    }
}

/// What the air does to the motion, and the bank angle about which its lift is turned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AirAcceleration {
    /// Lift L/m per mass, perpendicular to the velocity, m/s².
    pub lift: f64,
    /// Drag D/m per mass, against the velocity, m/s².
    pub drag: f64,
    /// Bank angle σ, rad.
    pub bank: f64,
}

/// Returns the time derivative of the motion (Vinh, Busemann, Culp 1980, chapter 2, with −σ and
/// J₂). It is not finite at a speed of zero, in vertical flight and at the poles, where the angles
/// have no meaning.
pub fn derivative(planet: &Planet, state: &State, air: &AirAcceleration) -> State {
    let Motion { radius: r, latitude, speed: v, flight_path_angle, azimuth, .. } =
        Motion::from(*state);
    let (sin_latitude, cos_latitude) = sin_cos(latitude);
    let (sin_path, cos_path) = sin_cos(flight_path_angle);
    let (sin_azimuth, cos_azimuth) = sin_cos(azimuth);
    let (sin_bank, cos_bank) = sin_cos(air.bank);
    let [g, g_north] = planet.gravity(r, latitude);
    // Of the rotation: the centrifugal acceleration at the equator, and twice the rate.
    let (centrifugal, coriolis) = (planet.rate * planet.rate * r, 2.0 * planet.rate);

    let speed_rate = -air.drag - g * sin_path
        + g_north * cos_path * cos_azimuth
        + centrifugal
            * cos_latitude
            * (sin_path * cos_latitude - cos_path * sin_latitude * cos_azimuth);
    let turn_up = air.lift * cos_bank + (v * v / r - g) * cos_path
        - g_north * sin_path * cos_azimuth
        + coriolis * v * cos_latitude * sin_azimuth
        + centrifugal
            * cos_latitude
            * (cos_path * cos_latitude + sin_path * cos_azimuth * sin_latitude);
    let turn_right = -(air.lift * sin_bank + g_north * sin_azimuth) / cos_path
        + v * v / r * cos_path * sin_azimuth * tan(latitude)
        - coriolis * v * (tan(flight_path_angle) * cos_azimuth * cos_latitude - sin_latitude)
        + centrifugal / cos_path * sin_azimuth * sin_latitude * cos_latitude;
    Motion {
        radius: v * sin_path,
        longitude: v * cos_path * sin_azimuth / (r * cos(latitude)),
        latitude: v * cos_path * cos_azimuth / r,
        speed: speed_rate,
        flight_path_angle: turn_up / v,
        azimuth: turn_right / v,
    }
    .into()
}
