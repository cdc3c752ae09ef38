//! Body rates, control moment and input as functions of the nominal motion (Θ, x_ω, a), a = ẋ_ω, with exact derivatives.
//!
//! ω = W x_ω with W = R⁻¹ (Chai 2022, proof of Lemma 1), hence ω̇ = W a + Ẇ x_ω, and from Euler's equation and u = R I⁻¹ m (4)
//!
//! m = I ω̇ + ω × I ω,  u = R I⁻¹ m = a − f.
//!
//! The angle of attack turns W about the pitch axis: ∂W/∂α = W × e_y, column by column, so that every derivative by α is a cross
//! product and only those by β are written out.

use nalgebra::{Matrix3, Matrix3x2, Vector3};
use vehicle::dynamics::RigidBody;
use vehicle::kinematics as kin;

/// A vector quantity y(Θ, x_ω, a) at a point, and its partial derivatives. Nothing depends on the bank angle.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    /// y.
    pub value: Vector3<f64>,
    /// ∂y/∂(α, β).
    pub by_angles: Matrix3x2<f64>,
    /// ∂y/∂x_ω.
    pub by_rates: Matrix3<f64>,
    /// ∂y/∂a.
    pub by_acceleration: Matrix3<f64>,
}

/// W = R⁻¹ and its derivatives by β at given angles.
#[derive(Clone, Copy, Debug)]
pub struct InverseKinematics {
    /// Sine and cosine of α and of β.
    sines: [f64; 4],
    w: Matrix3<f64>,
    w_beta: Matrix3<f64>,
    w_beta_beta: Matrix3<f64>,
}

impl InverseKinematics {
    /// At these angles, rad.
    pub fn at(angles: &Vector3<f64>) -> Self {
        let (sa, ca) = angles.x.sin_cos();
        let (sb, cb) = angles.y.sin_cos();
        // cos 2β, sin 2β
        let (c2, s2) = (cb * cb - sb * sb, 2.0 * sb * cb);
        Self {
            sines: [sa, ca, sb, cb],
            w: Matrix3::new(-ca * sb * cb, sa, -ca * cb, cb * cb, 0.0, -sb, -sa * sb * cb, -ca, -sa * cb),
            w_beta: Matrix3::new(-ca * c2, 0.0, ca * sb, -s2, 0.0, -cb, -sa * c2, 0.0, sa * sb),
            w_beta_beta: Matrix3::new(
                2.0 * ca * s2,
                0.0,
                ca * cb,
                -2.0 * c2,
                0.0,
                sb,
                2.0 * sa * s2,
                0.0,
                sa * cb,
            ),
        }
    }

    /// ω and ∂ω/∂(α, β).
    pub fn body_rates(&self, angle_rates: &Vector3<f64>) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let rates = self.w * angle_rates;
        (rates, [by_alpha(&rates), self.w_beta * angle_rates])
    }

    /// m, as [`moment`].
    pub fn moment(
        &self,
        body: &RigidBody,
        angle_rates: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        let rates = self.w * angle_rates;
        body.inertia * self.acceleration(angle_rates, acceleration) + rates.cross(&(body.inertia * rates))
    }

    /// ω̇ = W a + Ẇ x_ω.
    fn acceleration(&self, x: &Vector3<f64>, a: &Vector3<f64>) -> Vector3<f64> {
        self.w * a + by_alpha(&(self.w * x)) * x.x + self.w_beta * x * x.y
    }
}

/// y × e_y: the derivative by α of a vector that α turns with W.
fn by_alpha(y: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-y.z, 0.0, y.x)
}

