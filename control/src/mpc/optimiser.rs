//! The solvers of one controller with their scratch memory. The bounds are computed about the
//! optimum, and the problem is solved again, until the optimum satisfies the bounds computed about
//! it.

use super::bounds::{Bounded, Bounds, Within};
use super::budget::Budget;
use super::certificate::Certificate;
use super::conic::ConicSolver;
use super::constraints::LinearisedConstraints;
use super::layout::Layout;
use super::lq::Unconstrained;
use super::problem::{Cost, End, ErrorTrajectory, Outcome, Problem, Solution, Start, State};
use super::riccati::{Rest, Riccati};
use super::search::Search;
use super::settings::{Method, SolverSettings};
use crate::report::SolverStatus;
use std::mem::replace;
use std::ops::Range;

/// Result of an optimisation apart from its trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OptimiserReport {
    /// How the optimum was found; [`SolverStatus::Fallback`] if none was.
    pub status: SolverStatus,
    /// Number of iterations over all passes and solvers.
    pub iterations: u32,
    /// Residuals that prove the optimum.
    pub certificate: Certificate,
    /// Whether the trajectory is known to satisfy the bounds computed about it.
    pub settled: bool,
}

/// The data of one optimisation.
pub(super) struct Sample<'a, const O: usize> {
    pub bounded: &'a dyn Bounded<O>,
    pub start: &'a State<O>,
    pub affine: &'a [State<O>],
    /// Earlier plan from the present time on, with its multipliers.
    pub previous: Option<(&'a ErrorTrajectory<O>, &'a [[f64; 2]])>,
}

impl<'a, const O: usize> Sample<'a, O> {
    /// Returns the problem of the whole horizon.
    fn problem<C>(&self, layout: &'a Layout<O>, constraints: &'a C) -> Problem<'a, O, C> {
        let radius = self.bounded.terminal_radius();
        layout.problem(self.start, self.affine, constraints, radius)
    }
}

/// All solvers of one controller with their scratch memory.
pub struct Optimiser<const O: usize> {
    pub(super) layout: Layout<O>,
    pub(super) settings: SolverSettings,
    budget: Budget,
    /// Progress of the present optimisation.
    pub(super) search: Search,
    pub(super) unconstrained: Unconstrained<O>,
    pub(super) riccati: Riccati<O>,
    cone: ConicSolver<O>,
    linearised: LinearisedConstraints<O>,
    /// Trajectory about which the bounds are computed and the norm constraints are linearised.
    pub(super) linearisation_point: ErrorTrajectory<O>,
    pub(super) bounds: Bounds,
    /// Bounds computed about an optimum, to check whether a pass was the last.
    pub(super) checked_bounds: Bounds,
    pub(super) solution: Solution<O>,
}

impl<const O: usize> Optimiser<O> {
    /// Sets up all solvers for the given structure.
    ///
    /// # Errors
    /// Returns the cone solver's message if it refuses the data.
    pub fn new(layout: Layout<O>, settings: SolverSettings) -> Result<Self, String> {
        let cone = ConicSolver::new(layout.clone(), settings.max_iterations)?;
        let Layout { chain, cost, horizon: n, .. } = &layout;
        let n = *n;
        Ok(Self {
            unconstrained: Unconstrained::new(n, chain, cost),
            riccati: Riccati::new(n, settings.max_iterations),
            cone,
            linearised: LinearisedConstraints::new(n),
            linearisation_point: ErrorTrajectory::new(n),
            bounds: Bounds::unlimited(n),
            checked_bounds: Bounds::unlimited(n),
            solution: Solution::new(n),
            budget: Budget::unlimited(),
            search: Search::default(),
            layout,
            settings,
        })
    }

    /// Returns the optimum, or in a fallback the trajectory left by the last solver.
    pub fn trajectory(&self) -> &ErrorTrajectory<O> {
        &self.solution.trajectory
    }

