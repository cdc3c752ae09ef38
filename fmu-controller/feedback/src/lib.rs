//! The library of the FMUs whose laws are formulas: they solve no optimisation while they run.
#![deny(clippy::disallowed_methods)]

use fmu_controller::{
    AttitudeEstimator, Btvsmc, BtvsmcDo, EntryGuidance, EntryNavigation, Fbl, Lqr, SotvsmcDo,
    TwoLoopSmc,
};

fmi_export::export_fmus!(
    Lqr,
    Fbl,
    Btvsmc,
    BtvsmcDo,
    SotvsmcDo,
    TwoLoopSmc,
    AttitudeEstimator,
    EntryGuidance,
    EntryNavigation
);
