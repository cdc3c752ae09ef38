//! Centralised robust MPC of Chai et al. (2022): optimisation of a nominal motion, feedback law around it.
//!
//! Prediction is in x̃ = (Θ̃, x̃_ω), where the nominal model (7) under ũ = a − f is an exact double integrator; the error
//! E = x̃ − x_r is formed afterwards, so that a jump of the reference is seen in the preview and never enters the dynamics.

mod cone;
mod design;
mod plan;

pub use crate::report::{Report, Status};
pub use design::{
    Constraints, Design, InitialState, PaperConstants, Settings, Tightening, step_response_peak,
    terminal_weight,
};
pub use plan::Plan;

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::DesignError;
use crate::linearise::{self, Linear, Linearisation};
use crate::lq::TrackingLq;
use crate::sampled::{InvariantSet, Reach, response, transition};
use cone::{AxisCosts, Ball, ConeProblem, Sample, Start, Structure};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3, Vector6};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Instant;
use vehicle::kinematics;
use vehicle::reference::Reference;

/// What CRMPC carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// The plan in force; it starts at the last optimisation.
    pub plan: Plan,
    /// Whether `plan` holds anything yet.
    pub started: bool,
    /// Outcome of the last optimisation.
    pub report: Report,
    /// Nominal state (Θ̃, x̃_ω) at the last tick.
    pub nominal: Vector6<f64>,
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        let Self { plan, started, report, nominal } = self;
        Self { plan: plan.clone(), started: *started, report: *report, nominal: *nominal }
    }

    // The derived version would allocate a new plan at every tick.
    fn clone_from(&mut self, source: &Self) {
        self.plan.clone_from(&source.plan);
        self.started = source.started;
        self.report = source.report;
        self.nominal = source.nominal;
    }
}

/// The controller: settings, offline design, solvers and scratch space. Everything that matters later is in [`Memory`].
pub struct Crmpc {
    settings: Settings,
    sets: Sets,
    design: Design,
    /// Lᵀ with G = L Lᵀ, per axis.
    terminal_root: [Matrix2<f64>; 3],
    lq: [TrackingLq; 3],
    /// The whole horizon.
    whole: ConeProblem,
    windows: Option<Windows>,
    /// Whether the unconstrained optimum is tried first.
    exits: bool,
    // Scratch of one optimisation.
    references: Vec<Reference>,
    affine: Vec<Vector6<f64>>,
    errors: Vec<Vector6<f64>>,
    candidate: Plan,
    previous: Plan,
    state_balls: Vec<Ball>,
    input_balls: Vec<Ball>,
}

/// Parts of the horizon that stand for the whole of it while no constraint outside is active.
struct Windows {
    /// The first [`HEAD`] intervals.
    head: ConeProblem,
    /// [`MIDDLE`] intervals anywhere later.
    middle: ConeProblem,
    /// The last [`TAIL`] intervals, with the terminal ball.
    tail: ConeProblem,
}

/// Lengths of the windows in intervals: the start of a manoeuvre, a jump of the reference ahead, a jump at the horizon.
const HEAD: usize = 36;
const MIDDLE: usize = 8;
const TAIL: usize = 16;

/// The constraint sets in force.
#[derive(Clone, Copy, Debug)]
enum Sets {
    /// ‖ω‖ and ‖m‖ with stage-wise bounds.
    Robust,
    /// Constant bounds on ‖x_ω‖, ‖u‖ and ‖E_N‖_G.
    Paper { x_tube: f64, u_tube: f64, epsilon: f64 },
}

/// Passes of the first optimisation at most.
const FIRST_PASSES: usize = 20;
/// The first optimisation has converged when no state moves by more than this (rad, rad/s) between passes.
const FIRST_TOLERANCE: f64 = 1e-5;
/// Relative slack when the exact constraints are checked, for rounding.
const CHECK_SLACK: f64 = 1e-9;
/// Typical angle error, by which the solver's unknowns are scaled, rad.
const ANGLE_SCALE: f64 = 0.1;
/// Smallest share of a limit that a tightened bound keeps, so that the problem stays well posed.
const SMALLEST_SHARE: f64 = 0.02;
/// Disturbance bound (rad/s²) that the invariant set has at least, so that it keeps an inside.
const SMALLEST_DISTURBANCE: f64 = 1e-6;
/// Smallest terminal radius in the G-norm: 0.03° of angle.
const SMALLEST_RADIUS: f64 = 5e-3;

