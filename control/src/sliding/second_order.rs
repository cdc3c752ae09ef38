//! The second-order reaching law of Wu 2015, (43).

use crate::error::DesignError;
use crate::sliding::Reaching;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use vehicle::axes::NUMBERED_ANGLES;
use vehicle::math::{powf, powi};

/// Signs of the second-order reaching law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum SecondOrderForm {
    /// Signs with which the sliding variables converge to zero.
    ///
    /// τ̇ = −k₃ sig^((m−2)/m)(s) − k₄ s, and sgn once, inside sig (44).
    #[default]
    Corrected,
    /// Opposite sign of the term with k3 and a second sgn, as printed in (43) and (45); the sliding
    /// variables do not converge.
    ///
    /// τ̇ = +k₃ sig^((m−2)/m)(s) sgn(s) − k₄ s, and the term of k₁ with a second sgn too, as (43)
    /// and (45) are printed: the powers are even functions of s, which does not come to rest
    /// at zero.
    Printed,
}

/// The reaching law ṡ = −k₁ sig^((m−1)/m)(s) − k₂ s + τ, τ̇ = −k₃ sig^((m−2)/m)(s) − k₄ s, with
/// sig^a(s) = |s|^a sgn(s).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct SecondOrder {
    /// Reaching gain k1.
    #[setting(name = "reaching.k1", each = NUMBERED_ANGLES, above = 0.0)]
    pub k1: [f64; 3],
    /// Reaching gain k2.
    #[setting(name = "reaching.k2", each = NUMBERED_ANGLES, unit = "1/s", above = 0.0)]
    pub k2: [f64; 3],
    /// Reaching gain k3.
    #[setting(name = "reaching.k3", each = NUMBERED_ANGLES, above = 0.0)]
    pub k3: [f64; 3],
    /// Reaching gain k4.
    #[setting(name = "reaching.k4", each = NUMBERED_ANGLES, unit = "1/s2", above = 0.0)]
    pub k4: [f64; 3],
    /// Exponent m of the reaching law.
    #[setting(name = "reaching.m", above = 2.0)]
    pub m: f64,
    #[allow(missing_docs)] // Its type says what it is.
    #[setting(name = "reaching.form")]
    pub form: SecondOrderForm,
}

impl SecondOrder {
    /// Returns the left-hand side of condition (46) for one axis (from 0). The proof of stability
    /// requires it to be positive.
    pub fn condition_46(&self, axis: usize) -> f64 {
        let Self { k1, k2, k3, k4, m, .. } = self;
        let (k1, k2, k3, k4) = (k1[axis], k2[axis], k3[axis], k4[axis]);
        m * m * k3 * k4
            - (powi(*m, 3) / (m - 1.0) * k3 + (4.0 * m * m - 4.0 * m + 1.0) * k1 * k1) * k2 * k2
    }

    /// Returns sig^a(s), (44), or sig^a(s) sgn(s) = |s|^a as it is printed in (43).
    fn power(&self, s: f64, a: f64) -> f64 {
        match self.form {
            SecondOrderForm::Corrected => super::power(s, a),
            SecondOrderForm::Printed => powf(s.abs(), a),
        }
    }
}

impl Reaching for SecondOrder {
    /// The integral state τ, rad/s².
    type Memory = Vector3<f64>;

    fn check(&self, period: f64) -> Result<(), DesignError> {
        for axis in 0..3 {
            let value = self.condition_46(axis);
            if value.is_nan() || value <= 0.0 {
                return Err(DesignError::Condition46 { index: axis + 1, value });
            }
        }
        super::sampled_decay("reaching.k2", self.k2.iter().copied().fold(0.0, f64::max), period)
    }

    fn sliding_rate(&self, tau: &Vector3<f64>, s: &Vector3<f64>) -> Vector3<f64> {
        let exponent = (self.m - 1.0) / self.m;
        Vector3::from_fn(|i, _| {
            tau[i] - self.k1[i] * self.power(s[i], exponent) - self.k2[i] * s[i]
        })
    }

    fn advance(&self, tau: &mut Vector3<f64>, s: &Vector3<f64>, period: f64) {
        let exponent = (self.m - 2.0) / self.m;
        let sign = match self.form {
            SecondOrderForm::Corrected => 1.0,
            SecondOrderForm::Printed => -1.0,
        };
        for i in 0..3 {
            let power = self.power(s[i], exponent);
            tau[i] -= period * (sign * self.k3[i] * power + self.k4[i] * s[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: SecondOrder = SecondOrder {
        form: SecondOrderForm::Corrected,
        k1: [0.1; 3],
        k2: [0.2; 3],
        k3: [0.1; 3],
        k4: [0.1; 3],
        m: 3.0,
    };

    /// Returns |s| after 60 s of the law from 0.1 rad/s.
    fn left(law: &SecondOrder) -> f64 {
        let (period, mut s, mut tau) = (0.001, Vector3::repeat(0.1), Vector3::zeros());
        for _ in 0..60_000 {
            let change = law.sliding_rate(&tau, &s);
            law.advance(&mut tau, &s, period);
            s += change * period;
        }
        s.amax()
    }

    #[test]
    fn published_gains_satisfy_condition_46() {
        assert!((LAW.condition_46(0) - 0.026).abs() < 1e-12, "{}", LAW.condition_46(0));
        LAW.check(0.01).unwrap();
    }

    #[test]
    fn published_sign_of_k3_does_not_converge() {
        let right = left(&LAW);
        assert!(right < 1e-4, "{right}");
        let printed = left(&SecondOrder { form: SecondOrderForm::Printed, ..LAW });
        assert!(printed > 0.5, "{printed}");
        // With the printed sign alone, and sgn once, s comes to rest away from zero.
        let period = 0.001;
        let (mut s, mut tau, mut least) = (0.1_f64, 0.0, f64::INFINITY);
        for k in 0..60_000 {
            let rate = -0.1 * crate::sliding::power(s, 2.0 / 3.0) - 0.2 * s + tau;
            tau += period * (0.1 * crate::sliding::power(s, 1.0 / 3.0) - 0.1 * s);
            s += rate * period;
            if k > 50_000 {
                least = least.min(s.abs());
            }
        }
        assert!(least > 0.5, "{least}");
    }
}
