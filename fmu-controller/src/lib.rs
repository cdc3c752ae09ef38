//! The FMI 2.0 units of the controllers, for co-simulation: the crate `control` behind tables of variables. All units have the
//! same inputs and outputs, so that one can take another's place without rewiring.

mod allocator;
mod crmpc;
mod dlmpc;
mod estimator;
mod fbl;
mod law;
mod lqr;
mod reference;
mod solver;
mod table;
#[cfg(test)]
mod tests;
mod ticks;
mod tvsmc;
mod two_loop;
mod unit;

pub use allocator::ControlAllocator;
pub use estimator::AttitudeEstimator;
pub use unit::Unit;

/// `CRMPC`: centralised robust model predictive control.
pub type Crmpc = Unit<crmpc::CrmpcLaw>;
/// `DLMPC`: double-layered model predictive and sliding-mode control.
pub type Dlmpc = Unit<dlmpc::DlmpcLaw>;
/// `FBL`: feedback linearisation.
pub type Fbl = Unit<fbl::FblLaw>;
/// `BTVSMC`: time-varying sliding mode with a boundary layer.
pub type Btvsmc = Unit<tvsmc::TvsmcLaw<tvsmc::Btvsmc>>;
/// `BTVSMC_DO`: the same with a disturbance observer.
pub type BtvsmcDo = Unit<tvsmc::TvsmcLaw<tvsmc::BtvsmcDo>>;
/// `SOTVSMC_DO`: second-order time-varying sliding mode with a disturbance observer.
pub type SotvsmcDo = Unit<tvsmc::TvsmcLaw<tvsmc::SotvsmcDo>>;
/// `TwoLoopSMC`: two-loop sliding-mode control.
pub type TwoLoopSmc = Unit<two_loop::TwoLoopLaw>;
/// `LQR`: linear-quadratic regulator.
pub type Lqr = Unit<lqr::LqrLaw>;

fmi2_export::export_fmus!(
    Crmpc,
    Dlmpc,
    Lqr,
    ControlAllocator,
    Fbl,
    Btvsmc,
    BtvsmcDo,
    SotvsmcDo,
    TwoLoopSmc,
    AttitudeEstimator
);