/// Body rates ω = R⁻¹(Θ) x_ω, rad/s.
pub fn body_rates(angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Vector3<f64> {
    kin::r_inverse(angles) * angle_rates
}

/// Control moment that gives the nominal motion the acceleration `a` (rad/s²): m = I R⁻¹ (a − f), N m.
pub fn moment(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    InverseKinematics::at(angles).moment(body, angle_rates, acceleration)
}

/// The input u = R I⁻¹ m = a − f of Chai 2022 (4), rad/s².
pub fn input(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    acceleration - body.drift(angles, angle_rates)
}

/// Body rates and moment together with their derivatives at one point of a motion.
#[derive(Clone, Copy, Debug)]
pub struct Linearisation {
    /// ω, rad/s.
    pub rates: Linear,
    /// m, N m.
    pub moment: Linear,
}

/// Derivatives of ω and m at (Θ, x_ω, a).
pub fn linearise(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Linearisation {
    InverseKinematics::at(angles).linearise(body, angle_rates, acceleration)
}

impl InverseKinematics {
    /// Derivatives of ω and m, as [`linearise`].
    pub fn linearise(&self, body: &RigidBody, x: &Vector3<f64>, a: &Vector3<f64>) -> Linearisation {
        let Self { w, w_beta, w_beta_beta, .. } = self;

        let rates = w * x;
        let rates_by_angles = [by_alpha(&rates), w_beta * x];

        let omega_dot = self.acceleration(x, a);
        let omega_dot_by_beta = w_beta * a + by_alpha(&rates_by_angles[1]) * x.x + w_beta_beta * x * x.y;
        let omega_dot_by_angles = [by_alpha(&omega_dot), omega_dot_by_beta];
        // Ẇ, and what α̇ and β̇ in it contribute.
        let mut omega_dot_by_rates = w_beta * x.y;
        for (i, by_angle) in rates_by_angles.iter().enumerate() {
            let mut column = omega_dot_by_rates.column_mut(i);
            column += by_angle;
        }
        for (i, column) in w.column_iter().enumerate() {
            let mut sum = omega_dot_by_rates.column_mut(i);
            sum += by_alpha(&column.into_owned()) * x.x;
        }

        let momentum = body.inertia * rates;
        // ∂(ω × I ω)/∂ω
        let gyroscopic = rates.cross_matrix() * body.inertia - momentum.cross_matrix();
        let moment_by_angle =
            |i: usize| body.inertia * omega_dot_by_angles[i] + gyroscopic * rates_by_angles[i];
        Linearisation {
            rates: Linear {
                value: rates,
                by_angles: Matrix3x2::from_columns(&rates_by_angles),
                by_rates: *w,
                by_acceleration: Matrix3::zeros(),
            },
            moment: Linear {
                value: body.inertia * omega_dot + rates.cross(&momentum),
                by_angles: Matrix3x2::from_columns(&[moment_by_angle(0), moment_by_angle(1)]),
                by_rates: body.inertia * omega_dot_by_rates + gyroscopic * w,
                by_acceleration: body.inertia * w,
            },
        }
    }
}

/// Bounds on ‖∂m/∂(α, β)‖ and ‖∂m/∂x_ω‖ (Frobenius) at any angles with these ‖x_ω‖ and ‖a‖, over the largest moment of inertia: far off
/// where a is large, but they cost nothing.
///
/// With ‖W‖ = 1 (Lemma 1), hence ‖ω‖ ≤ ‖x‖, and from the columns above ‖W‖² ≤ 3, ‖∂W/∂β‖² = 2 (‖·‖₂² ≤ 2) and
/// ‖∂²W/∂β²‖² ≤ 5 in Frobenius' norm, term by term of [`linearise`].
pub fn moment_slope_bounds(x: f64, a: f64) -> (f64, f64) {
    let (root2, root3, root5) = (std::f64::consts::SQRT_2, 3.0_f64.sqrt(), 5.0_f64.sqrt());
    // ‖ω̇‖ ≤ ‖a‖ + |α̇| ‖ω‖ + |β̇| √2 ‖x‖
    let acceleration = a + root3 * x * x;
    let by_alpha = acceleration + 2.0 * x * x;
    let by_beta = root2 * a + (2.0 + 5.0_f64).sqrt() * x * x + 2.0 * root2 * x * x;
    ((by_alpha * by_alpha + by_beta * by_beta).sqrt(), x * (root5 + 1.0 + root2 + 2.0 * root3))
}

impl InverseKinematics {
    /// The input u = R I⁻¹ m with its derivatives, from those of the moment. With γ = I⁻¹m and R = W⁻¹, column by column,
    /// ∂u = R (∂γ) + (∂R) γ.
    pub fn input_of_moment(&self, body: &RigidBody, moment: &Linear) -> Linear {
        let [sa, ca, sb, cb] = self.sines;
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
            by_angles: torque_to_input * moment.by_angles + Matrix3x2::from_columns(&[by_alpha, by_beta]),
            by_rates: torque_to_input * moment.by_rates,
            // R I⁻¹ I R⁻¹
            by_acceleration: Matrix3::identity(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle::dynamics::Inertia;

    fn body() -> RigidBody {
        let inertia = Inertia { Ixx: 588791.0, Iyy: 1303212.0, Izz: 1534163.0, Ixz: 24242.0 };
        RigidBody::new(inertia.matrix()).unwrap()
    }

    #[test]
    fn oracle_moment_is_that_of_the_printed_equations() {
        // m = I R⁻¹ (a − f), Chai 2022, (4) and (7).
        let body = body();
        let angles = Vector3::new(0.17, 0.12, -0.5);
        let (x, a) = (Vector3::new(0.05, -0.06, 0.04), Vector3::new(0.1, -0.08, 0.05));
        let printed = body.inertia * kin::r_inverse(&angles) * (a - body.drift(&angles, &x));
        let ours = moment(&body, &angles, &x, &a);
        assert!((ours - printed).norm() < 1e-13 * printed.norm(), "{ours} {printed}");
    }

    #[test]
    fn oracle_slopes_of_the_moment_stay_within_their_bounds() {
        let body = body();
        let largest = body.inertia.symmetric_eigenvalues().max();
        // A lattice of directions and sizes from a low-discrepancy sequence.
        let at = |i: usize, j: usize| {
            let irrational =
                [0.754_877_7, 0.569_840_3, 0.430_159_7, 0.324_717_9, 0.245_122_3, 0.185_037_6, 0.139_680_6];
            (0.5 + i as f64 * irrational[j]).fract() * 2.0 - 1.0
        };
        let mut tightest = 0.0_f64;
        for i in 1..20_000 {
            let angles = Vector3::new(3.1 * at(i, 0), 1.5 * at(i, 1), 0.0);
            let x = Vector3::new(at(i, 2), at(i, 3), at(i, 4)) * 10.0_f64.powf(2.0 * at(i, 5) - 1.0);
            let a = Vector3::new(at(i, 4), at(i, 2), at(i, 6)) * 10.0_f64.powf(2.0 * at(i, 6) - 1.0);
            let exact = linearise(&body, &angles, &x, &a).moment;
            let (by_angles, by_rates) = moment_slope_bounds(x.norm(), a.norm());
            let shares = (
                exact.by_angles.norm() / (largest * by_angles),
                exact.by_rates.norm() / (largest * by_rates),
            );
            assert!(shares.0 <= 1.0 && shares.1 <= 1.0, "{shares:?} at {angles} {x} {a}");
            tightest = tightest.max(shares.0).max(shares.1);
        }
        assert!(tightest > 0.5, "{tightest}");
    }

    #[test]
    fn oracle_derivatives_agree_with_central_differences() {
        let body = body();
        let point = [0.17, 0.12, -0.5, 0.05, -0.06, 0.04, 0.1, -0.08, 0.05];
        let split = |z: &[f64; 9]| {
            let at = |i: usize| Vector3::new(z[i], z[i + 1], z[i + 2]);
            (at(0), at(3), at(6))
        };
        let all = |z: &[f64; 9]| {
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
            assert!((linear.value - all(&point)[y]).norm() <= 1e-12 * linear.value.norm());
            for i in 0..9 {
                let step = 1e-5;
                let (mut plus, mut minus) = (point, point);
                plus[i] += step;
                minus[i] -= step;
                let numeric = (all(&plus)[y] - all(&minus)[y]) / (2.0 * step);
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
