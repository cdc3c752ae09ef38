//! The moment that an acceleration requires, in axes that turn with the angle of attack.
//!
//! W y = T(α) V(β) y with V y = [−c (s y₁ + y₃), c² y₁ − s y₃, y₂], s = sin β, c = cos β. T is a
//! reflection, T T = 1, so that T a × T b = −T (a × b). With J = T I T the moment is, up to T,
//!
//! m = J (V a + D) − ω × J ω,  ω = V x,  D = [s x₂ z, −c x₂ z, c x₁ (s x₁ + x₃)],  z = 2 s x₁ + x₃,
//!
//! where D = T Ẇ x. The norm of m is that in the body's axes. J depends on 2α through U and P
//! alone.

use super::jet::Jet;
use crate::dual::{Dual, Number};
use crate::interval::Interval;
use control::crmpc::Settings;

/// Inertia of a body that is symmetric about its x–z plane, kg m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// Mean ½ (I_xx + I_zz).
    mean: Interval,
    /// Half of the difference, ½ (I_xx − I_zz).
    half: Interval,
    /// Entry (1, 3) of the tensor.
    product: Interval,
    /// Moment of inertia about the pitch axis.
    pitch: Interval,
}

impl Body {
    /// Reads the tensor of the settings; `None` if it is not symmetric about the x–z plane.
    pub(super) fn new(s: &Settings) -> Option<Self> {
        let tensor = &s.body.inertia;
        let [xx, yy, zz, xz] =
            [(0, 0), (1, 1), (2, 2), (0, 2)].map(|at| Interval::from(tensor[at]));
        let half = Interval::from(0.5);
        let symmetric = tensor[(0, 1)] == 0.0 && tensor[(1, 2)] == 0.0;
        (symmetric && *tensor == tensor.transpose()).then_some(Self {
            mean: half * (xx + zz),
            half: half * (xx - zz),
            product: xz,
            pitch: yy,
        })
    }

    /// Returns the principal moments: two in the plane of symmetry, then that of the pitch axis.
    pub(super) fn principal(&self) -> [Interval; 3] {
        let radius = (self.half.square() + self.product.square()).sqrt();
        [self.mean - radius, self.mean + radius, self.pitch]
    }

    /// Returns U and P, the parts of J = [[mean + U, 0, P], [0, pitch, 0], [P, 0, mean − U]] that
    /// turn. Their derivatives by α are −2 P and 2 U.
    fn turning(&self, alpha: Interval) -> [Interval; 2] {
        let (s, c) = sin_cos(alpha + alpha);
        [self.half * c + self.product * s, self.half * s - self.product * c]
    }

    /// Returns the rows of J at `alpha` and of its inverse.
    pub(super) fn tensors(&self, alpha: Interval) -> [[[Interval; 3]; 3]; 2] {
        let [u, p] = self.turning(alpha);
        let (zero, pitch) = (Interval::ZERO, self.pitch);
        // The determinant in the plane does not depend on α.
        let scale =
            Interval::ONE / (self.mean.square() - self.half.square() - self.product.square());
        let (plus, minus) = (self.mean + u, self.mean - u);
        [
            [[plus, zero, p], [zero, pitch, zero], [p, zero, minus]],
            [
                [minus * scale, zero, -p * scale],
                [zero, Interval::ONE / pitch, zero],
                [-p * scale, zero, plus * scale],
            ],
        ]
    }

    /// Returns the attitude with derivatives by coordinates 0 (α) and 1 (β).
    pub(super) fn sloped<const N: usize>(&self, [alpha, beta]: [Interval; 2]) -> Attitude<Dual<N>> {
        let ([u, p], (s, c)) = (self.turning(alpha), sin_cos(beta));
        let jet = |i: usize, value: Interval, first: Interval| {
            let mut dual = Dual::fixed(value);
            dual.slope[i] = first;
            dual
        };
        Attitude {
            u: jet(0, u, -(p + p)),
            p: jet(0, p, u + u),
            sine: jet(1, s, c),
            cosine: jet(1, c, -s),
            mean: Dual::fixed(self.mean),
            pitch: Dual::fixed(self.pitch),
        }
    }

    /// Returns the attitude with first and second derivatives.
    pub(super) fn bent(&self, [alpha, beta]: [Interval; 2]) -> Attitude<Jet> {
        let ([u, p], (s, c)) = (self.turning(alpha), sin_cos(beta));
        let four = Interval::from(-4.0);
        Attitude {
            u: Jet::of_coordinate(0, u, -(p + p), four * u),
            p: Jet::of_coordinate(0, p, u + u, four * p),
            sine: Jet::of_coordinate(1, s, c, -s),
            cosine: Jet::of_coordinate(1, c, -s, -c),
            mean: Jet::fixed(self.mean),
            pitch: Jet::fixed(self.pitch),
        }
    }
}

/// Attitude and inertia, as far as the moment depends on them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attitude<T> {
    u: T,
    p: T,
    sine: T,
    cosine: T,
    mean: T,
    pitch: T,
}

impl<T: Number> Attitude<T> {
    /// Returns J y.
    fn inertia(&self, [p, t, q]: [T; 3]) -> [T; 3] {
        [
            (self.mean + self.u) * p + self.p * q,
            self.pitch * t,
            self.p * p + (self.mean - self.u) * q,
        ]
    }