impl Crmpc {
    /// Designs the controller and sets its solver up.
    ///
    /// # Errors
    /// Names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let design = Design::new(&settings)?;
        let sets = match settings.constraints {
            Constraints::Robust => Sets::Robust,
            Constraints::Paper => paper_sets(&design)?,
        };
        let n = settings.horizon;
        let terminal_root = design.g.map(|g| square_root(&g));
        let problem = |stages, start, terminal| {
            ConeProblem::new(Structure {
                stages,
                step: settings.period_optimisation,
                p: settings.p,
                q: settings.q,
                start,
                terminal,
                angle_scale: ANGLE_SCALE,
                rate_scale: settings.limit_rate,
                max_iterations: settings.max_iterations,
            })
            .map_err(DesignError::Solver)
        };
        let (whole, windows) = match settings.initial_state {
            InitialState::Tube => {
                let normals = design.invariant.as_ref().map(InvariantSet::normals).unwrap_or_default();
                let disturbance = design.tightening.disturbance;
                let start = std::array::from_fn(|i| {
                    normals.iter().map(|n| n / disturbance[i].max(SMALLEST_DISTURBANCE)).collect()
                });
                (problem(n, Start::Within(start), Some(terminal_root))?, None)
            }
            InitialState::Measured | InitialState::Nominal => {
                let windows = Windows {
                    head: problem(HEAD, Start::Fixed, None)?,
                    middle: problem(MIDDLE, Start::Arrival, None)?,
                    tail: problem(TAIL, Start::Arrival, Some(terminal_root))?,
                };
                let fits = n >= HEAD + 2;
                (problem(n, Start::Fixed, Some(terminal_root))?, fits.then_some(windows))
            }
        };
        let lq = std::array::from_fn(|i| {
            let p = Vector2::new(settings.p[i], settings.p[i + 3]);
            TrackingLq::new(n, settings.period_optimisation, p, settings.q[i], design.g[i])
        });
        Ok(Self {
            settings,
            sets,
            design,
            terminal_root,
            lq,
            whole,
            windows,
            exits: true,
            references: vec![Reference::default(); n + 1],
            affine: vec![Vector6::zeros(); n],
            errors: vec![Vector6::zeros(); n + 1],
            candidate: Plan::new(n),
            previous: Plan::new(n),
            state_balls: vec![Ball::default(); n],
            input_balls: vec![Ball::default(); n],
        })
    }

    /// Always solves the cone programme of the whole horizon, for comparison: the same optimum, only later.
    #[must_use]
    pub fn without_exits(mut self) -> Self {
        self.exits = false;
        self.windows = None;
        self
    }

    /// The offline design.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// One optimisation at `time` from the measured state (Θ, x_ω): leaves the plan and the report in `memory`.
    fn optimise(&mut self, memory: &mut Memory, time: f64, measured: Vector6<f64>, reference: ReferenceAt) {
        let clock = Instant::now();
        self.preview(time, reference);
        let first = !memory.started;
        if first {
            memory.plan.resize(self.settings.horizon);
            memory.started = true;
        } else {
            self.shift(&mut memory.plan);
        }

        let start = match self.settings.initial_state {
            InitialState::Nominal if !first => memory.plan.states[0],
            _ => measured,
        };

        self.unconstrained(start);
        let (mut status, mut iterations) = (Status::Unconstrained, 0);
        let violated = match self.settings.initial_state {
            InitialState::Measured | InitialState::Nominal if self.exits => self.violated(0..0),
            _ => Some(0..self.settings.horizon),
        };
        if let Some(violated) = violated {
            let solved = if first {
                self.constrained_first(start, &violated, &mut iterations)
            } else {
                self.constrained(&memory.plan, start, &violated, &mut iterations)
            };
            status = if solved { Status::Constrained } else { Status::Fallback };
        }
        if status == Status::Fallback {
            if first {
                self.follow_terminal_law(&mut memory.plan, start);
            }
            memory.report.fallbacks += 1;
            for (k, error) in self.errors.iter_mut().enumerate() {
                *error = memory.plan.states[k] - state(&self.references[k]);
            }
        } else {
            memory.plan.clone_from(&self.candidate);
        }
        memory.report.status = status;
        memory.report.cost = self.cost();
        memory.report.iterations = iterations;
        memory.report.solves += 1;
        memory.report.time = clock.elapsed().as_secs_f64();
    }

    /// References at the prediction times, and d_k = A x_r,k + B Θ̈_r,k − x_r,k+1.
    fn preview(&mut self, time: f64, reference: ReferenceAt) {
        let h = self.settings.period_optimisation;
        for (k, slot) in self.references.iter_mut().enumerate() {
            *slot = reference(time + k as f64 * h);
        }
        let (a, b) = (transition(h), response(h));
        for (k, d) in self.affine.iter_mut().enumerate() {
            let (now, next) = (&self.references[k], &self.references[k + 1]);
            for i in 0..3 {
                let moved = a * Vector2::new(now.angles[i], now.rates[i]) + b * now.accelerations[i];
                d[i] = moved.x - next.angles[i];
                d[3 + i] = moved.y - next.rates[i];
            }
        }
    }

    /// (31): drops the first interval and appends one under the terminal law (14), a = K̃ E + Θ̈_r.
    fn shift(&self, plan: &mut Plan) {
        let n = self.settings.horizon;
        let last = *plan.states.last().unwrap_or(&Vector6::zeros());
        plan.states.rotate_left(1);
        plan.accelerations.rotate_left(1);
        let a = self.terminal_acceleration(&last, &self.references[n - 1]);
        plan.accelerations[n - 1] = a;
        plan.states[n] = plan::advance(&last, &a, self.settings.period_optimisation);
    }

    /// The acceleration under the terminal law (14): ũ^f = −f + K̃ Ẽ + Θ̈_r, hence a = K̃ Ẽ + Θ̈_r.
    fn terminal_acceleration(&self, state: &Vector6<f64>, reference: &Reference) -> Vector3<f64> {
        let gain = self.settings.terminal;
        let angles = state.fixed_rows::<3>(0) - reference.angles;
        let rates = state.fixed_rows::<3>(3) - reference.rates;
        angles * gain.k1 + rates * gain.k2 + reference.accelerations
    }

    fn follow_terminal_law(&self, plan: &mut Plan, start: Vector6<f64>) {
        plan.states[0] = start;
        for k in 0..self.settings.horizon {
            plan.accelerations[k] = self.terminal_acceleration(&plan.states[k], &self.references[k]);
            plan.states[k + 1] =
                plan::advance(&plan.states[k], &plan.accelerations[k], self.settings.period_optimisation);
        }
    }

    /// The optimum without constraints into `candidate` and `errors`.
    fn unconstrained(&mut self, start: Vector6<f64>) {
        let Self { lq, references, affine, errors, candidate, settings, .. } = self;
        let first = start - state(&references[0]);
        for (i, lq) in lq.iter_mut().enumerate() {
            let last = lq.solve(
                axis(&first, i),
                |k| axis(&affine[k], i),
                |k, error, v| {
                    errors[k][i] = error.x;
                    errors[k][3 + i] = error.y;
                    candidate.accelerations[k][i] = v + references[k].accelerations[i];
                },
            );
            errors[settings.horizon][i] = last.x;
            errors[settings.horizon][3 + i] = last.y;
        }
        for (k, error) in errors.iter().enumerate() {
            candidate.states[k] = error + state(&references[k]);
        }
        candidate.states[0] = start;
    }

    /// The intervals, from the first to the last, in which `candidate` violates a constraint (exactly evaluated), where the
    /// terminal ball counts as interval N. Those in `skip` are not looked at.
    fn violated(&self, skip: Range<usize>) -> Option<Range<usize>> {
        let n = self.settings.horizon;
        let violates = |&k: &usize| !skip.contains(&k) && !self.is_feasible(k);
        let first = (0..=n).find(violates)?;
        let last = (first..=n).rfind(violates).unwrap_or(first);
        Some(first..last + 1)
    }

    /// Whether `candidate` satisfies the input constraint of interval `k` and the state constraint at its end, or for k = N
    /// the terminal constraint.
    fn is_feasible(&self, k: usize) -> bool {
        let within = |value: f64, bound: f64| value <= bound * (1.0 + CHECK_SLACK);
        if k == self.settings.horizon {
            return within(self.terminal_norm(), self.terminal_radius());
        }
        let (angles, rates) = split(&self.candidate.states[k]);
        let (next_angles, next_rates) = split(&self.candidate.states[k + 1]);
        let a = &self.candidate.accelerations[k];
        let body = &self.settings.body;
        match self.sets {
            Sets::Paper { x_tube, u_tube, .. } => {
                within(next_rates.norm(), x_tube)
                    && within(linearise::input(body, &angles, &rates, a).norm(), u_tube)
            }
            Sets::Robust => {
                // The untightened limits first: most of what fails, fails here.
                let (limit_rate, limit_moment) = (self.settings.limit_rate, self.settings.limit_moment);
                let limits = within(linearise::body_rates(&next_angles, &next_rates).norm(), limit_rate)
                    && within(linearise::moment(body, &angles, &rates, a).norm(), limit_moment);
                limits && {
                    let here = linearise::linearise(body, &angles, &rates, a);
                    let next = linearise::linearise(body, &next_angles, &next_rates, a);
                    within(here.moment.value.norm(), self.moment_bound(k, &here, &next))
                        && within(next.rates.value.norm(), self.rate_bound(k + 1, &next))
                }
            }
        }
    }

    /// ‖E_N‖_G.
    fn terminal_norm(&self) -> f64 {
        let end = &self.errors[self.settings.horizon];
        let axis = |i: usize| (self.terminal_root[i] * axis(end, i)).norm_squared();
        (0..3).map(axis).sum::<f64>().sqrt()
    }

    /// Σ h(EᵀPE + vᵀQv) + E_NᵀG E_N of `errors`.
    fn cost(&self) -> f64 {
        let Settings { period_optimisation: h, p, q, .. } = self.settings;
        let mut cost = self.terminal_norm().powi(2);
        for (k, d) in self.affine.iter().enumerate() {
            for i in 0..3 {
                let v = (self.errors[k + 1][3 + i] - self.errors[k][3 + i] - d[3 + i]) / h;
                let error = &self.errors[k];
                cost += h * (p[i] * error[i].powi(2) + p[3 + i] * error[3 + i].powi(2) + q[i] * v * v);
            }
        }
        cost
    }

    /// The first optimisation: linearised again about its own solution until that stands still.
    fn constrained_first(
        &mut self,
        start: Vector6<f64>,
        violated: &Range<usize>,
        iterations: &mut u32,
    ) -> bool {
        let mut about = std::mem::take(&mut self.previous);
        let mut solved = true;
        for _ in 0..FIRST_PASSES {
            about.clone_from(&self.candidate);
            solved = self.constrained(&about, start, violated, iterations);
            if !solved || about.distance(&self.candidate) < FIRST_TOLERANCE {
                break;
            }
        }
        self.previous = about;
        solved
    }

    /// The optimum with the constraints linearised about a plan, into `candidate` and `errors`; whether there is one.
    fn constrained(
        &mut self,
        about: &Plan,
        start: Vector6<f64>,
        violated: &Range<usize>,
        iterations: &mut u32,
    ) -> bool {
        self.linearise_balls(about, &start);
        self.in_window(start, violated, iterations) || self.over_whole_horizon(start, iterations)
    }

    /// Solves only a window around the violated intervals, with arrival cost and cost-to-go for the rest of the horizon. If
    /// the rest then satisfies its constraints exactly, this is the optimum of the whole, as it is that of a relaxation.
    fn in_window(&mut self, start: Vector6<f64>, violated: &Range<usize>, iterations: &mut u32) -> bool {
        let n = self.settings.horizon;
        let terminal_radius = self.terminal_radius();
        let Some(Windows { head, middle, tail }) = &mut self.windows else { return false };
        let centred = (violated.start + violated.end).saturating_sub(MIDDLE) / 2;
        let (problem, window) =
            if violated.end <= n - TAIL / 2 && violated.len() <= MIDDLE / 2 && centred >= 2 {
                (middle, centred..centred + MIDDLE)
            } else if violated.start > n - TAIL {
                (tail, n - TAIL..n)
            } else {
                (head, 0..HEAD)
            };
        if violated.end > window.end + usize::from(window.end == n) {
            return false;
        }

        let first = start - state(&self.references[0]);
        let affine = &self.affine;
        let mut arrival = AxisCosts::default();
        let mut to_go = AxisCosts::default();
        for (i, lq) in self.lq.iter_mut().enumerate() {
            to_go[i] = lq.cost_to_go(window.end);
            if window.start > 0 {
                let (weight, centre) =
                    lq.arrival_cost(window.start, axis(&first, i), |k| axis(&affine[k], i));
                arrival[i] = (weight, -(weight * centre));
            }
        }
        let sample = Sample {
            start: first,
            arrival: &arrival,
            to_go: &to_go,
            affine: &affine[window.clone()],
            state_balls: &self.state_balls[window.clone()],
            input_balls: &self.input_balls[window.clone()],
            terminal_radius,
        };
        let (solved, spent) = problem.solve(&sample, &mut self.errors[window.start..=window.end]);
        *iterations += spent;
        if !solved {
            return false;
        }
        let (begin, end) = (self.errors[window.start], self.errors[window.end]);
        for (i, lq) in self.lq.iter().enumerate() {
            let errors = &mut self.errors;
            let mut set = |k: usize, error: Vector2<f64>| {
                errors[k][i] = error.x;
                errors[k][3 + i] = error.y;
            };
            lq.trace_back(window.start, axis(&begin, i), &mut set);
            let last =
                lq.follow(window.end, axis(&end, i), |k| axis(&affine[k], i), |k, error, _| set(k, error));
            set(n, last);
        }
        self.plan_from_errors(start);
        let solved_for = window.start..window.end + usize::from(window.end == n);
        self.violated(solved_for).is_none()
    }

    fn over_whole_horizon(&mut self, start: Vector6<f64>, iterations: &mut u32) -> bool {
        let sample = Sample {
            start: start - state(&self.references[0]),
            arrival: &AxisCosts::default(),
            to_go: &self.design.g.map(|g| (g, Vector2::zeros())),
            affine: &self.affine,
            state_balls: &self.state_balls,
            input_balls: &self.input_balls,
            terminal_radius: self.terminal_radius(),
        };
        let (solved, spent) = self.whole.solve(&sample, &mut self.errors);
        *iterations += spent;
        if solved {
            self.plan_from_errors(start);
        }
        solved
    }

    /// `candidate` from `errors`, rolled out so that it is an exact motion of the nominal model.
    fn plan_from_errors(&mut self, start: Vector6<f64>) {
        let h = self.settings.period_optimisation;
        let plan = &mut self.candidate;
        plan.states[0] = match self.settings.initial_state {
            InitialState::Measured | InitialState::Nominal => start,
            InitialState::Tube => self.errors[0] + state(&self.references[0]),
        };
        for k in 0..self.settings.horizon {
            let (_, next_rates) = split(&(self.errors[k + 1] + state(&self.references[k + 1])));
            let a = (next_rates - plan.states[k].fixed_rows::<3>(3)) / h;
            plan.accelerations[k] = a;
            plan.states[k + 1] = plan::advance(&plan.states[k], &a, h);
        }
    }

    /// State and input balls of every stage, linearised about `about` with `start` as its first state.
    fn linearise_balls(&mut self, about: &Plan, start: &Vector6<f64>) {
        let n = self.settings.horizon;
        for k in 0..n {
            let here_state = if k == 0 { start } else { &about.states[k] };
            let next_state = &about.states[k + 1];
            let a = &about.accelerations[k];
            let (angles, rates) = split(here_state);
            let (next_angles, next_rates) = split(next_state);
            let here = linearise::linearise(&self.settings.body, &angles, &rates, a);
            let (here_reference, next_reference) = (&self.references[k], &self.references[k + 1]);
            match self.sets {
                Sets::Paper { x_tube, u_tube, .. } => {
                    self.input_balls[k] = ball(&here.input, here_state, a, here_reference, u_tube);
                    let rates = Linear {
                        value: next_rates,
                        by_angles: nalgebra::Matrix3x2::zeros(),
                        by_rates: Matrix3::identity(),
                        by_acceleration: Matrix3::zeros(),
                    };
                    self.state_balls[k] = ball(&rates, next_state, a, next_reference, x_tube);
                }
                Sets::Robust => {
                    let next = linearise::linearise(&self.settings.body, &next_angles, &next_rates, a);
                    let bound = self.moment_bound(k, &here, &next);
                    self.input_balls[k] = ball(&here.moment, here_state, a, here_reference, bound);
                    let bound = self.rate_bound(k + 1, &next);
                    self.state_balls[k] = ball(&next.rates, next_state, a, next_reference, bound);
                }
            }
        }
    }

    /// Robust set: what ‖ω̃‖ may be at prediction step k so that ‖ω‖ keeps its limit whatever the error dynamics do.
    fn rate_bound(&self, k: usize, at: &Linearisation) -> f64 {
        let tightening = &self.design.tightening;
        let Reach { angle, rate, .. } = tightening.at_stage[k];
        // ω = R⁻¹ x_ω with ‖R⁻¹‖ = 1
        let deviation = (rate + at.rates.by_angles.norm() * angle) * tightening.norm;
        let limit = self.settings.limit_rate;
        (limit - deviation).max(SMALLEST_SHARE * limit)
    }

    /// Robust set: what ‖m̃‖ may be at the start of prediction interval k so that ‖m‖ keeps its limit at each of its
    /// feedback ticks.
    fn moment_bound(&self, k: usize, here: &Linearisation, next: &Linearisation) -> f64 {
        let tightening = &self.design.tightening;
        let Reach { angle, rate, feedback } = tightening.within_stage[k];
        let limit = self.settings.limit_moment;
        // I R⁻¹ K o for disturbances in a box, and for the inertia error, which acts along m.
        let by_acceleration = &here.moment.by_acceleration;
        let feedback = feedback
            * (largest_over_box(by_acceleration, &tightening.disturbance) + tightening.inertia * limit);
        // The cancellation of f sees the deviation too.
        let drift =
            (here.moment.by_angles.norm() * angle + here.moment.by_rates.norm() * rate) * tightening.norm;
        // With a held, m̃ moves within the interval.
        let within = (next.moment.value.norm() - here.moment.value.norm()).max(0.0);
        (limit - feedback - drift - within).max(SMALLEST_SHARE * limit)
    }

    /// ε: (12)–(13) for the paper's set; for the robust set by the same argument with its own bounds and the reference at
    /// the end of the horizon.
    fn terminal_radius(&self) -> f64 {
        let n = self.settings.horizon;
        match self.sets {
            Sets::Paper { epsilon, .. } => epsilon,
            Sets::Robust => {
                let end = &self.references[n];
                let at =
                    linearise::linearise(&self.settings.body, &end.angles, &end.rates, &end.accelerations);
                let rate = self.rate_bound(n, &at) - at.rates.value.norm();
                let moment = self.moment_bound(n - 1, &at, &at) - at.moment.value.norm();
                let gain = self.settings.terminal.k1.hypot(self.settings.terminal.k2);
                let radius =
                    self.design.terminal_scale * rate.min(moment / (self.design.largest_inertia * gain));
                radius.max(SMALLEST_RADIUS)
            }
        }
    }
}

