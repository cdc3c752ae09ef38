//! Linear models of a loop of FMUs as it is sampled, and its stability margins.
//!
//! An experiment is run to an instant and kept there. A component that declares continuous states
//! gives its derivatives ([`continuous`]); of every other one the responses to small changes of its
//! inputs are taken from the kept state ([`responses`]), and realised as a linear model of the
//! fewest states ([`realisation`]). A component with edges is combined with the one that receives
//! its outputs. Then the master's calls are repeated on matrices instead of values
//! ([`propagation`]), so that order, coupling, periods and delays are those of the run. The loop is
//! opened at named signals. [`margins`] gives its distance from instability there.

pub mod components;
pub mod continuous;
pub mod curves;
mod derivatives;
mod fitting;
pub mod frequency;
pub mod identification;
pub mod linearise;
pub mod margins;
pub mod measures;
pub mod model;
mod opening;
mod pair;
pub mod propagation;
pub mod realisation;
mod reduction;
pub mod replay;
pub mod responses;
pub mod spectrum;
mod windows;

/// A real matrix.
pub type Matrix = nalgebra::DMatrix<f64>;
