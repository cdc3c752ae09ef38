//! Theorem 12: the second-order reaching law, with an exact estimate.

use super::sig;
use crate::prelude::*;
use control::sliding::{SecondOrderForm, Settings};
use proptest::prelude::*;

/// Gains of one axis with the matrices of (50).
pub(super) struct Axis {
    pub(super) law: SecondOrder,
    pub(super) axis: usize,
}

impl Axis {
    fn gains(&self) -> [f64; 5] {
        let (law, i) = (&self.law, self.axis);
        [law.k1[i], law.k2[i], law.k3[i], law.k4[i], law.m]
    }

    fn xi(&self, s: f64, tau: f64) -> Vector3<f64> {
        Vector3::new(sig(s, (self.law.m - 1.0) / self.law.m), s, tau)
    }

    /// Returns V₂ of this axis, (48).
    pub(super) fn v2(&self, s: f64, tau: f64) -> f64 {
        let [k1, k2, k3, k4, m] = self.gains();
        let rate = -k1 * sig(s, (m - 1.0) / m) - k2 * s + tau;
        rate * rate / 2.0
            + k3 * m / (m - 1.0) * s.abs().powf(2.0 * (m - 1.0) / m)
            + k4 * s * s
            + tau * tau / 2.0
    }

    fn lambda(&self) -> Matrix3<f64> {
        let [k1, k2, k3, k4, m] = self.gains();
        let first = 2.0 * m / (m - 1.0) * k3 + k1 * k1;
        let second = 2.0 * k4 + k2 * k2;
        Matrix3::new(first, k1 * k2, -k1, k1 * k2, second, -k2, -k1, -k2, 2.0) / 2.0
    }

    fn gamma_1(&self) -> Matrix3<f64> {
        let [k1, k2, k3, k4, m] = self.gains();
        let (first, second) = (m * k3 + (m - 1.0) * k1 * k1, m * k4 + (3.0 * m - 1.0) * k2 * k2);
        let (a, b) = (-(m - 1.0) * k1, -(2.0 * m - 1.0) * k2);
        Matrix3::new(first, 0.0, a, 0.0, second, b, a, b, m - 1.0) * (k1 / m)
    }

    fn gamma_2(&self) -> Matrix3<f64> {
        let [k1, k2, k3, k4, m] = self.gains();
        let first = k3 + (3.0 * m - 2.0) / m * k1 * k1;
        Matrix3::new(first, 0.0, 0.0, 0.0, k4 + k2 * k2, -k2, 0.0, -k2, 1.0) * k2
    }

    /// Returns ṡ and τ̇ of the implemented law.
    fn rates(&self, s: f64, tau: f64) -> (f64, f64) {
        let (s, tau) = (Vector3::repeat(s), Vector3::repeat(tau));
        let mut moved = Vector3::zeros();
        self.law.advance(&mut moved, &s, 1.0);
        (self.law.sliding_rate(&tau, &s)[self.axis], moved[self.axis])
    }

    /// Returns the derivative of V₂ along the implemented law, by a difference.
    fn v2_rate(&self, s: f64, tau: f64) -> f64 {
        let (s_rate, tau_rate) = self.rates(s, tau);
        let h = 1e-5 * s.abs() / (s_rate.abs() + tau_rate.abs());
        let at = |t: f64| self.v2(s + s_rate * t, tau + tau_rate * t);
        (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)
    }

    /// Returns the derivative of V₂ by (49) with `sign` before ξᵀ Γ₂ ξ.
    fn by_49(&self, s: f64, tau: f64, sign: f64) -> f64 {
        let xi = self.xi(s, tau);
        -s.abs().powf(-1.0 / self.law.m) * xi.dot(&(self.gamma_1() * xi))
            + sign * xi.dot(&(self.gamma_2() * xi))
    }

