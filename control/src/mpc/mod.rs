//! Model predictive control of chains of integrators within balls.
//!
//! | | |
//! |---|---|
//! | [`problem`], [`balls`], [`bounds`] | problem, balls, and their bounds as a function of the motion |
//! | `optimise`, `shortcuts`, `passes` | one optimisation, its cheaper ways to the optimum, its passes |
//! | [`optimiser`] | the solvers of one controller with their memory |
//! | [`lq`] | the problem without balls |
//! | [`riccati`] | the interior point method |
//! | [`conic`] | the cone solver behind it |
//! | [`certificate`] | the proof of optimality |
//!
//! Equations and figures are in docs/solver.md.

// Loops over axes and blocks are written with indices, as in the equations.
#![allow(clippy::needless_range_loop)]

pub mod balls;
pub mod bounds;
pub mod budget;
pub mod certificate;
pub mod conic;
pub mod layout;
pub mod lq;
mod optimise;
pub mod optimiser;
mod passes;
pub mod problem;
pub mod riccati;
mod search;
mod settings;
mod shortcuts;

pub use balls::{Ball, Balls, Constraints};
pub use bounds::{Bounded, Bounds};
pub use budget::Budget;
pub use certificate::Certificate;
pub use layout::Layout;
pub use optimiser::{Optimiser, Report};
pub use problem::{Chain, Cost, Motion, State, per_axis};
pub use settings::{Method, Nonlinearity, SolverSettings};
