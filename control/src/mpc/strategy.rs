//! One optimisation: the shortcuts, then the interior point method over the whole horizon, then the
//! cone solver.

use super::bounds::Bounded;
use super::certificate::Certificate;
use super::optimiser::{Optimiser, OptimiserReport, Sample};
use super::problem::{ErrorTrajectory, State};
use super::search::Search;
use super::settings::Method;
use crate::report::SolverStatus;

impl<const O: usize> Optimiser<O> {
    /// Solves one optimisation from `start`. `previous` holds the earlier plan from the present
    /// time on, with its multipliers. Without it, the bounds and the linearised constraints are
    /// computed about each solution in turn until the solution stops changing.
    pub fn optimise(
        &mut self,
        bounded: &dyn Bounded<O>,
        start: &State<O>,
        affine: &[State<O>],
        previous: Option<(&ErrorTrajectory<O>, &[[f64; 2]])>,
    ) -> OptimiserReport {
        let sample = Sample { bounded, start, affine, previous };
        self.without_constraints(start, affine);
        let outside =
            self.layout.ends_outside(&self.solution.trajectory, bounded.terminal_radius());
        self.search = Search::new(outside);
        let mut found = None;
        if self.settings.shortcuts {
            found = self.by_shortcut(&sample);
        }
        let status = found.unwrap_or_else(|| self.over_whole_horizon(&sample));
        // In a fallback the laws follow another plan.
        let is_optimum = status != SolverStatus::Fallback;
        let certificate =
            if is_optimum { self.certificate(&sample, true) } else { Certificate::default() };
        OptimiserReport {
            status,
            iterations: self.search.iterations,
            certificate,
            settled: self.search.settled,
        }
    }

    /// Finds the optimum by the solvers for the whole horizon.
    fn over_whole_horizon(&mut self, sample: &Sample<O>) -> SolverStatus {
        self.prepare(sample);
        if sample.previous.is_none() && self.settings.method == Method::Riccati {
            if let Some(status) = self.settle(sample, Self::by_riccati) {
                return status;
            }
            // From here on the bounds are those about the trajectory that the search has left.
            self.linearisation_point.clone_from(&self.solution.trajectory);
            self.search.restart_passes();
        }
        self.settle(sample, |this, sample| this.by_riccati(sample).or_else(|| this.by_cone(sample)))
            .unwrap_or(SolverStatus::Fallback)
    }
}
