//! Bounds of the dynamics: from above by the verified inequalities, and from below by a search for
//! the worst state.
//!
//! The acceleration is F = R G with G = I⁻¹ (m − g) − Ẇ x, g = ω × I ω, ω = W x, and ∂R = −R ∂W R.
//! The derivatives of F and of m are taken by the product rule, and each factor is replaced by its
//! verified bound. As g″ is bilinear and symmetric, its norm is twice that of g on the unit sphere.

use crate::dual::Number;
use crate::interval::Interval;
use crate::kinematics::{Turn, Vector, cross, scaled, sum, times, turned};
use crate::lemmas::{Finding, Suprema, over_the_domain};
use control::crmpc::{Lemmas, Settings};
use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Truncated power series c₀ + c₁ t + c₂ t² + ….
#[derive(Clone, Copy, Debug, PartialEq)]
struct Series([f64; 3]);

impl Series {
    fn line(from: f64, slope: f64) -> Self {
        Self([from, slope, 0.0])
    }

    fn sin_cos(self) -> (Self, Self) {
        let Self([angle, first, second]) = self;
        let (s, c) = angle.sin_cos();
        let half = 0.5 * first * first;
        (Self([s, c * first, c * second - s * half]), Self([c, -s * first, -s * second - c * half]))
    }
}

impl Number for Series {
    fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0])
    }
    fn squared(self) -> Self {
        self * self
    }
}

impl Neg for Series {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(Neg::neg))
    }
}

impl Add for Series {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for Series {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Series {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        Self([a * d, a * e + b * d, a * f + b * e + c * d])
    }
}

impl Div for Series {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        let first = a / d;
        let second = (b - first * e) / d;
        Self([first, second, (c - first * f - second * e) / d])
    }
}

fn vector(value: &Vector<f64>) -> Vector<Series> {
    value.map(Series::constant)
}

fn coefficient(value: &Vector<Series>, i: usize) -> Vector<f64> {
    value.map(|value| value.0[i])
}

fn norm(value: &Vector<f64>) -> f64 {
    crate::kinematics::square(value).sqrt()
}

/// Rigid body whose matrices are series, for use with angles and rates that are series.
struct Body {
    inertia: [Vector<Series>; 3],
    inverse: [Vector<Series>; 3],
}

impl Body {
    fn new(s: &Settings) -> Self {
        let rows = |m: &nalgebra::Matrix3<f64>| {
            std::array::from_fn(|i| std::array::from_fn(|j| Series::constant(m[(i, j)])))
        };
        Self { inertia: rows(&s.body.inertia), inverse: rows(&s.body.inverse) }
    }

    /// Body rates ω of the angles and x.
    fn rates(angles: &[Series; 2], x: &Vector<Series>) -> Vector<Series> {
        let ((sa, ca), (sb, cb)) = (angles[0].sin_cos(), angles[1].sin_cos());
        turned(sa, ca, &Turn::new(sb, cb).along(&[], x))
    }

    /// Acceleration F(Θ, x, m) of the attitude angles.
    fn acceleration(
        &self,
        angles: &[Series; 2],
        x: &Vector<Series>,
        m: &Vector<Series>,
    ) -> Vector<Series> {
        let ((sa, ca), (sb, cb)) = (angles[0].sin_cos(), angles[1].sin_cos());
        let turn = Turn::new(sb, cb);
        let rates = Self::rates(angles, x);
        let spin = cross(&rates, &times(&self.inertia, &rates));
        let driven = times(&self.inverse, &sum(*m, spin.map(Neg::neg)));
        // T is its own inverse.
        turn.r(&sum(turned(sa, ca, &driven), turn.drift(x).map(Neg::neg)))
    }

    /// Moment m(Θ, x, a) that gives the acceleration a.
    fn moment(
        &self,
        angles: &[Series; 2],
        x: &Vector<Series>,
        a: &Vector<Series>,
    ) -> Vector<Series> {
        let ((sa, ca), (sb, cb)) = (angles[0].sin_cos(), angles[1].sin_cos());
        let turn = Turn::new(sb, cb);
        let rates = Self::rates(angles, x);
        let spin = cross(&rates, &times(&self.inertia, &rates));
        sum(times(&self.inertia, &turned(sa, ca, &sum(turn.along(&[], a), turn.drift(x)))), spin)
    }
}