    /// Returns χ₁ and χ₂ of (53).
    pub(super) fn chi(&self) -> (f64, f64) {
        let smallest = |matrix: Matrix3<f64>| matrix.symmetric_eigenvalues().min();
        let largest = self.lambda().symmetric_eigenvalues().max();
        let power = smallest(self.lambda()).powf(1.0 / (2.0 * (self.law.m - 1.0)));
        (power * smallest(self.gamma_1()) / largest, smallest(self.gamma_2()) / largest)
    }
}

/// Returns the exponent of V₂ in (53).
pub(super) fn exponent_53(m: f64) -> f64 {
    (2.0 * m - 3.0) / (2.0 * m - 2.0)
}

/// Gains that condition (46) may or may not accept, one for each axis.
fn any_gains() -> impl Strategy<Value = SecondOrder> {
    let gain = || proptest::array::uniform3(0.05..0.6);
    (gain(), proptest::array::uniform3(0.01..0.3), gain(), gain(), 2.1..6.0).prop_map(
        |(k1, k2, k3, k4, m)| SecondOrder { form: SecondOrderForm::Corrected, k1, k2, k3, k4, m },
    )
}

/// Gains that are accepted.
fn gains() -> impl Strategy<Value = SecondOrder> {
    any_gains().prop_filter("(46)", |law| law.check(0.01).is_ok())
}

/// Sliding variables and states τ of the three axes.
fn states() -> impl Strategy<Value = [(f64, f64); 3]> {
    let size = prop_oneof![-0.5..-1e-3, 1e-3..0.5];
    proptest::array::uniform3((size, -0.3..0.3))
}

proptest! {
    #[test]
    fn oracle_condition_46_is_the_determinant_of_gamma_1(law in any_gains()) {
        for axis in 0..3 {
            let gamma = Axis { law, axis }.gamma_1();
            let expected = (law.k1[axis] / law.m).powi(3) * (law.m - 1.0) * law.condition_46(axis);
            let scale = gamma.norm().powi(3);
            prop_assert!((gamma.determinant() - expected).abs() < 2e-16 * scale);
            // Its other two minors are positive, so (46) decides whether Γ₁ is positive definite.
            prop_assert_eq!(gamma.cholesky().is_some(), law.condition_46(axis) > 0.0);
            let of_the_rest = Axis { law, axis }.gamma_2();
            prop_assert!(of_the_rest.cholesky().is_some());
        }
    }

    #[test]
    fn oracle_v2_lies_between_the_bounds_of_51(law in gains(), states in states()) {
        for (axis, (s, tau)) in states.into_iter().enumerate() {
            let axis_law = Axis { law, axis };
            let (xi, eigenvalues) = (axis_law.xi(s, tau), axis_law.lambda().symmetric_eigenvalues());
            let v2 = axis_law.v2(s, tau);
            prop_assert!((xi.dot(&(axis_law.lambda() * xi)) / v2 - 1.0).abs() < 1.5e-15);
            prop_assert!(eigenvalues.min() > 0.0);
            prop_assert!(v2 >= eigenvalues.min() * xi.norm_squared() * (1.0 - 1e-13));
            prop_assert!(v2 <= eigenvalues.max() * xi.norm_squared() * (1.0 + 1e-13));
            // (52)
            let bound = (v2 / eigenvalues.min()).powf(0.5 / (law.m - 1.0));
            prop_assert!(s.abs().powf(1.0 / law.m) <= bound * (1.0 + 1e-13));
        }
    }

    #[test]
    fn published_49_has_the_wrong_sign_before_gamma_2(law in gains(), states in states()) {
        for (axis, (s, tau)) in states.into_iter().enumerate() {
            let axis_law = Axis { law, axis };
            let (rate, right, printed) = (axis_law.v2_rate(s, tau), axis_law.by_49(s, tau, -1.0), axis_law.by_49(s, tau, 1.0));
            prop_assert!((rate - right).abs() < 2e-8 * right.abs(), "{rate} {right}");
            let xi = axis_law.xi(s, tau);
            prop_assert!(printed - rate > 1.999 * xi.dot(&(axis_law.gamma_2() * xi)));
        }
    }

    #[test]
    fn oracle_v2_decreases_as_54_says_with_the_least_chi(
        law in gains(),
        states in states(),
        off in prop_oneof![Just(vec![0]), Just(vec![1, 2]), Just(vec![0, 1, 2])],
    ) {
        let axes = [0, 1, 2].map(|axis| Axis { law, axis });
        let chi = [0, 1, 2].map(|i| axes[i].chi());
        let least = |value: fn(&(f64, f64)) -> f64| chi.iter().map(value).fold(f64::INFINITY, f64::min);
        let (chi_1, chi_2) = (least(|chi| chi.0), least(|chi| chi.1));
        prop_assert!(chi_1 > 0.0 && chi_2 > 0.0);
        // The other axes are at rest.
        let sum = |value: &dyn Fn(&Axis, f64, f64) -> f64| -> f64 {
            off.iter().map(|&i: &usize| value(&axes[i], states[i].0, states[i].1)).sum()
        };
        let (v2, rate) = (sum(&Axis::v2), sum(&Axis::v2_rate));
        // (55), for which Lemma 9 puts the power of the sum in place of the sum of powers.
        prop_assert!(rate + chi_1 * v2.powf(exponent_53(law.m)) + chi_2 * v2 <= 0.0);
    }
}

