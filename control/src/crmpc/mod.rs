//! Centralised robust MPC of Chai et al. (2022): an optimisation plans a nominal motion, and a
//! feedback law keeps the vehicle near it.
//!
//! The prediction is made in x̃ = (Θ̃, x̃_ω), where the nominal model (7) under ũ = a − f is an
//! exact double integrator. The error E = x̃ − x_r is formed afterwards, so that a jump of the
//! reference is seen in the preview and never enters the dynamics.

mod commands;
mod design;
mod few_stages;
mod guarantee;
mod observer;
mod plan;
mod published;
mod robust;
mod sets;
mod settings;
mod supervision;

pub use crate::report::{SolverReport, SolverStatus};
pub use commands::Commands;
pub use design::{
    Design, PaperConstants, held_terminal_weight, step_response_peak, terminal_weight,
};
#[doc(hidden)]
pub use guarantee::Lemmas;
pub use guarantee::{Assessment, Carried, Deviation, Geometry, Onset, Switching, Tightening};
pub use observer::Observed;
pub use plan::Plan;
pub use published::Published;
pub use robust::Margins;
pub use sets::Bounds;
pub use settings::{Constraints, Guarantee, InitialState, ObserverSettings, Settings};
pub use supervision::{Contradiction, Supervision};

use crate::controller::{Controller, Explained, Measurement, ReferenceAt};
use crate::error::DesignError;
use crate::error_dynamics::InvariantSet;
use crate::linearise;
use crate::mpc::{
    self, Chain, Cost, ErrorTrajectory, Layout, Nonlinearity, Optimiser, State, per_axis,
};
use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};
use sets::{Certified, Sets};
use std::time::Instant;
use vehicle::kinematics;
use vehicle::math::cos;
use vehicle::reference::Reference;

/// The state that CRMPC carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Plan in force, which starts at the last optimisation.
    pub plan: Plan,
    /// Whether `plan` has been filled by an optimisation.
    pub started: bool,
    /// Outcome of the last optimisation.
    pub report: SolverReport,
    /// Nominal state (Θ̃, x̃_ω) at the last tick.
    pub nominal: Vector6<f64>,
    /// Whether the plan in force gives the guarantee, or the reason why not.
    pub standing: Standing,
    /// What is said of the guarantee, which takes into account what contradicts its assumptions.
    pub supervision: Supervision,
    /// Margins to the limits that the plan in force leaves in its first interval.
    pub margins: Margins,
    /// Share of the moment limit that the design leaves to the plan at rest, see
    /// [`Assessment::moment_left`]; zero with the paper's set.
    pub moment_left: f64,
    /// Feedback ticks from the beginning of the nominal motion to the beginning of the plan in
    /// force.
    pub age: u32,
    /// Feedback ticks until a pending guarantee is in force.
    pub pending: u32,
    /// Estimate of the disturbance with its filter state.
    pub observed: Observed,
    /// Recent changes of the command, if the delay is not exact.
    pub commands: Commands,
}

/// Status of the guarantee of the robust set at a tick. While it is in force, ‖ω‖ and ‖m‖ keep
/// their limits for as long as the assumptions hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Standing {
    /// No optimisation has been run yet, or the sets guarantee nothing.
    #[default]
    None,
    /// A plan is certified, and the guarantee comes into force once the delay has passed; until
    /// then moments act that were commanded without it.
    Pending,
    /// The limits are guaranteed from this tick on.
    InForce,
    /// The design does not hold for the settings, so that the controller works on best effort.
    Refused,
    /// No plan has been found that satisfies the conditions of the theorem.
    Uncertified,
    /// The vehicle is further from the plan than the assumptions explain, or something else
    /// contradicts them.
    Exceeded,
    /// The inputs were set before the tick.
    Stale,
}

impl Standing {
    fn is_assured(self) -> bool {
        matches!(self, Self::Pending | Self::InForce)
    }
}

