//! Model predictive control of chains of integrators within balls: one problem ([`problem`]), two solvers ([`riccati`], [`cone`]), the
//! ways around them ([`optimiser`]), and what shows an optimum to be one ([`certificate`]). Equations and figures are in
//! docs/solver.md.

// Loops over axes and blocks are written with their indices, as the equations are.
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
