//! The theory of Wu 2015 in numbers: its lemmas and theorems with the implemented laws put into
//! them, and the misprints that show where its bounds do not hold. A bound on a random draw is at
//! most twice the largest value of ten thousand draws.

use control::sliding::{
    BoundaryLayer, Estimate, Memory, Observer, Reaching, SecondOrder, SecondOrderForm, Settings,
    Surface, TrackingError, Tvsmc,
};
use control::{Controller, Measurement};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use vehicle::Scenario;
use vehicle::dynamics::RigidBody;
use vehicle::kinematics::{Kinematics, r, r_dot, r_inverse};
use vehicle::plant::{self, Load, Plant};

/// Returns |x|^a sgn(x).
fn sig(x: f64, a: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.abs().powf(a) * x.signum() }
}

/// Integrates `f` from `from` to `to` by Simpson's rule.
fn simpson(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const HALVES: u32 = 4000;
    let h = (to - from) / f64::from(2 * HALVES);
    let at = |k: u32| f(from + f64::from(k) * h);
    let middles: f64 = (0..HALVES).map(|k| at(2 * k + 1)).sum();
    let inner: f64 = (1..HALVES).map(|k| at(2 * k)).sum();
    h / 3.0 * (at(0) + 4.0 * middles + 2.0 * inner + at(2 * HALVES))
}

// (3), (12) and (13): the dynamics with their uncertainties.

/// Returns F of (13), as it is printed or as the dynamics require.
fn f_of_13(angles: &Vector3<f64>, rates: &Vector3<f64>, printed: bool) -> Matrix3<f64> {
    let ((sa, ca), (sb, cb)) = (angles.x.sin_cos(), angles.y.sin_cos());
    let (p, q, r) = (rates.x, rates.y, rates.z);
    let sec2 = 1.0 / (cb * cb);
    let right = Matrix3::new(
        (p * sa - r * ca) * sb / cb,
        -(p * ca + r * sa) * sec2,
        0.0,
        p * ca + r * sa,
        0.0,
        0.0,
        (p * sa - r * ca) * cb,
        (p * ca + r * sa) * sb - q * cb,
        0.0,
    );
    if !printed {
        return right;
    }
    let mut misprint = Matrix3::identity();
    misprint[(1, 0)] = r * (ca - sa);
    right + misprint
}

/// Returns Θ̈ of (3) by a difference along the motion, with Δf = a sin(w t) and Δd constant.
fn differenced_acceleration(
    body: &RigidBody,
    [angles, rates, moment, delta_d]: [Vector3<f64>; 4],
    delta_f: impl Fn(f64) -> Vector3<f64>,
) -> Vector3<f64> {
    let angle_rates =
        |angles: &Vector3<f64>, rates: &Vector3<f64>, t: f64| r(angles) * rates + delta_f(t);
    let (now, acceleration) =
        (angle_rates(&angles, &rates, 0.0), body.angular_acceleration(&rates, &moment) + delta_d);
    let h = 1e-5;
    let at = |t: f64| angle_rates(&(angles + now * t), &(rates + acceleration * t), t);
    (at(h) - at(-h)) / (2.0 * h)
}

