//! Strapdown: position, velocity and attitude from the samples of gyroscope and accelerometer.
//! D. Titterton, J. Weston, "Strapdown Inertial Navigation Technology" (2004), chapter 11.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use vehicle::frames::{Place, fixed_from_inertial};
use vehicle::translation::Planet;

/// Position, velocity and attitude in inertial axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Position, m.
    pub position: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Rotation from the body axes to the inertial ones.
    pub attitude: UnitQuaternion<f64>,
}

/// Corrected readings of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Felt {
    /// Angular rate, rad/s.
    pub(super) rate: Vector3<f64>,
    /// Specific force, m/s².
    pub(super) force: Vector3<f64>,
}

impl State {
    /// Returns the state at a place of the rotating planet at `time` (s).
    pub fn at(planet: &Planet, place: &Place, time: f64) -> Self {
        let to_inertial = fixed_from_inertial(planet, time).transpose();
        let position = to_inertial * place.position;
        Self {
            position,
            velocity: to_inertial * place.velocity + rotation(planet).cross(&position),
            attitude: place.attitude.inverse(),
        }
    }

    /// Returns the place of the rotating planet at `time` (s).
    pub fn place(&self, planet: &Planet, time: f64) -> Place {
        let to_fixed = fixed_from_inertial(planet, time);
        Place {
            position: to_fixed * self.position,
            velocity: to_fixed * self.over_ground(planet),
            attitude: self.attitude.inverse(),
        }
    }

    /// Returns the velocity relative to the planet, along the inertial axes, m/s.
    pub fn over_ground(&self, planet: &Planet) -> Vector3<f64> {
        self.velocity - rotation(planet).cross(&self.position)
    }

    /// Returns the state after `elapsed` (s), in which the readings change linearly, and the change
    /// of the velocity by the specific force (m/s). The rotation vector of a linear rate has the
    /// coning term (T²/12) ω₀ × ω₁.
    pub(super) fn after(
        &self,
        planet: &Planet,
        elapsed: f64,
        from: &Felt,
        to: &Felt,
    ) -> (Self, Vector3<f64>) {
        let turned = (from.rate + to.rate) * (elapsed / 2.0)
            + from.rate.cross(&to.rate) * (elapsed * elapsed / 12.0);
        let attitude = self.attitude * UnitQuaternion::from_scaled_axis(turned);
        let pushed = (self.attitude * from.force + attitude * to.force) * (elapsed / 2.0);
        let middle = self.position + self.velocity * (elapsed / 2.0);
        let change = pushed + planet.gravity_vector(&middle) * elapsed;
        let position = self.position + (self.velocity + change / 2.0) * elapsed;
        // Rounding would make the quaternion longer or shorter in the course of a flight.
        let attitude = UnitQuaternion::new_normalize(attitude.into_inner());
        (Self { position, velocity: self.velocity + change, attitude }, pushed)
    }
}

/// Returns the angular rate of the planet, rad/s.
pub(super) fn rotation(planet: &Planet) -> Vector3<f64> {
    Vector3::new(0.0, 0.0, planet.rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle::integrator::rk4;
    use vehicle::math::{cos, sin};

    /// A body whose rate moves on a cone turns about the axis of the cone although its rate has no
    /// part along it: Goodman and Robinson (1958).
    #[test]
    fn oracle_coning_turns_the_attitude() {
        let (rate, half) = (4.0_f64, 0.02_f64);
        let felt = |time: f64| Felt {
            rate: Vector3::new(
                -rate * half * sin(rate * time),
                rate * half * cos(rate * time),
                0.0,
            ),
            force: Vector3::zeros(),
        };
        let planet = Planet { gravitation: 0.0, rate: 0.0, ..Planet::EARTH };
        let start = State { position: Vector3::new(7e6, 0.0, 0.0), ..State::default() };
        let (mut state, period) = (start, 0.04);
        for k in 0..2500 {
            let (from, to) = (f64::from(k) * period, f64::from(k + 1) * period);
            (state, _) = state.after(&planet, period, &felt(from), &felt(to));
        }
        // The body turns by half the solid angle rate a second, as an integration shows.
        let mut f = |time: f64, q: &nalgebra::Vector4<f64>| {
            let rate = felt(time).rate;
            let q = nalgebra::Quaternion::from(*q);
            (q * nalgebra::Quaternion::from_parts(0.0, rate) * 0.5).coords
        };
        let mut exact = UnitQuaternion::identity().into_inner().coords;
        for k in 0..100_000 {
            exact = rk4(&mut f, f64::from(k) * 1e-3, &exact, 1e-3);
        }
        let exact = UnitQuaternion::new_normalize(nalgebra::Quaternion::from(exact));
        assert!(exact.angle() > 0.05, "{}", exact.angle());
        // Without the coning term all of it would be missing.
        let error = state.attitude.angle_to(&exact) / exact.angle();
        assert!(error < 6e-3, "{error}");
    }

    #[test]
    fn oracle_a_state_comes_back_from_its_place() {
        let planet = Planet::EARTH;
        let state = State {
            position: Vector3::new(5e6, -3e6, 2e6),
            velocity: Vector3::new(1e3, 6e3, -2e3),
            attitude: UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.0, 0.5)),
        };
        let back = State::at(&planet, &state.place(&planet, 900.0), 900.0);
        assert!((back.position - state.position).norm() < 1e-8);
        assert!((back.velocity - state.velocity).norm() < 1e-11);
    }
}
