//! Double-layered MPC (DLMPC), the comparison of Chai et al. (2022), section 5: an outer MPC commands body rates that steer the
//! attitude, an inner terminal sliding mode follows them. The paper that defines it was not available; the reading is in
//! docs/DLMPC.md.
//!
//! The outer layer predicts Θ⁺ = Θ + h v, where v = R ω is the commanded rate of the angles; the body rates R⁻¹(Θ) v that are
//! bounded are linearised along the previous prediction, and exact in the present.

mod cone;
mod lq;
mod settings;

pub use crate::report::{Report, Status};
pub use settings::{Settings, SlidingMode};

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::DesignError;
use cone::{ConeProblem, Rates, Sample, Start, Structure};
use lq::AngleLq;
use nalgebra::{Matrix3x2, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::time::Instant;
use vehicle::kinematics;
use vehicle::reference::Reference;

/// A motion of the angles over the horizon.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Θ_0 … Θ_N, rad.
    pub angles: Vec<Vector3<f64>>,
    /// v_0 … v_{N−1}, held between them, rad/s.
    pub commands: Vec<Vector3<f64>>,
}

impl Clone for Plan {
    fn clone(&self) -> Self {
        Self { angles: self.angles.clone(), commands: self.commands.clone() }
    }

    // Keeps the memory it has.
    fn clone_from(&mut self, source: &Self) {
        self.angles.clone_from(&source.angles);
        self.commands.clone_from(&source.commands);
    }
}

impl Plan {
    /// A plan of `horizon` intervals at rest at the origin.
    pub fn new(horizon: usize) -> Self {
        Self { angles: vec![Vector3::zeros(); horizon + 1], commands: vec![Vector3::zeros(); horizon] }
    }

    /// Largest difference of any angle.
    fn distance(&self, other: &Self) -> f64 {
        self.angles.iter().zip(&other.angles).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
    }
}

/// What DLMPC carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// The plan in force; it starts at the last optimisation.
    pub plan: Plan,
    /// Whether `plan` holds anything yet.
    pub started: bool,
    /// Outcome of the last optimisation.
    pub report: Report,
    /// ω_c in force, rad/s.
    pub rate_command: Vector3<f64>,
    /// z of the manifold.
    pub integral: Vector3<f64>,
    /// s at the last tick, rad/s.
    pub sliding: Vector3<f64>,
    /// Wall-clock time of the last evaluation of the inner law, s. Not reproducible.
    pub inner_time: f64,
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        Self { plan: self.plan.clone(), ..*self }
    }

    // The derived version would allocate a new plan at every tick.
    fn clone_from(&mut self, source: &Self) {
        let Self { plan, started, report, rate_command, integral, sliding, inner_time } = self;
        plan.clone_from(&source.plan);
        *started = source.started;
        *report = source.report;
        *rate_command = source.rate_command;
        *integral = source.integral;
        *sliding = source.sliding;
        *inner_time = source.inner_time;
    }
}

/// The controller: settings, solvers and scratch space. Everything that matters later is in [`Memory`].
pub struct Dlmpc {
    settings: Settings,
    /// Inner ticks per optimisation.
    ratio: u64,
    lq: [AngleLq; 3],
    /// κ of the terminal law v = Θ̇_r − κ (Θ − Θ_r).
    gains: Vector3<f64>,
    /// The whole horizon.
    whole: ConeProblem,
    windows: Option<Windows>,
    /// Whether the unconstrained optimum is tried first.
    exits: bool,
    // Scratch of one optimisation.
    references: Vec<Reference>,
    affine: Vec<Vector3<f64>>,
    errors: Vec<Vector3<f64>>,
    candidate: Plan,
    previous: Plan,
    rates: Vec<Rates>,
}

/// Parts of the horizon that stand for the whole of it while no constraint outside is active, as in [`crate::crmpc`].
struct Windows {
    /// The first [`HEAD`] intervals.
    head: ConeProblem,
    /// [`MIDDLE`] intervals anywhere later.
    middle: ConeProblem,
}

/// Lengths of the windows in intervals: the start of a manoeuvre, a jump of the reference ahead.
const HEAD: usize = 24;
const MIDDLE: usize = 8;
/// Passes of the first optimisation at most.
const FIRST_PASSES: usize = 20;
/// The first optimisation has converged when no angle moves by more than this (rad) between passes.
const FIRST_TOLERANCE: f64 = 1e-7;
/// Relative slack when the exact constraints are checked, for rounding.
const CHECK_SLACK: f64 = 1e-9;
/// Typical angle error, by which the solver's unknowns are scaled, rad.
const ANGLE_SCALE: f64 = 0.1;

