//! What most tests of the crate use: the plant with its parts, and vectors.

pub(crate) use nalgebra::{Matrix3, Rotation3, SVector, Vector3, Vector6};
pub(crate) use proptest::prelude::Strategy;
pub(crate) use vehicle::actuators::Command;
pub(crate) use vehicle::aerodynamics::Flow;
pub(crate) use vehicle::disturbance::{Disturbance, DisturbanceKind, DisturbanceTable};
pub(crate) use vehicle::dynamics::Inertia;
pub(crate) use vehicle::integrator::rk4;
pub(crate) use vehicle::kinematics::Kinematics;
pub(crate) use vehicle::plant::{Config, Input, Plant, State};
pub(crate) use vehicle::platform::Pose;
pub(crate) use vehicle::scenario::Scenario;
pub(crate) use vehicle::sensor_data::SensorData;
pub(crate) use vehicle::trajectory::Trajectory;
pub(crate) use vehicle::translation::{AirAcceleration, Motion, Planet};

/// Draws angles up to 80 deg of sideslip.
pub(crate) fn attitude() -> impl Strategy<Value = Vector3<f64>> {
    (-3.0..3.0, -1.4..1.4, -3.0..3.0).prop_map(|angles| Vector3::new(angles.0, angles.1, angles.2))
}

/// A vehicle that rests at these angles, over an Earth that does not turn.
pub(crate) fn at_rest(angles: Vector3<f64>) -> Pose {
    Pose {
        specific_force: None,
        kinematics: Kinematics::Printed,
        angles,
        rates: Vector3::zeros(),
        alpha_rate: 0.0,
        trajectory: Trajectory::default(),
    }
}