#[test]
fn published_54_with_the_greatest_chi_is_violated() {
    // The third axis is slow, and only it is off its surface.
    let published = Settings::sotvsmc_do().reaching;
    let law = SecondOrder {
        k1: [0.4, 0.4, 0.05],
        k2: [0.3, 0.3, 0.02],
        k3: [0.5, 0.5, 0.1],
        k4: [0.5, 0.5, 0.1],
        ..published
    };
    law.check(0.01).unwrap();
    let axes = [0, 1, 2].map(|axis| Axis { law, axis });
    let (s, tau) = (0.02, 0.15);
    let (v2, rate) = (axes[2].v2(s, tau), axes[2].v2_rate(s, tau));
    let sum = |pick: fn(f64, f64) -> f64| {
        let [one, _, three] = [0, 1, 2].map(|i| axes[i].chi());
        let (chi_1, chi_2) = (pick(one.0, three.0), pick(one.1, three.1));
        rate + chi_1 * v2.powf(exponent_53(law.m)) + chi_2 * v2
    };
    assert!(sum(f64::min) < 0.0, "(55) with the minimum");
    assert!(sum(f64::max) > 0.0, "(55) with the maximum");
}

#[test]
fn published_near_the_surface_the_powers_converge_faster_and_far_from_it_the_linear_terms() {
    // Remark 11. Both terms of ṡ are equal at |s| = (k₁/k₂)^m, those of τ̇ at (k₃/k₄)^(m/2).
    let law = Settings::sotvsmc_do().reaching;
    let none = [0.0; 3];
    let powers = SecondOrder { k2: none, k4: none, ..law };
    let linear = SecondOrder { k1: none, k3: none, ..law };
    let m = law.m;
    for axis in 0..3 {
        let edges =
            [(law.k1[axis] / law.k2[axis]).powf(m), (law.k3[axis] / law.k4[axis]).powf(m / 2.0)];
        for s in [1e-6, 1e-3, 0.1, 10.0, 1e3] {
            let [by_powers, by_linear] =
                [powers, linear].map(|law| Axis { law, axis }.rates(s, 0.0));
            let ratios = [by_powers.0 / by_linear.0, by_powers.1 / by_linear.1];
            for ((ratio, edge), power) in ratios.into_iter().zip(edges).zip([1.0 / m, 2.0 / m]) {
                let expected = (edge / s).powf(power);
                assert!((ratio / expected - 1.0).abs() < 1e-12, "{s}: {ratio} {expected}");
                assert_eq!(ratio > 1.0, s < edge);
            }
        }
    }
}
