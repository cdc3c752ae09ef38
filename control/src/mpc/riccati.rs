//! Primal-dual interior point method on the Riccati recursion; see docs/solver.md.
//!
//! Balls are written c = ½(‖y‖² − 1) ≤ 0 with one slack s and one multiplier λ each. Every iterate
//! satisfies the chain of integrators exactly, so that Newton's method is left with three
//! residuals: stationarity of the inputs, c + s, and sλ. The Hessian contains the curvature of
//! ½‖y‖² exactly; the curvature of y itself is left out (Gauss-Newton). Balls are left out while
//! the motion stays well inside them. Every iterate is checked, and a ball enters the problem as
//! soon as an iterate comes near it.

use super::balls::{Balls, Constraints};
use super::budget::Budget;
use super::lq::Unconstrained;
use super::problem::{End, Multipliers, Outcome, Problem, Solution, Start, State, apply, dot, zero_state};
use super::sweep::{Blocks, Gain, Quadratic, minimiser};
use nalgebra::{Matrix3, SVector, Vector3};

/// Relative residuals below which a motion counts as the optimum.
const STATIONARITY: f64 = 1e-6;
const FEASIBILITY: f64 = 1e-9;
/// Feasibility tolerance for bounds that follow the motion. As their derivatives are left out, the
/// residual then only shrinks by a constant factor per iteration.
const FEASIBILITY_FOLLOWING: f64 = 1e-5;
const GAP: f64 = 1e-9;
/// Largest share of the way to the boundary that a step covers.
const TO_BOUNDARY: f64 = 0.9999;
/// A step shorter than `SHORT` is computed again without second-order terms, towards `RECENTRING`
/// times the mean of sλ.
const SHORT: f64 = 0.1;
const RECENTRING: f64 = 0.5;
/// A search has stalled when `STALLED_STEPS` successive steps were shorter than `STALLED`.
const STALLED: f64 = 1e-5;
const STALLED_STEPS: u32 = 4;
/// A search has also stalled when its residual has not been halved in the first number of
/// iterations. The count restarts when the residual exceeds the least one by the second number,
/// because the iterate has then met balls that were left out. `PATIENCE` is for given bounds, which
/// may have any size, `PATIENCE_FOLLOWING` for bounds that follow the motion.
const PATIENCE: (u32, f64) = (30, 1e3);
const PATIENCE_FOLLOWING: (u32, f64) = (16, f64::INFINITY);
/// A search runs in a cycle when its residual has not been halved in `CIRCLING` iterations; its
/// steps are then multiplied by `DAMPING`.
const CIRCLING: u32 = 8;
const DAMPING: f64 = 0.5;
/// A first guess is misleading when the residual of the balls exceeds the least one so far by this
/// factor; least values below 1 count as 1.
const ASTRAY: f64 = 1e3;
/// A search that fails while the residual of the balls is above this value is hopeless.
const FAR_FROM_FEASIBLE: f64 = 1e-3;
/// A ball is near when ‖y‖² exceeds this value.
const NEAR: f64 = 0.5;
/// A stage beyond the end is included when ‖y‖² exceeds this value.
const NEARLY_OUTSIDE: f64 = 0.9;
/// Number of stages beyond the end that are examined.
const AHEAD: usize = 6;
/// Cold start: smallest slack, and Σ sλ relative to half the cost.
const COLD: (f64, f64) = (0.03, 0.03);
/// Smallest initial slack of a ball that an iterate comes near.
const NEWLY: f64 = 0.3;
/// Warm start, with the multipliers of a similar problem: smallest slack, and Σ sλ relative to half
/// the cost.
const WARM: (f64, f64) = (3e-4, 1e-6);
/// First guess that violates a ball by far: smallest slack, and Σ sλ relative to half the cost.
const FAR: (f64, f64) = (3.0, 10.0);
/// A first guess violates a ball by far when c exceeds this value.
const FAR_OUTSIDE: f64 = 1.5;

