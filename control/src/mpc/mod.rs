//! Model predictive control of chains of integrators within balls. The problem is in [`problem`],
//! the two solvers in [`riccati`] and [`conic`], the cheaper ways to the optimum in [`optimiser`],
//! and the proof of optimality in [`certificate`]. Equations and figures are in docs/solver.md.

// Loops over axes and blocks are written with indices, as in the equations.
#![allow(clippy::needless_range_loop)]

pub mod budget;
pub mod certificate;
pub mod conic;
pub mod lq;
pub mod optimiser;
pub mod problem;
pub mod riccati;
mod sweep;

pub use budget::Budget;
pub use certificate::Certificate;
pub use optimiser::{Bounded, Layout, Method, Nonlinearity, Optimiser, Report, SolverSettings};
pub use problem::{Ball, Balls, Chain, Constraints, Cost, Motion, State, per_axis};
