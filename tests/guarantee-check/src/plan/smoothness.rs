//! How fast the vehicle's acceleration changes within the domain, derived from R and the body
//! rates.
//!
//! With γ = I⁻¹ (m − ω × I ω) = ω̇ and R = V⁻¹ T the acceleration without disturbance is
//!
//! F = h + R γ,  h = [x₂ (2 s x₁ + x₃)/c, −c x₁ (s x₁ + x₃), 0],  c² x₁² + x₂² + x₃² = ‖ω‖².
//!
//! Along a trajectory with m held, F′ = R″ ω + 2 R′ γ + R γ′ and F″ = R‴ ω + 3 R″ γ + 3 R′ γ′ + R
//! γ″, as ẋ = (R ω)′. The derivatives of R are those of V⁻¹ [p, t, q] = [t − p tan β, q, −(c p + s
//! t)] by β, and by α those of T, which has the norm 1.

use crate::body::Body;
use crate::interval::{Interval, number};
use crate::kinematics::{Turn, unit};
use control::crmpc::Settings;
use std::f64::consts::PI;

/// Bounds on the dynamics for ‖ω‖ ≤ `rate`, |β| ≤ `sideslip` and ‖m‖ up to its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smoothness {
    /// Bound on ‖∂F/∂x_ω‖, 1/s.
    pub(super) by_rates: Interval,
    /// Bound on ‖∂F/∂(α, β)‖, 1/s².
    pub(super) by_angles: Interval,
    /// Bound on ‖F′‖ along a trajectory with m held, rad/s³.
    pub(super) slope: Interval,
    /// Bound on ‖F″‖ along a trajectory with m held, rad/s⁴.
    pub(super) bend: Interval,
    /// Bound on ‖ω̇‖, rad/s².
    pub(super) turning: Interval,
    /// Bound on the rate of (α, β), rad/s.
    pub(super) angle_rate: Interval,
}

fn hypot(values: &[Interval]) -> Interval {
    values.iter().fold(Interval::ZERO, |sum, value| sum + value.square()).sqrt()
}

/// Largest sizes of the derivatives of R by angles, for |β| up to the one with this sine and
/// cosine.
struct Kinematics {
    /// Bounds on ‖R‖ and on its first, second and third derivative along a unit vector.
    turns: [Interval; 4],
    sine: Interval,
    cosine: Interval,
    tangent: Interval,
}

impl Kinematics {
    fn new(sideslip: f64) -> Self {
        let (s, c) = number(sideslip).sin_cos();
        let (one, t, secant) = (Interval::ONE, s / c, Interval::ONE / c);
        let (t2, sec2) = (t.square(), secant.square());
        // Frobenius norms of V⁻¹ and its derivatives by β, with Nⁱ, i > 0, for those by α, too
        // (N is that of [`growth`]). Each grows with |β|; c² is replaced by 1. The parts of the
        // first derivative by α and β are orthogonal, and the one by β is longer.
        let by_alpha_twice = (one + one + t2).sqrt();
        let by_beta = (sec2.square() + one).sqrt();
        let mixed = (sec2.square() + s.square()).sqrt();
        let tangent_twice = number(2.0) * sec2 * t;
        let by_beta_twice = (tangent_twice.square() + one).sqrt();
        let tangent_thrice = number(2.0) * sec2.square() + number(4.0) * sec2 * t2;
        let by_beta_thrice = (tangent_thrice.square() + one).sqrt();
        // A quadratic form a n₁² + 2 b n₁ n₂ + d n₂² is at most the larger eigenvalue of its
        // matrix, and |n₁² n₂| ≤ 2/√27 < 0.385.
        let half = number(0.5);
        let (a, b, d) = (by_alpha_twice, mixed, by_beta_twice);
        let second = half * (a + d) + ((half * (a - d)).square() + b.square()).sqrt();
        let third = hypot(&[by_alpha_twice, by_beta_thrice])
            + number(3.0 * 0.385) * (mixed + by_beta_twice);
        Self { turns: [secant, by_beta, second, third], sine: s, cosine: c, tangent: t }
    }
}

/// Returns bounds on ‖R‖ and on its first, second and third derivative along a unit vector, for |β|
/// ≤ `sideslip`.
pub(super) fn turns(sideslip: f64) -> [Interval; 4] {
    Kinematics::new(sideslip).turns
}

