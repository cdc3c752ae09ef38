//! The FMI 2.0 FMUs of the controllers for co-simulation: the crate `control` behind variable
//! tables. All controllers have the same inputs and outputs, so that one can replace another
//! without rewiring.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod allocator;
mod crmpc;
mod dlmpc;
mod estimator;
mod fbl;
mod guidance;
mod lqr;
mod navigation;
mod solver;
#[cfg(test)]
mod tests;
mod tvsmc;
mod two_loop;

pub use allocator::ControlAllocator;
use controller_export::ControllerFmu;
pub use estimator::AttitudeEstimator;
pub use guidance::EntryGuidance;
pub use navigation::EntryNavigation;

/// `CRMPC`: centralised robust model predictive control.
pub type Crmpc = ControllerFmu<crmpc::CrmpcLaw>;
/// `DLMPC`: double-layered model predictive and sliding-mode control.
pub type Dlmpc = ControllerFmu<dlmpc::DlmpcLaw>;
/// `FBL`: feedback linearisation.
pub type Fbl = ControllerFmu<fbl::FblLaw>;
/// `BTVSMC`: time-varying sliding mode with a boundary layer.
pub type Btvsmc = ControllerFmu<tvsmc::TvsmcLaw<tvsmc::Btvsmc>>;
/// `BTVSMC_DO`: time-varying sliding mode with a boundary layer and a disturbance observer.
pub type BtvsmcDo = ControllerFmu<tvsmc::TvsmcLaw<tvsmc::BtvsmcDo>>;
/// `SOTVSMC_DO`: second-order time-varying sliding mode with a disturbance observer.
pub type SotvsmcDo = ControllerFmu<tvsmc::TvsmcLaw<tvsmc::SotvsmcDo>>;
/// `TwoLoopSMC`: two-loop sliding-mode control.
pub type TwoLoopSmc = ControllerFmu<two_loop::TwoLoopLaw>;
/// `LQR`: linear-quadratic regulator.
pub type Lqr = ControllerFmu<lqr::LqrLaw>;
