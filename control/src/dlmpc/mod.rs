//! Double-layered MPC (DLMPC), the comparison of Chai et al. (2022), section 5. An outer MPC
//! commands body rates that steer the attitude, and an inner terminal sliding mode follows them.
//! The paper that defines it was not available; docs/laws.md describes our reading.
//!
//! The outer layer predicts Θ⁺ = Θ + h v, where v = R ω is the commanded rate of the angles. The
//! bound is on the body rates R⁻¹(Θ) v, which are linearised along the previous prediction and
//! exact at present.

mod plan;
mod rate_limit;
mod settings;

use crate::clock::Instant;
pub use crate::report::{SolverReport, SolverStatus};
pub use plan::Plan;
pub use settings::{Settings, SlidingMode};

use crate::clone_in_place::clone_in_place;
use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::DesignError;
use crate::mpc::{Chain, Cost, ErrorTrajectory, Layout, Optimiser, State};
use nalgebra::Vector3;
use rate_limit::RateLimit;
use serde::{Deserialize, Serialize};
use vehicle::kinematics;
use vehicle::math::powf;
use vehicle::reference::Reference;

/// The state that DLMPC carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Plan in force, which starts at the last optimisation.
    pub plan: Plan,
    /// Whether `plan` has been filled by an optimisation.
    pub started: bool,
    /// Outcome of the last optimisation.
    pub report: SolverReport,
    /// Commanded body rates ω_c in force, rad/s.
    pub rate_command: Vector3<f64>,
    /// Integral z of the sliding manifold.
    pub integral: Vector3<f64>,
    /// Sliding variable s at the last tick, rad/s.
    pub sliding: Vector3<f64>,
    /// Wall-clock time of the last evaluation of the inner law, s; not reproducible.
    pub inner_time: f64,
}

clone_in_place!([] Memory { plan });

/// The controller: settings, solvers and scratch memory. All state that later ticks depend on is in
/// [`Memory`].
///
/// ```
/// use control::closed_loop::fly;
/// use control::dlmpc::{Dlmpc, Settings};
/// use control::Controller;
/// use vehicle::Scenario;
///
/// let settings = Settings::published();
/// let mut law = Dlmpc::new(settings)?;
/// let mut memory = law.memory();
/// let scenario = Scenario { duration: 4.0, ..Scenario::crmpc2022() };
/// fly(&mut law, &mut memory, settings.period_feedback, &scenario, |_| ())?;
/// assert_eq!(memory.report.solves, 20, "the outer layer optimises five times a second");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Dlmpc {
    settings: Settings,
    /// Number of inner ticks per optimisation.
    ratio: u64,
    /// Gains κ of the terminal law v = Θ̇_r − κ (Θ − Θ_r).
    gains: Vector3<f64>,
    rates: RateLimit,
    optimiser: Box<Optimiser<1>>,
    // Scratch memory of one optimisation.
    affine: Vec<State<1>>,
    previous: ErrorTrajectory<1>,
}

/// Largest change of any angle (rad) between passes at which the first optimisation has converged.
const STANDSTILL: f64 = 1e-7;
/// Share by which a window of the horizon is wider than the violated intervals, at each end.
const MARGIN: f64 = 0.5;
/// Typical angle error, by which the cone solver's unknowns are scaled, rad.
const ANGLE_SCALE: f64 = 0.1;

