//! What most tests use: the instance with its parameters, and vectors.

pub(crate) use crate::parameters::{Actuation, Parameters};
pub(crate) use crate::plant::{INDICATORS, Output, ReentryPlant};
pub(crate) use fmi_export::{Failure, LastEvent, Model, describe};
pub(crate) use model_description::variable::{Causality, VariableKind};
pub(crate) use nalgebra::Vector3;
pub(crate) use vehicle::Scenario;
pub(crate) use vehicle::disturbance::DisturbanceKind;
pub(crate) use vehicle::effectors::Surfaces;
pub(crate) use vehicle::kinematics::Kinematics;
