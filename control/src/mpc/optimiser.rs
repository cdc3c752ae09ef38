//! The ways to the optimum, cheapest first. The result of each is checked against the constraints
//! as functions of the motion, so that no way loses accuracy.

use super::budget::Budget;
use super::certificate::Certificate;
use super::conic::{ConicSolver, Structure};
use super::lq::Unconstrained;
use super::problem::{
    Chain, Constraints, Cost, End, From, Frozen, Motion, Multipliers, Problem, Solution, Start, State,
    zero_state,
};
use super::riccati::{Rest, Riccati};
use crate::report::Status;
use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The solver that is tried first if the exits do not lead to the optimum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Method {
    /// The interior point method on the Riccati recursion, with the cone solver where it fails.
    #[default]
    Riccati,
    /// The cone solver alone, without the Riccati method.
    Cone,
}

/// The form of the balls for the Riccati method; the cone solver always receives linearised balls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Nonlinearity {
    /// The balls are functions of the motion.
    #[default]
    Exact,
    /// The balls are linearised about the previous plan.
    Frozen,
}

/// Settings that choose and limit the solvers of an optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolverSettings {
    /// Solver that is tried first.
    pub method: Method,
    /// Form of the balls that it receives.
    pub nonlinearity: Nonlinearity,
    /// Largest number of iterations of each solver in each pass.
    pub max_iterations: u32,
    /// Whether the exits, cheaper ways to the optimum, are tried first.
    pub exits: bool,
    /// Wall-clock time after which no further iteration or solver is started, s; 0 for no limit.
    /// Runs with a time budget are not reproducible.
    pub time_budget: f64,
    /// Iterations of all solvers together after which no further one is started; 0 for no limit.
    pub iteration_budget: u32,
}

impl SolverSettings {
    /// Returns the default settings with the given limit on iterations.
    pub fn new(max_iterations: u32) -> Self {
        Self {
            method: Method::default(),
            nonlinearity: Nonlinearity::default(),
            max_iterations,
            exits: true,
            time_budget: 0.0,
            iteration_budget: 0,
        }
    }
}

/// The constraints of a controller. If their bounds depend on the motion, they are evaluated about
/// a motion that was given before.
pub trait Bounded<const O: usize>: Constraints<O> {
    /// Selects whether the bounds of [`Constraints::balls`] are those about the evaluated motion
    /// (without their own derivatives) or those of the last [`Self::tighten`]. The bounds of
    /// [`Constraints::squares`] always stay those of the last call. Bounds that do not depend on
    /// the motion need no implementation.
    fn follow(&mut self, _follow: bool) {}

    /// Sets the bounds of the intervals `of` about `motion`: for the state at the end of each
    /// interval, and for its input.
    fn tighten(&mut self, motion: &Motion<O>, of: Range<usize>);

    /// Returns the range from the first to the last interval that `motion` violates. The intervals
    /// in `skip` and the terminal ball are not checked. The bounds of the other intervals are set
    /// about `motion`; those between the first and the last violated interval may stay unchanged.
    fn violated(&mut self, motion: &Motion<O>, skip: Range<usize>) -> Option<Range<usize>>;

    /// Returns whether `motion` violates one of the intervals `of` with the bounds about itself.
    /// The bounds stay unchanged. Bounds that do not depend on the motion need no implementation.
    fn unsettled(&mut self, _motion: &Motion<O>, _of: Range<usize>) -> bool {
        false
    }

    /// Returns whether intervals without a call of [`Self::tighten`] already have the bounds that
    /// it would set. This holds if the bounds do not depend on the motion, or if they follow the
    /// iterates.
    fn is_set_beyond(&self) -> bool {
        true
    }

    /// Returns whether no motion from this start can satisfy the constraints. `false` leaves the
    /// question open.
    fn out_of_reach(&self, _start: &State<O>) -> bool {
        false
    }

    /// Returns the radius ε of the terminal ball, if there is one.
    fn terminal_radius(&self) -> Option<f64>;
}