impl Controller for Crmpc {
    type Memory = Memory;

    fn period(&self) -> f64 {
        self.settings.period_feedback
    }

    fn memory(&self) -> Memory {
        Memory { plan: Plan::new(self.settings.horizon), ..Memory::default() }
    }

    fn update(
        &mut self,
        memory: &mut Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let angle_rates = kinematics::r(&measured.angles) * measured.rates;
        let within = tick % self.design.ratio as u64;
        if within == 0 {
            self.optimise(memory, time, join(&measured.angles, &angle_rates), reference);
        }
        let a = memory.plan.accelerations[0];
        memory.nominal =
            plan::advance(&memory.plan.states[0], &a, within as f64 * self.settings.period_feedback);
        // (20): with ũ* = a − f(x̃*), u = K O_e − f(x) + a, and m = I R⁻¹ u.
        let (nominal_angles, nominal_rates) = split(&memory.nominal);
        let gain = self.settings.feedback;
        let feedback = (measured.angles - nominal_angles) * gain.k1 + (angle_rates - nominal_rates) * gain.k2;
        let moment = linearise::moment(&self.settings.body, &measured.angles, &angle_rates, &(a + feedback));
        // Without a solution nothing keeps the moment within its limit.
        let excess = moment.norm() / self.settings.limit_moment;
        if memory.report.status == Status::Fallback && excess > 1.0 { moment / excess } else { moment }
    }
}

