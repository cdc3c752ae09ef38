//! Rigid-body attitude dynamics, Chai 2022 (1)–(5).

use crate::error::Error;
use crate::kinematics;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Inertia tensor with the products of inertia in the sign convention of Chai 2022 (3): off-diagonal entries are −I_ij.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct Inertia {
    /// Roll moment of inertia, kg m².
    pub Ixx: f64,
    /// Pitch moment of inertia, kg m².
    pub Iyy: f64,
    /// Yaw moment of inertia, kg m².
    pub Izz: f64,
    /// Roll-yaw product of inertia, kg m².
    pub Ixz: f64,
}

impl Inertia {
    /// The tensor I, kg m².
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.Ixx, 0.0, -self.Ixz, 0.0, self.Iyy, 0.0, -self.Ixz, 0.0, self.Izz)
    }

    /// The rigid body of `scale` times this inertia.
    ///
    /// # Errors
    /// Names the moment or product of inertia that no body can have: I must be positive definite, and no principal
    /// moment may exceed the sum of the other two.
    pub fn body(&self, scale: f64) -> Result<RigidBody, Error> {
        let refuse = |name, problem: String| Err(Error::Parameter { name, problem });
        for (name, value) in [("inertia.Ixx", self.Ixx), ("inertia.Iyy", self.Iyy), ("inertia.Izz", self.Izz)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(name, format!("= {value} kg m2 must be positive"));
            }
        }
        let Some(body) = RigidBody::new(self.matrix() * scale) else {
            let bound = (self.Ixx * self.Izz).sqrt();
            let problem = format!(
                "= {} kg m2 leaves no positive definite inertia: |Ixz| must be below {bound}",
                self.Ixz
            );
            return refuse("inertia.Ixz", problem);
        };
        let principal = self.matrix().symmetric_eigenvalues();
        if 2.0 * principal.max() > principal.sum() {
            let problem =
                "violate the triangle inequality: no principal moment may exceed the sum of the others";
            return refuse("inertia.Ixx, inertia.Iyy, inertia.Izz, inertia.Ixz", problem.into());
        }
        Ok(body)
    }
}

/// A rigid body: its inertia tensor and the inverse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigidBody {
    /// I, kg m².
    pub inertia: Matrix3<f64>,
    /// I⁻¹.
    pub inverse: Matrix3<f64>,
}

impl RigidBody {
    /// From an inertia tensor (kg m²); `None` if it is not symmetric positive definite.
    pub fn new(inertia: Matrix3<f64>) -> Option<Self> {
        let inverse = inertia.cholesky().filter(|_| inertia == inertia.transpose())?.inverse();
        Some(Self { inertia, inverse })
    }

    /// ω̇ = I⁻¹ (m − ω × I ω), Chai 2022 (1b) without Δ_m; `rates` rad/s, `moment` N m.
    pub fn angular_acceleration(&self, rates: &Vector3<f64>, moment: &Vector3<f64>) -> Vector3<f64> {
        self.inverse * (moment - rates.cross(&(self.inertia * rates)))
    }

    /// f(Θ, x_ω) = Ṙ ω − R I⁻¹ Ω I ω of Chai 2022 (4b), the drift of ẍ_Θ = f + u, in rad/s².
    pub fn drift(&self, angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Vector3<f64> {
        let rates = kinematics::r_inverse(angles) * angle_rates;
        let gyroscopic = self.inverse * rates.cross(&(self.inertia * rates));
        kinematics::r_dot(angles, angle_rates) * rates - kinematics::r(angles) * gyroscopic
    }

    /// The moment behind the input u = R I⁻¹ m of Chai 2022 (4): m = I R⁻¹ u, N m.
    pub fn moment(&self, angles: &Vector3<f64>, u: &Vector3<f64>) -> Vector3<f64> {
        self.inertia * (kinematics::r_inverse(angles) * u)
    }
}