/// Result of an optimisation apart from its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// The way that led to the optimum; [`Status::Fallback`] if none did.
    pub status: Status,
    /// Number of iterations over all passes and solvers.
    pub iterations: u32,
    /// Residuals that prove the optimum.
    pub certificate: Certificate,
    /// Whether the motion is known to satisfy the bounds about itself.
    pub settled: bool,
}

/// Structure of a controller's optimisation problem.
#[derive(Clone, Debug)]
pub struct Layout<const O: usize> {
    /// Chain of integrators with its matrices A and B.
    pub chain: Chain<O>,
    /// Weights of the quadratic cost.
    pub cost: Cost<O>,
    /// Number of intervals of the horizon.
    pub horizon: usize,
    /// Whether the states have balls of their own.
    pub state_balls: bool,
    /// Whether the last state must lie in a terminal ball.
    pub terminal: bool,
    /// Normals of the set of admissible initial states; `None` if the initial state is given.
    pub start: Option<[Vec<SVector<f64, O>>; 3]>,
    /// Typical sizes of the errors and their derivatives.
    pub scale: [f64; O],
    /// Largest change of any error between passes at which the first optimisation has converged.
    pub standstill: f64,
}

/// The data of one optimisation.
struct Sample<'a, const O: usize> {
    start: &'a State<O>,
    affine: &'a [State<O>],
}

/// Progress of the search for the optimum.
#[derive(Default)]
struct Search {
    /// Window of the horizon to solve for, if it is not the whole horizon.
    window: Option<Range<usize>>,
    /// Whether the multipliers come from a similar problem.
    warm: bool,
    iterations: u32,
    /// Whether the last solver concluded that no motion satisfies the balls.
    hopeless: bool,
    /// Whether the optimum satisfies the bounds about itself.
    settled: bool,
}

/// All solvers of one controller with their scratch memory.
pub struct Optimiser<const O: usize> {
    layout: Layout<O>,
    settings: SolverSettings,
    budget: Budget,
    unconstrained: Unconstrained<O>,
    riccati: Riccati<O>,
    cone: ConicSolver<O>,
    frozen: Frozen<O>,
    about: Motion<O>,
    solution: Solution<O>,
}

/// Largest number of passes of the first optimisation.
const FIRST_PASSES: usize = 20;
/// Relative tolerance in the check of the terminal ball, for rounding.
const CHECK_SLACK: f64 = 1e-9;

impl<const O: usize> Optimiser<O> {
    /// Sets up all solvers for the given structure.
    ///
    /// # Errors
    /// Returns the cone solver's message if it refuses the data.
    pub fn new(layout: Layout<O>, settings: SolverSettings) -> Result<Self, String> {
        let Layout { chain, cost, horizon, start, .. } = &layout;
        let cone = ConicSolver::new(Structure {
            chain: *chain,
            cost: *cost,
            horizon: *horizon,
            state_balls: layout.state_balls,
            terminal: layout.terminal,
            start: start.clone(),
            scale: layout.scale,
            max_iterations: settings.max_iterations,
        })?;
        let faces = start.iter().flatten().map(Vec::len).sum();
        Ok(Self {
            unconstrained: Unconstrained::new(*horizon, chain, cost),
            riccati: Riccati::new(*horizon, faces, settings.max_iterations),
            cone,
            frozen: Frozen::new(*horizon),
            about: Motion::new(*horizon),
            solution: Solution::new(*horizon),
            budget: Budget::unlimited(),
            layout,
            settings,
        })
    }

    /// Returns the optimum, or in a fallback the motion left by the last solver.
    pub fn motion(&self) -> &Motion<O> {
        &self.solution.motion
    }

    /// Returns K of the first stage of the optimum without constraints, negative.
    pub fn feedback(&self) -> State<O> {
        self.unconstrained.feedback()
    }