/// One inequality c ≤ 0 with its slack and its multiplier.
#[derive(Clone, Copy, Debug, Default)]
struct Pair {
    /// Whether the inequality is included in the problem.
    watched: bool,
    /// Value of c at the iterate.
    c: f64,
    /// Slack of the inequality, s > 0.
    slack: f64,
    /// Multiplier of the inequality, λ > 0.
    multiplier: f64,
    /// Residual c + s, corrected by the curvature along the predictor.
    infeasibility: f64,
    /// Target of sλ, less the predictor's Δs Δλ.
    target: f64,
    /// First-order change ∇cᵀΔz along the last direction.
    change: f64,
    /// Second-order change ½‖JΔz‖² along the last direction.
    curvature: f64,
    d_slack: f64,
    d_multiplier: f64,
}

impl Pair {
    /// Includes the inequality. The slack is −c but at least `smallest`; sλ is `mean`, unless the
    /// `known` multiplier is larger.
    fn begin(&mut self, smallest: f64, mean: f64, known: f64) {
        self.watched = true;
        self.slack = (-self.c).max(smallest);
        self.multiplier = (mean / self.slack).max(known);
    }

    /// Evaluates c of a ball at y.
    fn evaluate(&mut self, y: &Vector3<f64>) {
        self.c = 0.5 * (y.norm_squared() - 1.0);
    }

    /// Returns the scaling λ/s of the inequality.
    fn scaling(&self) -> f64 {
        self.multiplier / self.slack
    }

    /// Returns the multiplier on the right side of the Newton system after Δs and Δλ are
    /// eliminated.
    fn effective(&self) -> f64 {
        (self.target + self.multiplier * self.infeasibility) / self.slack
    }

    fn aim(&mut self) {
        self.infeasibility = self.c + self.slack;
        self.target = 0.0;
    }

    /// Prepares the direction to sλ = `centre`. The pair gives the shares of the predictor's
    /// second-order terms to include: the products Δs Δλ, and the ball's curvature along the
    /// predictor.
    fn correct(&mut self, centre: f64, (products, curvature): (f64, f64)) {
        self.infeasibility = self.c + self.slack + curvature * self.curvature;
        self.target = centre - products * self.d_slack * self.d_multiplier;
    }

    /// Computes Δs and Δλ for a direction along which c changes by `change`.
    fn set_direction(&mut self, change: f64, curvature: f64) {
        self.change = change;
        self.curvature = curvature;
        self.d_slack = -self.infeasibility - change;
        self.d_multiplier = (self.target - self.multiplier * self.d_slack) / self.slack - self.multiplier;
    }

    /// Returns the longest step that keeps s and λ positive.
    fn longest(&self) -> f64 {
        let until = |value: f64, change: f64| if change < 0.0 { -value / change } else { f64::INFINITY };
        until(self.slack, self.d_slack).min(until(self.multiplier, self.d_multiplier))
    }
}

/// One stage of the horizon: the iterate, its balls and the direction.
#[derive(Clone, Copy, Debug)]
struct Stage<const O: usize> {
    state: State<O>,
    input: Vector3<f64>,
    balls: Balls<O>,
    slopes: Slopes<O>,
    state_pair: Pair,
    input_pair: Pair,
    gain: Gain<O>,
    feedforward: Vector3<f64>,
    d_state: State<O>,
    d_input: Vector3<f64>,
}

/// Gradients ∇c of a stage's balls: first of the state ball, then of the input ball.
#[derive(Clone, Copy, Debug)]
struct Slopes<const O: usize> {
    state: State<O>,
    input: (State<O>, Vector3<f64>),
}

/// A face ±nᵀ(E_given − E_0) ≤ 1 of the set of admissible initial states.
#[derive(Clone, Copy, Debug)]
struct Face<const O: usize> {
    axis: usize,
    normal: SVector<f64, O>,
    pair: Pair,
}

/// The optimum without balls that continues the motion after the last stage.
pub struct Rest<'a, const O: usize> {
    /// Solved optimum without balls over the whole horizon.
    pub unconstrained: &'a Unconstrained<O>,
    /// Affine terms d of the whole horizon.
    pub affine: &'a [State<O>],
}

