//! Scaling (5) of the norm constraints, and factorisation (7) of the Newton system.

use super::iterate::Riccati;
use super::stage::Stage;
use super::sweep::{Blocks, Gain, Quadratic};
use crate::mpc::constraints::Constraints;
use crate::mpc::problem::{Problem, Start, zero_state};
use nalgebra::{Matrix3, Vector3};
use vehicle::math::powi;

impl<const O: usize> Stage<O> {
    /// Adds the norm constraints to the Hessian of the stage, (5).
    fn add_constraints(&self, quadratic: &mut Quadratic<O>) {
        let Stage { constraints, slopes, state_pair, input_pair, .. } = self;
        if input_pair.watched {
            quadratic.add_constraint(
                &constraints.input,
                &slopes.input,
                input_pair.multiplier,
                input_pair.scaling(),
            );
        }
        if state_pair.watched {
            let (multiplier, scaling) = (state_pair.multiplier, state_pair.scaling());
            quadratic.add_state_constraint(&constraints.state, &slopes.state, multiplier, scaling);
        }
    }
}

impl<const O: usize> Riccati<O> {
    /// Runs the backward recursion (7) for P and the gains, on the Hessians (5). Returns `None` if
    /// some M is not positive definite.
    pub(super) fn factor<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> Option<()> {
        let last = self.horizon;
        let mut p = self.end_weight(problem);
        for stage in self.stages[..last].iter_mut().rev() {
            let mut quadratic = Quadratic::diagonal(&problem.cost.state, &problem.cost.input);
            stage.add_constraints(&mut quadratic);
            stage.gain = Gain::factor(&quadratic, problem.chain, &mut p)?;
        }
        Self::add_start_weight(problem, &mut p);
        self.first.0 = p;
        Some(())
    }

    /// Returns the weight P_N of the last stage, with its norm constraints.
    fn end_weight<C: Constraints<O>>(&self, problem: &Problem<O, C>) -> Blocks<O> {
        let stage = &self.stages[self.horizon];
        let mut quadratic = Quadratic::diagonal(&zero_state(), &Vector3::zeros());
        let (mut weight, mut outer) = (1.0, 0.0);
        if let Some(radius) = problem.end.radius {
            weight += self.terminal.multiplier / (radius * radius);
            outer = self.terminal.scaling() / powi(radius, 4);
        }
        let slope = problem.end.weighted(&stage.state);
        for i in 0..O {
            for j in i..O {
                quadratic.q[i][j] = Matrix3::from_diagonal(&(problem.end.weight[i][j] * weight))
                    + slope[i] * outer * slope[j].transpose();
            }
        }
        let pair = &stage.state_pair;
        if pair.watched {
            quadratic.add_state_constraint(
                &stage.constraints.state,
                &stage.slopes.state,
                pair.multiplier,
                pair.scaling(),
            );
        }
        quadratic.q
    }

    /// Adds to P_0 the arrival cost.
    fn add_start_weight<C>(problem: &Problem<O, C>, p: &mut Blocks<O>) {
        if let Start::Arrival(weight, _) = &problem.start {
            for i in 0..O {
                for j in i..O {
                    p[i][j] += Matrix3::from_diagonal(&weight[i][j]);
                }
            }
        }
    }
}
