//! Trajectory of the vehicle: the direction of flight, and how it turns, as in Wu 2015 (1).

use crate::math::sin_cos;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Direction of flight and its change: the angles and rates of the trajectory in Wu 2015 (1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Trajectory {
    /// Flight path angle, positive above the horizon.
    ///
    /// It is γ in the paper.
    #[setting(unit = "rad", nominal = 0.1)]
    pub flight_path_angle: f64,
    /// Heading of the velocity, measured from north towards east.
    ///
    /// It is ψ in the paper.
    #[setting(unit = "rad", nominal = 0.1)]
    pub heading: f64,
    /// Latitude, positive to the north.
    ///
    /// It is φ in the paper.
    #[setting(unit = "rad", nominal = 0.1)]
    pub latitude: f64,
    /// Time derivative of the flight path angle.
    #[setting(unit = "rad/s", nominal = 1e-3)]
    pub flight_path_angle_rate: f64,
    /// Time derivative of the heading.
    #[setting(unit = "rad/s", nominal = 1e-3)]
    pub heading_rate: f64,
    /// Time derivative of the longitude, positive to the east.
    ///
    /// The longitude is θ in the paper.
    #[setting(unit = "rad/s", nominal = 1e-3)]
    pub longitude_rate: f64,
    /// Time derivative of the latitude.
    #[setting(unit = "rad/s", nominal = 1e-3)]
    pub latitude_rate: f64,
}

impl Trajectory {
    /// Returns all values in the order of the fields.
    pub fn values(&self) -> [f64; 7] {
        [
            self.flight_path_angle,
            self.heading,
            self.latitude,
            self.flight_path_angle_rate,
            self.heading_rate,
            self.longitude_rate,
            self.latitude_rate,
        ]
    }

    /// Angular velocity (rad/s) of the trajectory's axes relative to inertial space, about these
    /// axes: x along the velocity, y to the right in the horizontal plane, z down. `earth_rate` is
    /// the angular rate of the Earth, rad/s. The sign of sin φ sin γ in the bank row corrects Wu
    /// 2015 (1), which prints −.
    pub fn turn_rate(&self, earth_rate: f64) -> Vector3<f64> {
        let around = self.longitude_rate + earth_rate;
        let (climb, turn, north) =
            (self.flight_path_angle_rate, self.heading_rate, self.latitude_rate);
        if [around, climb, turn, north] == [0.0; 4] {
            return Vector3::zeros();
        }
        self.turn_rate_at(around, &self.sines())
    }

    /// Sines and cosines of flight path angle, heading and latitude.
    pub(crate) fn sines(&self) -> [(f64, f64); 3] {
        [self.flight_path_angle, self.heading, self.latitude].map(sin_cos)
    }

    /// Turn rate with the sum `around` of the rates of longitude and Earth, rad/s.
    pub(crate) fn turn_rate_at(&self, around: f64, sines: &[(f64, f64); 3]) -> Vector3<f64> {
        let (climb, turn, north) =
            (self.flight_path_angle_rate, self.heading_rate, self.latitude_rate);
        let [(sg, cg), (sp, cp), (sl, cl)] = *sines;
        Vector3::new(
            -turn * sg - north * sp * cg + around * (cl * cp * cg + sl * sg),
            climb - north * cp - around * cl * sp,
            turn * cg - north * sp * sg + around * (cl * cp * sg - sl * cg),
        )
    }
}