    /// Returns the bounds of the last pass, if they depend on the trajectory, and the trajectory
    /// about which the cone solver linearised the norm constraints in it.
    pub fn last_pass(&self) -> (&Bounds, &ErrorTrajectory<O>) {
        (&self.bounds, &self.linearisation_point)
    }

    /// Returns the weights of the cost.
    pub fn cost(&self) -> &Cost<O> {
        &self.layout.cost
    }

    /// Returns K of the first stage of the unconstrained optimum, negative.
    pub fn feedback(&self) -> State<O> {
        self.unconstrained.feedback()
    }

    /// Returns the multipliers of the norm constraints of each interval.
    pub fn multipliers(&self) -> &[[f64; 2]] {
        &self.solution.multipliers.intervals
    }

    /// Starts the budget of an optimisation of the controller. It covers all calls of
    /// [`Self::optimise`] until the next `begin`.
    pub fn begin(&mut self) {
        self.budget = Budget::begin(&self.settings);
    }

    /// Returns whether the budget ended the present optimisation.
    pub fn is_exhausted(&self) -> bool {
        self.budget.is_exhausted()
    }

    /// Finds the optimum with the present bounds by the Riccati method.
    pub(super) fn by_riccati(&mut self, sample: &Sample<O>) -> Option<SolverStatus> {
        if !self.may_iterate() {
            return None;
        }
        self.search.window = None;
        if !self.search.is_warm() {
            self.without_constraints(sample.start, sample.affine);
        }
        let outcome = self.interior_point(sample, 0..self.layout.horizon);
        if outcome.solved() {
            return Some(SolverStatus::Constrained);
        }
        let is_hopeless =
            outcome.hopeless() && (!self.search.is_warm() || sample.bounded.has_another_start());
        if self.search.is_warm() && !is_hopeless && !self.is_exhausted() {
            // The first guess was misleading.
            self.begin_cold(sample);
            return self.by_riccati(sample);
        }
        if is_hopeless {
            self.search.give_up();
        }
        None
    }

    /// Finds the optimum with the present bounds and linearised constraints by the cone solver. In
    /// a hopeless search it would find none either.
    pub(super) fn by_cone(&mut self, sample: &Sample<O>) -> Option<SolverStatus> {
        if self.search.is_hopeless() {
            return None;
        }
        let limits = self.budget.of_the_cone()?;
        self.search.window = None;
        sample.bounded.bounds_about(
            &self.linearisation_point,
            0..self.layout.horizon,
            &mut self.bounds,
        );
        self.linearised.set(&within(sample, &mut self.bounds), &self.linearisation_point, 0);
        let problem = sample.problem(&self.layout, &self.linearised);
        let outcome = self.cone.solve(&problem, &mut self.solution, limits);
        self.search.iterations += outcome.iterations();
        self.budget.spend(outcome.iterations());
        outcome.solved().then_some(SolverStatus::Cone)
    }

    /// Returns whether the Riccati method may begin.
    pub(super) fn may_iterate(&self) -> bool {
        self.settings.method == Method::Riccati
            && !self.search.is_hopeless()
            && !self.is_exhausted()
    }

