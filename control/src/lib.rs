//! Attitude control laws of the papers, with estimation and allocation. The crate knows the vehicle
//! but not FMI. SI units and radians are used throughout.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod allocation;
mod clock;
mod clone_in_place;
pub mod closed_loop;
mod conic_program;
mod consistency;
pub mod controller;
pub mod crmpc;
pub mod delay;
pub mod delay_estimate;
pub mod dlmpc;
pub mod error;
pub mod error_dynamics;
pub mod estimation;
pub mod guidance;
pub mod linearise;
pub mod lqr;
pub mod mpc;
pub mod navigation;
pub mod report;
pub mod schedule;
pub mod sliding;
pub mod turns;
pub mod two_loop;

pub use allocation::Allocator;
pub use controller::{Controller, Measurement};
pub use crmpc::Crmpc;
pub use delay::Delayed;
pub use dlmpc::Dlmpc;
pub use error::DesignError;
pub use estimation::Estimator;
pub use lqr::Lqr;
pub use sliding::{Btvsmc, Fbl, SotvsmcDo};
pub use two_loop::TwoLoopSmc;
