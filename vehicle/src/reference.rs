//! Reference attitude Θ_r with its first and second derivatives.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Reference attitude `[alpha, beta, sigma]` and its derivatives at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Reference angles Θ_r, rad.
    pub angles: Vector3<f64>,
    /// Reference angle rates Θ̇_r, rad/s.
    pub rates: Vector3<f64>,
    /// Reference angle accelerations Θ̈_r, rad/s².
    pub accelerations: Vector3<f64>,
}
