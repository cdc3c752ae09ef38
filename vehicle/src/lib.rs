//! The vehicle: attitude kinematics and dynamics, inertia, atmosphere, effectors and actuators, reference profiles, disturbances and integrators.
//! Knows neither control nor FMI. SI units and radians throughout.

pub mod actuators;
pub mod atmosphere;
pub mod disturbance;
pub mod dynamics;
pub mod effectors;
pub mod error;
pub mod integrator;
pub mod kinematics;
pub mod plant;
pub mod reference;
pub mod scenario;
pub mod table;
pub mod time;

pub use error::Error;
pub use plant::Plant;
pub use reference::{Profile, Reference};
pub use scenario::Scenario;
