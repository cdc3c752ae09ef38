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

mod bounds;
mod derivatives;

pub use bounds::{MomentSlopeBounds, TURN_BY_ANGLES, input_bound};
pub use derivatives::{Linear, Linearisation};

use nalgebra::{Matrix3, Vector3};
use vehicle::dynamics::RigidBody;
use vehicle::math::sin_cos;

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

    /// Returns the input u = R I⁻¹ m = a − f of Chai 2022 (4), rad/s².
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

#[cfg(test)]
mod tests;
