//! Theorem 10: the boundary layer, with an exact estimate.

use crate::prelude::*;
use control::sliding::Settings;
use proptest::prelude::*;

/// Returns V₁ = s·s/2, (37).
pub(super) fn v1(s: &Vector3<f64>) -> f64 {
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