fn paper_sets(design: &Design) -> Result<Sets, DesignError> {
    let PaperConstants { x_tube, u_tube, epsilon1, epsilon2, .. } =
        design.paper.ok_or(DesignError::NotReal { name: "feedback" })?;
    let epsilon = epsilon1.min(epsilon2);
    for (name, value) in [("x_tube", x_tube), ("u_tube", u_tube), ("epsilon", epsilon)] {
        if value.is_nan() || value <= 0.0 {
            return Err(DesignError::EmptySet { name, value });
        }
    }
    Ok(Sets::Paper { x_tube, u_tube, epsilon })
}

/// Lᵀ with G = L Lᵀ; zero where G is zero.
fn square_root(g: &Matrix2<f64>) -> Matrix2<f64> {
    g.cholesky().map_or_else(Matrix2::zeros, |factor| factor.l().transpose())
}

/// Angle and rate of one axis.
fn axis(state: &Vector6<f64>, i: usize) -> Vector2<f64> {
    Vector2::new(state[i], state[3 + i])
}

fn state(reference: &Reference) -> Vector6<f64> {
    join(&reference.angles, &reference.rates)
}

fn join(angles: &Vector3<f64>, rates: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angles.x, angles.y, angles.z, rates.x, rates.y, rates.z)
}

fn split(state: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (state.fixed_rows::<3>(0).into_owned(), state.fixed_rows::<3>(3).into_owned())
}

/// A linearised quantity as a ball in terms of the tracking error and v = a − Θ̈_r.
fn ball(y: &Linear, at: &Vector6<f64>, a: &Vector3<f64>, reference: &Reference, bound: f64) -> Ball {
    let from_reference = at - state(reference);
    let offset = y.value
        - y.by_angles * from_reference.fixed_rows::<2>(0)
        - y.by_rates * from_reference.fixed_rows::<3>(3)
        - y.by_acceleration * (a - reference.accelerations);
    Ball { offset, by_angles: y.by_angles, by_rates: y.by_rates, by_acceleration: y.by_acceleration, bound }
}

/// max ‖M s‖ over |s_i| ≤ b_i.
fn largest_over_box(m: &Matrix3<f64>, b: &Vector3<f64>) -> f64 {
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
        .map(|(y, z)| (m * Vector3::new(b.x, y * b.y, z * b.z)).norm())
        .into_iter()
        .fold(0.0, f64::max)
}
