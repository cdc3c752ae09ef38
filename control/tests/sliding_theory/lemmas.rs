//! Lemma 2 with (20), the motion on the surface s = 0, and Lemmas 7, 8 and 9.

use super::simpson;
use crate::prelude::*;
use control::sliding::TrackingError;
use proptest::prelude::*;

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

proptest! {
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
