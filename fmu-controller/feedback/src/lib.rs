//! The library of the units whose laws are formulas: nothing is optimised while they run.
#![deny(clippy::disallowed_methods)]

use fmu_controller::{AttitudeEstimator, Btvsmc, BtvsmcDo, Fbl, Lqr, SotvsmcDo, TwoLoopSmc};

fmi2_export::export_fmus!(Lqr, Fbl, Btvsmc, BtvsmcDo, SotvsmcDo, TwoLoopSmc, AttitudeEstimator);
