//! What most tests of the crate use: the laws, CRMPC's settings, the plant and its scenario, and the loops of
//! the harness.

pub(crate) use crate::harness::flight::{
    Flight, Random, Shown, Sight, Slow, Waveform, assert_kept,
};
pub(crate) use crate::harness::recording::{
    Interrupted, Recorded, assert_a_saved_memory_continues,
    assert_another_evaluation_leaves_no_trace, recorded, reference,
};
pub(crate) use crate::harness::{
    FEEDBACK, Optimising, disturbance, in_parallel, lqr, settings, simulate, white,
};
pub(crate) use control::allocation::Allocator;
pub(crate) use control::controller::{Forecast, Preview, saturated};
pub(crate) use control::crmpc::{
    Constraints, Contradiction, Design, Guarantee, GuaranteeStatus, InitialState, Memory, Settings,
    terminal_weight,
};
pub(crate) use control::delay::{Latency, Predictor};
pub(crate) use control::error_dynamics::{Gain, SampledError};
pub(crate) use control::estimation::Alignment;
pub(crate) use control::lqr::LqrSettings;
pub(crate) use control::mpc::SolverSettings;
pub(crate) use control::report::{SolverReport, SolverStatus};
pub(crate) use control::sliding::{
    BoundaryLayer, FblSettings, Observer, Reaching, SecondOrder, Surface, Tvsmc,
};
pub(crate) use control::two_loop::TwoLoopSettings;
pub(crate) use control::{
    Btvsmc, Controller, Crmpc, Delayed, DesignError, Dlmpc, Fbl, Lqr, Measurement, SotvsmcDo,
    TwoLoopSmc, dlmpc,
};
pub(crate) use nalgebra::{Matrix2, Matrix3, Rotation3, Vector2, Vector3};
pub(crate) use std::cell::Cell;
pub(crate) use std::f64::consts::{PI, TAU};
pub(crate) use std::ops::Range;
pub(crate) use vehicle::disturbance::{Disturbance, DisturbanceKind};
pub(crate) use vehicle::dynamics::RigidBody;
pub(crate) use vehicle::kinematics::{self, Kinematics};
pub(crate) use vehicle::plant::{self, Input, Load, Plant};
pub(crate) use vehicle::platform::body_from_velocity;
pub(crate) use vehicle::profile::Profile;
pub(crate) use vehicle::reference::Reference;
pub(crate) use vehicle::scenario::Scenario;
pub(crate) use vehicle::sensor_data::SensorData;
pub(crate) use vehicle::trajectory::Trajectory;
