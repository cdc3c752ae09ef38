//! The vehicle: attitude kinematics and dynamics, inertia, reference profiles, disturbances and integrators.
//! Knows neither control nor FMI. SI units and radians throughout.

pub mod dynamics;
pub mod kinematics;
