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

use crate::math::sin_cos;
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// A planet that rotates about its axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Planet {
    /// Radius of the planet at its equator.
    #[setting(unit = "m", min = 1e3, nominal = 1e6)]
    pub radius: f64,
    /// Flattening of the ellipsoid from which altitudes are counted; 0 for a sphere.
    #[setting(min = 0.0, max = 0.1, nominal = 1e-3)]
    pub flattening: f64,
    /// Gravitational parameter of the planet.
    #[setting(unit = "m3/s2", min = 0.0, nominal = 1e14)]
    pub gravitation: f64,
    /// Second zonal harmonic J2 of the planet's gravity; 0 for a sphere.
    #[setting(min = 0.0, max = 0.1, nominal = 1e-3)]
    pub oblateness: f64,
    /// Angular rate of the planet's rotation.
    #[setting(unit = "rad/s", min = 0.0, max = 1.0, nominal = 1e-4)]
    pub rate: f64,
}

impl Planet {
    /// The Earth by WGS 84.
    pub const EARTH: Self = Self {
        radius: 6_378_137.0,
        flattening: 1.0 / 298.257_223_563,
        gravitation: 3.986_004_418e14,
        oblateness: 1.082_629_82e-3,
        rate: 7.292_115e-5,
    };

    /// Returns the distance of the ellipsoid's surface from the centre (m) where the geocentric
    /// latitude has this sine, and its derivative with respect to the sine, m.
    pub fn surface(&self, sine: f64) -> [f64; 2] {
        let polar = 1.0 - self.flattening;
        let bulge = 1.0 - polar * polar;
        let square = polar * polar + bulge * sine * sine;
        let distance = self.radius * (polar / square.sqrt());
        [distance, -distance * bulge * sine / square]
    }

    /// Returns the acceleration of gravity at a distance from the centre (m) and a latitude (rad):
    /// downward and to the north, m/s².
    pub fn gravity(&self, radius: f64, latitude: f64) -> [f64; 2] {
        self.gravity_at(radius, sin_cos(latitude))
    }

    /// Returns the acceleration of gravity at a position along the planet-fixed axes (m), m/s².
    pub fn gravity_vector(&self, position: &Vector3<f64>) -> Vector3<f64> {
        let radius = position.norm();
        let sphere = self.gravitation / (radius * radius * radius);
        let bulge = 1.5 * self.oblateness * (self.radius / radius) * (self.radius / radius);
        let sine = position.z / radius;
        let across = 1.0 + bulge * (1.0 - 5.0 * sine * sine);
        let along = across + 2.0 * bulge;
        position.component_mul(&Vector3::new(across, across, along)) * -sphere
    }

    fn gravity_at(&self, radius: f64, (sine, cosine): (f64, f64)) -> [f64; 2] {
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

/// Effect of the air on the motion, and the bank angle about which its lift is turned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AirAcceleration {
    /// Lift L/m per mass, perpendicular to the velocity, m/s².
    pub lift: f64,
    /// Drag D/m per mass, against the velocity, m/s².
    pub drag: f64,
    /// Bank angle σ, rad.
    pub bank: f64,
}

impl AirAcceleration {
    /// Returns the specific force along the trajectory's axes: x along the velocity, y to the right
    /// in the horizontal plane, z down, m/s².
    pub fn specific_force(&self) -> Vector3<f64> {
        let (sine, cosine) = sin_cos(self.bank);
        Vector3::new(-self.drag, -self.lift * sine, -self.lift * cosine)
    }
}

/// Returns the time derivative of the motion under lift and drag.
pub fn derivative(planet: &Planet, state: &State, air: &AirAcceleration) -> State {
    derivative_under(planet, state, &air.specific_force())
}

/// Returns the time derivative of the motion under a specific force (m/s²) along the trajectory's
/// axes (Vinh, Busemann, Culp 1980, chapter 2, with −σ and J₂). It is not finite at a speed of
/// zero, in vertical flight and at the poles, where the angles have no meaning.
pub fn derivative_under(planet: &Planet, state: &State, force: &Vector3<f64>) -> State {
    let Motion { latitude, flight_path_angle, azimuth, .. } = Motion::from(*state);
    derivative_at(planet, state, &[flight_path_angle, azimuth, latitude].map(sin_cos), force)
}

/// Returns the time derivative of [`derivative_under`], given the sines and cosines of flight path
/// angle, azimuth and latitude.
pub(crate) fn derivative_at(
    planet: &Planet,
    state: &State,
    sines: &[(f64, f64); 3],
    force: &Vector3<f64>,
) -> State {
    let Motion { radius: r, speed: v, .. } = Motion::from(*state);
    let [(sin_path, cos_path), (sin_azimuth, cos_azimuth), (sin_latitude, cos_latitude)] = *sines;
    let [g, g_north] = planet.gravity_at(r, (sin_latitude, cos_latitude));
    // Of the rotation: the centrifugal acceleration at the equator, and twice the rate.
    let (centrifugal, coriolis) = (planet.rate * planet.rate * r, 2.0 * planet.rate);

    let speed_rate = force.x - g * sin_path
        + g_north * cos_path * cos_azimuth
        + centrifugal
            * cos_latitude
            * (sin_path * cos_latitude - cos_path * sin_latitude * cos_azimuth);
    let turn_up = -force.z + (v * v / r - g) * cos_path - g_north * sin_path * cos_azimuth
        + coriolis * v * cos_latitude * sin_azimuth
        + centrifugal
            * cos_latitude
            * (cos_path * cos_latitude + sin_path * cos_azimuth * sin_latitude);
    let turn_right = (force.y - g_north * sin_azimuth) / cos_path
        + v * v / r * cos_path * sin_azimuth * (sin_latitude / cos_latitude)
        - coriolis * v * (sin_path / cos_path * cos_azimuth * cos_latitude - sin_latitude)
        + centrifugal / cos_path * sin_azimuth * sin_latitude * cos_latitude;
    Motion {
        radius: v * sin_path,
        longitude: v * cos_path * sin_azimuth / (r * cos_latitude),
        latitude: v * cos_path * cos_azimuth / r,
        speed: speed_rate,
        flight_path_angle: turn_up / v,
        azimuth: turn_right / v,
    }
    .into()
}
