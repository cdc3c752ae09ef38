//! The time-varying sliding surface of Wu 2015, (17) and (18).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::NUMBERED_ANGLES;
use vehicle::math::exp;

/// Gains of the surface s = ė + c e + a exp(−λ(t − t₀)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Surface {
    /// Gain c of the sliding surface, diagonal.
    #[setting(each = NUMBERED_ANGLES, unit = "1/s", above = 0.0)]
    pub c: [f64; 3],
    /// Rate lambda at which the offset of the sliding surface decays.
    #[setting(unit = "1/s", above = 0.0)]
    pub lambda: f64,
}

/// Tracking error e = Θ − Θ_r (rad) and its derivative ė (rad/s).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackingError {
    /// Angle error e, rad.
    pub angles: Vector3<f64>,
    /// Rate error ė, rad/s.
    pub rates: Vector3<f64>,
}

/// Time and offset at which the surface was placed through the state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// Time t₀ of the placement, s.
    pub time: f64,
    /// Offset a of the surface at t₀, rad/s.
    pub a: Vector3<f64>,
}

impl Surface {
    /// Returns the surface through the state at `time` (s): a = −ė − c e, (18).
    pub fn anchor(&self, time: f64, error: &TrackingError) -> Anchor {
        Anchor { time, a: -error.rates - self.c().component_mul(&error.angles) }
    }

    /// Returns the sliding variable s at `time`, (17), rad/s.
    pub fn sliding(&self, anchor: &Anchor, time: f64, error: &TrackingError) -> Vector3<f64> {
        error.rates + self.c().component_mul(&error.angles) + anchor.a * self.decay(anchor, time)
    }

    /// Returns b = Θ̈_r − c ė + λ a exp(−λ(t − t₀)), (22), rad/s². Without uncertainty, v = b keeps
    /// s constant.
    pub fn equivalent(
        &self,
        anchor: &Anchor,
        time: f64,
        error: &TrackingError,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        acceleration - self.c().component_mul(&error.rates)
            + anchor.a * (self.lambda * self.decay(anchor, time))
    }

    fn c(&self) -> Vector3<f64> {
        Vector3::from(self.c)
    }

    fn decay(&self, anchor: &Anchor, time: f64) -> f64 {
        exp(-self.lambda * (time - anchor.time))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_error_on_the_surface_is_21() {
        // For c = λ, e = (1 + c t) exp(−c t) e(0) from rest.
        let surface = Surface { c: [2.0; 3], lambda: 2.0 };
        let start = Vector3::new(0.1, -0.2, 0.3);
        let anchor = surface.anchor(0.0, &TrackingError { angles: start, rates: Vector3::zeros() });
        for k in 0..50 {
            let t = f64::from(k) * 0.1;
            let decay = (-2.0 * t).exp();
            let error = TrackingError {
                angles: start * ((1.0 + 2.0 * t) * decay),
                rates: start * (-4.0 * t * decay),
            };
            assert!(surface.sliding(&anchor, t, &error).norm() < 1e-15, "t = {t}");
            // The second derivative ë along (21) equals b.
            let second = start * ((8.0 * t - 4.0) * decay);
            assert!(
                (surface.equivalent(&anchor, t, &error, &Vector3::zeros()) - second).norm() < 1e-14
            );
        }
    }
}