impl Memory {
    /// Returns whether the plan in force is certified and the vehicle no further from it than the
    /// assumptions explain.
    pub fn assured(&self) -> bool {
        self.standing.is_assured()
    }
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        let mut clone = Self::default();
        clone.clone_from(self);
        clone
    }

    // The derived version would allocate memory for a plan at every tick.
    fn clone_from(&mut self, source: &Self) {
        let Self {
            plan,
            started,
            report,
            nominal,
            standing,
            margins,
            moment_left,
            age,
            pending,
            supervision,
            observed,
            commands,
        } = source;
        self.plan.clone_from(plan);
        self.started = *started;
        self.report = *report;
        self.nominal = *nominal;
        self.standing = *standing;
        self.margins = *margins;
        self.moment_left = *moment_left;
        self.age = *age;
        self.pending = *pending;
        self.supervision = *supervision;
        self.observed = *observed;
        self.commands.clone_from(commands);
    }
}

/// The controller: settings, offline design, solvers and scratch memory. All state that later ticks
/// depend on is in [`Memory`].
///
/// ```
/// use control::crmpc::{Constraints, Settings, Standing};
/// use control::closed_loop::fly;
/// use control::{Controller, Crmpc};
/// use vehicle::Scenario;
///
/// let scenario = Scenario { duration: 4.0, ..Scenario::crmpc2022() }; let settings =
/// Settings::new(Constraints::Robust); let mut law = Crmpc::new(settings)?; let mut memory =
/// law.memory(); fly(&mut law, &mut memory, settings.period_feedback, &scenario, |sample| {
/// assert_eq!(sample.memory.standing, Standing::InForce, "the limits are guaranteed from the first
/// tick on"); })?; assert_eq!(memory.report.fallbacks, 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Crmpc {
    settings: Settings,
    design: Design,
    chain: Chain<2>,
    sets: Sets,
    optimiser: Optimiser<2>,
    // Scratch memory of one optimisation.
    affine: Vec<State<2>>,
    previous: ErrorTrajectory<2>,
    /// Shift of the reference's angles by the observer, rad.
    shift: Vector3<f64>,
}

/// Largest share of the rate limit to which the terminal law steers if there is no optimum.
const SHARE_OF_RATE: f64 = 0.8;
/// Shares of the tightening that are tried if no plan is certified.
const LESS: [f64; 2] = [0.5, 0.0];
/// Number of steps from a kept plan towards the optimum without constraints that are tried: the
/// first covers half of the way, each further one half as much as the one before.
const HALVINGS: usize = 6;
/// Largest change of any state (rad, rad/s) between passes at which the first optimisation has
/// converged.
const STANDSTILL: f64 = 1e-8;
/// Share by which a window of the horizon is wider than the violated intervals, at each end. With
/// the robust set most intervals of a window are near their bounds, and an iteration costs more.
const MARGIN: f64 = 0.25;
const MARGIN_OF_THE_PAPER: f64 = 0.5;
/// Typical angle error, by which the cone solver's unknowns are scaled, rad.
const ANGLE_SCALE: f64 = 0.1;
/// Smallest disturbance bound for which the invariant set is computed, rad/s², so that the set has
/// an interior.
const SMALLEST_DISTURBANCE: f64 = 1e-5;

