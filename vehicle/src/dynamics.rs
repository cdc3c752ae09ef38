//! Rigid-body attitude dynamics of Chai 2022, (1)–(5).

use crate::error::{Error, positive};
use crate::kinematics;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Relative error of an inertia that rounding explains.
const ROUNDING: f64 = 1e-12;

/// Moments and products of inertia in the sign convention of Chai 2022 (3): the off-diagonal
/// entries of the tensor are −I_ij.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct Inertia {
    /// Moment about the roll axis.
    #[setting(name = "Ixx", part, unit = "kg.m2", min = 1.0, nominal = 1e6)]
    pub Ixx: f64,
    /// Moment about the pitch axis.
    #[setting(name = "Iyy", part, unit = "kg.m2", min = 1.0, nominal = 1e6)]
    pub Iyy: f64,
    /// Moment about the yaw axis.
    #[setting(name = "Izz", part, unit = "kg.m2", min = 1.0, nominal = 1e6)]
    pub Izz: f64,
    /// Product of the roll and yaw axes; the inertia tensor contains -Ixz.
    #[setting(name = "Ixz", part, unit = "kg.m2", nominal = 1e6)]
    pub Ixz: f64,
    /// Product of the roll and pitch axes; the inertia tensor contains -Ixy.
    #[setting(name = "Ixy", part, unit = "kg.m2", nominal = 1e6)]
    pub Ixy: f64,
    /// Product of the pitch and yaw axes; the inertia tensor contains -Iyz.
    #[setting(name = "Iyz", part, unit = "kg.m2", nominal = 1e6)]
    pub Iyz: f64,
}

impl Inertia {
    /// Returns the inertia tensor I, kg m².
    #[rustfmt::skip]
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(
            self.Ixx, -self.Ixy, -self.Ixz,
            -self.Ixy, self.Iyy, -self.Iyz,
            -self.Ixz, -self.Iyz, self.Izz,
        )
    }

    /// Returns the rigid body whose inertia is `scale` times this one.
    ///
    /// # Errors
    /// Names the moment or product of inertia that no body can have: I must be positive definite,
    /// and no principal moment may exceed the sum of the other two.
    pub fn body(&self, scale: f64) -> Result<RigidBody, Error> {
        let refuse = |name: &'static str, problem: String| Err(Error::parameter(name, problem));
        for (name, value) in
            [("inertia.Ixx", self.Ixx), ("inertia.Iyy", self.Iyy), ("inertia.Izz", self.Izz)]
        {
            positive(name, value, " kg m2")?;
        }
        for (name, value, moments) in [
            ("inertia.Ixz", self.Ixz, self.Ixx * self.Izz),
            ("inertia.Ixy", self.Ixy, self.Ixx * self.Iyy),
            ("inertia.Iyz", self.Iyz, self.Iyy * self.Izz),
        ] {
            let bound = moments.sqrt();
            if value.is_nan() || value.abs() >= bound {
                let problem = format!(
                    "= {value} kg m2 leaves no positive definite inertia: its size must be below {bound}"
                );
                return refuse(name, problem);
            }
        }
        let all = "inertia.Ixx, inertia.Iyy, inertia.Izz, inertia.Ixz, inertia.Ixy, inertia.Iyz";
        let Some(body) = RigidBody::new(self.matrix() * scale) else {
            return refuse(all, "leave no positive definite inertia".into());
        };
        let principal = self.matrix().symmetric_eigenvalues();
        if 2.0 * principal.max() > principal.sum() {
            let problem = "violate the triangle inequality: no principal moment may exceed the sum of the others";
            return refuse(all, problem.into());
        }
        Ok(body)
    }
}

/// Rigid body, given by its inertia tensor and the inverse of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RigidBody {
    /// Inertia tensor I about the body axes, kg m².
    pub inertia: Matrix3<f64>,
    /// Inverse I⁻¹ of the inertia tensor, 1/(kg m²).
    pub inverse: Matrix3<f64>,
}

impl Default for RigidBody {
    /// Returns a body with moments of inertia of 1 kg m².
    fn default() -> Self {
        Self { inertia: Matrix3::identity(), inverse: Matrix3::identity() }
    }
}

impl RigidBody {
    /// Makes a body from its inertia tensor (kg m²), or `None` if the tensor is not symmetric
    /// positive definite.
    pub fn new(inertia: Matrix3<f64>) -> Option<Self> {
        let inverse = inertia.cholesky().filter(|_| inertia == inertia.transpose())?.inverse();
        Some(Self { inertia, inverse })
    }

    /// Angular acceleration ω̇ = I⁻¹ (m − ω × I ω) in rad/s², Chai 2022 (1b) without Δ_m; `rates`
    /// in rad/s, `moment` in N m.
    pub fn angular_acceleration(
        &self,
        rates: &Vector3<f64>,
        moment: &Vector3<f64>,
    ) -> Vector3<f64> {
        self.inverse * (moment - rates.cross(&(self.inertia * rates)))
    }

    /// Returns how the tensor differs from a nominal one (kg m²) by I = (1 + c) I₀^½ (1 + E) I₀^½: c
    /// and the spectral norm of E, which is the smallest that any c allows. What rounding explains
    /// is no difference.
    ///
    /// # Errors
    /// Returns `None` if the nominal tensor is not positive definite.
    pub fn error_from(&self, nominal: &Matrix3<f64>) -> Option<[f64; 2]> {
        // The congruent L⁻¹ I L⁻ᵀ with I₀ = L Lᵀ has the eigenvalues of I₀^-½ I I₀^-½.
        let inverse = nominal.cholesky()?.l().try_inverse()?;
        let ratios = (inverse * self.inertia * inverse.transpose()).symmetric_eigenvalues();
        let (least, largest) = (ratios.min(), ratios.max());
        let errors = [f64::midpoint(largest, least) - 1.0, (largest - least) / (largest + least)];
        Some(errors.map(|error| if error.abs() < ROUNDING { 0.0 } else { error }))
    }

    /// Drift f(Θ, x_ω) = Ṙ ω − R I⁻¹ Ω I ω of ẍ_Θ = f + u, Chai 2022 (4b), in rad/s².
    pub fn drift(&self, angles: &Vector3<f64>, angle_rates: &Vector3<f64>) -> Vector3<f64> {
        let rates = kinematics::r_inverse(angles) * angle_rates;
        let gyroscopic = self.inverse * rates.cross(&(self.inertia * rates));
        kinematics::r_dot(angles, angle_rates) * rates - kinematics::r(angles) * gyroscopic
    }

    /// Moment m = I R⁻¹ u (N m) that gives the input u = R I⁻¹ m of Chai 2022 (4).
    pub fn moment(&self, angles: &Vector3<f64>, u: &Vector3<f64>) -> Vector3<f64> {
        self.inertia * (kinematics::r_inverse(angles) * u)
    }
}