    /// Runs the Riccati method on the intervals `range`, with the present bounds. The rest of the
    /// horizon is replaced by its arrival cost and its unconstrained cost-to-go.
    pub(super) fn interior_point(&mut self, sample: &Sample<O>, range: Range<usize>) -> Outcome {
        let (warm, follows) = (self.search.is_warm(), self.search.follows);
        let Self {
            layout,
            budget,
            unconstrained,
            riccati,
            linearisation_point,
            bounds,
            solution,
            ..
        } = self;
        let (bounded, first) = (sample.bounded, range.start);
        bounded.bounds_about(linearisation_point, range.clone(), bounds);
        let within = Within { bounded, bounds: bounds.cells(), follows, first };
        let (weight, slope) = unconstrained.to_go(range.end);
        let radius = bounded.terminal_radius().filter(|_| range.end == layout.horizon);
        let mut problem = sample.problem(layout, &within);
        if first > 0 {
            let (weight, mean) = unconstrained.arrival(first);
            problem.start = Start::Arrival(weight, mean);
        }
        problem.affine = &sample.affine[range];
        problem.end = End { weight, slope, radius };
        // A warm search knows its window; bounds that depend on the trajectory rarely hold beyond
        // it.
        let extends = !warm || !bounded.depends_on_trajectory();
        let rest = Rest { unconstrained: &*unconstrained, affine: sample.affine };
        let rest = Some(&rest).filter(|_| extends && radius.is_none());
        let outcome = riccati.solve(&problem, solution, first, warm, budget, rest);
        self.search.iterations += outcome.iterations();
        outcome
    }

    /// Returns the range from the first to the last interval in which the present trajectory
    /// violates the bounds computed about it. The intervals in `skip` and the terminal constraint
    /// are not checked.
    pub(super) fn violated(
        &mut self,
        sample: &Sample<O>,
        skip: &Range<usize>,
    ) -> Option<Range<usize>> {
        let Self { bounds, solution: Solution { trajectory, .. }, .. } = self;
        let before = sample.bounded.violated(trajectory, 0..skip.start, bounds);
        let after = sample.bounded.violated(trajectory, skip.end..self.layout.horizon, bounds);
        match (before, after) {
            (Some(before), Some(after)) => Some(before.start..after.end),
            (before, after) => before.or(after),
        }
    }

    /// Computes the arrival costs of the sample, once.
    pub(super) fn arrive(&mut self, sample: &Sample<O>) {
        if !replace(&mut self.search.arrived, true) {
            self.unconstrained.arrive(sample.start, sample.affine);
        }
    }

    /// Leaves the unconstrained optimum in [`Self::trajectory`].
    pub fn without_constraints(&mut self, start: &State<O>, affine: &[State<O>]) {
        let Solution { trajectory, multipliers } = &mut self.solution;
        self.unconstrained.solve(start, affine, trajectory);
        multipliers.clear();
    }

    /// Moves [`Self::trajectory`] half of the way to `plan`.
    pub fn halve_the_way_to(&mut self, plan: &ErrorTrajectory<O>) {
        self.solution.trajectory.halve_the_way_to(plan);
    }

    /// Returns the report of a plan that is followed instead of an optimum, after an optimisation
    /// with the outcome `ended`. The bounds are computed about the plan.
    pub fn fall_back(
        &mut self,
        bounded: &dyn Bounded<O>,
        start: &State<O>,
        affine: &[State<O>],
        plan: &ErrorTrajectory<O>,
        ended: OptimiserReport,
    ) -> OptimiserReport {
        self.solution.trajectory.clone_from(plan);
        self.solution.multipliers.clear();
        bounded.bounds_about(plan, 0..self.layout.horizon, &mut self.bounds);
        let sample = Sample { bounded, start, affine, previous: None };
        let certificate = self.certificate(&sample, false);
        OptimiserReport { certificate, settled: false, ..ended }
    }

    /// Returns the residuals of the present trajectory. `is_checked` says that the intervals
    /// without multipliers are known to satisfy their constraints.
    pub(super) fn certificate(&mut self, sample: &Sample<O>, is_checked: bool) -> Certificate {
        let Self { layout, bounds, solution, .. } = self;
        let within = within(sample, bounds);
        Certificate::new(&sample.problem(layout, &within), solution, is_checked)
    }
}

/// Returns the constraints of all stages with fixed bounds.
fn within<'a, const O: usize>(sample: &Sample<'a, O>, bounds: &'a mut Bounds) -> Within<'a, O> {
    Within { bounded: sample.bounded, bounds: bounds.cells(), follows: false, first: 0 }
}