impl Crmpc {
    /// Designs the controller and sets up its solver.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let design = Design::new(&settings)?;
        let sets = Sets::new(&settings, &design)?;
        let Settings { horizon: n, period_optimisation: h, p, q, .. } = settings;
        let start = (settings.initial_state == InitialState::Tube).then(|| {
            let normals = design.invariant.as_ref().map(InvariantSet::normals).unwrap_or_default();
            let size = (design.counted * settings.disturbance_bound).max(SMALLEST_DISTURBANCE);
            std::array::from_fn(|_| normals.iter().map(|n| n / size).collect())
        });
        let chain = Chain::new(h);
        // Cost (10), sampled: Σ h (EᵀPE + vᵀQv) + E_NᵀG E_N.
        let cost = Cost {
            state: [Vector3::new(p[0], p[1], p[2]) * h, Vector3::new(p[3], p[4], p[5]) * h],
            input: Vector3::from(q) * h,
            end: per_axis(&design.g),
        };
        let layout = Layout {
            chain,
            cost,
            horizon: n,
            constrains_states: true,
            // With the robust set the horizon ends in a bound on the rates (docs/guarantee.md).
            terminal: settings.constraints == Constraints::Paper,
            start,
            margin: match settings.constraints {
                Constraints::Robust => MARGIN,
                Constraints::Paper => MARGIN_OF_THE_PAPER,
            },
            scale: [ANGLE_SCALE, settings.limit_rate],
            standstill: STANDSTILL,
        };
        let optimiser = Optimiser::new(layout, settings.solver).map_err(DesignError::Solver)?;
        Ok(Self {
            settings,
            design,
            chain,
            sets,
            optimiser,
            affine: vec![[Vector3::zeros(); 2]; n],
            previous: ErrorTrajectory::new(n),
            shift: Vector3::zeros(),
        })
    }

    /// Returns the result of the offline design.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Returns the bounds of the last optimisation, for benchmarks and tests that solve the same
    /// problem by other means.
    pub fn bounds(&self) -> Bounds {
        self.sets.bounds(self.optimiser.bounds())
    }

    /// Runs one optimisation at `time` from the measured state (Θ, x_ω). The plan and the report
    /// are left in `memory`. Returns whether the vehicle was further from the plan before than the
    /// assumptions explain, although a guarantee was given.
    fn optimise(
        &mut self,
        memory: &mut Memory,
        time: f64,
        measured: Vector6<f64>,
        reference: ReferenceAt,
    ) -> bool {
        let (clock, was_assured) = (Instant::now(), memory.assured());
        self.optimiser.begin();
        // Without guarantee the command compensates for the disturbance instead.
        self.shift =
            if memory.assured() { memory.observed.shift(&self.settings) } else { Vector3::zeros() };
        self.preview(time, reference);
        let first = !memory.started;
        let anew = if first {
            memory.plan.resize(self.settings.horizon);
            memory.started = true;
            true
        } else {
            self.shift(&mut memory.plan);
            memory.age = memory.age.saturating_add(self.design.ratio as u32);
            self.is_left_behind(memory, &measured)
        };
        let report = match self.settings.constraints {
            Constraints::Robust => self.plan_robustly(memory, &measured, anew),
            Constraints::Paper => self.plan_as_printed(memory, &measured, first),
        };
        memory.report.record(&report, self.optimiser.is_exhausted(), clock);
        was_assured && anew && !first
    }

    /// Returns whether the vehicle is further from the plan than the assumptions explain. The plan
    /// is then useless: the guarantee ends, and bounds about the plan would be misleading. If the
    /// design does not hold anyway, the plan still serves as a guess, and the result is `false`.
    fn is_left_behind(&mut self, memory: &mut Memory, measured: &Vector6<f64>) -> bool {
        let (angles, rates) = split(&(measured - memory.plan.states[0]));
        let gain = self.settings.feedback;
        let left = self.design.counted >= 1.0
            && !self.explains(memory, 0, &angles, &rates, &(angles * gain.k1 + rates * gain.k2));
        if memory.assured() && left {
            memory.standing = Standing::Exceeded;
        }
        left
    }

    /// Plans by the optimum within the paper's sets, or by the shifted previous plan (31).
    fn plan_as_printed(
        &mut self,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        first: bool,
    ) -> mpc::OptimiserReport {
        let start = match self.settings.initial_state {
            InitialState::Nominal if !first => memory.plan.states[0],
            _ => *measured,
        };
        let report = self.solve(memory, &start, first);
        if report.status != SolverStatus::Fallback {
            self.follow_optimum(memory, &start);
            return report;
        }
        if first {
            self.follow_terminal_law(&mut memory.plan, start);
        }
        self.keep(memory, &start, (SolverStatus::Fallback, report.iterations))
    }

    /// Returns what a nominal motion follows on that begins at the measured state.
    fn onset_anew(&self, memory: &Memory, measured: &Vector6<f64>) -> Onset {
        let Some(switching) = &self.design.tightening.switching else { return Onset::default() };
        let at_rest = || {
            let (angles, rates) = split(measured);
            self.settings.body.drift(&angles, &rates)
        };
        let allowed = memory.plan.begins_with(switching).z
            + self.design.tightening.pulse(memory.age as usize);
        Onset {
            carried: switching.unseen(memory.commands.changes()),
            before: memory.observed.commanded().unwrap_or_else(at_rest),
            allowed: if memory.assured() { allowed } else { f64::INFINITY },
        }
    }

    /// Returns what the present plan follows on, if it goes on.
    fn onset_going_on(&self, memory: &Memory) -> Onset {
        let Plan { onset, .. } = &memory.plan;
        let Some(switching) = &self.design.tightening.switching else { return *onset };
        let allowed = switching.pulse_of_command(memory.plan.first_change());
        Onset { allowed: if memory.assured() { allowed } else { f64::INFINITY }, ..*onset }
    }

    /// Finds a plan that satisfies the conditions of the theorem (docs/guarantee.md). The first
    /// choice is the optimum from the measured state, the second the optimum from the state that
    /// the previous plan predicted. The last is the previous plan itself, which satisfies the
    /// conditions if it did before and the vehicle is no further from it than the assumptions
    /// explain. Without such a plan the limits are violated as little as possible.
    fn plan_robustly(
        &mut self,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        anew: bool,
    ) -> mpc::OptimiserReport {
        let assured = memory.assured();
        if !self.credible(memory) {
            return self.violate_least(memory, measured, 0);
        }
        let anew_from = (*measured, 0, self.onset_anew(memory, measured));
        let goes_on = (memory.plan.states[0], memory.age, self.onset_going_on(memory));
        let starts = match self.settings.initial_state {
            InitialState::Nominal if assured => [Some(goes_on), None],
            InitialState::Measured if assured => [Some(anew_from), Some(goes_on)],
            _ => [Some(anew_from), None],
        };
        let mut iterations = 0;
        for (start, age, onset) in starts.into_iter().flatten() {
            self.sets.begin(age as usize, 1.0, &onset);
            let (report, certified) = self.certified(memory, &start, anew);
            iterations += report.iterations;
            let solved = report.status != SolverStatus::Fallback;
            // Linearised constraints serve for comparison, so their optimum is accepted without
            // guarantee.
            let taken = !assured || self.settings.solver.nonlinearity == Nonlinearity::Frozen;
            if certified.is_some() || solved && taken {
                self.follow_optimum(memory, &start);
                (memory.age, memory.plan.onset) = (age, onset);
                self.take_over(memory, certified);
                return mpc::OptimiserReport { iterations, ..report };
            }
        }
        if assured {
            self.go_towards_the_optimum(memory);
            let report = self.keep(memory, measured, (SolverStatus::Kept, iterations));
            memory.margins = self.sets.margins(&self.previous);
            return report;
        }
        self.violate_least(memory, measured, iterations)
    }

    /// Follows the motion that has just become the plan, under guarantee if it is certified.
    fn take_over(&mut self, memory: &mut Memory, certified: Option<Certified>) {
        let Some(Certified { margins, braking }) = certified else {
            memory.margins = self.sets.margins(self.optimiser.trajectory());
            memory.standing = self.without_guarantee(memory);
            return;
        };
        (memory.margins, memory.plan.braking) = (margins, braking);
        if !memory.assured() {
            memory.standing = Standing::Pending;
            memory.pending = self.design.delay_ticks;
        }
    }

    /// Moves the certified plan towards the optimum without constraints as far as that is
    /// certified, so that a plan that is kept repeatedly still leads to the reference.
    fn go_towards_the_optimum(&mut self, memory: &mut Memory) {
        self.sets.begin(memory.age as usize, 1.0, &self.onset_going_on(memory));
        memory.plan.errors(&self.sets.references, &mut self.previous);
        self.optimiser.without_constraints(&self.previous.states[0], &self.affine);
        for _ in 0..HALVINGS {
            self.optimiser.halve_the_way_to(&self.previous);
            if let Some(certified) = self.sets.certify(self.optimiser.trajectory(), false) {
                let start = memory.plan.states[0];
                self.follow_optimum(memory, &start);
                self.take_over(memory, Some(certified));
                return;
            }
        }
    }

    /// Returns the optimum from `start`, with its certificate if it satisfies the conditions of the
    /// theorem.
    fn certified(
        &mut self,
        memory: &Memory,
        start: &Vector6<f64>,
        first: bool,
    ) -> (mpc::OptimiserReport, Option<Certified>) {
        let report = self.solve(memory, start, first);
        if report.status == SolverStatus::Fallback {
            return (report, None);
        }
        (report, self.sets.certify(self.optimiser.trajectory(), report.settled))
    }

    /// Plans by the optimum with less tightening, or by the terminal law from the measured state
    /// within the available moment.
    fn violate_least(
        &mut self,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        tried: u32,
    ) -> mpc::OptimiserReport {
        memory.standing = self.without_guarantee(memory);
        let onset = self.onset_anew(memory, measured);
        (memory.age, memory.plan.onset) = (0, onset);
        let mut iterations = tried;
        for share in LESS {
            if self.optimiser.is_exhausted() {
                break;
            }
            self.sets.begin(0, share, &onset);
            let report = self.solve(memory, measured, true);
            iterations += report.iterations;
            if report.status != SolverStatus::Fallback {
                self.follow_optimum(memory, measured);
                memory.margins = self.sets.margins(self.optimiser.trajectory());
                return mpc::OptimiserReport { iterations, ..report };
            }
        }
        self.follow_terminal_law(&mut memory.plan, *measured);
        let report = self.keep(memory, measured, (SolverStatus::Fallback, iterations));
        memory.margins = self.sets.margins(&self.previous);
        report
    }

    /// Returns whether the assumptions explain the observed disturbance.
    fn credible(&self, memory: &Memory) -> bool {
        let Tightening { observable, switching, growth, .. } = &self.design.tightening;
        let by_pulses =
            |switching: &Switching| switching.observed(memory.commands.filtered()) * growth;
        let explained = observable + switching.as_deref().map_or(0.0, by_pulses);
        memory.observed.disturbance.amax() <= explained
    }

    /// Returns the reason why a plan is not certified.
    fn without_guarantee(&self, memory: &Memory) -> Standing {
        if self.design.counted < 1.0 {
            Standing::Refused
        } else if self.credible(memory) {
            Standing::Uncertified
        } else {
            Standing::Exceeded
        }
    }

    /// Returns the optimum from `start` with the bounds about the previous plan, or about itself if
    /// there is none (`first`).
    fn solve(
        &mut self,
        memory: &Memory,
        start: &Vector6<f64>,
        first: bool,
    ) -> mpc::OptimiserReport {
        let error = error(start, &self.sets.references[0]);
        let previous = (!first).then(|| {
            memory.plan.errors(&self.sets.references, &mut self.previous);
            // The optimum moves with the shifted reference.
            let moved = self.shift - memory.plan.shift;
            self.previous.states.iter_mut().for_each(|[angles, _]| *angles += moved);
            (&self.previous, &memory.plan.multipliers[..])
        });
        self.optimiser.optimise(&self.sets, &error, &self.affine, previous)
    }

    /// Makes the optimum the plan in force.
    fn follow_optimum(&mut self, memory: &mut Memory, start: &Vector6<f64>) {
        let start = (self.settings.initial_state != InitialState::Tube).then_some(*start);
        let motion = self.optimiser.trajectory();
        memory.plan.follow(motion, start, &self.sets.references, self.settings.period_optimisation);
        memory.plan.shift = self.shift;
        memory.plan.multipliers.clear();
        memory.plan.multipliers.extend(self.optimiser.multipliers());
    }

    /// Keeps the present plan and returns a report on it.
    fn keep(
        &mut self,
        memory: &Memory,
        start: &Vector6<f64>,
        ended: (SolverStatus, u32),
    ) -> mpc::OptimiserReport {
        let error = error(start, &self.sets.references[0]);
        memory.plan.errors(&self.sets.references, &mut self.previous);
        let Self { optimiser, sets, affine, previous, .. } = self;
        optimiser.fall_back(sets, &error, affine, previous, ended)
    }

    /// Computes the references at the prediction times, with shifted angles, and d_k = A x_r,k + B
    /// Θ̈_r,k − x_r,k+1.
    fn preview(&mut self, time: f64, reference: ReferenceAt) {
        let h = self.settings.period_optimisation;
        for (k, slot) in self.sets.references.iter_mut().enumerate() {
            *slot = reference(time + k as f64 * h);
            slot.angles += self.shift;
        }
        for (d, pair) in self.affine.iter_mut().zip(self.sets.references.windows(2)) {
            let moved =
                self.chain.advance(&[pair[0].angles, pair[0].rates], &pair[0].accelerations);
            *d = [moved[0] - pair[1].angles, moved[1] - pair[1].rates];
        }
    }

    /// Shifts the plan as in (31): drops the first interval and appends one under the terminal law
    /// (14), a = K̃ E + Θ̈_r. With the robust set the appended interval brakes.
    fn shift(&self, plan: &mut Plan) {
        let n = self.settings.horizon;
        let last = *plan.states.last().unwrap_or(&Vector6::zeros());
        if let Some(switching) = &self.design.tightening.switching {
            plan.onset.carried = switching.next(&plan.begins_with(switching));
            plan.onset.before = plan.accelerations[0];
        }
        plan.states.rotate_left(1);
        plan.accelerations.rotate_left(1);
        plan.multipliers.rotate_left(1);
        plan.multipliers[n - 1] = [0.0; 2];
        let a = match self.settings.constraints {
            Constraints::Robust => {
                let braking = Vector3::new(guarantee::BRAKING, plan.braking, guarantee::BRAKING);
                -last.fixed_rows::<3>(3).component_mul(&braking)
            }
            Constraints::Paper => self.terminal_acceleration(&last, &self.sets.references[n - 1]),
        };
        plan.accelerations[n - 1] = a;
        plan.states[n] = plan::advance(&last, &a, self.settings.period_optimisation);
    }

    /// Returns the acceleration under the terminal law (14): ũ^f = −f + K̃ Ẽ + Θ̈_r, hence
    /// a = K̃ Ẽ + Θ̈_r.
    fn terminal_acceleration(&self, state: &Vector6<f64>, reference: &Reference) -> Vector3<f64> {
        let gain = self.settings.terminal;
        let angles = state.fixed_rows::<3>(0) - reference.angles;
        let rates = state.fixed_rows::<3>(3) - reference.rates;
        angles * gain.k1 + rates * gain.k2 + reference.accelerations
    }

    /// Returns the acceleration under the terminal law with limited rates and moment. The limited
    /// rates are those to which the law steers, Θ̇_r − (k̃₁/k̃₂) E_θ.
    fn terminal_acceleration_within_limits(
        &self,
        state: &Vector6<f64>,
        reference: &Reference,
    ) -> Vector3<f64> {
        let Settings { terminal: gain, limit_rate, .. } = &self.settings;
        let (angles, rates) = split(state);
        let wanted = reference.rates - (angles - reference.angles) * (gain.k1 / gain.k2);
        let excess = wanted.norm() / (SHARE_OF_RATE * limit_rate);
        let (wanted, wanted_acceleration) = if excess > 1.0 {
            (wanted / excess, Vector3::zeros())
        } else {
            (wanted, reference.accelerations)
        };
        self.within_the_moment(state, (rates - wanted) * gain.k2 + wanted_acceleration)
    }

    /// Returns the largest share of `acceleration` whose moment is within the limit. The share is
    /// zero if even zero acceleration exceeds the limit.
    fn within_the_moment(&self, state: &Vector6<f64>, acceleration: Vector3<f64>) -> Vector3<f64> {
        let (angles, rates) = split(state);
        let Settings { body, limit_moment, .. } = &self.settings;
        let motion = linearise::InverseKinematics::at(&angles).motion(body, &rates);
        if motion.moment(&acceleration).norm() <= *limit_moment {
            return acceleration;
        }
        // ‖m‖² is a parabola in the share; its larger root is the result.
        let (slope, rest) = (motion.moment_by_acceleration * acceleration, motion.moment_at_rest);
        let (square, mixed) = (slope.norm_squared(), slope.dot(&rest));
        let discriminant =
            mixed * mixed - square * (rest.norm_squared() - limit_moment * limit_moment);
        acceleration * ((discriminant.max(0.0).sqrt() - mixed) / square).max(0.0)
    }

    fn follow_terminal_law(&self, plan: &mut Plan, start: Vector6<f64>) {
        plan.states[0] = start;
        for k in 0..self.settings.horizon {
            let (state, reference) = (plan.states[k], &self.sets.references[k]);
            plan.accelerations[k] = match self.settings.constraints {
                Constraints::Robust => self.terminal_acceleration_within_limits(&state, reference),
                Constraints::Paper => self.terminal_acceleration(&state, reference),
            };
            plan.states[k + 1] = plan::advance(
                &plan.states[k],
                &plan.accelerations[k],
                self.settings.period_optimisation,
            );
        }
    }
}

