//! Direction of a step: predictor, centring (10) and corrector (11), with the same factors.

use super::iterate::Riccati;
use super::pair::Pair;
use super::residuals::{GAP, Residuals};
use super::sweep::minimiser;
use crate::mpc::constraints::Constraints;
use crate::mpc::problem::{Problem, Start, add, dot, zero_state};
use nalgebra::Vector3;
use vehicle::math::powi;

/// Largest share of the way to the boundary that a step covers.
const TO_BOUNDARY: f64 = 0.9999;
/// A step shorter than `SHORT` is computed again without second-order terms, towards `RECENTRING`
/// times the mean of sλ.
const SHORT: f64 = 0.1;
const RECENTRING: f64 = 0.5;

/// Length of a step, and the value of sλ to which it leads.
pub(super) struct Direction {
    pub length: f64,
    pub centre: f64,
}

impl<const O: usize> Riccati<O> {
    /// Computes the direction from the iterate with these residuals.
    pub(super) fn direction<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        residuals: &Residuals,
    ) -> Direction {
        let affine = self.predictor(problem);
        let centring = self.centring(problem, residuals, affine);
        // The step follows the predictor about this far; where it does not follow it at all, the
        // second-order terms only disturb.
        let second_order = (1.0 - centring * centring, affine * (1.0 - centring));
        let centre = centring * residuals.mean();
        let mut length = self.corrector(problem, centre, second_order);
        if length < SHORT {
            // The second-order terms are misleading.
            length = self.corrector(problem, RECENTRING * residuals.mean(), (0.0, 0.0));
        }
        Direction { length, centre }
    }

    /// Predictor: computes the direction to sλ = 0 and returns the longest step along it.
    fn predictor<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> f64 {
        self.each_pair(problem, Pair::aim);
        self.newton(problem);
        self.longest(problem).min(1.0)
    }

    /// Centring (10): returns Mehrotra's σ for a predictor of this length, with a lower bound.
    /// Smaller targets are below the tolerance, and the scaling would grow without bound while the
    /// trajectory still changes.
    fn centring<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        residuals: &Residuals,
        affine: f64,
    ) -> f64 {
        let least = 0.1 * GAP * residuals.cost / residuals.gap;
        let ratio = self.mean_after(problem, affine, residuals.count) / residuals.mean();
        powi(ratio, 3).max(least).min(1.0)
    }

    /// Corrector (11): computes the direction to sλ = `centre` with the second-order terms from the
    /// predictor, and returns the step (12) along it.
    fn corrector<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        centre: f64,
        second_order: (f64, f64),
    ) -> f64 {
        self.each_pair(problem, |pair| pair.correct(centre, second_order));
        self.newton(problem);
        (TO_BOUNDARY * self.longest(problem)).min(1.0)
    }

    /// Computes Newton's direction with the present factors: the feedforward (8) backwards, then
    /// the trajectory and the pairs (9) forwards.
    fn newton<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) {
        let last = self.horizon;
        let mut p = self.end_slope(problem, &Pair::effective);
        for stage in self.stages[..last].iter_mut().rev() {
            let (q, r) = stage.slope(problem, &Pair::effective);
            let (feedforward, through) =
                stage.gain.feedforward(&(r + problem.chain.input_adjoint(&p)));
            stage.feedforward = feedforward;
            p = add(&add(&problem.chain.adjoint(&p), &q), &through);
        }
        let mut change = zero_state();
        if let Start::Arrival(..) = problem.start {
            let slope = add(&p, &self.start_slope(problem));
            change = minimiser(&self.first.0, &slope).unwrap_or(change);
        }
        for (k, stage) in self.stages[..=last].iter_mut().enumerate() {
            stage.d_state = change;
            if stage.state_pair.watched {
                let constraint = &stage.constraints.state;
                let y = constraint.change(&change, &Vector3::zeros());
                stage.state_pair.follow(&constraint.value, &y);
            }
            if k < last {
                stage.d_input = stage.gain.input(&change, &stage.feedforward);
                if stage.input_pair.watched {
                    let constraint = &stage.constraints.input;
                    let y = constraint.change(&change, &stage.d_input);
                    stage.input_pair.follow(&constraint.value, &y);
                }
                change = problem.chain.advance(&change, &stage.d_input);
            }
        }
        if let Some(radius) = problem.end.radius {
            let end = problem.end.weighted(&self.stages[last].state);
            let scale = 1.0 / (radius * radius);
            let curvature = 0.5 * dot(&change, &problem.end.weighted(&change)) * scale;
            self.terminal.set_direction(dot(&end, &change) * scale, curvature);
        }
    }
}
