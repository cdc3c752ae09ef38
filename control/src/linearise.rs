//! Body rates and control moment as functions of the nominal motion (Θ, x_ω, a), a = ẋ_ω, with exact derivatives.
//!
//! ω = R⁻¹ x_ω and, from ẋ_ω = f + u with u = R I⁻¹ m (Chai 2022, (4) and (7)),
//! m = I R⁻¹ (a − Ṙ ω) + ω × I ω, u = a − Ṙ ω + R I⁻¹ (ω × I ω).

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
    let inverse = kin::r_inverse(angles);
    let rates = inverse * angle_rates;
    let required = acceleration - kin::r_dot(angles, angle_rates) * rates;
    body.inertia * (inverse * required) + rates.cross(&(body.inertia * rates))
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

/// Body rates, moment and input together with their derivatives at one point of a trajectory.
#[derive(Clone, Copy, Debug)]
pub struct Linearisation {
    /// ω, rad/s.
    pub rates: Linear,
    /// m, N m.
    pub moment: Linear,
    /// u, rad/s².
    pub input: Linear,
}

/// Derivatives of ω, m and u at (Θ, x_ω, a).
pub fn linearise(
    body: &RigidBody,
    angles: &Vector3<f64>,
    angle_rates: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Linearisation {
    let r = kin::r(angles);
    let w = kin::r_inverse(angles);
    let by = [kin::r_alpha(angles), kin::r_beta(angles)];
    let mixed = kin::r_alpha_beta(angles);
    let second = [[kin::r_alpha_alpha(angles), mixed], [mixed, kin::r_beta_beta(angles)]];
    let r_dot = by[0] * angle_rates.x + by[1] * angle_rates.y;

    let rates = w * angle_rates;
    let momentum = body.inertia * rates;
    let gyroscopic = rates.cross(&momentum);
    // ∂(ω × I ω)/∂ω
    let by_omega = rates.cross_matrix() * body.inertia - momentum.cross_matrix();
    // c = a − Ṙ ω
    let c = acceleration - r_dot * rates;

    let mut rates_by_angles = Matrix3x2::zeros();
    let mut moment_by_angles = Matrix3x2::zeros();
    let mut input_by_angles = Matrix3x2::zeros();
    for i in 0..2 {
        // ∂R⁻¹/∂z = −R⁻¹ (∂R/∂z) R⁻¹
        let omega_z = -(w * (by[i] * rates));
        let r_dot_z = second[i][0] * angle_rates.x + second[i][1] * angle_rates.y;
        let c_z = -(r_dot_z * rates + r_dot * omega_z);
        let gyroscopic_z = by_omega * omega_z;
        rates_by_angles.set_column(i, &omega_z);
        moment_by_angles.set_column(i, &(body.inertia * (w * (c_z - by[i] * (w * c))) + gyroscopic_z));
        let input_z = c_z + by[i] * (body.inverse * gyroscopic) + r * (body.inverse * gyroscopic_z);
        input_by_angles.set_column(i, &input_z);
    }

    // ∂c/∂x_ω: Ṙ depends on α̇ and β̇, and ω = R⁻¹ x_ω.
    let mut c_by_rates = -(r_dot * w);
    for (i, r_z) in by.iter().enumerate() {
        let column = c_by_rates.column(i) - r_z * rates;
        c_by_rates.set_column(i, &column);
    }
    let gyroscopic_by_rates = by_omega * w;
    let inertia_w = body.inertia * w;

    Linearisation {
        rates: Linear {
            value: rates,
            by_angles: rates_by_angles,
            by_rates: w,
            by_acceleration: Matrix3::zeros(),
        },
        moment: Linear {
            value: inertia_w * c + gyroscopic,
            by_angles: moment_by_angles,
            by_rates: inertia_w * c_by_rates + gyroscopic_by_rates,
            by_acceleration: inertia_w,
        },
        input: Linear {
            value: c + r * (body.inverse * gyroscopic),
            by_angles: input_by_angles,
            by_rates: c_by_rates + r * (body.inverse * gyroscopic_by_rates),
            by_acceleration: Matrix3::identity(),
        },
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
        for (y, linear) in [exact.rates, exact.moment, exact.input].iter().enumerate() {
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
