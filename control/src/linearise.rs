//! Body rates, control moment and input as functions of the nominal state and acceleration (Θ, x_ω,
//! a), a = ẋ_ω, with exact derivatives.
//!
//! ω = W x_ω with W = R⁻¹ (Chai 2022, proof of Lemma 1), hence ω̇ = W a + Ẇ x_ω, and from Euler's
//! equation and u = R I⁻¹ m (4)
//!
//! m = I ω̇ + ω × I ω,  u = R I⁻¹ m = a − f.
//!
//! The angle of attack turns W about the pitch axis: ∂W/∂α = W × e_y, column by column, so that
//! every derivative by α is a cross product and only those by β are written out.

use nalgebra::{Matrix3, Matrix3x2, Vector3};
use std::f64::consts::SQRT_2;
use vehicle::dynamics::RigidBody;
use vehicle::math::sin_cos;

/// A vector quantity y(Θ, x_ω, a) at a point with its partial derivatives. Nothing depends on the
/// bank angle.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    /// Value of y at the point.
    pub value: Vector3<f64>,
    /// Derivative ∂y/∂(α, β) of the quantity.
    pub by_angles: Matrix3x2<f64>,
    /// Derivative ∂y/∂x_ω of the quantity.
    pub by_rates: Matrix3<f64>,
    /// Derivative ∂y/∂a of the quantity.
    pub by_acceleration: Matrix3<f64>,
}

/// The matrix W = R⁻¹ at given angles with its derivatives by β: W x = T(α) V(β) x, where T turns
/// about the pitch axis.
#[derive(Clone, Copy, Debug)]
pub struct InverseKinematics {
    /// Sine and cosine of α.
    alpha: (f64, f64),
    /// Sine and cosine of β.
    beta: (f64, f64),
}

impl InverseKinematics {
    /// Computes the kinematics at these angles, rad.
    pub fn at(angles: &Vector3<f64>) -> Self {
        Self { alpha: sin_cos(angles.x), beta: sin_cos(angles.y) }
    }

    /// Returns the turned vector T [p, t, q].
    #[inline]
    fn turn(&self, p: f64, t: f64, q: f64) -> Vector3<f64> {
        let (sa, ca) = self.alpha;
        Vector3::new(ca * p + sa * q, t, sa * p - ca * q)
    }

    /// Returns the product W x.
    #[inline]
    fn w(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let (sb, cb) = self.beta;
        self.turn(-cb * (sb * x.x + x.z), cb * cb * x.x - sb * x.z, x.y)
    }

    /// Returns the product ∂W/∂β x.
    #[inline]
    fn w_beta(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let (sb, cb) = self.beta;
        self.turn(sb * x.z - (cb * cb - sb * sb) * x.x, -cb * (2.0 * sb * x.x + x.z), 0.0)
    }

    /// Returns the product ∂²W/∂β² x.
    #[inline]
    fn w_beta_beta(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let (sb, cb) = self.beta;
        self.turn(cb * (4.0 * sb * x.x + x.z), sb * x.z - 2.0 * (cb * cb - sb * sb) * x.x, 0.0)
    }

    /// Returns the columns of W and of ∂W/∂β.
    #[inline]
    fn columns(&self) -> ([Vector3<f64>; 3], [Vector3<f64>; 3]) {
        let (sb, cb) = self.beta;
        let w =
            [self.turn(-cb * sb, cb * cb, 0.0), self.turn(0.0, 0.0, 1.0), self.turn(-cb, -sb, 0.0)];
        let w_beta = [
            self.turn(sb * sb - cb * cb, -2.0 * sb * cb, 0.0),
            Vector3::zeros(),
            self.turn(sb, -cb, 0.0),
        ];
        (w, w_beta)
    }