/// The solver with its iterate and scratch memory. Nothing is carried from one problem to the next.
pub struct Riccati<const O: usize> {
    stages: Vec<Stage<O>>,
    terminal: Pair,
    faces: Vec<Face<O>>,
    /// Weight P and slope p of the first stage.
    first: (Blocks<O>, State<O>),
    /// Number of intervals of the present problem.
    horizon: usize,
    max_iterations: u32,
}

/// Distance of the iterate from the optimum.
#[derive(Clone, Copy, Debug)]
struct Residuals {
    stationarity: f64,
    feasibility: f64,
    /// Sum Σ sλ over all included inequalities.
    gap: f64,
    /// Half the cost of the iterate.
    cost: f64,
    /// Number of included inequalities, at least 1.
    count: f64,
}

impl Residuals {
    fn converged(&self, feasibility: f64) -> bool {
        self.stationarity <= STATIONARITY && self.feasibility <= feasibility && self.gap <= GAP * self.cost
    }

    /// Returns the mean μ of sλ.
    fn mean(&self) -> f64 {
        self.gap / self.count
    }
}

impl<const O: usize> Riccati<O> {
    /// Allocates a solver for `horizon` intervals and at most `faces` normals of the initial set.
    pub fn new(horizon: usize, faces: usize, max_iterations: u32) -> Self {
        let stage = Stage {
            state: zero_state(),
            input: Vector3::zeros(),
            balls: Balls::default(),
            slopes: Slopes { state: zero_state(), input: (zero_state(), Vector3::zeros()) },
            state_pair: Pair::default(),
            input_pair: Pair::default(),
            gain: Gain::default(),
            feedforward: Vector3::zeros(),
            d_state: zero_state(),
            d_input: Vector3::zeros(),
        };
        Self {
            stages: vec![stage; horizon + 1],
            terminal: Pair::default(),
            faces: Vec::with_capacity(2 * faces),
            first: ([[Matrix3::zeros(); O]; O], zero_state()),
            horizon,
            max_iterations,
        }
    }

