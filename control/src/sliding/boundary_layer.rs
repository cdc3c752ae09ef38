//! Reaching laws that are continuous within a boundary layer: (34) of Wu 2015, and the finite-time
//! law (7) of Jia et al.

use crate::error::DesignError;
use crate::sliding::Reaching;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::NUMBERED_ANGLES;
use vehicle::math::{exp2, powf};

/// Returns sat(s) of Wu 2015, (35): s/h within the layer |s| ≤ h, sgn(s) outside.
pub fn saturated(s: f64, h: f64) -> f64 {
    (s / h).clamp(-1.0, 1.0)
}

/// The reaching law ṡ = −η sat(s) of Wu 2015, (34) and (35). The finite time that (42) promises
/// holds up to the layer only; within, s decays as exp(−η t/h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct BoundaryLayer {
    /// Reaching gain eta, diagonal.
    #[setting(name = "reaching.eta", each = NUMBERED_ANGLES, unit = "rad/s2", above = 0.0)]
    pub eta: [f64; 3],
    /// Thickness h of the boundary layer.
    #[setting(name = "boundaryLayer.h", each = NUMBERED_ANGLES, unit = "rad/s", above = 0.0)]
    pub h: [f64; 3],
}

impl Reaching for BoundaryLayer {
    type Memory = ();

    fn check(&self, period: f64) -> Result<(), DesignError> {
        let steepest = self.eta.iter().zip(&self.h).map(|(eta, h)| eta / h).fold(0.0, f64::max);
        super::sampled_decay("reaching.eta / boundaryLayer.h", steepest, period)
    }

    fn sliding_rate(&self, (): &(), s: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| -self.eta[i] * saturated(s[i], self.h[i]))
    }

    fn advance(&self, (): &mut (), _s: &Vector3<f64>, _period: f64) {}
}

/// The continuous finite-time replacement of ρ SIGN(s) by Jia et al., (7): ρ f(|s/ε|) SAT(s/ε) with
/// f = 2^(−(b+1)/2) |s/ε|^b.
///
/// The thickness has the unit of the sliding variable, and the gain that of its rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct FiniteTimeLayer {
    /// Reaching gain rho.
    #[setting(part, rate, above = 0.0)]
    pub rho: [f64; 3],
    /// Thickness epsilon of the boundary layer.
    #[setting(part, above = 0.0)]
    pub epsilon: [f64; 3],
    /// Exponent b of the finite-time factor.
    #[setting(part, unit = "1", above = 0.0, below = 1.0)]
    pub b: [f64; 3],
}

impl FiniteTimeLayer {
    /// Returns ρ f SAT of each component of s.
    pub fn value(&self, s: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let (factor, x, b) = self.scaled(i, s[i]);
            factor * powf(x.abs(), b) * saturated(x, 1.0)
        })
    }

    /// Returns the derivative of the value by s; inside the layer it is the one at |s| = ε.
    pub fn slope(&self, s: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let (factor, x, b) = self.scaled(i, s[i]);
            let x = x.abs();
            let slope = if x <= 1.0 { (b + 1.0) * powf(x, b) } else { b * powf(x, b - 1.0) };
            factor * slope / self.epsilon[i]
        })
    }

    /// Returns the largest slope of any axis, which occurs at the edge of the layer, 1/s.
    pub(crate) fn steepest(&self) -> f64 {
        self.slope(&Vector3::from(self.epsilon)).max()
    }

    /// Returns f = 2^(−(b+1)/2) of one axis (from 0) at the edge |s| = ε of the layer.
    pub(crate) fn edge_factor(&self, axis: usize) -> f64 {
        exp2(-(self.b[axis] + 1.0) / 2.0)
    }

    /// Returns ρ 2^(−(b+1)/2), s/ε and b of one axis.
    fn scaled(&self, i: usize, s: f64) -> (f64, f64, f64) {
        (self.rho[i] * self.edge_factor(i), s / self.epsilon[i], self.b[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYER: FiniteTimeLayer =
        FiniteTimeLayer { rho: [0.8, 0.5, 1.0], epsilon: [0.02, 0.01, 1.0], b: [0.5, 0.3, 0.9] };

    #[test]
    fn oracle_slope_against_differences() {
        for s in [-0.5, -0.015, -0.003, 0.0004, 0.007, 0.03, 2.0] {
            let s = Vector3::repeat(s);
            let step = Vector3::repeat(1e-7 * s.amax());
            let difference =
                (LAYER.value(&(s + step)) - LAYER.value(&(s - step))).component_div(&(2.0 * step));
            assert!((difference - LAYER.slope(&s)).amax() < 1e-6 * LAYER.slope(&s).amax(), "{s}");
        }
    }

    #[test]
    fn oracle_layer_is_odd_continuous_and_at_its_edge_below_rho() {
        let edge = Vector3::from(LAYER.epsilon);
        let value = LAYER.value(&edge);
        assert!((value - LAYER.value(&(edge * (1.0 + 1e-12)))).amax() < 1e-11);
        assert_eq!(LAYER.value(&-edge), -value);
        for i in 0..3 {
            assert!(
                (value[i] - LAYER.rho[i] * 2f64.powf(-f64::midpoint(LAYER.b[i], 1.0))).abs()
                    < 1e-15
            );
        }
    }

    #[test]
    fn oracle_outside_the_layer_the_reaching_time_is_finite() {
        // The solution of ds/dt = −k s^b reaches ε from s₀ after (s₀^(1−b) − ε^(1−b))/(k (1−b)).
        let (mut s, step) = (Vector3::repeat(0.3), 1e-5);
        let (rho, epsilon, b) = (0.8, 0.02_f64, 0.5);
        let k = rho * 2f64.powf(-0.75) / epsilon.powf(b);
        let expected = (0.3_f64.sqrt() - epsilon.sqrt()) / (k * 0.5);
        let mut time = 0.0;
        while s.x > epsilon {
            s -= LAYER.value(&s) * step;
            time += step;
        }
        assert!((time - expected).abs() < 1e-3 * expected, "{time} {expected}");
    }
}