impl Dlmpc {
    /// Checks the settings and sets the solvers up.
    ///
    /// # Errors
    /// Names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let ratio = settings.ratio()?;
        let Settings { horizon: n, period_optimisation: h, p, q, .. } = settings;
        let problem = |stages, start| {
            ConeProblem::new(Structure {
                stages,
                step: h,
                p,
                q,
                start,
                limit: settings.limit_rate,
                angle_scale: ANGLE_SCALE,
                max_iterations: settings.max_iterations,
            })
            .map_err(DesignError::Solver)
        };
        let windows =
            Windows { head: problem(HEAD, Start::Fixed)?, middle: problem(MIDDLE, Start::Arrival)? };
        let lq: [AngleLq; 3] = std::array::from_fn(|i| AngleLq::new(n, h, p[i], q[i]));
        Ok(Self {
            ratio,
            gains: Vector3::from_fn(|i, _| lq[i].gain()),
            lq,
            whole: problem(n, Start::Fixed)?,
            windows: (n >= HEAD + 2).then_some(windows),
            exits: true,
            references: vec![Reference::default(); n + 1],
            affine: vec![Vector3::zeros(); n],
            errors: vec![Vector3::zeros(); n + 1],
            candidate: Plan::new(n),
            previous: Plan::new(n),
            rates: vec![Rates::default(); n],
            settings,
        })
    }

    /// Always solves the cone programme of the whole horizon, for comparison: the same optimum, only later.
    #[must_use]
    pub fn without_exits(mut self) -> Self {
        self.exits = false;
        self.windows = None;
        self
    }

    /// Inner ticks per optimisation.
    pub fn ratio(&self) -> u64 {
        self.ratio
    }

    /// One optimisation at `time` from the measured angles: leaves the plan and the report in `memory`.
    fn optimise(&mut self, memory: &mut Memory, time: f64, measured: Vector3<f64>, reference: ReferenceAt) {
        let clock = Instant::now();
        self.preview(time, reference);
        let first = !memory.started;
        if first {
            self.follow_reference(&mut memory.plan);
            memory.started = true;
        } else {
            self.shift(&mut memory.plan);
        }

        self.unconstrained(measured);
        let (mut status, mut iterations) = (Status::Unconstrained, 0);
        let violated = if self.exits { self.violated(0..0) } else { Some(0..self.settings.horizon) };
        if let Some(violated) = violated {
            let solved = if first {
                self.constrained_first(measured, &violated, &mut iterations)
            } else {
                self.constrained(&memory.plan, measured, &violated, &mut iterations)
            };
            status = if solved { Status::Constrained } else { Status::Fallback };
        }
        if status == Status::Fallback {
            self.track(&mut memory.plan, measured);
            memory.report.fallbacks += 1;
            for (k, error) in self.errors.iter_mut().enumerate() {
                *error = memory.plan.angles[k] - self.references[k].angles;
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

    /// References at the prediction times, and d_k = Θ_r,k + h Θ̇_r,k − Θ_r,k+1.
    fn preview(&mut self, time: f64, reference: ReferenceAt) {
        let h = self.settings.period_optimisation;
        for (k, slot) in self.references.iter_mut().enumerate() {
            *slot = reference(time + k as f64 * h);
        }
        for (d, pair) in self.affine.iter_mut().zip(self.references.windows(2)) {
            *d = pair[0].angles + pair[0].rates * h - pair[1].angles;
        }
    }

    /// The plan that there is before the first optimisation: the reference.
    fn follow_reference(&self, plan: &mut Plan) {
        plan.angles.clear();
        plan.angles.extend(self.references.iter().map(|reference| reference.angles));
        plan.commands.clear();
        plan.commands
            .extend(self.references[..self.settings.horizon].iter().map(|reference| reference.rates));
    }

    /// Drops the first interval and appends one under the terminal law, within the limit.
    fn shift(&self, plan: &mut Plan) {
        let n = self.settings.horizon;
        let (last, reference) = (plan.angles[n], &self.references[n - 1]);
        let command = reference.rates - self.gains.component_mul(&(last - reference.angles));
        plan.angles.rotate_left(1);
        plan.commands.rotate_left(1);
        plan.commands[n - 1] = self.within_limit(&last, command);
        plan.angles[n] = last + plan.commands[n - 1] * self.settings.period_optimisation;
    }

    /// Follows `plan` from the measured angles with the terminal law's gain, within the limit, and makes that the plan.
    fn track(&self, plan: &mut Plan, measured: Vector3<f64>) {
        let mut angles = measured;
        for k in 0..self.settings.horizon {
            let command = plan.commands[k] - self.gains.component_mul(&(angles - plan.angles[k]));
            plan.angles[k] = angles;
            plan.commands[k] = self.within_limit(&angles, command);
            angles += plan.commands[k] * self.settings.period_optimisation;
        }
        plan.angles[self.settings.horizon] = angles;
    }

    /// `command` scaled so that ‖R⁻¹(Θ) v‖ keeps its limit.
    fn within_limit(&self, angles: &Vector3<f64>, command: Vector3<f64>) -> Vector3<f64> {
        within((kinematics::r_inverse(angles) * command).norm(), self.settings.limit_rate) * command
    }

    /// The optimum without constraints into `candidate` and `errors`.
    fn unconstrained(&mut self, measured: Vector3<f64>) {
        let Self { lq, references, affine, errors, candidate, settings, .. } = self;
        let start = measured - references[0].angles;
        for (i, lq) in lq.iter_mut().enumerate() {
            errors[settings.horizon][i] = lq.solve(
                start[i],
                |k| affine[k][i],
                |k, error, w| {
                    errors[k][i] = error;
                    candidate.commands[k][i] = w + references[k].rates[i];
                },
            );
        }
        for (k, error) in errors.iter().enumerate() {
            candidate.angles[k] = error + references[k].angles;
        }
        candidate.angles[0] = measured;
    }

    /// The intervals, from the first to the last, in which `candidate` violates the constraint (exactly evaluated). Those in
    /// `skip` are not looked at.
    fn violated(&self, skip: Range<usize>) -> Option<Range<usize>> {
        let n = self.settings.horizon;
        let bound = self.settings.limit_rate * (1.0 + CHECK_SLACK);
        let violates = |&k: &usize| {
            let rates = kinematics::r_inverse(&self.candidate.angles[k]) * self.candidate.commands[k];
            let feasible = rates.norm() <= bound;
            !skip.contains(&k) && !feasible
        };
        let first = (0..n).find(violates)?;
        let last = (first..n).rfind(violates).unwrap_or(first);
        Some(first..last + 1)
    }

    /// Σ_{k≤N} EᵀPE + Σ_{k<N} (v − Θ̇_r)ᵀQ(v − Θ̇_r) of `errors`.
    fn cost(&self) -> f64 {
        let Settings { period_optimisation: h, p, q, .. } = self.settings;
        let (p, q) = (Vector3::from(p), Vector3::from(q));
        let square = |weight: &Vector3<f64>, x: Vector3<f64>| weight.dot(&x.component_mul(&x));
        let angles: f64 = self.errors.iter().map(|error| square(&p, *error)).sum();
        let command = |(pair, d): (&[Vector3<f64>], &Vector3<f64>)| square(&q, (pair[1] - pair[0] - d) / h);
        angles + self.errors.windows(2).zip(&self.affine).map(command).sum::<f64>()
    }

    /// The first optimisation: linearised again about its own solution until that stands still.
    fn constrained_first(
        &mut self,
        measured: Vector3<f64>,
        violated: &Range<usize>,
        iterations: &mut u32,
    ) -> bool {
        let mut about = std::mem::take(&mut self.previous);
        let mut solved = true;
        for _ in 0..FIRST_PASSES {
            about.clone_from(&self.candidate);
            solved = self.constrained(&about, measured, violated, iterations);
            if !solved || about.distance(&self.candidate) < FIRST_TOLERANCE {
                break;
            }
        }
        self.previous = about;
        solved
    }

    /// The optimum with the constraint linearised about a plan, into `candidate` and `errors`; whether there is one.
    fn constrained(
        &mut self,
        about: &Plan,
        measured: Vector3<f64>,
        violated: &Range<usize>,
        iterations: &mut u32,
    ) -> bool {
        for (k, rates) in self.rates.iter_mut().enumerate() {
            let angles = if k == 0 { measured } else { about.angles[k] };
            *rates = linearise(&angles, &about.commands[k], &self.references[k]);
        }
        self.in_window(measured, violated, iterations) || self.over_whole_horizon(measured, iterations)
    }

    /// Solves only a window around the violated intervals, with arrival cost and cost-to-go for the rest of the horizon. If
    /// the rest then satisfies the constraint exactly, this is the optimum of the whole, as it is that of a relaxation.
    fn in_window(&mut self, measured: Vector3<f64>, violated: &Range<usize>, iterations: &mut u32) -> bool {
        let n = self.settings.horizon;
        let Some(Windows { head, middle }) = &mut self.windows else { return false };
        let centred = ((violated.start + violated.end).saturating_sub(MIDDLE) / 2).min(n - MIDDLE);
        let (problem, window) = if violated.len() <= MIDDLE / 2 && centred >= 1 {
            (middle, centred..centred + MIDDLE)
        } else {
            (head, 0..HEAD)
        };
        if violated.end > window.end {
            return false;
        }

        let start = measured - self.references[0].angles;
        let affine = &self.affine;
        let mut arrival = [(0.0, 0.0); 3];
        let mut to_go = [(0.0, 0.0); 3];
        for (i, lq) in self.lq.iter_mut().enumerate() {
            to_go[i] = lq.cost_to_go(window.end);
            if window.start > 0 {
                let (weight, centre) = lq.arrival_cost(window.start, start[i], |k| affine[k][i]);
                arrival[i] = (weight, -weight * centre);
            }
        }
        let sample = Sample {
            start,
            arrival,
            to_go,
            affine: &affine[window.clone()],
            rates: &self.rates[window.clone()],
        };
        let (solved, spent) = problem.solve(&sample, &mut self.errors[window.start..=window.end]);
        *iterations += spent;
        if !solved {
            return false;
        }
        let (begin, end) = (self.errors[window.start], self.errors[window.end]);
        for (i, lq) in self.lq.iter().enumerate() {
            let errors = &mut self.errors;
            lq.trace_back(window.start, begin[i], |k, error| errors[k][i] = error);
            errors[n][i] =
                lq.follow(window.end, end[i], |k| affine[k][i], |k, error, _| errors[k][i] = error);
        }
        self.plan_from_errors(measured);
        self.violated(window).is_none()
    }

    fn over_whole_horizon(&mut self, measured: Vector3<f64>, iterations: &mut u32) -> bool {
        let sample = Sample {
            start: measured - self.references[0].angles,
            arrival: [(0.0, 0.0); 3],
            to_go: self.settings.p.map(|p| (p, 0.0)),
            affine: &self.affine,
            rates: &self.rates,
        };
        let (solved, spent) = self.whole.solve(&sample, &mut self.errors);
        *iterations += spent;
        if solved {
            self.plan_from_errors(measured);
        }
        solved
    }

    /// `candidate` from `errors`, rolled out so that it is an exact motion of the model.
    fn plan_from_errors(&mut self, measured: Vector3<f64>) {
        let h = self.settings.period_optimisation;
        let plan = &mut self.candidate;
        plan.angles[0] = measured;
        for k in 0..self.settings.horizon {
            let next = self.errors[k + 1] + self.references[k + 1].angles;
            plan.commands[k] = (next - plan.angles[k]) / h;
            plan.angles[k + 1] = plan.angles[k] + plan.commands[k] * h;
        }
    }

    /// The inner law at one tick; moves the manifold's integral on.
    fn follow_command(&self, memory: &mut Memory, rates: &Vector3<f64>) -> Vector3<f64> {
        let Settings { body, sliding_mode: SlidingMode { q, p, gamma, rho }, .. } = self.settings;
        // s = e + Γ z, ż = sig^ρ(e); with ω_c held, ω̇_c = 0 between its jumps, and ṡ = −q s − p sig^ρ(s) asks for ω̇ as below.
        let e = rates - memory.rate_command;
        let growth = signed_power(&e, rho);
        let s = e + memory.integral * gamma;
        let acceleration = -(growth * gamma + s * q + signed_power(&s, rho) * p);
        let moment = rates.cross(&(body.inertia * rates)) + body.inertia * acceleration;
        let share = within(moment.norm(), self.settings.limit_moment);
        // No wind-up while the moment is less than asked for.
        if share >= 1.0 {
            memory.integral += growth * self.settings.period_feedback;
        }
        memory.sliding = s;
        moment * share
    }
}

impl Controller for Dlmpc {
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
        if tick.is_multiple_of(self.ratio) {
            self.optimise(memory, time, measured.angles, reference);
            memory.rate_command = kinematics::r_inverse(&measured.angles) * memory.plan.commands[0];
        }
        let clock = Instant::now();
        let moment = self.follow_command(memory, &measured.rates);
        memory.inner_time = clock.elapsed().as_secs_f64();
        moment
    }
}

/// The factor that scales a vector of this norm into `limit`: at most 1. Rounding does not lift the result above it.
fn within(norm: f64, limit: f64) -> f64 {
    if norm > limit { limit / norm * (1.0 - 8.0 * f64::EPSILON) } else { 1.0 }
}

/// sig^ρ(x) = |x|^ρ sgn x, by component.
fn signed_power(x: &Vector3<f64>, rho: f64) -> Vector3<f64> {
    x.map(|x| x.abs().powf(rho).copysign(x))
}

/// ω = R⁻¹(Θ) v near a point of a plan, in terms of the errors.
fn linearise(angles: &Vector3<f64>, command: &Vector3<f64>, reference: &Reference) -> Rates {
    let by_command = kinematics::r_inverse(angles);
    let rates = by_command * command;
    // ∂R⁻¹/∂z = −R⁻¹ (∂R/∂z) R⁻¹
    let by_angles = Matrix3x2::from_columns(&[
        -(by_command * (kinematics::r_alpha(angles) * rates)),
        -(by_command * (kinematics::r_beta(angles) * rates)),
    ]);
    let error = angles - reference.angles;
    let offset = rates - by_angles * error.xy() - by_command * (command - reference.rates);
    Rates { offset, by_angles, by_command }
}
