//! Progress of the search for the optimum.

use std::ops::Range;

/// Progress of the search for the optimum.
#[allow(clippy::struct_excessive_bools)] // They do not exclude each other.
#[derive(Default)]
pub(super) struct Search {
    /// Radius of the terminal constraint, if the unconstrained optimum violates it.
    pub outside: Option<f64>,
    /// Range from the first to the last interval in which the unconstrained optimum violates a
    /// constraint.
    pub violated: Option<Range<usize>>,
    /// Window of the horizon to solve for, if it is not the whole horizon.
    pub window: Option<Range<usize>>,
    /// Whether the first guess has been chosen.
    pub begun: bool,
    /// Whether the arrival cost has been computed.
    pub arrived: bool,
    /// Whether the bounds of the present pass follow the iterates.
    pub follows: bool,
    /// Number of passes so far; the bounds are computed anew for each.
    pub pass: usize,
    /// Whether the multipliers come from a similar problem.
    pub warm: bool,
    /// Number of iterations over all passes and solvers.
    pub iterations: u32,
    /// Whether the last solver concluded that no trajectory satisfies the norm constraints.
    pub hopeless: bool,
    /// Whether the optimum satisfies the bounds computed about it.
    pub settled: bool,
}
