//! Derivatives of body rates, moment and input.

use super::{InverseKinematics, by_alpha};
use nalgebra::{Matrix3, Matrix3x2, Vector3};
use vehicle::dynamics::RigidBody;

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

/// Body rates and moment with their derivatives at one point (Θ, x_ω, a).
#[derive(Clone, Copy, Debug)]
pub struct Linearisation {
    /// Body rates ω with derivatives, rad/s.
    pub rates: Linear,
    /// Control moment m with derivatives, N m.
    pub moment: Linear,
}

impl InverseKinematics {
    /// Returns ω and m with their derivatives at (Θ, x_ω, a).
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