proptest! {
    #[test]
    fn oracle_12_and_13_against_differences_of_the_dynamics(
        angles in (-1.0..1.0, -1.2..1.2, -3.0..3.0),
        rates in proptest::array::uniform3(-0.5..0.5),
        moment in proptest::array::uniform3(-1e5..1e5),
        delta_d in proptest::array::uniform3(-0.1..0.1),
        amplitude in proptest::array::uniform3(0.01..0.1),
        phase in 0.2..1.3,
    ) {
        let body = Scenario::tvsmc2015().inertia.body(1.0).unwrap();
        let angles = Vector3::new(angles.0, angles.1, angles.2);
        let [rates, moment, delta_d, amplitude] =
            [rates, moment, delta_d, amplitude].map(Vector3::from);
        let delta_f = |t: f64| amplitude * f64::sin(phase + 2.0 * t);
        let delta_f_dot = amplitude * (2.0 * f64::cos(phase));
        let acceleration = differenced_acceleration(&body, [angles, rates, moment, delta_d], delta_f);
        let matrix = r(&angles);
        let modelled = matrix * body.inverse * moment + body.drift(&angles, &(matrix * rates));
        let f = f_of_13(&angles, &rates, false) * delta_f(0.0);
        let scale = 1.0 / angles.y.cos().powi(3);
        let right = modelled + matrix * delta_d + f + delta_f_dot;
        prop_assert!((acceleration - right).amax() < 5e-11 * scale, "{}", acceleration - right);
        // Each of the three misprints by itself makes the sum wrong: Δd, which (8) has already
        // divided by the inertia, is divided again, the derivative of Δf is missing, and F is wrong
        // in four entries.
        let divided = modelled + matrix * body.inverse * delta_d + f + delta_f_dot;
        let without = modelled + matrix * delta_d + f;
        let other = modelled + matrix * delta_d + f_of_13(&angles, &rates, true) * delta_f(0.0) + delta_f_dot;
        let off = |sum: Vector3<f64>| (acceleration - sum).norm();
        prop_assert!(off(divided) > 0.999 * (matrix * delta_d).norm() - 5e-11 * scale);
        prop_assert!(off(without) > 0.999 * delta_f_dot.norm());
        // Of F, (1,1), (2,2) and (3,3) carry a 1 too many, which in α and σ adds Δf itself.
        prop_assert!((other - acceleration).x > 0.999 * delta_f(0.0).x && (other - acceleration).z > 0.999 * delta_f(0.0).z);
    }

    // Lemma 2: the motion on the surface s = 0.

    #[test]
    fn oracle_error_on_the_surface_from_any_state(
        c in 0.5..4.0,
        other in prop_oneof![0.4..0.9, 1.1..2.5],
        start in (-0.2..0.2, -0.2..0.2),
        t in 0.0..5.0,
    ) {
        // The general solution of (19); (20) is its special case ė(0) = 0.
        let (lambda, (e0, rate0)): (f64, (f64, f64)) = (c * other, start);
        let surface = Surface { c: [c; 3], lambda };
        let error = |t: f64| {
            let (slow, fast) = ((rate0 + c * e0) / (c - lambda), (rate0 + lambda * e0) / (c - lambda));
            let (a, b) = (slow * (-lambda * t).exp(), fast * (-c * t).exp());
            [a - b, -lambda * a + c * b, lambda * lambda * a - c * c * b].map(Vector3::repeat)
        };
        let at = |t: f64| {
            let [angles, rates, _] = error(t);
            TrackingError { angles, rates }
        };
        let anchor = surface.anchor(0.0, &at(0.0));
        let size = (e0.abs() + rate0.abs()) / (c - lambda).abs();
        prop_assert!((at(0.0).angles.x - e0).abs() < 3e-15 * size);
        prop_assert!(surface.sliding(&anchor, t, &at(t)).amax() < 8e-15 * size);
        let b = surface.equivalent(&anchor, t, &at(t), &Vector3::zeros());
        prop_assert!((b - error(t)[2]).amax() < 5e-14 * size);
    }

    #[test]
    fn published_bound_20_is_too_small(
        c in 0.5..4.0,
        other in prop_oneof![0.4..0.9, 1.1..2.5],
        t in 0.01..20.0,
    ) {
        // |e(t)| over |e(0)| exp(−ςt) exceeds the printed 1 at once, tends to max(c, λ)/|c − λ| and
        // stays below (c + λ)/|c − λ|.
        let lambda = c * other;
        let ratio = ratio_to_20(c, lambda, t);
        prop_assert!(ratio > 1.0);
        let limit = f64::max(c, lambda) / (c - lambda).abs();
        prop_assert!(ratio <= limit * (1.0 + 1e-12) && limit < (c + lambda) / (c - lambda).abs());
        prop_assert!(ratio_to_20(c, lambda, 30.0 / (c - lambda).abs()) > limit * (1.0 - 1e-9));
    }

    // Lemmas 7, 8 and 9.

    #[test]
    fn oracle_settling_times_of_lemmas_7_and_8(
        k in 0.05..5.0,
        l in 0.05..5.0,
        alpha in 0.1..0.9,
        v0 in 0.01..10.0,
    ) {
        let beta = 1.0 - alpha;
        let bound_32 = |below: f64| f64::ln_1p(l / k * f64::powf(v0, beta)) / (below * beta);
        prop_assert!((settling_time(k, l, alpha, v0) / bound_32(l) - 1.0).abs() < 1e-9);
        prop_assert!((settling_time(k, 0.0, alpha, v0) / (f64::powf(v0, beta) / (k * beta)) - 1.0).abs() < 2.7e-11);
        // With k in the denominator the print is too small wherever k exceeds l.
        prop_assert_eq!(settling_time(k, l, alpha, v0) > bound_32(k), k > l);
    }

    #[test]
    fn oracle_lemma_9_with_the_exponent_of_55(
        v in proptest::collection::vec(1e-6..10.0, 1..6),
        m in 2.01..20.0,
    ) {
        let p = (2.0 * m - 3.0) / (2.0 * m - 2.0);
        let sum = |p: f64| v.iter().map(|v| f64::powf(*v, p)).sum::<f64>();
        prop_assert!(sum(1.0).powf(p) <= sum(p) * (1.0 + 1e-14));
        // The exponent must not exceed 1.
        prop_assert!(v.len() < 2 || sum(1.0).powf(2.0 - p) > sum(2.0 - p));
    }
}