    /// Returns for each interval the multipliers of the state ball at its end and of the ball on
    /// its input.
    pub fn multipliers(&self) -> impl Iterator<Item = [f64; 2]> {
        let Multipliers { state, input, .. } = &self.solution.multipliers;
        state.iter().zip(input).map(|(&state, &input)| [state, input])
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

    /// Solves one optimisation from `start`. `previous` holds the earlier plan from the present
    /// time on, with its multipliers. Without it, the bounds and the linearised balls are set about
    /// each solution again until the solution stops changing.
    pub fn optimise<B: Bounded<O>>(
        &mut self,
        bounded: &mut B,
        start: &State<O>,
        affine: &[State<O>],
        previous: Option<(&Motion<O>, &[[f64; 2]])>,
    ) -> Report {
        let sample = Sample { start, affine };
        let Self { layout, settings, unconstrained, solution, .. } = self;
        let Solution { motion, multipliers } = solution;
        multipliers.clear();
        unconstrained.solve(start, affine, motion);
        let mut search = Search::default();
        let outside = layout.ends_outside(motion, bounded.terminal_radius());
        if settings.exits && layout.start.is_none() {
            let multiplier = match outside {
                None => Some(0.0),
                Some(radius) => unconstrained.solve_onto_terminal_ball(start, affine, radius, motion),
            };
            let violated = bounded.violated(motion, 0..0);
            match (multiplier, violated) {
                (Some(multiplier), None) => {
                    multipliers.terminal = multiplier;
                    let status = if outside.is_some() { Status::TerminalBall } else { Status::Unconstrained };
                    return Report { settled: true, ..self.report(bounded, &sample, status, 0) };
                }
                (_, violated) => search.window = layout.window(violated, outside.is_some()),
            }
        }
        if layout.start.is_none() && bounded.out_of_reach(start) {
            return self.report(bounded, &sample, Status::Fallback, 0);
        }

        let mut status = Status::Fallback;
        match previous {
            Some((previous, active)) => {
                self.about.clone_from(previous);
                // Where the terminal ball is active, each sample has one more stage to reach it,
                // and successive plans differ too much for a warm start.
                if self.settings.method == Method::Riccati && self.layout.start.is_none() && outside.is_none()
                {
                    self.begin_at(start, affine, active, &mut search);
                }
                self.about.states[0] = *start;
                status = self.settle(bounded, &sample, &mut search, false, Self::solve);
            }
            None if self.settled_by_riccati(bounded, &sample, &mut search) => status = Status::Constrained,
            None if (self.settings.method, self.settings.nonlinearity)
                == (Method::Riccati, Nonlinearity::Exact) =>
            {
                self.about.clone_from(&self.solution.motion);
                status = self.settle(bounded, &sample, &mut search, false, Self::solve);
            }
            None => {
                for _ in 0..FIRST_PASSES {
                    self.about.clone_from(&self.solution.motion);
                    status = self.solve(bounded, &sample, &mut search);
                    search.warm = true;
                    let moved = self.about.distance(&self.solution.motion);
                    if status == Status::Fallback || moved < self.layout.standstill {
                        break;
                    }
                }
            }
        }
        Report { settled: search.settled, ..self.report(bounded, &sample, status, search.iterations) }
    }

    /// Finds an optimum that satisfies the bounds about itself. The first bounds are those about
    /// the previous plan, or follow the iterates of the Riccati method (`follow`). They are then
    /// set about the optimum until it satisfies its own bounds. One pass suffices for bounds that
    /// do not depend on the motion.
    fn settle<B: Bounded<O>>(
        &mut self,
        bounded: &mut B,
        sample: &Sample<O>,
        search: &mut Search,
        follow: bool,
        mut solve: impl FnMut(&mut Self, &mut B, &Sample<O>, &mut Search) -> Status,
    ) -> Status {
        let mut status = Status::Fallback;
        for pass in 0..SETTLING_PASSES {
            let follow = follow && pass == 0;
            bounded.follow(follow);
            status = solve(self, bounded, sample, search);
            bounded.follow(false);
            // Linearised balls would have to be linearised again as well.
            if status == Status::Fallback || self.settings.nonlinearity == Nonlinearity::Frozen {
                break;
            }
            if follow {
                bounded.tighten(&self.solution.motion, 0..self.layout.horizon);
            }
            // The intervals outside a window have already been checked.
            let solved = search.window.clone().unwrap_or(0..self.layout.horizon);
            search.settled = !bounded.unsettled(&self.solution.motion, solved);
            if search.settled {
                break;
            }
            if pass == 0 {
                self.about.clone_from(&self.solution.motion);
            } else {
                // Where the bounds change more than the motion, whole steps would alternate between
                // two motions.
                self.about.halve_the_way_to(&self.solution.motion);
            }
            search.warm = true;
        }
        status
    }

    /// Takes the previous plan and its multipliers as first guess if some of them are active in the
    /// range to be solved. A window is extended by the active stages just beyond its end, as it
    /// would otherwise have to grow.
    fn begin_at(&mut self, start: &State<O>, affine: &[State<O>], active: &[[f64; 2]], search: &mut Search) {
        let n = self.layout.horizon;
        let mut range = search.window.clone().unwrap_or(0..n);
        let more_than = |least: f64| move |&[state, input]: &[f64; 2]| state.max(input) > least;
        if !active[range.clone()].iter().any(more_than(0.0)) {
            return;
        }
        let largest = active.iter().flatten().copied().fold(0.0, f64::max);
        let is_active = more_than(ACTIVE * largest);
        while let Some(last) = active[range.end..(range.end + MARGIN).min(n)].iter().rposition(is_active) {
            range.end += last + 1;
        }
        if let Some(window) = &mut search.window {
            window.end = range.end;
        }
        // The motion must satisfy the chain over the whole range to be solved.
        if !self.layout.is_worth_a_window(&range) {
            search.window = None;
            range = 0..n;
        }
        let Self { unconstrained, about, solution, .. } = self;
        let Solution { motion, multipliers } = solution;
        motion.states[range.start] = if range.start == 0 { *start } else { about.states[range.start] };
        unconstrained.track(range.start, range.end, about, affine, motion);
        for k in range {
            [multipliers.state[k], multipliers.input[k]] = active[k];
        }
        search.warm = true;
    }

    /// Runs the first optimisation by the Riccati method, with bounds that follow its iterates.
    fn settled_by_riccati<B: Bounded<O>>(
        &mut self,
        bounded: &mut B,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> bool {
        if self.settings.nonlinearity == Nonlinearity::Frozen {
            return false;
        }
        self.about.clone_from(&self.solution.motion);

        let by_riccati = |this: &mut Self, bounded: &mut B, sample: &Sample<O>, search: &mut Search| {
            if this.by_riccati(bounded, sample, search) { Status::Constrained } else { Status::Fallback }
        };
        self.settle(bounded, sample, search, true, by_riccati) == Status::Constrained
    }

    /// Finds the optimum with the bounds about `about` by the Riccati method, if the settings
    /// select it.
    fn by_riccati<B: Bounded<O>>(
        &mut self,
        bounded: &mut B,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> bool {
        if self.settings.method != Method::Riccati || search.hopeless || self.is_exhausted() {
            return false;
        }
        self.in_windows(bounded, sample, search)
            || !search.hopeless && self.over_whole_horizon(bounded, sample, search)
    }

    /// Finds the optimum with the bounds about `about`, trying the solvers in turn.
    fn solve<B: Bounded<O>>(&mut self, bounded: &mut B, sample: &Sample<O>, search: &mut Search) -> Status {
        if self.by_riccati(bounded, sample, search) {
            return Status::Constrained;
        }
        // The cone solver would not find a motion within the balls either.
        if search.hopeless {
            return Status::Fallback;
        }
        let Some(limits) = self.budget.of_the_cone() else { return Status::Fallback };
        search.window = None;
        bounded.follow(false);
        bounded.tighten(&self.about, 0..self.layout.horizon);
        self.frozen.set(bounded, &self.about);
        let end = self.layout.end(bounded.terminal_radius());
        let problem = self.layout.problem(sample, end, &self.frozen);
        let outcome = self.cone.solve(&problem, &mut self.solution, limits);
        search.iterations += outcome.iterations();
        self.budget.spend(outcome.iterations());
        if outcome.solved() { Status::Cone } else { Status::Fallback }
    }

    fn over_whole_horizon<B: Bounded<O>>(
        &mut self,
        bounded: &mut B,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> bool {
        search.window = None;
        if !search.warm {
            self.unconstrained.solve(sample.start, sample.affine, &mut self.solution.motion);
            self.solution.multipliers.clear();
        }
        bounded.tighten(&self.about, 0..self.layout.horizon);
        let end = self.layout.end(bounded.terminal_radius());
        let outcome = match self.settings.nonlinearity {
            Nonlinearity::Exact => {
                let exact = self.layout.problem(sample, end, &*bounded);
                self.riccati.solve(&exact, &mut self.solution, 0, search.warm, &mut self.budget, None)
            }
            Nonlinearity::Frozen => {
                self.frozen.set(bounded, &self.about);
                let frozen = self.layout.problem(sample, end, &self.frozen);
                self.riccati.solve(&frozen, &mut self.solution, 0, search.warm, &mut self.budget, None)
            }
        };
        search.iterations += outcome.iterations();
        if !outcome.solved() && search.warm && !self.is_exhausted() {
            // The first guess was misleading.
            search.warm = false;
            return self.over_whole_horizon(bounded, sample, search);
        }
        search.hopeless = outcome.hopeless() && !search.warm;
        outcome.solved()
    }

    /// Solves only for a window of the horizon around the violated intervals, with arrival cost and
    /// cost-to-go in place of the rest. If the rest then satisfies its constraints, the result is
    /// the optimum of a relaxation and therefore of the whole problem. Otherwise the window grows.
    fn in_windows<B: Bounded<O>>(
        &mut self,
        bounded: &mut B,
        sample: &Sample<O>,
        search: &mut Search,
    ) -> bool {
        let Self { layout, budget, unconstrained, riccati, frozen, about, solution, .. } = self;
        let n = layout.horizon;
        let Sample { start, affine } = *sample;
        let Some(window) = search.window.as_mut() else { return false };
        unconstrained.arrive(start, affine);
        for _ in 0..WINDOWS {
            if !layout.is_worth_a_window(window) {
                return false;
            }
            bounded.tighten(about, window.clone());
            let (weight, slope) = unconstrained.to_go(window.end);
            let radius = bounded.terminal_radius().filter(|_| window.end == n);
            let start = if window.start == 0 {
                Start::Fixed(*start)
            } else {
                let (weight, mean) = unconstrained.arrival(window.start);
                Start::Arrival(weight, mean)
            };
            let problem = Problem {
                chain: &layout.chain,
                cost: &layout.cost,
                start,
                affine: &affine[window.clone()],
                constraints: &From { constraints: &*bounded, first: window.start },
                end: End { weight, slope, radius },
            };
            let outcome = if self.settings.nonlinearity == Nonlinearity::Exact {
                let rest = Rest { unconstrained: &*unconstrained, affine };
                let rest = Some(&rest).filter(|_| bounded.is_set_beyond() && problem.end.radius.is_none());
                riccati.solve(&problem, solution, window.start, search.warm, budget, rest)
            } else {
                frozen.set(bounded, about);
                let constraints = &From { constraints: &*frozen, first: window.start };
                let Problem { chain, cost, start, affine, end, .. } = problem;
                let problem = Problem { chain, cost, start, affine, constraints, end };
                riccati.solve(&problem, solution, window.start, search.warm, budget, None)
            };
            search.iterations += outcome.iterations();
            if !outcome.solved() {
                // If no motion satisfies the balls within the window, none does over the horizon,
                // unless the first guess was misleading.
                search.hopeless = outcome.hopeless() && !search.warm;
                search.warm = false;
                return false;
            }
            window.end = window.start + riccati.horizon();
            // A window that grew to the end was solved without the terminal ball.
            let unheld = bounded.terminal_radius().filter(|_| radius.is_none());
            let motion = &mut solution.motion;
            unconstrained.trace_back(window.start, affine, motion);
            unconstrained.follow(window.end, affine, motion);
            let outside = layout.ends_outside(motion, unheld);
            let violated = bounded.violated(motion, window.clone());
            if outside.is_none() && violated.is_none() {
                return true;
            }
            search.warm = true;
            let Some(more) = layout.window(violated, outside.is_some()) else { return false };
            *window = window.start.min(more.start)..window.end.max(more.end);
        }
        false
    }

    /// Leaves the optimum without constraints in [`Self::motion`].
    pub fn without_constraints(&mut self, start: &State<O>, affine: &[State<O>]) {
        let Solution { motion, multipliers } = &mut self.solution;
        self.unconstrained.solve(start, affine, motion);
        multipliers.clear();
    }

    /// Moves [`Self::motion`] half of the way to `plan`.
    pub fn halve_the_way_to(&mut self, plan: &Motion<O>) {
        self.solution.motion.halve_the_way_to(plan);
    }

    /// Returns the report of a plan that is followed instead of an optimum.
    pub fn fall_back<B: Bounded<O>>(
        &mut self,
        bounded: &B,
        start: &State<O>,
        affine: &[State<O>],
        plan: &Motion<O>,
        (status, iterations): (Status, u32),
    ) -> Report {
        self.solution.motion.clone_from(plan);
        self.solution.multipliers.clear();
        let sample = Sample { start, affine };
        self.report(bounded, &sample, status, iterations)
    }

    fn report<B: Bounded<O>>(
        &self,
        bounded: &B,
        sample: &Sample<O>,
        status: Status,
        iterations: u32,
    ) -> Report {
        let exact = self.layout.problem(sample, self.layout.end(bounded.terminal_radius()), bounded);
        // [`Bounded::violated`] has checked these intervals; the other solvers give every ball a
        // multiplier.
        let checked = !matches!(status, Status::Fallback | Status::Kept);
        let certificate = Certificate::of(&exact, &self.solution, checked);
        Report { status, iterations, certificate, settled: false }
    }
}

impl<const O: usize> Layout<O> {
    /// Returns the problem of the whole horizon.
    fn problem<'a, C>(
        &'a self,
        sample: &Sample<'a, O>,
        end: End<'a, O>,
        constraints: &'a C,
    ) -> Problem<'a, O, C> {
        let start = match &self.start {
            None => Start::Fixed(*sample.start),
            Some(normals) => Start::Within(*sample.start, normals),
        };
        Problem { chain: &self.chain, cost: &self.cost, start, affine: sample.affine, constraints, end }
    }

    /// Returns the cost and the ball at the end of the whole horizon.
    fn end(&self, radius: Option<f64>) -> End<'_, O> {
        End { weight: &self.cost.end, slope: zero_state(), radius }
    }

    /// Returns `radius` if the motion ends outside the terminal ball.
    fn ends_outside(&self, motion: &Motion<O>, radius: Option<f64>) -> Option<f64> {
        let square = self.cost.end_square(&motion.states[self.horizon]);
        radius.filter(|radius| square > radius * radius * (1.0 + CHECK_SLACK))
    }

    /// Returns the violated intervals with a margin; with `terminal`, the range extends to the last
    /// interval.
    fn window(&self, violated: Option<Range<usize>>, terminal: bool) -> Option<Range<usize>> {
        let n = self.horizon;
        let violated = match (violated, terminal) {
            (Some(violated), true) => violated.start..n,
            (None, true) => n..n,
            (violated, false) => violated?,
        };
        Some(self.widen(&violated, MARGIN + violated.len() / 2))
    }

    /// Returns whether it pays to solve for these intervals alone, which may be at most three
    /// quarters of the horizon.
    fn is_worth_a_window(&self, range: &Range<usize>) -> bool {
        4 * range.len() <= 3 * self.horizon
    }

    /// Extends the range by `margin` intervals before and after.
    fn widen(&self, range: &Range<usize>, margin: usize) -> Range<usize> {
        let start = range.start.saturating_sub(margin);
        // Fewer steps than the order cannot reach every state.
        (if start < O { 0 } else { start })..(range.end + margin).min(self.horizon)
    }
}

/// Smallest number of intervals that a window adds before and after the violated ones.
const MARGIN: usize = 3;
/// A multiplier counts as active above this share of the largest one.
const ACTIVE: f64 = 1e-3;
/// Largest number of passes until an optimum satisfies the bounds about itself.
const SETTLING_PASSES: usize = 8;
/// Largest number of windows tried before the whole horizon.
const WINDOWS: usize = 4;
