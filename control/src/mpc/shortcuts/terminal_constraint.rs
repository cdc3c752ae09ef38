//! The optimum with the terminal constraint as the only constraint.
//!
//! Gain: none in the mean (0.009 ms, CRMPC paper) or in the longest time. It is kept because
//! `solver.status` reports it separately, and because a window would change the last digits of the
//! results.

use super::{Optimiser, Sample, SolverStatus};
use crate::mpc::lq::Unconstrained;
use crate::mpc::problem::{ErrorTrajectory, State, apply, dot, of_axis, zero_state};
use nalgebra::{SMatrix, SVector};

/// Limits of the secant search for λ.
const SECANT_STEPS: usize = 30;
const SECANT_TOLERANCE: f64 = 1e-12;

impl<const O: usize> Optimiser<O> {
    /// Finds the optimum with the terminal constraint alone, and checks the norm constraints.
    pub(super) fn by_terminal_constraint(&mut self, sample: &Sample<O>) -> Option<SolverStatus> {
        let radius = self.search.outside?;
        self.arrive(sample);
        let Self { unconstrained, solution, .. } = self;
        let trajectory = &mut solution.trajectory;
        let multiplier = solve(unconstrained, sample.affine, radius, trajectory);
        let violated = self.violated(sample, &(0..0));
        self.search.settled = multiplier.is_some() && violated.is_none();
        if self.search.settled {
            self.solution.multipliers.terminal = multiplier?;
            return Some(SolverStatus::TerminalConstraint);
        }
        self.search.window = self.layout.window(violated, true);
        None
    }
}

/// Writes the optimum from the start of the arrival costs with ‖E_N‖_G = `radius` into `trajectory`
/// and returns its multiplier for half the cost. It applies to a start whose unconstrained optimum
/// violates the terminal constraint; the result is `None` if no solution is found.
///
/// The end minimises (E − Ē)ᵀΠ⁻¹(E − Ē) + EᵀG E, so that (Π⁻¹ + (1 + λ)G) E = Π⁻¹Ē. As 1/‖E‖_G is
/// nearly linear in λ, a secant method finds λ in a few steps.
fn solve<const O: usize>(
    unconstrained: &Unconstrained<O>,
    affine: &[State<O>],
    radius: f64,
    trajectory: &mut ErrorTrajectory<O>,
) -> Option<f64> {
    let n = affine.len();
    if n < O {
        return None;
    }
    let (weight, mean) = unconstrained.arrival(n);
    let pull = apply(weight, &mean);
    let end_of = |lambda: f64| -> Option<(State<O>, f64)> {
        let mut end = zero_state();
        for axis in 0..3 {
            let sum: SMatrix<f64, O, O> =
                of_axis(weight, axis) + of_axis(&unconstrained.end, axis) * (1.0 + lambda);
            let solution = sum.try_inverse()? * SVector::<f64, O>::from_fn(|i, _| pull[i][axis]);
            for (i, slot) in end.iter_mut().enumerate() {
                slot[axis] = solution[i];
            }
        }
        let norm = dot(&end, &apply(&unconstrained.end, &end)).sqrt();
        Some((end, radius / norm - 1.0))
    };

    let (mut lambda, mut excess) = (0.0, end_of(0.0)?.1);
    let mut next = 1.0;
    for _ in 0..SECANT_STEPS {
        let (end, left) = end_of(next)?;
        if left.abs() <= SECANT_TOLERANCE {
            trajectory.states[n] = end;
            unconstrained.trace_back(n, affine, trajectory);
            trajectory.roll_out(&unconstrained.chain, affine);
            return Some(next * radius * radius);
        }
        let slope = (left - excess) / (next - lambda);
        (lambda, excess) = (next, left);
        next = (lambda - left / slope).max(0.0);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mpc::lq::tests::{N, affine, cost, optimum, slopes, start};

    #[test]
    fn oracle_the_terminal_constraint_adds_its_multiplier_to_the_end() {
        let (mut lq, trajectory) = optimum::<2>();
        lq.arrive(&start(), &affine());
        let norm = cost().end_square(&trajectory.states[N]).sqrt();
        for share in [0.99, 0.5, 0.01] {
            let radius = share * norm;
            let mut onto = ErrorTrajectory::new(N);
            let multiplier = solve(&lq, &affine(), radius, &mut onto).unwrap();
            assert!(multiplier > 0.0);
            assert!((cost().end_square(&onto.states[N]).sqrt() - radius).abs() < 1e-9 * radius);
            let slope = slopes(&onto, multiplier / (radius * radius)).amax();
            assert!(slope < 1e-8, "{share}: {slope}");
        }
    }
}
