//! Reference attitude Θ_r with its first and second derivatives.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Reference attitude `[alpha, beta, sigma]` and its derivatives at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Reference {
    /// Reference {}.
    ///
    /// Angles Θ_r.
    #[setting(name = "", unit = "rad", nominal = 0.1)]
    pub angles: Vector3<f64>,
    /// First derivative of the reference {}.
    #[setting(name = "+Rate", unit = "rad/s", nominal = 0.1)]
    pub rates: Vector3<f64>,
    /// Second derivative of the reference {}.
    #[setting(name = "+Acceleration", unit = "rad/s2", nominal = 0.1)]
    pub accelerations: Vector3<f64>,
}