impl Controller for Crmpc {
    type Memory = Memory;

    fn memory(&self) -> Memory {
        let robust = self.settings.constraints == Constraints::Robust;
        Memory {
            plan: Plan::new(self.settings.horizon),
            moment_left: if robust { self.design.assessment.moment_left } else { 0.0 },
            commands: Commands::new(&self.settings),
            ..Memory::default()
        }
    }

    fn fits(&self, memory: &Memory) -> bool {
        let (n, Plan { states, accelerations, multipliers, .. }) =
            (self.settings.horizon, &memory.plan);
        states.len() == n + 1
            && accelerations.len() == n
            && multipliers.len() == n
            && memory.commands.fits(&self.settings)
    }

    fn command(
        &mut self,
        memory: &mut Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let angle_rates = kinematics::r(&measured.angles) * measured.rates;
        let within = tick % self.design.ratio as u64;
        memory.pending = memory.pending.saturating_sub(1);
        memory.observed.observe(&self.settings, &angle_rates);
        if let Some(switching) = &self.design.tightening.switching {
            memory.commands.observe(&self.settings, switching, &memory.observed);
        }
        let mut left_behind = false;
        if within == 0 {
            let state = join(&measured.angles, &angle_rates);
            left_behind = self.optimise(memory, time, state, reference);
        }
        let a = memory.plan.accelerations[0];
        memory.nominal = plan::advance(
            &memory.plan.states[0],
            &a,
            within as f64 * self.settings.period_feedback,
        );
        // Feedback law (20): with ũ* = a − f(x̃*), u = K O_e − f(x) + a, and m = I R⁻¹ u.
        let (nominal_angles, nominal_rates) = split(&memory.nominal);
        let (off_angles, off_rates) =
            (measured.angles - nominal_angles, angle_rates - nominal_rates);
        let gain = self.settings.feedback;
        let robust = self.settings.constraints == Constraints::Robust;
        // Without guarantee the command compensates for the disturbance at once, because no plan
        // reserves moment for it.
        let compensates = robust && self.settings.observer.active && !memory.assured();
        let against = if compensates { -memory.observed.disturbance } else { Vector3::zeros() };
        let commanded = a + off_angles * gain.k1 + off_rates * gain.k2 + against;
        let Settings { body, limit_moment, .. } = &self.settings;
        let moment = if robust {
            self.moment_over_the_period(&measured.angles, &angle_rates, &commanded)
        } else {
            linearise::moment(body, &measured.angles, &angle_rates, &commanded)
        };
        let mut found = Contradiction::None;
        if robust {
            // The guarantee is judged by the moment before the limit.
            let kept = moment.norm() <= limit_moment * (1.0 + 1e-9)
                && measured.rates.norm() <= self.rate_shown();
            let explained =
                self.explains(memory, within, &off_angles, &off_rates, &(commanded - a));
            if memory.assured() && !(explained && self.credible(memory) && kept) {
                memory.standing = Standing::Exceeded;
            }
            found = self.contradiction(memory, measured, explained && !left_behind, kept);
            if memory.standing == Standing::Pending && memory.pending == 0 {
                memory.standing = Standing::InForce;
            }
            memory.observed.remember([&measured.angles, &angle_rates], &commanded);
        }
        memory.supervision.judge(memory.standing, found, self.settings.period_feedback);
        moment
    }

