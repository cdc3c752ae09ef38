//! Linear models of a loop of FMUs as it is sampled, and its stability margins.
//!
//! An experiment is run to an instant and kept there. From the kept state the master flies on with
//! the loop opened at named signals, and short changes are put in there ([`linearise`]). So order,
//! coupling, periods and delays are those of the run. What arrives at the signals is realised as a
//! linear model of the fewest states (`realisation`). [`margins`] gives the loop's distance from
//! instability.

mod culprit;
pub mod curves;
mod flights;
pub mod linearise;
pub mod margins;
pub mod measures;
pub mod model;
mod opening;
mod realisation;
mod spectrum;

/// A real matrix.
pub type Matrix = nalgebra::DMatrix<f64>;