/// Returns |e(t)| of (20) over its printed bound |e(0)| exp(−min(c, λ) t).
fn ratio_to_20(c: f64, lambda: f64, t: f64) -> f64 {
    let decay = c.min(lambda);
    let part = |rate: f64| ((decay - rate) * t).exp();
    ((c * part(lambda) - lambda * part(c)) / (c - lambda)).abs()
}

#[test]
fn published_bound_20_by_an_example() {
    assert!((ratio_to_20(2.0, 1.0, 5.0) - 1.99).abs() < 0.005);
    // Table 1 has c = λ, where (21) holds: (1 + c t) exp(−c t) is below no multiple of exp(−c t),
    // but below c/(c − d) exp(−d/c) exp(−d t) for each d < c, which it touches.
    let c = 2.0;
    for d in [0.5, 1.0, 1.9] {
        let over = |t: f64| (1.0 + c * t) * (-(c - d) * t).exp();
        let bound = c / (c - d) * f64::exp(-d / c);
        assert!((0..10_000_u32).all(|k| over(f64::from(k) * 1e-2) <= bound));
        assert!((over(d / (c * (c - d))) / bound - 1.0).abs() < 1e-14);
    }
}

/// Returns the time in which V' = −k V^α − l V leads from `v0` to 0, by a quadrature over ln V.
fn settling_time(k: f64, l: f64, alpha: f64, v0: f64) -> f64 {
    let beta = 1.0 - alpha;
    let time = |y: f64| 1.0 / (k * (-beta * y).exp() + l);
    simpson(time, v0.ln() - 25.0 / beta, v0.ln())
}

#[test]
fn published_settling_time_32_is_wrong_by_an_example() {
    let (k, l, alpha, v0) = (2.0, 0.5, 0.5, 3.0);
    assert!((settling_time(k, l, alpha, v0) - 1.439).abs() < 5e-4);
    let printed = f64::ln_1p(l / k * v0.sqrt()) / (k * (1.0 - alpha));
    assert!((printed - 0.360).abs() < 5e-4);
}

// Theorem 10: the boundary layer, with an exact estimate.

/// Returns V₁ = s·s/2, (37).
fn v1(s: &Vector3<f64>) -> f64 {
    s.norm_squared() / 2.0
}

proptest! {
    #[test]
    fn published_finite_time_42_does_not_hold_inside_the_layer(
        eta in proptest::array::uniform3(0.05..0.5),
        h in proptest::array::uniform3(0.01..0.05),
        start in proptest::array::uniform3(-0.1..0.1),
    ) {
        let law = BoundaryLayer { eta, h };
        let start = Vector3::from(start);
        let chi = eta.into_iter().fold(f64::INFINITY, f64::min);
        let bound_42 = 2.0 * v1(&start).sqrt() / chi;
        let (mut s, steps) = (start, 5000_u32);
        let step = bound_42 / f64::from(steps);
        for _ in 0..steps {
            let slope = s.dot(&law.sliding_rate(&(), &s));
            // (41) is true while every axis is outside its layer, even with √2 χ, and false once
            // all are deep within.
            if (0..3).all(|i| s[i].abs() > h[i]) {
                prop_assert!(slope <= -chi * f64::sqrt(2.0 * v1(&s)) * (1.0 - 1e-12));
            }
            if (0..3).all(|i| eta[i] * s[i].abs() < 0.4 * chi * h[i]) {
                prop_assert!(slope > -chi * v1(&s).sqrt());
            }
            let middle = s + law.sliding_rate(&(), &s) * (0.5 * step);
            let next = s + law.sliding_rate(&(), &middle) * step;
            prop_assert!(v1(&next) < v1(&s), "V₁ decreases");
            s = next;
        }
        let off = (s - closed_form(&law, &start, bound_42)).component_div(&Vector3::from(h)).amax();
        prop_assert!(off < 1e-7, "{off}");
        prop_assert!(s.amax() > 0.0, "s = 0 at the time of (42)");
    }
}

