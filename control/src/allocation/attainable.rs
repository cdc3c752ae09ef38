//! Attainable moments: the largest ball of moments that effectors can give, W. C. Durham,
//! "Constrained control allocation", Journal of Guidance, Control, and Dynamics 16(4), 1993.

use ::settings::Declared;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::axes::AXES;

/// Effect of an effector, N m per command, with its smallest and its largest command.
pub type Reach = (Vector3<f64>, f64, f64);

/// The largest ball of moments about zero that effectors can give.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Ball {
    /// Radius of the largest ball of moments that the surfaces within their ranges and the jets can
    /// give at present; 0 if there is a moment, however small, that they cannot give.
    #[setting(name = "moment", unit = "N.m", nominal = 1e5)]
    pub radius: f64,
    /// Direction in which the attainable moments end first, along the {}.
    #[setting(each = AXES)]
    pub axis: Vector3<f64>,
}

/// Returns the largest ball about zero within the moments of some effectors, which add to a moment
/// that is there without commands (N m).
///
/// The moments form a zonotope about the moment at the middle of all ranges. The distance of its
/// boundary from zero is the least value of its support function h(n) = n·centre + Σ |nᵀc| (u − l)/2
/// over the unit normals n of its faces, which are those of pairs of columns c. Any other direction
/// has a larger value, so that columns which are nearly parallel do no harm.
pub fn largest_ball(effectors: &[Reach], offset: &Vector3<f64>) -> Ball {
    let middle = |(column, low, high): &Reach| column * f64::midpoint(*low, *high);
    let centre = effectors.iter().map(middle).fold(*offset, |sum, moment| sum + moment);
    let mut least = Ball { radius: f64::INFINITY, axis: Vector3::zeros() };
    for (i, (first, ..)) in effectors.iter().enumerate() {
        for (second, ..) in &effectors[i + 1..] {
            let normal = first.cross(second);
            let length = normal.norm();
            if length <= 0.0 {
                continue;
            }
            let half =
                |(column, low, high): &Reach| (normal.dot(column) * (high - low)).abs() / 2.0;
            let across: f64 = effectors.iter().map(half).sum();
            // Of both sides of the zonotope, zero is nearer to the one away from the centre.
            let to_centre = normal.dot(&centre);
            let radius = (across - to_centre.abs()) / length;
            if radius < least.radius {
                least = Ball { radius, axis: normal * (-to_centre.signum() / length) };
            }
        }
    }
    // Without two effectors that turn about different axes, there is no face.
    if least.radius.is_finite() {
        Ball { radius: least.radius.max(0.0), ..least }
    } else {
        Ball::default()
    }
}
