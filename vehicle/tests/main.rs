//! Tests of the crate, in one program.

mod check_case;
mod check_case_motion;
mod disturbance;
mod entry;
mod kinematics;
mod plant;
mod platform;
mod prelude;
mod reference;
mod sensors;
mod turntable;