/// Returns s at time `t` under ṡ = −η sat(s): straight to the layer, exponential within.
fn closed_form(law: &BoundaryLayer, start: &Vector3<f64>, t: f64) -> Vector3<f64> {
    Vector3::from_fn(|i, _| {
        let (size, eta, h) = (start[i].abs(), law.eta[i], law.h[i]);
        let arrival = (size - h).max(0.0) / eta;
        let left = if t < arrival {
            size - eta * t
        } else {
            size.min(h) * (-(eta / h) * (t - arrival)).exp()
        };
        left * start[i].signum()
    })
}

#[test]
fn published_settling_time_42_by_an_example() {
    // With Table 1 and s at the edge of the layer on one axis, 24 % of it are left after (42), and
    // 1 % of it after 3.3 times (42).
    let law = Settings::btvsmc_do().reaching;
    let start = Vector3::new(law.h[0], 0.0, 0.0);
    let bound = 2.0 * v1(&start).sqrt() / law.eta[0];
    let left = |t: f64| closed_form(&law, &start, t).x / start.x;
    assert!((bound - 0.2121).abs() < 5e-5, "{bound}");
    assert!((left(bound) - 0.243).abs() < 5e-4, "{}", left(bound));
    assert!((left(3.257 * bound) - 0.01).abs() < 1e-5, "{}", left(3.257 * bound));
}

// Theorem 12: the second-order reaching law, with an exact estimate.