impl Smoothness {
    /// Computes the bounds; `None` if the body is not symmetric about its x–z plane.
    pub(super) fn new(s: &Settings, rate: f64, sideslip: f64) -> Option<Self> {
        let body = Body::new(s)?;
        let kinematics = Kinematics::new(sideslip);
        let [r, first, second, third] = kinematics.turns;
        let omega = number(rate);
        let spin = Spin::new(&body);
        let gamma = number(s.limit_total()) / spin.smallest + spin.quadratic * omega.square();
        let (drift, drift_by_sideslip) = drift(&kinematics);
        let (drift, drift_by_sideslip) =
            (drift * omega.square(), drift_by_sideslip * omega.square());
        let force = drift + r * gamma;
        let angle_rate = omega / kinematics.cosine;
        let size = hypot(&[angle_rate, omega]);
        // The derivatives of γ follow from those of the bilinear ω × I ω.
        let gamma_slope = spin.bilinear * omega * gamma;
        let gamma_bend = spin.bilinear * (gamma.square() + omega * gamma_slope);
        let turned = second * angle_rate.square() + first * force;
        let slope = turned * omega + number(2.0) * first * angle_rate * gamma + r * gamma_slope;
        let turned_twice = third * angle_rate.square() * angle_rate
            + number(3.0) * second * angle_rate * force
            + first * slope;
        let bend = turned_twice * omega
            + number(3.0) * (turned * gamma + first * angle_rate * gamma_slope)
            + r * gamma_bend;
        // ‖∂W[n] x‖ ≤ √3 ‖x‖: ‖∂W/∂α‖ ≤ 1, and ∂W/∂β has the Frobenius norm √2.
        let by_angles = drift_by_sideslip
            + first * gamma
            + r * spin.bilinear * omega * number(3.0).sqrt() * size;
        let by_rates = (drift_by_rates(sideslip) + r * spin.bilinear) * omega;
        Some(Self { by_rates, by_angles, slope, bend, turning: gamma, angle_rate })
    }
}

/// Bounds on the gyroscopic term.
struct Spin {
    /// Smallest principal moment, kg m².
    smallest: Interval,
    /// Bound on ‖I⁻¹ (ω × I ω)‖ / ‖ω‖².
    quadratic: Interval,
    /// Bound on ‖I⁻¹ (a × I b + b × I a)‖ / (‖a‖ ‖b‖).
    bilinear: Interval,
}

impl Spin {
    /// In principal axes the components are (I_k − I_j)/I_i times ω_j ω_k, or times a_j b_k + a_k
    /// b_j.
    fn new(body: &Body) -> Self {
        let [x, z, y] = body.principal();
        let ratios = [(z - y) / x, (x - z) / y, (y - x) / z].map(Interval::abs);
        let least = ratios[0].min(ratios[1]).min(ratios[2]);
        // Each a_j² meets two of the three squares.
        let bilinear = (hypot(&ratios).square() - least.square()).sqrt();
        Self { smallest: x.min(z).min(y), quadratic: number(0.5) * bilinear, bilinear }
    }
}

/// Bounds on ‖h‖ and ‖∂h/∂β‖ relative to ‖ω‖². With y = [c x₁, x₂, x₃] and t = tan β the entries
/// are y₂ (2 t y₁ + y₃)/c and −y₁ (t y₁ + y₃).
fn drift(kinematics: &Kinematics) -> (Interval, Interval) {
    let Kinematics { sine: s, cosine: c, tangent: t, .. } = kinematics;
    let (half, one, two) = (number(0.5), Interval::ONE, number(2.0));
    let roll = hypot(&[two * *t, one]) / *c;
    // The eigenvalues of y₁ (t y₁ + y₃) are ½ (t ± √(t² + 1)).
    let value = hypot(&[half * roll, half * (*t + hypot(&[*t, one]))]);
    // ∂h₁/∂β = y₂ ((2/c + 2 s²/c³) y₁ + s/c² y₃), ∂h₂/∂β = (t² − 1) y₁² + t y₁ y₃, t ≤ 1.
    let secant = one / *c;
    let by_y1 = two * secant + two * t.square() * secant;
    let of_roll = half * hypot(&[by_y1, *s * secant.square()]);
    (value, hypot(&[of_roll, one.max(t.square()) + half * *t]))
}

/// Bound on ‖∂h/∂x‖ relative to ‖ω‖, from the larger eigenvalue of M Mᵀ with the rows
/// [2 s x₂, z, x₂]/c and −c [z, 0, x₁], z = 2 s x₁ + x₃, on all faces of a cube. A change of the
/// signs of β and x₁ does not change the eigenvalues.
fn drift_by_rates(sideslip: f64) -> Interval {
    let sides = Interval::new(-1.0, 1.0).parts(40);
    let mut largest = Interval::ZERO;
    for beta in Interval::new(0.0, sideslip).parts(10) {
        let (s, c) = beta.sin_cos();
        for first in sides.clone() {
            for second in sides.clone() {
                for face in 0..3 {
                    let mut y = [first, second, first];
                    y[face] = Interval::ONE;
                    y[(face + 1) % 3] = first;
                    y[(face + 2) % 3] = second;
                    largest = largest.max(slope_at(s, c, &y));
                }
            }
        }
    }
    number(largest.high).sqrt()
}