    fn explained(&self) -> Option<Explained> {
        let is_robust = self.settings.constraints == Constraints::Robust;
        is_robust.then_some(self.design.tightening.explained)
    }

    /// The paper's sets leave the limit to the optimisation. Without a solution, and with the
    /// robust set, the command is limited as well.
    fn limit(&self, memory: &Memory) -> f64 {
        let robust = self.settings.constraints == Constraints::Robust;
        if robust || memory.report.status == SolverStatus::Fallback {
            self.settings.limit_moment
        } else {
            f64::INFINITY
        }
    }

    fn limited(&mut self, memory: &mut Memory, applied: &Vector3<f64>) {
        memory.observed.limit(&self.settings.body, applied);
    }
}

impl Crmpc {
    /// Returns the moment that gives the commanded acceleration in the middle of the period over
    /// which it is held, so that the effects of a changing f on the rate cancel over the period.
    fn moment_over_the_period(
        &self,
        angles: &Vector3<f64>,
        rates: &Vector3<f64>,
        commanded: &Vector3<f64>,
    ) -> Vector3<f64> {
        let half = 0.5 * self.settings.period_feedback;
        let angles = angles + (rates + commanded * (0.5 * half)) * half;
        linearise::moment(&self.settings.body, &angles, &(rates + commanded * half), commanded)
    }

