//! Bounds of the same quantities from the verified inequalities of the lemmas.

use crate::interval::{Interval, number};
use crate::lemmas::Suprema;
use control::crmpc::Settings;

/// Returns bounds, in the order of [`super::attained`], that hold with certainty.
pub(super) fn from_lemmas(
    s: &Settings,
    sup: &Suprema,
    sizes: (f64, f64),
    curved: (f64, f64),
) -> [Interval; 12] {
    let (two, half) = (number(2.0), number(0.5));
    let upper = |value: Interval| number(value.high);
    let [drift, curvature, turn, mixed, third, fourth, r] =
        [sup.drift, sup.curvature, sup.turn, sup.mixed, sup.twice, sup.fourth, sup.r].map(upper);
    let [largest, inverse, bilinear, bilinear_inverse] =
        [sup.largest, sup.inverse, two * sup.spin, two * sup.spin_inverse].map(upper);
    let (limit, moment) = (number(s.limit_rate), number(s.limit_total()));
    let rate = r * limit;
    // These are the bounds of ‖G‖ and ‖∂G/∂(α, β)‖.
    let inner = inverse * moment + half * bilinear_inverse * limit.square() + drift * rate.square();
    let inner_by_angles = curvature * rate.square() + bilinear_inverse * limit * turn * rate;
    let acceleration = r * inner;
    let by_rates = r * (two * drift * rate + bilinear_inverse * limit);
    let by_angles = r * turn * acceleration + r * inner_by_angles;
    let second = r * (bilinear_inverse + two * drift);
    let both = r * turn * by_rates
        + r * (mixed * rate + bilinear_inverse * turn * rate + bilinear_inverse * limit * turn);
    // The terms follow from ∂²R = 2 R ∂W R ∂W R − R ∂²W R and R G = F.
    let angles_twice = (two * (r * turn).square() + r * curvature) * acceleration
        + two * r * turn * r * inner_by_angles
        + r * (third * rate.square()
            + bilinear_inverse * ((turn * rate).square() + limit * curvature * rate));
    let jerk = second * acceleration.square()
        + two * both * acceleration * rate
        + angles_twice * rate.square()
        + by_angles * acceleration
        + by_rates * (by_rates * acceleration + by_angles * rate);
    let (x, a) = (number(sizes.0), number(sizes.1));
    let moment_by_angles =
        largest * (turn * a + curvature * x.square()) + bilinear * turn * x.square();
    let moment_by_rates = (largest * two * drift + bilinear) * x;
    let nominal = largest * (a + drift * x.square()) + half * bilinear * x.square();
    let (x, a) = (number(curved.0), number(curved.1));
    let moment_curvature = largest * (curvature * x.square() * a + turn * a.square())
        + (two * largest * drift + bilinear) * a.square()
        + two * (largest * mixed + two * bilinear * turn) * x.square() * a
        + (largest * third + bilinear * (turn.square() + curvature)) * x.square().square()
        + (largest * curvature + bilinear * turn) * x.square() * a;
    let rate_curvature = number(3.0) * turn * x * a + curvature * x.square() * x;
    // The derivatives of ω and of P = ∂W[o] x, or of W v, along the trajectory.
    let (root2, root3) = (two.sqrt(), number(3.0).sqrt());
    let three = number(3.0);
    let [omega, omega_first, omega_second] = [x, turn * x.square() + a, rate_curvature];
    let [p, p_first, p_second] = [
        turn * x,
        curvature * x.square() + turn * a,
        third * x.square() * x + three * curvature * x * a,
    ];
    let curvature_by_angles = largest
        * (third * x.square() * a
            + curvature * a.square()
            + fourth * x.square().square()
            + (three + two) * third * x.square() * a
            + two * curvature * a.square())
        + bilinear * (omega_second * p + two * omega_first * p_first + omega * p_second);
    let curvature_by_rates = largest
        * (p_second + third * x.square() * x + three * curvature * x * a)
        + bilinear * (omega_second + two * omega_first * turn * x + omega * p_first);
    [
        acceleration,
        by_rates,
        by_angles,
        jerk,
        moment_by_angles,
        moment_by_rates,
        nominal,
        moment_curvature,
        rate_curvature,
        root2 * curvature_by_angles,
        root3 * curvature_by_rates,
        root3 * largest * p_first,
    ]
}