/// Maps coordinates in [−1, 1] to a vector in the ball of this radius.
fn ball(z: &[f64], radius: f64) -> Vector<f64> {
    let value = [z[0], z[1], z[2]];
    let size = norm(&value);
    scaled(radius / size.max(1.0), value)
}

/// Number of coordinates of a trial point: β, α, ω or x, m or a, a direction of the angles, and one
/// of the rates.
const COORDINATES: usize = 13;

/// Returns the largest value of `f` that repeated ascents by random steps find.
fn ascent(f: impl Fn(&[f64; COORDINATES]) -> f64) -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut largest = 0.0_f64;
    for _ in 0..40 {
        let mut at: [f64; COORDINATES] = std::array::from_fn(|_| random());
        let (mut value, mut step) = (f(&at), 1.0);
        for _ in 0..400 {
            let tried = at.map(|z| (z + step * random()).clamp(-1.0, 1.0));
            let there = f(&tried);
            if there > value {
                (at, value) = (tried, there);
            } else {
                step = f64::max(step * 0.98, 1e-4);
            }
        }
        largest = largest.max(value);
    }
    largest
}

/// Direction of the angles at a trial point.
fn angle_unit(z: &[f64; COORDINATES]) -> [f64; 2] {
    let size = z[8].hypot(z[9]).max(1e-9);
    [z[8] / size, z[9] / size]
}

/// Vector that begins at `x` and changes by `v` per unit of time.
fn line(x: &Vector<f64>, v: &Vector<f64>) -> Vector<Series> {
    std::array::from_fn(|i| Series::line(x[i], v[i]))
}

/// Direction of these three coordinates.
fn unit(z: &[f64]) -> Vector<f64> {
    let size = norm(&[z[0], z[1], z[2]]).max(1e-9);
    scaled(1.0 / size, [z[0], z[1], z[2]])
}

/// Returns the largest values that the search found, in the order of [`from_lemmas`].
fn attained(s: &Settings, sizes: (f64, f64), curved: (f64, f64)) -> [f64; 12] {
    let body = Body::new(s);
    let angles = |z: &[f64; COORDINATES]| [PI * z[1], s.sideslip_domain * z[0]];
    // This gives the state (α, β), x and m, with x = R ω.
    let state = |z: &[f64; COORDINATES]| {
        let [alpha, beta] = angles(z);
        let (omega, m) = (ball(&z[2..5], s.limit_rate), ball(&z[5..8], s.limit_moment));
        let x = Turn::new(beta.sin(), beta.cos()).r(&turned(alpha.sin(), alpha.cos(), &omega));
        ([alpha, beta], x, m)
    };
    let held = |[alpha, beta]: [f64; 2]| [Series::constant(alpha), Series::constant(beta)];
    let along = |[alpha, beta]: [f64; 2], o: [f64; 2]| {
        [Series::line(alpha, o[0]), Series::line(beta, o[1])]
    };
    let acceleration = |z: &[f64; COORDINATES]| {
        let (angles, x, m) = state(z);
        norm(&coefficient(&body.acceleration(&held(angles), &vector(&x), &vector(&m)), 0))
    };
    let by_rates = |z: &[f64; COORDINATES]| {
        let (angles, x, m) = state(z);
        norm(&coefficient(
            &body.acceleration(&held(angles), &line(&x, &unit(&z[10..])), &vector(&m)),
            1,
        ))
    };
    let by_angles = |z: &[f64; COORDINATES]| {
        let (angles, x, m) = state(z);
        norm(&coefficient(
            &body.acceleration(&along(angles, angle_unit(z)), &vector(&x), &vector(&m)),
            1,
        ))
    };
    let jerk = |z: &[f64; COORDINATES]| {
        let (from, x, m) = state(z);
        let m = vector(&m);
        let mut series = vector(&x);
        for _ in 0..2 {
            let angles = std::array::from_fn(|i| Series([from[i], x[i], 0.5 * series[i].0[1]]));
            let a = body.acceleration(&angles, &series, &m);
            series = std::array::from_fn(|i| Series([x[i], a[i].0[0], 0.5 * a[i].0[1]]));
        }
        let angles = std::array::from_fn(|i| Series([from[i], x[i], 0.5 * series[i].0[1]]));
        2.0 * norm(&coefficient(&body.acceleration(&angles, &series, &m), 2))
    };
    let nominal = |z: &[f64; COORDINATES], (x, a): (f64, f64)| {
        (angles(z), ball(&z[2..5], x), ball(&z[5..8], a))
    };
    let moment_by_angles = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = nominal(z, sizes);
        norm(&coefficient(&body.moment(&along(angles, angle_unit(z)), &vector(&x), &vector(&a)), 1))
    };
    let moment_by_rates = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = nominal(z, sizes);
        norm(&coefficient(&body.moment(&held(angles), &line(&x, &unit(&z[10..])), &vector(&a)), 1))
    };
    let moment = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = nominal(z, sizes);
        norm(&coefficient(&body.moment(&held(angles), &vector(&x), &vector(&a)), 0))
    };
    let [moment_curvature, rate_curvature, by_angles_curvature, by_rates_curvature, bearing] =
        attained_along_a_trajectory(s, &body, curved);
    [
        ascent(acceleration),
        ascent(by_rates),
        ascent(by_angles),
        ascent(jerk),
        ascent(moment_by_angles),
        ascent(moment_by_rates),
        ascent(moment),
        moment_curvature,
        rate_curvature,
        by_angles_curvature,
        by_rates_curvature,
        bearing,
    ]
}

