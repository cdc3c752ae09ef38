//! Model predictive control of chains of integrators under norm constraints.
//!
//! | | |
//! |---|---|
//! | [`problem`], [`constraints`], [`bounds`] | problem, norm constraints, and their bounds as a function of the trajectory |
//! | `strategy`, `shortcuts`, `passes` | one optimisation, its shortcuts, its passes |
//! | [`optimiser`] | the solvers of one controller with their memory |
//! | [`lq`] | the unconstrained problem |
//! | [`riccati`] | the interior point method |
//! | [`conic`] | the cone solver behind it |
//! | [`certificate`] | the proof of optimality |
//!
//! Equations and figures are in docs/solver.md.

// Loops over axes and blocks are written with indices, as in the equations.
#![allow(clippy::needless_range_loop)]

pub mod bounds;
pub mod budget;
pub mod certificate;
pub mod conic;
pub mod constraints;
pub mod layout;
pub mod lq;
pub mod optimiser;
mod passes;
pub mod problem;
pub mod riccati;
mod search;
mod settings;
mod shortcuts;
mod strategy;

pub use bounds::{Bounded, Bounds};
pub use budget::Budget;
pub use certificate::Certificate;
pub use constraints::{Constraints, NormConstraint, StageConstraints};
pub use layout::Layout;
pub use optimiser::{Optimiser, OptimiserReport};
pub use problem::{Chain, Cost, ErrorTrajectory, State, per_axis};
pub use settings::{Method, SolverSettings};