/// Gains of one axis with the matrices of (50).
struct Axis {
    law: SecondOrder,
    axis: usize,
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
    fn v2(&self, s: f64, tau: f64) -> f64 {
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
    fn chi(&self) -> (f64, f64) {
        let smallest = |matrix: Matrix3<f64>| matrix.symmetric_eigenvalues().min();
        let largest = self.lambda().symmetric_eigenvalues().max();
        let power = smallest(self.lambda()).powf(1.0 / (2.0 * (self.law.m - 1.0)));
        (power * smallest(self.gamma_1()) / largest, smallest(self.gamma_2()) / largest)
    }
}

/// Returns the exponent of V₂ in (53).
fn exponent_53(m: f64) -> f64 {
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

// Lemma 5: the observer.

/// Returns the observer of Table 1 with `l` in place of L.
fn observer(l: f64) -> Observer {
    let published = Settings::sotvsmc_do().observer.unwrap();
    Observer { l: [l; 3], ..published }
}

/// A run of the observer in which time is stretched by `stretch` and Δv̈ is multiplied by `size`.
/// The noise on s is then stretched by size · stretch³. Returns all estimates.
fn estimates(stretch: f64, size: f64, noise: &[f64]) -> Vec<Estimate> {
    let (observer, period) = (observer(0.005 * size), 0.01 * stretch);
    let (of_s, of_v) = (size * stretch.powi(3), size * stretch * stretch);
    let mut estimate = Estimate::default();
    let mut at = 0.0;
    let samples = noise.iter().map(|noise| {
        // The time τ = t/stretch is that of the run which is not stretched.
        at += 0.01;
        let tau: f64 = at;
        let s = 1e-3 * (3.0 * tau).sin() + 0.5e-3 * (8.0 * tau).cos() + 1e-5 * noise;
        let drive = 0.02 * (2.0 * tau).cos() - 0.01;
        estimate = observer.advance(
            &estimate,
            &Vector3::repeat(s * of_s),
            &Vector3::repeat(drive * of_v),
            period,
        );
        estimate
    });
    samples.collect()
}

proptest! {
    #[test]
    fn oracle_estimates_scale_with_the_noise_as_25_says(
        stretch in prop_oneof![0.1..0.7, 1.5..10.0],
        size in prop_oneof![0.1..0.7, 1.5..10.0],
        noise in proptest::collection::vec(-1.0..1.0, 300),
    ) {
        // If s and its noise ε are stretched by κ³ and time by κ, the estimates are stretched by
        // κ³, κ² and κ, that is by ε, ε^(2/3) and ε^(1/3). What holds for one noise with
        // constants μ therefore holds for every noise, and the same if all is scaled, L included.
        // Differences are of 1e-15, but the square root in (24) can make 1e-9 of a rounding error
        // near its zero. A power that is wrong by 0.003 shows at 1e-6.
        let (plain, stretched) = (estimates(1.0, 1.0, &noise), estimates(stretch, size, &noise));
        for (plain, stretched) in plain.iter().zip(&stretched) {
            for (plain, stretched, power) in [
                (plain.sliding, stretched.sliding, 3),
                (plain.disturbance, stretched.disturbance, 2),
                (plain.disturbance_rate, stretched.disturbance_rate, 1),
            ] {
                let back = stretched.x / (size * stretch.powi(power));
                prop_assert!((back - plain.x).abs() < 1e-9, "{back} {}", plain.x);
            }
        }
    }

    #[test]
    fn oracle_the_observer_follows_a_second_derivative_up_to_lambda_2_l(
        share in -0.7..0.7,
        more in 1.05..1.5,
        start in -0.02..0.02,
        rate in -0.01..0.01,
    ) {
        let observer = observer(0.005);
        let strongest = observer.lambda[2] * observer.l[0];
        // Errors of z₁ and z₂ after `ticks` of Δv with this constant second derivative.
        let off = |second: f64, ticks: u32| {
            let (start, rate): (f64, f64) = (start, rate);
            let (mut estimate, mut s, period) = (Estimate::default(), 0.0, 1e-3);
            let mut off = (0.0_f64, 0.0_f64);
            for k in 0..ticks {
                let t = f64::from(k) * period;
                let value = start + rate * t + second * t * t / 2.0;
                if k + 1000 > ticks {
                    let slope = rate + second * t;
                    off.0 = off.0.max((estimate.disturbance.x - value).abs());
                    off.1 = off.1.max((estimate.disturbance_rate.x - slope).abs());
                }
                estimate = observer.advance(&estimate, &Vector3::repeat(s), &Vector3::zeros(), period);
                s += value * period;
            }
            off
        };
        let (of_z1, of_z2) = off(share * strongest, 8_000);
        prop_assert!(of_z1 < 6e-7 && of_z2 < 2.4e-4, "{of_z1} {of_z2}");
        // A stronger one outruns z₂, whose rate is λ₂ L at most.
        let (early, late) = (off(more * strongest, 8_000).1, off(more * strongest, 16_000).1);
        let expected: f64 = (more - 1.0) * strongest * 8.0;
        prop_assert!(((late - early) / expected - 1.0).abs() < 8e-12, "{early} {late} {expected}");
    }
}

// The laws in flight on the scenario of section 6.

/// Disturbance moment of section 6, (66), N m.
fn moment_66(t: f64) -> Vector3<f64> {
    Vector3::repeat(1e4 * (0.5 + (0.1 * t).sin() + t.sin()))
}

/// One tick of a flight.
struct Tick<R: Reaching> {
    time: f64,
    memory: Memory<R::Memory>,
    /// The lumped uncertainty Δv = Θ̈ − v that acts, rad/s².
    uncertainty: Vector3<f64>,
}

/// Returns v = K M + B of a moment by (12), rad/s².
fn v_of(
    body: &RigidBody,
    angles: &Vector3<f64>,
    rates: &Vector3<f64>,
    moment: Vector3<f64>,
) -> Vector3<f64> {
    let matrix = r(angles);
    matrix * (body.inverse * moment) + body.drift(angles, &(matrix * rates))
}

fn fly<R: Reaching>(settings: Settings<R>) -> Vec<Tick<R>> {
    let (scenario, period) = (Scenario::tvsmc2015(), settings.period);
    let mut law = Tvsmc::new(settings).unwrap();
    let mut memory = law.memory();
    let mut plant = Plant::new(&scenario.config(period), 0.0).unwrap();
    let reference = |time: f64| scenario.reference.at(time);
    let mut flight = vec![];
    for tick in 0..(scenario.duration / period).round() as u64 {
        let time = tick as f64 * period;
        let (angles, rates) = (plant.angles(), plant.rates());
        let measured = Measurement { angles, rates, ..Measurement::default() };
        let moment = law.update(&mut memory, tick, time, &measured, &reference);
        let load = Load { moment: moment + moment_66(time), ..Load::default() };
        let change = plant::derivative(plant.body(), Kinematics::Printed, &plant.state, &load);
        let angle_rates = plant::angles(&change);
        let acceleration =
            r_dot(&angles, &angle_rates) * rates + r(&angles) * plant::rates(&change);
        let uncertainty = acceleration - v_of(&settings.body, &angles, &rates, moment);
        flight.push(Tick { time, memory, uncertainty });
        plant.advance(time, time + period, moment).unwrap();
    }
    flight
}

/// Returns the time from which z₁ is within 2·10⁻⁴ rad/s² of Δv on all axes. The chatter of z₁ at
/// rest stays below it.
fn t_ob<R: Reaching>(flight: &[Tick<R>]) -> f64 {
    let off = |tick: &Tick<R>| (tick.memory.estimate.disturbance - tick.uncertainty).amax();
    flight.iter().rfind(|tick| off(tick) > 2e-4).map_or(0.0, |tick| tick.time + 0.01)
}

/// Returns the uncertainty Δv at `t` if the error follows (21) exactly, as it does on the surface.
fn uncertainty_on_the_surface(t: f64) -> Vector3<f64> {
    let scenario = Scenario::tvsmc2015();
    let (nominal, real) =
        (scenario.inertia.body(1.0).unwrap(), scenario.inertia.body(1.05).unwrap());
    let target = scenario.reference.at(0.0).angles;
    let (start, c) = (scenario.initial_angles - target, 2.0);
    let decay = (-c * t).exp();
    let angles = target + start * ((1.0 + c * t) * decay);
    let angle_rates = start * (-c * c * t * decay);
    let acceleration = start * ((c * t - 1.0) * c * c * decay);
    let rates = r_inverse(&angles) * angle_rates;
    let rates_dot = r_inverse(&angles) * (acceleration - r_dot(&angles, &angle_rates) * rates);
    let moment = real.inertia * (rates_dot - real.angular_acceleration(&rates, &Vector3::zeros()))
        - moment_66(t);
    acceleration - v_of(&nominal, &angles, &rates, moment)
}

#[test]
fn published_l_lies_below_the_second_derivative_of_the_uncertainty() {
    let second = |t: f64| {
        let (h, at) = (1e-3, uncertainty_on_the_surface);
        ((at(t + h) - at(t) * 2.0 + at(t - h)) / (h * h)).abs()
    };
    let sup = |from: u32| {
        (from..2000)
            .map(|k| second(f64::from(k) * 0.01))
            .fold(Vector3::zeros(), |a: Vector3<f64>, b| a.sup(&b))
    };
    // From 2 s on the vehicle is close to rest, and (66) alone makes Δv change.
    let at_rest = sup(200);
    assert!((at_rest - Vector3::new(0.00775, 0.00278, 0.01853)).amax() < 5e-6, "{at_rest}");
    let Observer { lambda, l } = Settings::sotvsmc_do().observer.unwrap();
    let l = Vector3::from(l);
    assert!(l.x < at_rest.x && l.z < at_rest.z, "L is no bound for α and σ");
    let margin = (l * lambda[2]).component_div(&at_rest);
    assert!((margin - Vector3::new(1.29, 3.60, 1.08)).amax() < 5e-3, "{margin}");
    // During the first turn the wrong inertia makes Δv change ten times as fast, and z₁ cannot be
    // exact before λ₂ L exceeds it.
    let first = second(0.0);
    assert!((first - Vector3::new(0.0825, 0.0856, 0.0831)).amax() < 5e-5, "{first}");
    let last = |i: usize| (0..2000).rfind(|&k| second(f64::from(k) * 0.01)[i] > lambda[2] * l[i]);
    assert_eq!([0, 1, 2].map(last), [Some(63), Some(65), Some(40)], "hundredths of a second");
}

#[test]
fn regress_the_observer_converges_in_seven_tenths_of_a_second() {
    // The paper gives no bound on t_ob.
    let (one, two) = (t_ob(&fly(Settings::btvsmc_do())), t_ob(&fly(Settings::sotvsmc_do())));
    assert!((one - 0.72).abs() < 0.015 && (two - 0.71).abs() < 0.015, "{one} {two}");
}

#[test]
fn regress_with_half_of_l_the_estimate_is_ten_times_as_far_off() {
    // λ₂ L then lies below the second derivative of Δv in σ.
    let late_error = |settings| {
        let flight = fly(settings);
        let late = flight.iter().filter(|tick| tick.time > 10.0);
        let off = late.map(|tick| (tick.memory.estimate.disturbance - tick.uncertainty).amax());
        off.fold(0.0, f64::max)
    };
    let settings = Settings::sotvsmc_do();
    let halved =
        settings.observer.map(|observer| Observer { l: observer.l.map(|l| 0.5 * l), ..observer });
    let (full, half) =
        (late_error(settings), late_error(Settings { observer: halved, ..settings }));
    assert!((full - 1.37e-4).abs() < 2e-6 && (half - 1.65e-3).abs() < 2e-5, "{full} {half}");
}

/// Returns the ticks from t_ob on until `v` has fallen below `rest`, and the time that this takes.
fn after_t_ob<R: Reaching>(
    flight: &[Tick<R>],
    v: impl Fn(&Tick<R>) -> f64,
    rest: f64,
) -> (&[Tick<R>], f64) {
    let from = flight.iter().position(|tick| tick.time >= t_ob(flight)).unwrap();
    let count = flight[from..].iter().position(|tick| v(tick) < rest).unwrap();
    (&flight[from..from + count], flight[from + count].time - flight[from].time)
}

#[test]
fn regress_v1_decreases_in_flight_but_far_more_slowly_than_42() {
    let settings = Settings::btvsmc_do();
    let flight = fly(settings);
    // The sliding variable never comes near the edge of the layer, so that the finite time of (42)
    // says nothing about this flight.
    let peak = flight.iter().map(|tick| tick.memory.sliding.amax()).fold(0.0, f64::max);
    let peak = peak / settings.reaching.h[0];
    assert!((peak - 0.0723).abs() < 5e-4, "{peak}");
    // At rest V₁ stays below 4·10⁻¹¹.
    let v = |tick: &Tick<BoundaryLayer>| v1(&tick.memory.sliding);
    let (falling, measured) = after_t_ob(&flight, v, 1e-10);
    assert!(falling.windows(2).all(|pair| v(&pair[1]) < v(&pair[0])));
    assert!((measured - 0.30).abs() < 0.015, "{measured}");
    let bound = 2.0 * v(&falling[0]).sqrt() / settings.reaching.eta[0];
    assert!((bound - 0.0018).abs() < 5e-5, "{bound}");
}

#[test]
fn regress_v2_decreases_in_flight_and_faster_than_56() {
    let settings = Settings::sotvsmc_do();
    let flight = fly(settings);
    let axes = [0, 1, 2].map(|axis| Axis { law: settings.reaching, axis });
    let v = |tick: &Tick<SecondOrder>| -> f64 {
        let Memory { sliding, integral, .. } = &tick.memory;
        axes.iter().map(|axis| axis.v2(sliding[axis.axis], integral[axis.axis])).sum()
    };
    let (falling, _) = after_t_ob(&flight, v, 2e-7);
    assert!(falling.windows(2).all(|pair| v(&pair[1]) < v(&pair[0])));
    // At rest V₂ stays below 2·10⁻⁸.
    let (_, measured) = after_t_ob(&flight, v, 2e-8);
    assert!((measured - 5.82).abs() < 0.05, "{measured}");
    let (chi_1, chi_2) = axes[0].chi();
    let power = 1.0 - exponent_53(settings.reaching.m);
    let bound =
        |below: f64| f64::ln_1p(chi_2 / chi_1 * v(&falling[0]).powf(power)) / (below * power);
    let (right, printed) = (bound(chi_2), bound(chi_1));
    assert!((right - 190.6).abs() < 0.5 && (printed - 3177.0).abs() < 10.0, "{right} {printed}");
}