impl Dlmpc {
    /// Checks the settings and sets up the solvers.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let ratio = settings.ratio()?;
        let Settings { horizon: n, period_optimisation: h, p, q, .. } = settings;
        let p = Vector3::from(p);
        let cost = Cost { state: [p], input: Vector3::from(q), end: [[p]] };
        let layout = Layout {
            chain: Chain::new(h),
            cost,
            horizon: n,
            constrains_states: false,
            terminal: false,
            margin: MARGIN,
            scale: [ANGLE_SCALE],
            standstill: STANDSTILL,
        };
        let optimiser = Optimiser::new(layout, settings.solver).map_err(DesignError::Solver)?;
        Ok(Self {
            ratio,
            gains: -optimiser.feedback()[0],
            rates: RateLimit {
                limit: settings.limit_rate,
                references: vec![Reference::default(); n + 1],
            },
            optimiser: Box::new(optimiser),
            affine: vec![[Vector3::zeros()]; n],
            previous: ErrorTrajectory::new(n),
            settings,
        })
    }

    /// Returns the number of inner ticks per optimisation.
    pub fn ratio(&self) -> u64 {
        self.ratio
    }

    /// Runs one optimisation at `time` from the measured angles. The plan and the report are left
    /// in `memory`.
    fn optimise(
        &mut self,
        memory: &mut Memory,
        time: f64,
        measured: Vector3<f64>,
        reference: ReferenceAt,
    ) {
        let clock = Instant::now();
        self.optimiser.begin();
        self.preview(time, reference);
        let first = !memory.started;
        if first {
            self.follow_reference(&mut memory.plan);
            memory.started = true;
        } else {
            self.shift(&mut memory.plan);
        }

        let start = [measured - self.rates.references[0].angles];
        memory.plan.errors(&self.rates.references, &mut self.previous);
        let previous = (!first).then_some((&self.previous, &memory.plan.multipliers[..]));
        let mut report = self.optimiser.optimise(&self.rates, &start, &self.affine, previous);
        if report.status == SolverStatus::Fallback {
            self.track(&mut memory.plan, measured);
            memory.plan.errors(&self.rates.references, &mut self.previous);
            let Self { optimiser, rates, affine, previous, .. } = self;
            report = optimiser.fall_back(rates, &start, affine, previous, report);
        } else {
            let trajectory = self.optimiser.trajectory();
            memory.plan.follow(
                trajectory,
                measured,
                &self.rates.references,
                self.settings.period_optimisation,
            );
            memory.plan.multipliers.clear();
            memory.plan.multipliers.extend(self.optimiser.multipliers());
        }
        memory.report.record(&report, self.optimiser.is_exhausted(), clock);
    }

    /// Computes the references at the prediction times, and d_k = Θ_r,k + h Θ̇_r,k − Θ_r,k+1.
    fn preview(&mut self, time: f64, reference: ReferenceAt) {
        let h = self.settings.period_optimisation;
        for (k, slot) in self.rates.references.iter_mut().enumerate() {
            *slot = reference(time + k as f64 * h);
        }
        for (d, pair) in self.affine.iter_mut().zip(self.rates.references.windows(2)) {
            *d = [pair[0].angles + pair[0].rates * h - pair[1].angles];
        }
    }

    /// Sets the plan before the first optimisation, which is the reference itself.
    fn follow_reference(&self, plan: &mut Plan) {
        plan.angles.clear();
        plan.angles.extend(self.rates.references.iter().map(|reference| reference.angles));
        plan.multipliers.clear();
        plan.multipliers.resize(self.settings.horizon, [0.0; 2]);
        plan.commands.clear();
        plan.commands.extend(
            self.rates.references[..self.settings.horizon].iter().map(|reference| reference.rates),
        );
    }

    /// Drops the first interval of the plan and appends one under the terminal law, within the
    /// limit.
    fn shift(&self, plan: &mut Plan) {
        let n = self.settings.horizon;
        let (last, reference) = (plan.angles[n], &self.rates.references[n - 1]);
        let command = reference.rates - self.gains.component_mul(&(last - reference.angles));
        plan.angles.rotate_left(1);
        plan.commands.rotate_left(1);
        plan.multipliers.rotate_left(1);
        plan.multipliers[n - 1] = [0.0; 2];
        plan.commands[n - 1] = self.within_limit(&last, command);
        plan.angles[n] = last + plan.commands[n - 1] * self.settings.period_optimisation;
    }

    /// Replaces `plan` by a trajectory that follows it from the measured angles with the terminal
    /// law's gain, within the limit.
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

    /// Returns `command` scaled so that ‖R⁻¹(Θ) v‖ keeps its limit.
    fn within_limit(&self, angles: &Vector3<f64>, command: Vector3<f64>) -> Vector3<f64> {
        within((kinematics::r_inverse(angles) * command).norm(), self.settings.limit_rate) * command
    }

    /// Evaluates the inner law at one tick and advances the manifold's integral.
    fn follow_command(&self, memory: &mut Memory, rates: &Vector3<f64>) -> Vector3<f64> {
        let Settings { body, sliding_mode: SlidingMode { q, p, gamma, rho }, .. } = self.settings;
        // Manifold s = e + Γ z, ż = sig^ρ(e). With ω_c held, ω̇_c = 0 between its jumps, and ṡ = −q
        // s − p sig^ρ(s) requires the ω̇ below.
        let e = rates - memory.rate_command;
        let growth = signed_power(&e, rho);
        let s = e + memory.integral * gamma;
        let acceleration = -(growth * gamma + s * q + signed_power(&s, rho) * p);
        let moment = rates.cross(&(body.inertia * rates)) + body.inertia * acceleration;
        // The inner law limits its moment itself: the integral must not wind up while the moment
        // is smaller than required, and the published runs depend on the rounding of this scaling.
        let share = within(moment.norm(), self.settings.limit_moment);
        if share >= 1.0 {
            memory.integral += growth * self.settings.period_feedback;
        }
        memory.sliding = s;
        moment * share
    }
}

impl Controller for Dlmpc {
    type Memory = Memory;

    fn memory(&self) -> Memory {
        Memory { plan: Plan::new(self.settings.horizon), ..Memory::default() }
    }

    fn fits(&self, memory: &Memory) -> bool {
        let (n, Plan { angles, commands, multipliers }) = (self.settings.horizon, &memory.plan);
        angles.len() == n + 1 && commands.len() == n && multipliers.len() == n
    }

    fn command(
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

/// Returns the factor, at most 1, that scales a vector of this norm into `limit`. Rounding does not
/// lift the result above the limit.
fn within(norm: f64, limit: f64) -> f64 {
    if norm > limit { limit / norm * (1.0 - 8.0 * f64::EPSILON) } else { 1.0 }
}

/// Returns sig^ρ(x) = |x|^ρ sgn x, component by component.
fn signed_power(x: &Vector3<f64>, rho: f64) -> Vector3<f64> {
    x.map(|x| powf(x.abs(), rho).copysign(x))
}
