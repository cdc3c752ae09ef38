//! Vehicle model: attitude kinematics and dynamics, inertia, atmosphere, effectors and actuators,
//! reference profiles, disturbances, sensors and integrators. The crate knows neither control nor
//! FMI and uses SI units and radians throughout.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod actuators;
pub mod aerodynamics;
pub mod air;
pub mod atmosphere;
pub mod axes;
pub mod data;
pub mod disturbance;
pub mod dynamics;
pub mod effectors;
pub mod entry;
pub mod error;
pub mod fault;
pub mod fixes;
pub mod frames;
mod given;
pub mod integrator;
pub mod kinematics;
pub mod math;
pub mod noise;
pub mod plant;
pub mod platform;
pub mod profile;
pub mod reference;
pub mod scenario;
pub mod sensor_data;
pub mod sensors;
pub mod state;
pub mod table;
pub mod time;
pub mod trajectory;
pub mod translation;
pub mod transport;
pub mod triad;
pub mod turntable;
pub mod vehicles;

pub use error::Error;
pub use plant::Plant;
pub use profile::Profile;
pub use reference::Reference;
pub use scenario::Scenario;
pub use vehicles::Vehicle;