/// Returns the larger eigenvalue of M Mᵀ in [`drift_by_rates`] relative to ‖y‖².
fn slope_at(s: Interval, c: Interval, &[y1, x2, x3]: &[Interval; 3]) -> Interval {
    let (half, two) = (number(0.5), number(2.0));
    let x1 = y1 / c;
    let z = two * s * x1 + x3;
    let first =
        ((number(4.0) * s.square() + Interval::ONE) * x2.square() + z.square()) / c.square();
    let second = c.square() * z.square() + y1.square();
    let both = -(x2 * (two * s * z + x1));
    let largest =
        half * (first + second) + ((half * (first - second)).square() + both.square()).sqrt();
    largest / (y1.square() + x2.square() + x3.square())
}

/// How fast the moment that compensates an earlier one of 1 N m can grow while the vehicle turns,
/// as multiples of ‖ω‖.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    /// Bound on ‖I Ẇ R I⁻¹‖, the rate of the exponential growth of ‖I W R₀ I⁻¹‖.
    exponential: Interval,
    /// Bound on ‖I‖ ‖Ẇ‖ ‖R₀‖ ‖I⁻¹‖, the rate at which it grows at most.
    linear: Interval,
    /// Bound on ‖I‖ ‖W‖ ‖R₀‖ ‖I⁻¹‖.
    cap: Interval,
}

impl Growth {
    /// Finds the bounds over all α and |β| ≤ `sideslip`. Ẇ R = T (N α̇ + B β̇) T with N [p, t, q] =
    /// [q, 0, −p] and B = [[−s³/c, −c², 0], [1 + s², −c s, 0], 0].
    pub(super) fn new(body: &Body, sideslip: f64) -> Self {
        let [x, z, y] = body.principal();
        let secant = Interval::ONE / number(sideslip).sin_cos().1;
        let cap = secant * x.max(z).max(y) / x.min(z).min(y);
        let (mut exponential, mut turning) = (Interval::ZERO, Interval::ZERO);
        let half_turn = Interval::new(0.0, PI.next_up());
        // J and its inverse are symmetric, so that their columns are their rows.
        let tensors = |alpha: Interval| {
            let at = body.at([alpha, Interval::ZERO]);
            [[0, 1, 2].map(|i| at.inertia(unit(i))), [0, 1, 2].map(|i| at.inverse(unit(i)))]
        };
        let tensors: Vec<[Matrix; 2]> = half_turn.parts(60).map(tensors).collect();
        for beta in Interval::new(-sideslip, sideslip).parts(10) {
            let (s, c) = beta.sin_cos();
            for direction in half_turn.parts(60) {
                let (by_beta, by_alpha) = direction.sin_cos();
                let rates = [by_alpha / c, by_beta];
                let turn = turn(rates, s, c);
                let at = Turn::new(s, c);
                turning = turning.max(size(&[0, 1, 2].map(|i| at.along(&[rates], &unit(i)))));
                for [inertia, inverse] in &tensors {
                    let growth = size(&product(inertia, &product(&turn, inverse)));
                    exponential = exponential.max(growth);
                }
            }
        }
        let linear = (cap * turning).upper();
        Self { exponential: exponential.upper(), linear, cap: cap.upper() }
    }

    /// Upper bound of ‖I W R₀ I⁻¹ X‖ after turning by up to `angle` = ∫ ‖ω‖, with ‖X‖ ≤ `size` and
    /// ‖I⁻¹ X‖ ≤ ‖I⁻¹‖.
    pub(super) fn after(&self, size: Interval, angle: Interval) -> Interval {
        let exponential = size * (self.exponential * angle).exp();
        let linear = size + self.linear * angle;
        Interval::point(exponential.high.min(linear.high).min(self.cap.high))
    }
}

type Matrix = [[Interval; 3]; 3];

fn turn([alpha, beta]: [Interval; 2], s: Interval, c: Interval) -> Matrix {
    let (zero, one) = (Interval::ZERO, Interval::ONE);
    [
        [-(beta * s.square() * s / c), -(beta * c.square()), alpha],
        [beta * (one + s.square()), -(beta * c * s), zero],
        [-alpha, zero, zero],
    ]
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j])
    })
}

/// Bound on the spectral norm: ‖M‖⁸ ≤ tr (M Mᵀ)⁴.
fn size(m: &Matrix) -> Interval {
    let transposed: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| m[j][i]));
    let square = product(m, &transposed);
    let fourth = product(&square, &square);
    let trace = fourth.iter().flatten().fold(Interval::ZERO, |sum, entry| sum + entry.square());
    trace.sqrt().sqrt().sqrt()
}