/// Returns the largest second derivatives that the search found along trajectories with a held.
fn attained_along_a_trajectory(s: &Settings, body: &Body, curved: (f64, f64)) -> [f64; 5] {
    let angles = |z: &[f64; COORDINATES]| [PI * z[1], s.sideslip_domain * z[0]];
    // This gives a trajectory along which a is held.
    let trajectory = |z: &[f64; COORDINATES]| {
        let from = angles(z);
        let (x, a) = (ball(&z[2..5], curved.0), ball(&z[5..8], curved.1));
        let angles: [Series; 2] = std::array::from_fn(|i| Series([from[i], x[i], 0.5 * a[i]]));
        (angles, line(&x, &a), vector(&a))
    };
    let moment_curvature = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = trajectory(z);
        2.0 * norm(&coefficient(&body.moment(&angles, &x, &a), 2))
    };
    let rate_curvature = |z: &[f64; COORDINATES]| {
        let (angles, x, _) = trajectory(z);
        2.0 * norm(&coefficient(&Body::rates(&angles, &x), 2))
    };
    // The derivatives by the angles and rates are those of differences over a short distance.
    let short = 1e-4;
    let difference = |after: Vector<Series>, before: Vector<Series>| {
        let change = sum(after, before.map(Neg::neg));
        norm(&coefficient(&change, 2)) / short
    };
    let curvature_by_angles = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = trajectory(z);
        let o = angle_unit(z);
        let moved = |side: f64| {
            let turned = std::array::from_fn(|i| angles[i] + Series::constant(side * short * o[i]));
            body.moment(&turned, &x, &a)
        };
        difference(moved(1.0), moved(-1.0))
    };
    let curvature_by_rates = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = trajectory(z);
        let v = unit(&z[10..]);
        let moved = |side: f64| {
            let changed = std::array::from_fn(|i| x[i] + Series::constant(side * short * v[i]));
            body.moment(&angles, &changed, &a)
        };
        difference(moved(1.0), moved(-1.0))
    };
    let curvature_of_bearing = |z: &[f64; COORDINATES]| {
        let (angles, ..) = trajectory(z);
        let corner = [z[10], z[11], z[12]].map(|z| if z < 0.0 { -1.0 } else { 1.0 });
        let at_rest = vector(&[0.0; 3]);
        2.0 * norm(&coefficient(&body.moment(&angles, &at_rest, &vector(&corner)), 2))
    };
    [
        ascent(moment_curvature),
        ascent(rate_curvature),
        ascent(curvature_by_angles),
        ascent(curvature_by_rates),
        ascent(curvature_of_bearing),
    ]
}