    /// Solves `problem`, which covers the stages of `solution` from `first` on. Their motion is the
    /// first guess, which must satisfy the chain; it is replaced if the optimum is found. With a
    /// `rest`, stages beyond the end that an iterate nearly violates are included in the problem.
    pub fn solve<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        solution: &mut Solution<O>,
        first: usize,
        warm: bool,
        budget: &mut Budget,
        rest: Option<&Rest<O>>,
    ) -> Outcome {
        let problem = &mut Problem { ..*problem };
        self.horizon = problem.affine.len();
        self.begin(problem, solution, first, warm);
        let (feasibility, (patience, anew)) = if problem.constraints.follows() {
            (FEASIBILITY_FOLLOWING, PATIENCE_FOLLOWING)
        } else {
            (FEASIBILITY, PATIENCE)
        };
        let (mut short_steps, mut best) = (0, (f64::INFINITY, 0));
        let mut least_outside = f64::INFINITY;
        for iteration in 0..=self.max_iterations {
            let residuals = self.residuals(problem);
            if residuals.converged(feasibility) {
                self.write(problem, solution, first);
                return Outcome::Solved(iteration);
            }
            if iteration == self.max_iterations || !budget.take() {
                return Outcome::Failed(iteration);
            }
            let gives_up = if residuals.feasibility > FAR_FROM_FEASIBLE {
                Outcome::Hopeless(iteration + 1)
            } else {
                Outcome::Failed(iteration + 1)
            };
            if self.factor(problem).is_none() {
                return gives_up;
            }
            let affine = self.predictor(problem);
            // Mehrotra's rule, with a lower bound: smaller targets are below the tolerance, and the
            // scaling would grow without bound while the motion still changes.
            let least = 0.1 * GAP * residuals.cost / residuals.gap;
            let ratio = self.mean_after(problem, affine, residuals.count) / residuals.mean();
            let centring = ratio.powi(3).max(least).min(1.0);
            // The step follows the predictor about this far; where it does not follow it at all,
            // the second-order terms only disturb.
            let second_order = (1.0 - centring * centring, affine * (1.0 - centring));
            let centre = centring * residuals.mean();
            let mut alpha = self.corrector(problem, centre, second_order);
            if alpha < SHORT {
                // The second-order terms are misleading.
                alpha = self.corrector(problem, RECENTRING * residuals.mean(), (0.0, 0.0));
            }
            short_steps = if alpha < STALLED { short_steps + 1 } else { 0 };
            let residual = residuals.stationarity.max(residuals.feasibility);
            if !(0.5 * best.0..=anew * best.0).contains(&residual) {
                best = (residual, iteration);
            }
            let stalls = residuals.feasibility > feasibility && iteration >= best.1 + patience;
            if short_steps == STALLED_STEPS || stalls {
                return gives_up;
            }
            least_outside = residuals.feasibility.clamp(1.0, least_outside);
            if warm && residuals.feasibility > ASTRAY * least_outside {
                return Outcome::Failed(iteration + 1);
            }
            if iteration >= best.1 + CIRCLING {
                alpha *= DAMPING;
            }
            self.step(problem, alpha);
            let mean = centre.max(WARM.1 * residuals.cost / residuals.count);
            if let Some(rest) = rest {
                self.extend(problem, rest, first);
            }
            self.watch(problem, NEWLY, mean, |_| [0.0; 2]);
        }
        Outcome::Failed(self.max_iterations)
    }

    /// Returns the number of intervals of the last problem.
    pub fn horizon(&self) -> usize {
        self.horizon
    }

    /// Extends the problem by the next stages if one of them is nearly outside a ball.
    #[inline(never)]
    fn extend<'a, C: Constraints<O>>(
        &mut self,
        problem: &mut Problem<'a, O, C>,
        rest: &Rest<'a, O>,
        first: usize,
    ) {
        let last = rest.affine.len() - first;
        loop {
            let end = self.horizon;
            let until = (end + AHEAD).min(last);
            let state_balls = problem.constraints.has_state_balls();
            let mut is_near = false;
            for k in end..until {
                let state = self.stages[k].state;
                let (input, next) = rest.unconstrained.go_on(first + k, &state, rest.affine);
                let (of_state, of_input) = problem.constraints.squares(k, &state, &input);
                is_near |= of_input > NEARLY_OUTSIDE || state_balls && k > end && of_state > NEARLY_OUTSIDE;
                self.stages[k].input = input;
                let stage = &mut self.stages[k + 1];
                stage.state = next;
                (stage.state_pair.watched, stage.input_pair.watched) = (false, false);
            }
            if !is_near || end == until {
                return;
            }
            self.horizon = until;
            // The input after the last state must not keep values of an earlier problem.
            let after = &mut self.stages[until];
            (after.input, after.d_input) = (Vector3::zeros(), Vector3::zeros());
            let (weight, slope) = rest.unconstrained.to_go(first + until);
            problem.end = End { weight, slope, radius: None };
        }
    }

    /// Sets the first iterate from the guess in `solution`.
    fn begin<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        solution: &Solution<O>,
        first: usize,
        warm: bool,
    ) {
        let Solution { motion, multipliers } = solution;
        for (stage, state) in self.stages[..=self.horizon].iter_mut().zip(&motion.states[first..]) {
            stage.state = *state;
            (stage.state_pair.watched, stage.input_pair.watched) = (false, false);
        }
        for (stage, input) in self.stages[..self.horizon].iter_mut().zip(&motion.inputs[first..]) {
            stage.input = *input;
        }
        // The bounds on the last state may depend on the input that follows it.
        let last = &mut self.stages[self.horizon];
        last.input = motion.inputs.get(first + self.horizon).copied().unwrap_or_default();
        last.d_input = Vector3::zeros();
        self.faces.clear();
        if let Start::Within(_, normals) = problem.start {
            for (axis, normals) in normals.iter().enumerate() {
                for normal in normals {
                    let face = |normal| Face { axis, normal, pair: Pair::default() };
                    self.faces.extend([face(*normal), face(-normal)]);
                }
            }
        }
        self.evaluate(problem);
        let cost = self.cost(problem);
        let (smallest, gap) = if warm { WARM } else { COLD };
        let balls = if problem.constraints.has_state_balls() { 2 } else { 1 };
        let share = cost / (balls * self.horizon + self.faces.len() + 1) as f64;
        let mean = gap * share;
        let Multipliers { state, input, terminal, .. } = multipliers;
        self.terminal.begin(smallest, mean, if warm { *terminal } else { 0.0 });
        for face in &mut self.faces {
            face.pair.begin(smallest, mean, 0.0);
        }
        self.watch(problem, smallest, mean, |k| {
            let before = (first + k).checked_sub(1);
            let known = [before.and_then(|k| state.get(k)), input.get(first + k)];
            known.map(|known| known.copied().filter(|_| warm).unwrap_or_default())
        });
        let pairs =
            self.stages[..=self.horizon].iter().flat_map(|stage| [&stage.state_pair, &stage.input_pair]);
        if pairs.filter(|pair| pair.watched).any(|pair| pair.c > FAR_OUTSIDE) {
            self.each_pair(problem, |pair| pair.begin(FAR.0, FAR.1 * share, 0.0));
        }
    }

    /// Includes the balls that the iterate has come near. `known` gives the multipliers of a stage,
    /// state ball first.
    fn watch<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        smallest: f64,
        mean: f64,
        known: impl Fn(usize) -> [f64; 2],
    ) {
        let end = self.end();
        let state_balls = problem.constraints.has_state_balls();
        // A value that is not a number must not go unnoticed.
        let near = |square: f64| square.is_nan() || square > NEAR;
        for (k, stage) in self.stages[..=end].iter_mut().enumerate() {
            let (has_state, has_input) = (k > 0 && state_balls, k < end);
            if !stage.watched() {
                let (state, input) = problem.constraints.squares(k, &stage.state, &stage.input);
                if !(has_state && near(state) || has_input && near(input)) {
                    continue;
                }
                stage.evaluate(problem.constraints, k);
            }
            let known = known(k);
            let Stage { state_pair, input_pair, .. } = stage;
            for (pair, exists, known) in
                [(state_pair, has_state, known[0]), (input_pair, has_input, known[1])]
            {
                if exists && !pair.watched && near(2.0 * pair.c + 1.0) {
                    pair.begin(smallest, mean, known);
                }
            }
        }
    }

    /// Evaluates c and its slopes at the iterate.
    fn evaluate<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) {
        let end = self.end();
        for (k, stage) in self.stages[..=end].iter_mut().enumerate() {
            if stage.watched() {
                stage.evaluate(problem.constraints, k);
            }
        }
        if let Some(radius) = problem.end.radius {
            let end = &self.stages[end].state;
            self.terminal.c = 0.5 * (dot(end, &problem.end.weighted(end)) / (radius * radius) - 1.0);
        }
        if let Start::Within(given, _) = &problem.start {
            let first = self.stages[0].state;
            for Face { axis, normal, pair } in &mut self.faces {
                let deviation: f64 = (0..O).map(|i| normal[i] * (given[i][*axis] - first[i][*axis])).sum();
                pair.c = deviation - 1.0;
            }
        }
    }

    fn each_pair<C: Constraints<O>>(&mut self, problem: &Problem<O, C>, mut visit: impl FnMut(&mut Pair)) {
        let pairs = self.stages[..=self.horizon]
            .iter_mut()
            .flat_map(|Stage { state_pair, input_pair, .. }| [state_pair, input_pair]);
        pairs.filter(|pair| pair.watched).for_each(&mut visit);
        if problem.end.radius.is_some() {
            visit(&mut self.terminal);
        }
        for face in &mut self.faces {
            visit(&mut face.pair);
        }
    }

    /// Computes the residuals of the optimality conditions at the iterate, with the costates p of
    /// the motion.
    fn residuals<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> Residuals {
        let (mut feasibility, mut gap, mut count) = (0.0_f64, 0.0, 0.0_f64);
        self.each_pair(problem, |pair| {
            let own = (pair.c + pair.slack).abs();
            // A value that is not a number must stay visible.
            feasibility = if own.is_nan() || own > feasibility { own } else { feasibility };
            gap += pair.slack * pair.multiplier;
            count += 1.0;
        });
        let (mut largest, mut scale) = (0.0_f64, f64::MIN_POSITIVE);
        self.adjoint(
            problem,
            |pair| pair.multiplier,
            |own, future| {
                largest = largest.max((own + future).amax());
                scale = scale.max(own.amax()).max(future.amax());
            },
        );
        if !matches!(problem.start, Start::Fixed(_)) {
            largest = self.first.1.iter().fold(largest, |largest, p| largest.max(p.amax()));
        }
        Residuals {
            stationarity: largest / scale,
            feasibility,
            gap,
            cost: self.cost(problem),
            count: count.max(1.0),
        }
    }

    /// Returns half the cost of the iterate, without the term that is linear in its end.
    fn cost<C: Constraints<O>>(&self, problem: &Problem<O, C>) -> f64 {
        let stages = self.stages[..self.horizon].iter();
        let inner: f64 = stages
            .map(|stage| {
                dot(&stage.state, &problem.cost.slope(&stage.state))
                    + stage.input.dot(&problem.cost.input.component_mul(&stage.input))
            })
            .sum();
        let end = &self.stages[self.end()].state;
        0.5 * (inner + dot(end, &problem.end.weighted(end)))
    }

    /// Returns the index of the last stage.
    fn end(&self) -> usize {
        self.horizon
    }

    /// Computes ∇L from the end to the start. `visit` receives two parts of the slope in each
    /// input: the stage's own, and the part of all later stages. The slope in E_0 remains in
    /// `first`.
    fn adjoint<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        multiplier: impl Fn(&Pair) -> f64,
        mut visit: impl FnMut(Vector3<f64>, Vector3<f64>),
    ) {
        let last = self.end();
        let mut p = self.end_slope(problem, &multiplier);
        for stage in self.stages[..last].iter().rev() {
            let (q, r) = stage.slope(problem, &multiplier);
            visit(r, problem.chain.input_adjoint(&p));
            p = add(&problem.chain.adjoint(&p), &q);
        }
        self.first.1 = add(&p, &self.start_slope(problem, &multiplier));
    }

    /// Returns the slope ∂L/∂E_N at the last stage.
    fn end_slope<C: Constraints<O>>(
        &self,
        problem: &Problem<O, C>,
        multiplier: &impl Fn(&Pair) -> f64,
    ) -> State<O> {
        let stage = &self.stages[self.end()];
        let mut weight = 1.0;
        if let Some(radius) = problem.end.radius {
            weight += multiplier(&self.terminal) / (radius * radius);
        }
        let weighted = problem.end.weighted(&stage.state);
        let mut slope: State<O> = std::array::from_fn(|i| weighted[i] * weight + problem.end.slope[i]);
        if stage.state_pair.watched {
            let multiplier = multiplier(&stage.state_pair);
            slope = std::array::from_fn(|i| slope[i] + stage.slopes.state[i] * multiplier);
        }
        slope
    }

    /// Returns the part of ∂L/∂E_0 that comes from the conditions on the start.
    fn start_slope<C>(&self, problem: &Problem<O, C>, multiplier: &impl Fn(&Pair) -> f64) -> State<O> {
        let mut slope = zero_state();
        if let Start::Arrival(weight, mean) = &problem.start {
            slope = apply(weight, &std::array::from_fn(|i| self.stages[0].state[i] - mean[i]));
        }
        for face in &self.faces {
            for (i, slope) in slope.iter_mut().enumerate() {
                slope[face.axis] -= face.normal[i] * multiplier(&face.pair);
            }
        }
        slope
    }

    /// Runs the backward recursion for P and the gains.
    fn factor<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> Option<()> {
        let last = self.end();
        let mut p = self.end_weight(problem);
        for stage in self.stages[..last].iter_mut().rev() {
            let mut quadratic = Quadratic::diagonal(&problem.cost.state, &problem.cost.input);
            let Stage { balls, slopes, state_pair, input_pair, .. } = &stage;
            if input_pair.watched {
                quadratic.add_ball(&balls.input, &slopes.input, input_pair.multiplier, input_pair.scaling());
            }
            if state_pair.watched {
                let (multiplier, scaling) = (state_pair.multiplier, state_pair.scaling());
                quadratic.add_state_ball(&balls.state, &slopes.state, multiplier, scaling);
            }
            stage.gain = Gain::factor(&quadratic, problem.chain, &mut p)?;
        }
        for face in &self.faces {
            for i in 0..O {
                for j in i..O {
                    p[i][j][(face.axis, face.axis)] += face.pair.scaling() * face.normal[i] * face.normal[j];
                }
            }
        }
        if let Start::Arrival(weight, _) = &problem.start {
            for i in 0..O {
                for j in i..O {
                    p[i][j] += Matrix3::from_diagonal(&weight[i][j]);
                }
            }
        }
        self.first.0 = p;
        Some(())
    }

    /// Returns the weight P_N of the last stage.
    fn end_weight<C: Constraints<O>>(&self, problem: &Problem<O, C>) -> Blocks<O> {
        let stage = &self.stages[self.end()];
        let mut quadratic = Quadratic::diagonal(&zero_state(), &Vector3::zeros());
        let (mut weight, mut outer) = (1.0, 0.0);
        if let Some(radius) = problem.end.radius {
            weight += self.terminal.multiplier / (radius * radius);
            outer = self.terminal.scaling() / radius.powi(4);
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
            quadratic.add_state_ball(
                &stage.balls.state,
                &stage.slopes.state,
                pair.multiplier,
                pair.scaling(),
            );
        }
        quadratic.q
    }

    /// Computes the direction to sλ = 0 and returns the longest step along it.
    fn predictor<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> f64 {
        self.each_pair(problem, Pair::aim);
        self.direction(problem);
        self.longest(problem).min(1.0)
    }

    /// Computes the direction to sλ = σμ with the second-order terms from the predictor, and
    /// returns the step along it.
    fn corrector<C: Constraints<O>>(
        &mut self,
        problem: &Problem<O, C>,
        centre: f64,
        second_order: (f64, f64),
    ) -> f64 {
        self.each_pair(problem, |pair| pair.correct(centre, second_order));
        self.direction(problem);
        (TO_BOUNDARY * self.longest(problem)).min(1.0)
    }

    fn longest<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) -> f64 {
        let mut longest = f64::INFINITY;
        self.each_pair(problem, |pair| longest = longest.min(pair.longest()));
        longest
    }

    /// Returns the mean of sλ after a step `alpha`.
    fn mean_after<C: Constraints<O>>(&mut self, problem: &Problem<O, C>, alpha: f64, count: f64) -> f64 {
        let mut gap = 0.0;
        self.each_pair(problem, |pair| {
            gap += (pair.slack + alpha * pair.d_slack) * (pair.multiplier + alpha * pair.d_multiplier);
        });
        gap / count
    }

    /// Computes Newton's direction with the present factors: the feedforward backwards, then the
    /// motion forwards.
    fn direction<C: Constraints<O>>(&mut self, problem: &Problem<O, C>) {
        let last = self.end();
        let mut p = self.end_slope(problem, &Pair::effective);
        for stage in self.stages[..last].iter_mut().rev() {
            let (q, r) = stage.slope(problem, &Pair::effective);
            let (feedforward, through) = stage.gain.feedforward(&(r + problem.chain.input_adjoint(&p)));
            stage.feedforward = feedforward;
            p = add(&add(&problem.chain.adjoint(&p), &q), &through);
        }
        let mut change = zero_state();
        if !matches!(problem.start, Start::Fixed(_)) {
            let slope = add(&p, &self.start_slope(problem, &Pair::effective));
            change = minimiser(&self.first.0, &slope).unwrap_or(change);
        }
        for face in &mut self.faces {
            let of_face: f64 = (0..O).map(|i| -face.normal[i] * change[i][face.axis]).sum();
            face.pair.set_direction(of_face, 0.0);
        }
        for (k, stage) in self.stages[..=last].iter_mut().enumerate() {
            stage.d_state = change;
            if stage.state_pair.watched {
                let ball = &stage.balls.state;
                let y = ball.by_state.iter().zip(&change).fold(Vector3::zeros(), |sum, (by, e)| sum + by * e);
                stage.state_pair.set_direction(ball.value.dot(&y), 0.5 * y.norm_squared());
            }
            if k < last {
                stage.d_input = stage.gain.input(&change, &stage.feedforward);
                if stage.input_pair.watched {
                    let ball = &stage.balls.input;
                    let y = ball.change(&change, &stage.d_input);
                    stage.input_pair.set_direction(ball.value.dot(&y), 0.5 * y.norm_squared());
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

    fn step<C: Constraints<O>>(&mut self, problem: &Problem<O, C>, alpha: f64) {
        for stage in &mut self.stages[..=self.horizon] {
            stage.state = std::array::from_fn(|i| stage.state[i] + stage.d_state[i] * alpha);
            stage.input += stage.d_input * alpha;
        }
        self.each_pair(problem, |pair| {
            pair.slack += alpha * pair.d_slack;
            pair.multiplier += alpha * pair.d_multiplier;
        });
        self.evaluate(problem);
    }

    fn write<C: Constraints<O>>(&self, problem: &Problem<O, C>, solution: &mut Solution<O>, first: usize) {
        let Solution { motion, multipliers } = solution;
        let state_balls = problem.constraints.has_state_balls();
        for (k, stage) in self.stages[..=self.horizon].iter().enumerate() {
            let multiplier = |pair: &Pair| if pair.watched { pair.multiplier } else { 0.0 };
            motion.states[first + k] = stage.state;
            if k > 0 && state_balls {
                multipliers.state[first + k - 1] = multiplier(&stage.state_pair);
            }
            if k < self.horizon {
                motion.inputs[first + k] = stage.input;
                multipliers.input[first + k] = multiplier(&stage.input_pair);
            }
        }
        if problem.end.radius.is_some() {
            multipliers.terminal = self.terminal.multiplier;
        }
        if let Start::Within(..) = problem.start {
            multipliers.start = self.start_slope(problem, &|pair| pair.multiplier);
            multipliers.start_gap =
                self.faces.iter().map(|face| face.pair.multiplier * face.pair.c.abs()).sum();
        }
    }
}

impl<const O: usize> Stage<O> {
    /// Returns whether any ball of the stage is included in the problem.
    fn watched(&self) -> bool {
        self.state_pair.watched || self.input_pair.watched
    }

    /// Evaluates the balls, c and its slopes at the iterate.
    fn evaluate(&mut self, constraints: &impl Constraints<O>, k: usize) {
        self.balls = constraints.balls(k, &self.state, &self.input);
        let Balls { state, input } = &self.balls;
        self.slopes = Slopes {
            state: state.by_state.map(|by| by.tr_mul(&state.value)),
            input: (input.by_state.map(|by| by.tr_mul(&input.value)), input.by_input.tr_mul(&input.value)),
        };
        self.state_pair.evaluate(&state.value);
        self.input_pair.evaluate(&input.value);
    }

    /// Returns ∂/∂E and ∂/∂v of the stage's cost and of its balls, weighted by their multipliers.
    fn slope<C: Constraints<O>>(
        &self,
        problem: &Problem<O, C>,
        multiplier: &impl Fn(&Pair) -> f64,
    ) -> (State<O>, Vector3<f64>) {
        let mut by_state = problem.cost.slope(&self.state);
        let mut by_input = problem.cost.input.component_mul(&self.input);
        if self.input_pair.watched {
            let multiplier = multiplier(&self.input_pair);
            by_state = std::array::from_fn(|i| by_state[i] + self.slopes.input.0[i] * multiplier);
            by_input += self.slopes.input.1 * multiplier;
        }
        if self.state_pair.watched {
            let multiplier = multiplier(&self.state_pair);
            by_state = std::array::from_fn(|i| by_state[i] + self.slopes.state[i] * multiplier);
        }
        (by_state, by_input)
    }
}

fn add<const O: usize>(a: &State<O>, b: &State<O>) -> State<O> {
    std::array::from_fn(|i| a[i] + b[i])
}