    /// Returns the matrix W = R⁻¹.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&self.columns().0)
    }

    /// Returns ω and ∂ω/∂(α, β) for the given x_ω.
    pub fn body_rates(&self, angle_rates: &Vector3<f64>) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let rates = self.w(angle_rates);
        (rates, [by_alpha(&rates), self.w_beta(angle_rates)])
    }

    /// Returns the moment m, as [`moment`] does.
    pub fn moment(
        &self,
        body: &RigidBody,
        angle_rates: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        let (rates, by_angles) = self.body_rates(angle_rates);
        let omega_dot = self.acceleration(angle_rates, acceleration, &by_angles);
        body.inertia * omega_dot + rates.cross(&(body.inertia * rates))
    }

    /// Returns ω with its derivatives by (α, β), and the moment as a function of the acceleration.
    pub fn motion(&self, body: &RigidBody, angle_rates: &Vector3<f64>) -> BodyMotion {
        let (rates, by_angles) = self.body_rates(angle_rates);
        let omega_dot = self.acceleration(angle_rates, &Vector3::zeros(), &by_angles);
        BodyMotion {
            rates,
            rates_by_angles: by_angles,
            moment_by_acceleration: Matrix3::from_columns(
                &self.columns().0.map(|w| body.inertia * w),
            ),
            moment_at_rest: body.inertia * omega_dot + rates.cross(&(body.inertia * rates)),
        }
    }

    /// Returns the input u = R I⁻¹ m, as [`input`] does.
    pub fn input(
        &self,
        body: &RigidBody,
        angle_rates: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        self.r(&(body.inverse * self.moment(body, angle_rates, acceleration)))
    }

    /// Returns ω̇ = W a + Ẇ x_ω with Ẇ x_ω = ∂ω/∂α α̇ + ∂ω/∂β β̇.
    fn acceleration(
        &self,
        x: &Vector3<f64>,
        a: &Vector3<f64>,
        by_angles: &[Vector3<f64>; 2],
    ) -> Vector3<f64> {
        self.w(a) + by_angles[0] * x.x + by_angles[1] * x.y
    }

    /// Returns R y = [y_y − p tan β, q, −p cos β − y_y sin β] with p = y_x cos α + y_z sin α,
    /// q = y_x sin α − y_z cos α.
    fn r(&self, y: &Vector3<f64>) -> Vector3<f64> {
        let ((sa, ca), (sb, cb)) = (self.alpha, self.beta);
        let (p, q) = (ca * y.x + sa * y.z, sa * y.x - ca * y.z);
        Vector3::new(y.y - p * sb / cb, q, -p * cb - y.y * sb)
    }
}

/// Body rates and moment at given angles and rates, for any acceleration.
#[derive(Clone, Copy, Debug)]
pub struct BodyMotion {
    /// Body rates ω, rad/s.
    pub rates: Vector3<f64>,
    /// Derivative ∂ω/∂(α, β), column by column.
    pub rates_by_angles: [Vector3<f64>; 2],
    /// Derivative of the moment, ∂m/∂a = I W.
    pub moment_by_acceleration: Matrix3<f64>,
    /// Moment m for a = 0, which is I Ẇ x_ω + ω × I ω, N m.
    pub moment_at_rest: Vector3<f64>,
}

impl BodyMotion {
    /// Returns the moment for this acceleration, N m.
    pub fn moment(&self, acceleration: &Vector3<f64>) -> Vector3<f64> {
        self.moment_by_acceleration * acceleration + self.moment_at_rest
    }
}

/// Returns y × e_y: the derivative by α of a vector that α turns together with W.
fn by_alpha(y: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-y.z, 0.0, y.x)
}