/// Returns bounds of the same quantities from the verified inequalities, which hold with
/// certainty.
fn from_lemmas(
    s: &Settings,
    sup: &Suprema,
    sizes: (f64, f64),
    curved: (f64, f64),
) -> [Interval; 12] {
    let number = Interval::from;
    let (two, half) = (number(2.0), number(0.5));
    let upper = |value: Interval| number(value.high);
    let [drift, curvature, turn, mixed, third, fourth, r] =
        [sup.drift, sup.curvature, sup.turn, sup.mixed, sup.twice, sup.fourth, sup.r].map(upper);
    let [largest, inverse, bilinear, bilinear_inverse] =
        [sup.largest, sup.inverse, two * sup.spin, two * sup.spin_inverse].map(upper);
    let (limit, moment) = (number(s.limit_rate), number(s.limit_moment));
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

/// Checks the bounds of F and m over their domain. Bounds that depend on the sizes of x and a are
/// checked at the sizes with which the horizon may end, and at the largest ones.
pub fn check(s: &Settings, lemmas: &Lemmas, sup: &Suprema, terminal_rate: f64) -> Vec<Finding> {
    let s = &over_the_domain(s, lemmas);
    let sizes = (terminal_rate, lemmas.braking * terminal_rate);
    let curved = (lemmas.rate, lemmas.acceleration);
    let [moment_by_angles, moment_by_rates, moment] = lemmas.moment(sizes.0, sizes.1);
    let [moment_curvature, rate_curvature] = lemmas.curvatures(curved.0, curved.1);
    let [curvature_by_angles, curvature_by_rates, curvature_of_bearing] =
        lemmas.slope_curvatures(curved.0, curved.1);
    let bounds = [
        ("‖F‖ ≤ b", lemmas.acceleration),
        ("‖∂F/∂x‖ ≤ b", lemmas.by_rates),
        ("‖∂F/∂(α, β)‖ ≤ b", lemmas.by_angles),
        ("‖d²F/dt²‖ ≤ b, m held", lemmas.jerk),
        ("‖∂m/∂(α, β)‖ ≤ b at the terminal sizes", moment_by_angles),
        ("‖∂m/∂x‖ ≤ b at the terminal sizes", moment_by_rates),
        ("‖m‖ ≤ b at the terminal sizes", moment),
        ("‖d²m/dt²‖ ≤ b at the largest sizes, a held", moment_curvature),
        ("‖d²ω/dt²‖ ≤ b at the largest sizes, a held", rate_curvature),
        ("‖d²/dt² ∂m/∂(α, β)‖ ≤ b at the largest sizes", curvature_by_angles),
        ("‖d²/dt² ∂m/∂x‖ ≤ b at the largest sizes", curvature_by_rates),
        ("d²/dt² ‖I W s‖ ≤ b at the largest sizes", curvature_of_bearing),
    ];
    let (below, above) = (attained(s, sizes, curved), from_lemmas(s, sup, sizes, curved));
    bounds
        .into_iter()
        .zip(below.into_iter().zip(above))
        .map(|((statement, bound), (low, high))| Finding {
            statement: statement.into(),
            bound,
            truth: Interval::new(low, high.high),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn oracle_the_same_dynamics_as_those_of_the_vehicle() {
        let s = Settings::new(control::crmpc::Constraints::Robust);
        let body = Body::new(&s);
        let (angles, x, m) = ([0.3, -0.2], [0.05, -0.07, 0.04], [1e5, -5e4, 7e4]);
        let held = angles.map(Series::constant);
        let acceleration = coefficient(&body.acceleration(&held, &vector(&x), &vector(&m)), 0);
        let attitude = Vector3::new(angles[0], angles[1], 0.4);
        let r =
            control::linearise::InverseKinematics::at(&attitude).matrix().try_inverse().unwrap();
        let expected = s.body.drift(&attitude, &x.into()) + r * s.body.inverse * Vector3::from(m);
        assert!((Vector3::from(acceleration) - expected).norm() < 1e-14);
        let moment = coefficient(&body.moment(&held, &vector(&x), &vector(&acceleration)), 0);
        assert!((Vector3::from(moment) - Vector3::from(m)).norm() < 1e-8);
    }
}
