//! What most tests use: FMUs and their instances, the calls of FMI 2.0, and pointers as in C.

pub(crate) use conformance::interface::{CO_SIMULATION, ERROR, MODEL_EXCHANGE, OK, Status};
pub(crate) use conformance::table::{TABLE, instance_in, states};
pub(crate) use conformance::{Bits, Fmu, Instance, c, driver, fmus, fmus_and_interfaces, ok};
pub(crate) use model_description::variable::{Causality, VariableKind};
pub(crate) use std::ffi::{CStr, c_int};
pub(crate) use std::ptr::{null, null_mut};