/// Returns the body rates ω = R⁻¹(Θ) x_ω, rad/s.
pub fn body_rates(angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Vector3<f64> {
    InverseKinematics::at(angles).w(angle_rates)
}

/// Returns the control moment that gives the nominal model the acceleration `a` (rad/s²): m = I R⁻¹
/// (a − f), N m.
pub fn moment(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    InverseKinematics::at(angles).moment(body, angle_rates, acceleration)
}

/// Returns the input u = R I⁻¹ m = a − f of Chai 2022 (4), rad/s².
pub fn input(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    InverseKinematics::at(angles).input(body, angle_rates, acceleration)
}

/// Body rates and moment with their derivatives at one point (Θ, x_ω, a).
#[derive(Clone, Copy, Debug)]
pub struct Linearisation {
    /// Body rates ω with derivatives, rad/s.
    pub rates: Linear,
    /// Control moment m with derivatives, N m.
    pub moment: Linear,
}

/// Returns ω and m with their derivatives at (Θ, x_ω, a).
pub fn linearise(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Linearisation {
    InverseKinematics::at(angles).linearise(body, angle_rates, acceleration)
}

impl InverseKinematics {
    /// Returns ω and m with their derivatives, as [`linearise`] does.
    pub fn linearise(&self, body: &RigidBody, x: &Vector3<f64>, a: &Vector3<f64>) -> Linearisation {
        let (rates, rates_by_angles) = self.body_rates(x);
        let omega_dot = self.acceleration(x, a, &rates_by_angles);
        let omega_dot_by_beta =
            self.w_beta(a) + by_alpha(&rates_by_angles[1]) * x.x + self.w_beta_beta(x) * x.y;
        let omega_dot_by_angles = [by_alpha(&omega_dot), omega_dot_by_beta];
        let (w, w_beta) = self.columns();
        // Ẇ, and the contributions of α̇ and β̇ in it.
        let mut omega_dot_by_rates: [Vector3<f64>; 3] =
            std::array::from_fn(|i| by_alpha(&w[i]) * x.x + w_beta[i] * x.y);
        omega_dot_by_rates[0] += rates_by_angles[0];
        omega_dot_by_rates[1] += rates_by_angles[1];

        // Product rule: ∂(ω × I ω) = ∂ω × I ω + ω × I ∂ω.
        let momentum = body.inertia * rates;
        let moment_by =
            |omega_dot: &Vector3<f64>, omega: &Vector3<f64>, momentum_by: &Vector3<f64>| {
                body.inertia * omega_dot + omega.cross(&momentum) + rates.cross(momentum_by)
            };
        let momentum_by_rates = w.map(|w| body.inertia * w);
        let by_angle = |i: usize| {
            moment_by(
                &omega_dot_by_angles[i],
                &rates_by_angles[i],
                &(body.inertia * rates_by_angles[i]),
            )
        };
        let by_rate = |i: usize| moment_by(&omega_dot_by_rates[i], &w[i], &momentum_by_rates[i]);
        Linearisation {
            rates: Linear {
                value: rates,
                by_angles: Matrix3x2::from_columns(&rates_by_angles),
                by_rates: Matrix3::from_columns(&w),
                by_acceleration: Matrix3::zeros(),
            },
            moment: Linear {
                value: body.inertia * omega_dot + rates.cross(&momentum),
                by_angles: Matrix3x2::from_columns(&[by_angle(0), by_angle(1)]),
                by_rates: Matrix3::from_columns(&[by_rate(0), by_rate(1), by_rate(2)]),
                by_acceleration: Matrix3::from_columns(&momentum_by_rates),
            },
        }
    }
}

/// Bound on ‖∂(W y)/∂(α, β)‖ relative to ‖y‖ (Frobenius): √(5/2). The largest eigenvalue λ of the
/// quadratic form in y solves λ² − (2 + c²(1 + s²)) λ + c²(1 + c²) = 0 with s = sin β, c = cos β,
/// and is below 5/2 at any β.
pub const TURN_BY_ANGLES: f64 = 1.581_138_830_084_189_8;

/// Bounds on the derivatives of the moment that follow from the sizes of x_ω and a alone, relative
/// to the largest moment of inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentSlopeBounds {
    /// Bound on ‖∂m/∂(α, β)‖ (Frobenius).
    pub by_angles: f64,
    /// Bound on ‖∂m/∂x_ω‖ (Frobenius).
    pub by_rates: f64,
}

impl MomentSlopeBounds {
    /// Computes the bounds for any angles, with ‖x_ω‖ ≤ x, ‖a‖ ≤ a and this ratio of the largest to
    /// the smallest moment of inertia.
    ///
    /// The columns above give, in Frobenius' norm, ‖∂W/∂α‖² ≤ 2 and ‖∂W/∂β‖² = 2, orthogonal to
    /// each other, hence ‖Ẇ‖² ≤ 2 ‖x‖². They also give ‖∂W/∂α y‖² + ‖∂W/∂β y‖² ≤ 5/2 ‖y‖², and
    /// ‖∂²W y‖² ≤ (1 + 2 · 2 + 5) ‖y‖² over α², twice αβ, and β². With principal axes,
    /// ‖∂(ω × I ω)/∂ω‖² ≤ 2 (I_max − I_min)² ‖ω‖², and ‖ω‖ ≤ ‖x‖ as ‖W‖ = 1 (Lemma 1).
    pub fn new(x: f64, a: f64, ratio: f64) -> Self {
        let gyroscopic = SQRT_2 * (1.0 - 1.0 / ratio);
        Self {
            by_angles: TURN_BY_ANGLES * (a + gyroscopic * x * x) + 10.0_f64.sqrt() * x * x,
            by_rates: (SQRT_2 + TURN_BY_ANGLES + gyroscopic) * x,
        }
    }
}

/// Returns a bound on ‖u‖ at any α and this β, with ‖x_ω‖ = `x` and ‖a‖ = `a`. `ratio` is that of
/// the largest to the smallest moment of inertia.
///
/// u = a − f with f = −R (Ẇ x_ω + I⁻¹ (ω × I ω)); ‖R‖² ≤ 2 + 1/cos²β in Frobenius' norm, and
/// ‖ω × I ω‖ ≤ ½ (I_max − I_min) ‖ω‖².
pub fn input_bound(beta: f64, x: f64, a: f64, ratio: f64) -> f64 {
    let cosine = (1.0 - 0.5 * beta * beta).max(0.0);
    let r = (2.0 + 1.0 / (cosine * cosine)).sqrt();
    a + r * (3.0_f64.sqrt() + 0.5 * (ratio - 1.0)) * x * x
}

impl InverseKinematics {
    /// Returns the input u = R I⁻¹ m with its derivatives, from those of the moment. With γ = I⁻¹m
    /// and R = W⁻¹, ∂u = R (∂γ) + (∂R) γ, column by column.
    pub fn input_of_moment(&self, body: &RigidBody, moment: &Linear) -> Linear {
        let ((sa, ca), (sb, cb)) = (self.alpha, self.beta);
        let (tb, sec2) = (sb / cb, 1.0 / (cb * cb));
        let r = Matrix3::new(-ca * tb, 1.0, -sa * tb, sa, 0.0, -ca, -ca * cb, -sb, -cb * sa);
        let gamma = body.inverse * moment.value;
        let (p, q) = (ca * gamma.x + sa * gamma.z, sa * gamma.x - ca * gamma.z);
        // R γ = [γ_y − p tan β, q, −p cos β − γ_y sin β], and α turns (p, q) into each other.
        let by_alpha = Vector3::new(q * tb, p, q * cb);
        let by_beta = Vector3::new(-p * sec2, 0.0, p * sb - gamma.y * cb);
        let torque_to_input = r * body.inverse;
        Linear {
            value: r * gamma,
            by_angles: torque_to_input * moment.by_angles
                + Matrix3x2::from_columns(&[by_alpha, by_beta]),
            by_rates: torque_to_input * moment.by_rates,
            // This derivative is R I⁻¹ I R⁻¹.
            by_acceleration: Matrix3::identity(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle::dynamics::Inertia;
    use vehicle::kinematics as kin;

    fn body() -> RigidBody {
        let inertia = Inertia { Ixx: 588791.0, Iyy: 1303212.0, Izz: 1534163.0, Ixz: 24242.0 };
        RigidBody::new(inertia.matrix()).unwrap()
    }

    #[test]
    fn oracle_moment_is_that_of_the_printed_equations() {
        // Chai 2022, (4) and (7): m = I R⁻¹ (a − f).
        let body = body();
        let angles = Vector3::new(0.17, 0.12, -0.5);
        let (x, a) = (Vector3::new(0.05, -0.06, 0.04), Vector3::new(0.1, -0.08, 0.05));
        let u = a - body.drift(&angles, &x);
        assert!((input(&body, &angles, &x, &a) - u).norm() < 1e-13 * u.norm());
        let printed = body.inertia * kin::r_inverse(&angles) * (a - body.drift(&angles, &x));
        let ours = moment(&body, &angles, &x, &a);
        assert!((ours - printed).norm() < 1e-13 * printed.norm(), "{ours} {printed}");
    }

    #[test]
    fn oracle_slopes_of_the_moment_and_the_input_stay_within_their_bounds() {
        let body = body();
        let inertia = body.inertia.symmetric_eigenvalues();
        // The directions and sizes form a lattice from a low-discrepancy sequence.
        let at = |i: usize, j: usize| {
            let irrational = [
                0.754_877_7,
                0.569_840_3,
                0.430_159_7,
                0.324_717_9,
                0.245_122_3,
                0.185_037_6,
                0.139_680_6,
            ];
            (0.5 + i as f64 * irrational[j]).fract() * 2.0 - 1.0
        };
        let mut tightest = [0.0_f64; 4];
        for i in 1..20_000 {
            let angles = Vector3::new(3.1 * at(i, 0), 1.5 * at(i, 1), 0.0);
            let x =
                Vector3::new(at(i, 2), at(i, 3), at(i, 4)) * 10.0_f64.powf(2.0 * at(i, 5) - 1.0);
            let a =
                Vector3::new(at(i, 4), at(i, 2), at(i, 6)) * 10.0_f64.powf(2.0 * at(i, 6) - 1.0);
            let exact = linearise(&body, &angles, &x, &a);
            let ratio = inertia.max() / inertia.min();
            let bounds = MomentSlopeBounds::new(x.norm(), a.norm(), ratio);
            let u = input(&body, &angles, &x, &a).norm();
            let input_bound = input_bound(angles.y, x.norm(), a.norm(), ratio);
            let shares = [
                exact.moment.by_angles.norm() / (inertia.max() * bounds.by_angles),
                exact.moment.by_rates.norm() / (inertia.max() * bounds.by_rates),
                u / input_bound,
                exact.rates.by_angles.norm() / (TURN_BY_ANGLES * x.norm()),
            ];
            for (share, tightest) in shares.iter().zip(&mut tightest) {
                assert!(*share <= 1.0 + 1e-12, "{shares:?} at {angles} {x} {a}");
                *tightest = tightest.max(*share);
            }
        }
        let [by_angles, by_rates, ..] = tightest;
        assert!(by_angles.max(by_rates) > 0.5, "{tightest:?}");
        assert!(tightest.iter().all(|share| *share > 0.2), "{tightest:?}");
    }

    #[test]
    fn oracle_derivatives_agree_with_central_differences() {
        let body = body();
        let point = [0.17, 0.12, -0.5, 0.05, -0.06, 0.04, 0.1, -0.08, 0.05];
        let split = |z: &[f64; 9]| {
            let at = |i: usize| Vector3::new(z[i], z[i + 1], z[i + 2]);
            (at(0), at(3), at(6))
        };
        let quantities = |z: &[f64; 9]| {
            let (angles, rates, a) = split(z);
            [
                body_rates(&angles, &rates),
                moment(&body, &angles, &rates, &a),
                input(&body, &angles, &rates, &a),
            ]
        };
        let (angles, rates, a) = split(&point);
        let exact = linearise(&body, &angles, &rates, &a);
        let exact_input = InverseKinematics::at(&angles).input_of_moment(&body, &exact.moment);
        for (y, linear) in [exact.rates, exact.moment, exact_input].iter().enumerate() {
            assert!((linear.value - quantities(&point)[y]).norm() <= 1e-12 * linear.value.norm());
            let motion = InverseKinematics::at(&angles).motion(&body, &rates);
            assert!(
                (motion.moment(&a) - exact.moment.value).norm()
                    <= 1e-12 * exact.moment.value.norm()
            );
            for i in 0..9 {
                let step = 1e-5;
                let (mut plus, mut minus) = (point, point);
                plus[i] += step;
                minus[i] -= step;
                let numeric = (quantities(&plus)[y] - quantities(&minus)[y]) / (2.0 * step);
                let analytic = match i {
                    0 | 1 => linear.by_angles.column(i).into_owned(),
                    2 => Vector3::zeros(),
                    3..6 => linear.by_rates.column(i - 3).into_owned(),
                    _ => linear.by_acceleration.column(i - 6).into_owned(),
                };
                let scale = [1.0, 2e6, 1.0][y];
                assert!((numeric - analytic).norm() < 1e-8 * scale, "quantity {y}, argument {i}");
            }
        }
    }
}
