//! The iterate of the interior point method.

use super::pair::Pair;
use super::stage::Stage;
use super::sweep::Blocks;
use crate::mpc::lq::Unconstrained;
use crate::mpc::problem::{State, zero_state};
use nalgebra::Matrix3;

/// The unconstrained optimum that continues the trajectory after the last stage.
pub struct Rest<'a, const O: usize> {
    /// Solved unconstrained optimum over the whole horizon.
    pub unconstrained: &'a Unconstrained<O>,
    /// Affine terms d of the whole horizon.
    pub affine: &'a [State<O>],
}

/// The solver with its iterate and scratch memory. Nothing is carried from one problem to the next.
pub struct Riccati<const O: usize> {
    pub(super) stages: Vec<Stage<O>>,
    pub(super) terminal: Pair,
    /// Weight P and slope p of the first stage.
    pub(super) first: (Blocks<O>, State<O>),
    /// Number of intervals of the whole horizon before the present problem.
    pub(super) before: usize,
    /// Number of intervals of the present problem.
    pub(super) horizon: usize,
    pub(super) max_iterations: u32,
}

impl<const O: usize> Riccati<O> {
    /// Allocates a solver for `horizon` intervals.
    pub fn new(horizon: usize, max_iterations: u32) -> Self {
        Self {
            stages: vec![Stage::new(); horizon + 1],
            terminal: Pair::default(),
            first: ([[Matrix3::zeros(); O]; O], zero_state()),
            before: 0,
            horizon,
            max_iterations,
        }
    }

    /// Returns the number of intervals of the last problem.
    pub fn horizon(&self) -> usize {
        self.horizon
    }
}