    /// Returns V y.
    fn forward(&self, y: &[T; 3]) -> [T; 3] {
        let (s, c) = (self.sine, self.cosine);
        [-(c * (s * y[0] + y[2])), c.squared() * y[0] - s * y[2], y[1]]
    }

    /// Returns the column J V e_i of the moment by the acceleration, kg m².
    pub(super) fn column(&self, i: usize) -> [T; 3] {
        let (s, c, zero) = (self.sine, self.cosine, T::constant(0.0));
        self.inertia(match i {
            0 => [-(c * s), c.squared(), zero],
            1 => [zero, zero, T::constant(1.0)],
            _ => [-c, -s, zero],
        })
    }

    /// Returns the moment at the rates `x` (rad/s) and the acceleration `a` (rad/s²), N m.
    pub(super) fn moment(&self, x: &[T; 3], a: &[T; 3]) -> [T; 3] {
        let (s, c) = (self.sine, self.cosine);
        let (turned, z) = (s * x[0] + x[2], s * x[0] + s * x[0] + x[2]);
        let drift = [s * x[1] * z, -(c * x[1] * z), c * x[0] * turned];
        let forward = self.forward(a);
        let driven = self.inertia(std::array::from_fn(|i| forward[i] + drift[i]));
        let rates = [-(c * turned), c.squared() * x[0] - s * x[2], x[1]];
        let spin = self.inertia(rates);
        let cross = |i: usize, j: usize| rates[i] * spin[j] - rates[j] * spin[i];
        [driven[0] - cross(1, 2), driven[1] - cross(2, 0), driven[2] - cross(0, 1)]
    }
}

/// Encloses sine and cosine of all angles of an interval, rad.
pub(super) fn sin_cos(angle: Interval) -> (Interval, Interval) {
    let middle = angle.middle();
    if !middle.is_finite() || middle.abs() > 1e3 {
        return (Interval::new(-1.0, 1.0), Interval::new(-1.0, 1.0));
    }
    let (s, c) = sin_cos_at(middle);
    if angle.low == angle.high {
        return (s, c);
    }
    // sin(m + δ) = sin m cos δ + cos m sin δ with |sin δ| ≤ |δ| and 1 − δ²/2 ≤ cos δ ≤ 1.
    let reach = (angle - Interval::point(middle)).abs().high;
    let low = (Interval::ONE - Interval::from(0.5) * Interval::from(reach).square()).low;
    let (sine, cosine) = (Interval::new(-reach, reach), Interval::new(low.max(-1.0), 1.0));
    let within = |value: Interval| Interval::new(value.low.max(-1.0), value.high.min(1.0));
    (within(s * cosine + c * sine), within(c * cosine - s * sine))
}

/// Encloses sine and cosine of a number by doubling a part of it that is at most 1.
fn sin_cos_at(angle: f64) -> (Interval, Interval) {
    let (mut part, mut doublings) = (angle.abs(), 0);
    while part > 1.0 {
        // This is exact.
        part *= 0.5;
        doublings += 1;
    }
    let (mut s, mut c) = Interval::point(part).sin_cos();
    for _ in 0..doublings {
        (s, c) = ((s + s) * c, Interval::ONE - (s + s) * s);
    }
    (if angle < 0.0 { -s } else { s }, c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::crmpc::Constraints;
    use control::linearise;
    use nalgebra::Vector3;

    #[test]
    fn oracle_the_same_moment_as_that_of_the_controller() {
        let s = Settings::new(Constraints::Robust);
        let body = Body::new(&s).unwrap();
        let (x, a) = ([0.05, -0.07, 0.04], [0.02, 0.06, -0.05]);
        for (alpha, beta) in [(0.3, -0.2), (-2.5, 0.3), (6.0, 0.1)] {
            let theirs =
                linearise::moment(&s.body, &Vector3::new(alpha, beta, 0.4), &x.into(), &a.into());
            let at = body.sloped::<2>([alpha, beta].map(Interval::from));
            let constant = |y: [f64; 3]| y.map(Dual::constant);
            let mine = at.moment(&constant(x), &constant(a)).map(|value| value.value.middle());
            assert!((Vector3::from(mine).norm() / theirs.norm() - 1.0).abs() < 1e-12);
            // The columns are the derivatives by the acceleration.
            let sum = |i: usize| at.column(i).map(|value| value.value.middle());
            let rest = at.moment(&constant(x), &constant([0.0; 3])).map(|v| v.value.middle());
            let by_columns: Vector3<f64> =
                (0..3).map(|i| Vector3::from(sum(i)) * a[i]).sum::<Vector3<f64>>()
                    + Vector3::from(rest);
            assert!((by_columns - Vector3::from(mine)).norm() < 1e-8);
        }
    }

    #[test]
    fn oracle_sine_and_cosine_of_any_angle() {
        for i in -200..=200 {
            let angle = f64::from(i) * 0.0371;
            let (s, c) = sin_cos(Interval::new(angle - 0.01, angle + 0.02));
            for inside in [angle - 0.01, angle, angle + 0.02] {
                assert!(s.contains(inside.sin()) && c.contains(inside.cos()), "{angle}");
            }
            assert!(s.width() < 0.032 && c.width() < 0.032);
            assert!(sin_cos(Interval::point(angle)).0.width() < 1e-13);
        }
    }
}
