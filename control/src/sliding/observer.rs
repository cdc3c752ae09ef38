//! The disturbance observer of Wu 2015, (24): a robust exact differentiator of second order on the
//! sliding variable.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::axes::{Entry, NUMBERED_ANGLES};
use vehicle::math::cbrt;

/// Gains of the observer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Observer {
    /// Gain lambda of the disturbance observer.
    ///
    /// The gains λ₀, λ₁, λ₂ are γ₁, γ₂, γ₃ in Table 1.
    #[setting(each = LAMBDAS, above = 0.0)]
    pub lambda: [f64; 3],
    /// Gain L of the disturbance observer, a bound on the second derivative of the disturbance in
    /// rad/s4.
    ///
    /// The estimates can follow up to λ₂ L, and those of Table 1 need to.
    #[setting(name = "L", each = NUMBERED_ANGLES, above = 0.0)]
    pub l: [f64; 3],
}

/// Endings of the names of the gains λ, which are numbered from 0 as in the paper.
const LAMBDAS: [Entry; 3] = [("0", "of s"), ("1", "of its rate"), ("2", "of the disturbance")];

/// State of the observer: its three estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Estimate z₀ of s, rad/s.
    pub sliding: Vector3<f64>,
    /// Estimate z₁ of the lumped uncertainty Δv, rad/s².
    pub disturbance: Vector3<f64>,
    /// Estimate z₂ of the derivative of Δv, rad/s³.
    pub disturbance_rate: Vector3<f64>,
}

impl Observer {
    /// Returns the state (24) after `period` (s) by Euler's rule, with ṡ = `drive` + Δv,
    /// `drive` = v − b, and s = `sliding` at the beginning. A change of `drive` affects z₀ first,
    /// and z₁ one step later.
    pub fn advance(
        &self,
        estimate: &Estimate,
        sliding: &Vector3<f64>,
        drive: &Vector3<f64>,
        period: f64,
    ) -> Estimate {
        let [l0, l1, l2] = self.lambda;
        let mut next = *estimate;
        for i in 0..3 {
            let (z0, z1, z2) =
                (estimate.sliding[i], estimate.disturbance[i], estimate.disturbance_rate[i]);
            let l = self.l[i];
            let nu0 = z1 - l0 * cbrt(l) * super::power(z0 - sliding[i], 2.0 / 3.0);
            let nu1 = z2 - l1 * l.sqrt() * super::power(z1 - nu0, 0.5);
            next.sliding[i] += period * (drive[i] + nu0);
            next.disturbance[i] += period * nu1;
            next.disturbance_rate[i] -= period * l2 * l * super::sign(z2 - nu1);
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_estimates_become_exact_26() {
        let observer = Observer { lambda: [8.2, 4.1, 2.0], l: [0.005, 0.005, 0.01] };
        let period = 0.001;
        let uncertainty = |t: f64| Vector3::repeat(0.02 * (0.3 * t).sin());
        let drive = Vector3::new(0.1, -0.2, 0.3);
        let mut sliding = Vector3::zeros();
        let mut estimate = Estimate::default();
        for k in 0..20_000 {
            let t = f64::from(k) * period;
            if t > 10.0 {
                assert!((estimate.sliding - sliding).amax() < 1e-6, "{t}");
                assert!((estimate.disturbance - uncertainty(t)).amax() < 1e-4, "{t}");
                let rate = 0.006 * (0.3 * t).cos();
                assert!((estimate.disturbance_rate - Vector3::repeat(rate)).amax() < 1e-2, "{t}");
            }
            estimate = observer.advance(&estimate, &sliding, &drive, period);
            sliding += (drive + uncertainty(t)) * period;
        }
    }
}