    /// Returns what contradicts the assumptions at a tick. As long as no plan was certified, a
    /// motion beyond the limits, or away from the plan, contradicts nothing.
    fn contradiction(
        &self,
        memory: &Memory,
        measured: &Measurement,
        explained: bool,
        kept: bool,
    ) -> Contradiction {
        let certified = memory.supervision.status.is_assured()
            || memory.supervision.contradiction != Contradiction::None;
        if measured.stale {
            Contradiction::Step
        } else if measured.has_other_delay {
            Contradiction::Delay
        } else if measured.is_unexplained || !self.credible(memory) {
            Contradiction::Disturbance
        } else if certified && !explained {
            Contradiction::Deviation
        } else if certified && !kept {
            Contradiction::Limit
        } else {
            Contradiction::None
        }
    }

    /// Returns whether the assumptions explain the deviation of the predicted state from the
    /// nominal state, and this K ô, `tick` ticks after the optimisation.
    fn explains(
        &self,
        memory: &Memory,
        tick: u64,
        angles: &Vector3<f64>,
        rates: &Vector3<f64>,
        feedback: &Vector3<f64>,
    ) -> bool {
        let carried = self.design.tightening.switching.as_ref();
        let carried = carried.map(|switching| memory.plan.begins_with(switching));
        let tick = memory.age as usize + tick as usize;
        let Some(bounds) = self.sets.explained(tick, &carried.unwrap_or_default()) else {
            return false;
        };
        let slack = 1.0 + 1e-9;
        let r = 1.0 / cos(self.settings.sideslip_domain);
        let ball = bounds.feedback_norm + bounds.feedback_moment * r / self.design.smallest_inertia;
        let within = |i: usize| feedback[i].abs() <= (bounds.feedback + ball) * slack + 1e-12;
        angles.xy().norm() <= bounds.seen_angle * slack + 1e-12
            && rates.norm() <= bounds.seen_rate * slack + 1e-12
            && (0..3).all(within)
    }

    /// Returns the largest measured ‖ω‖ that is compatible with the limit, rad/s.
    fn rate_shown(&self) -> f64 {
        let Settings { limit_rate, rate_error, angle_error, .. } = self.settings;
        let of_rates = 3.0_f64.sqrt() * rate_error;
        (limit_rate + of_rates + linearise::TURN_BY_ANGLES * 1.5 * limit_rate * angle_error)
            * (1.0 + 1e-9)
    }
}

/// Returns the tracking error E = x̃ − x_r.
fn error(state: &Vector6<f64>, reference: &Reference) -> State<2> {
    let (angles, rates) = split(state);
    [angles - reference.angles, rates - reference.rates]
}

fn join(angles: &Vector3<f64>, rates: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(angles.x, angles.y, angles.z, rates.x, rates.y, rates.z)
}

fn split(state: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (state.fixed_rows::<3>(0).into_owned(), state.fixed_rows::<3>(3).into_owned())
}
