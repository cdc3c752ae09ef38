//! Centralised robust MPC of Chai et al. (2022): an optimisation plans a nominal trajectory, and a
//! feedback law keeps the vehicle near it.

mod commands;
mod design;
mod guarantee;
mod memory;
mod observer;
mod paper;
mod plan;
mod planner;
mod refusal;
mod robust;
mod rule;
mod set;
mod settings;
mod stages;
mod state;
mod supervision;
mod terminal;

use crate::clock::Instant;
pub use crate::report::{SolverReport, SolverStatus};
pub use commands::Commands;
pub use design::{
    Design, PaperConstants, held_terminal_weight, step_response_peak, terminal_weight,
};
#[doc(hidden)]
pub use guarantee::Lemmas;
pub use guarantee::{Assessment, Carried, Deviation, Geometry, Onset, Switching, Tightening};
pub use memory::{Acting, Margins, Memory};
pub use observer::Observed;
pub use plan::{Plan, Terms};
pub use set::{Bounds, Posed};
pub use settings::Published;
pub use settings::{Constraints, Guarantee, InitialState, ObserverSettings, Settings};
pub use supervision::{Contradiction, GuaranteeStatus, Supervision};

use crate::controller::{Controller, Explained, Measurement, ReferenceAt};
use crate::error::DesignError;
use nalgebra::{Vector3, Vector6};
use paper::Paper;
use planner::Planner;
use robust::Robust;
use set::{Command, ConstraintSet, Planned, Tick};
use state::{join, split};
use vehicle::kinematics;

/// The controller: settings, offline design, solvers and scratch memory. All state that later ticks
/// depend on is in [`Memory`].
///
/// ```
/// use control::crmpc::{Constraints, Settings, GuaranteeStatus};
/// use control::closed_loop::fly;
/// use control::{Controller, Crmpc};
/// use vehicle::Scenario;
///
/// let scenario = Scenario { duration: 4.0, ..Scenario::crmpc2022() };
/// let settings = Settings::new(Constraints::Robust);
/// let mut law = Crmpc::new(settings)?;
/// let mut memory = law.memory();
/// fly(&mut law, &mut memory, settings.period_feedback, &scenario, |sample| {
///     // The limits are guaranteed from the first tick on.
///     assert_eq!(sample.memory.guarantee, GuaranteeStatus::InForce);
/// })?;
/// assert_eq!(memory.report.fallbacks, 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Crmpc {
    settings: Settings,
    design: Design,
    set: Box<dyn ConstraintSet>,
    planner: Planner,
}

impl Crmpc {
    /// Designs the controller and sets up its solver.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let design = Design::new(&settings)?;
        let settings = Settings { feedback: design.feedback, ..settings };
        let set = Self::set(&settings, &design)?;
        let windows = (set.terminal_radius().is_some(), set.window_margin());
        let planner = Planner::new(&settings, &design, windows)?;
        Ok(Self { settings, design, set, planner })
    }

    /// Returns the constraints. What they need of the stack is not added to what the planner needs.
    #[inline(never)]
    fn set(settings: &Settings, design: &Design) -> Result<Box<dyn ConstraintSet>, DesignError> {
        Ok(match settings.constraints {
            Constraints::Robust => Box::new(Robust::new(settings, design)),
            Constraints::Paper => Box::new(Paper::new(settings, design)?),
        })
    }

    /// Returns the result of the offline design.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Returns the distance from the measured angles beyond which a reference is replaced by one on
    /// the way to it, rad; infinite with the paper's sets.
    pub fn reach(&self) -> f64 {
        self.planner.reach
    }

    /// Returns the last optimisation as data.
    pub fn posed(&mut self) -> Posed {
        let Planner { optimiser, start, .. } = &self.planner;
        let (held, point) = optimiser.last_pass();
        Posed {
            start: *start,
            bounds: self.set.bounds(held),
            references: self.set.stages_mut().references.clone(),
            cost: *optimiser.cost(),
            linearisation_point: point.clone(),
        }
    }

    /// Runs one optimisation at `time` from the measured state (Θ, x_ω). The plan and the report
    /// are left in `memory`. Returns whether the vehicle was further from the plan before than the
    /// assumptions explain, although a guarantee was given.
    fn optimise(
        &mut self,
        memory: &mut Memory,
        time: f64,
        measured: &Vector6<f64>,
        reference: ReferenceAt,
    ) -> bool {
        let clock = Instant::now();
        let Self { settings, set, planner, .. } = self;
        planner.optimiser.begin();
        let shift = set.shift(memory);
        let (angles, _) = split(measured);
        planner.preview(set.stages_mut(), time, reference, (shift, &angles));
        let first = !memory.started;
        if first {
            memory.plan.resize(settings.horizon);
            memory.started = true;
        } else {
            let a = set.beyond_the_horizon(&memory.plan);
            set.move_on(&mut memory.plan);
            memory.plan.shift(&a, settings.period_optimisation);
        }
        let Planned { report, left_behind } = set.plan(planner, memory, measured, first);
        memory.report.record(&report, planner.optimiser.is_exhausted(), clock);
        left_behind
    }
}

impl Controller for Crmpc {
    type Memory = Memory;

    fn memory(&self) -> Memory {
        Memory {
            plan: Plan::new(self.settings.horizon),
            moment_left: self.set.moment_left(),
            gain: self.settings.feedback,
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

    /// The feedback law (20) about the nominal trajectory: with ũ* = a − f(x̃*),
    /// u = K O_e − f(x) + a and m = I R⁻¹ u.
    fn command(
        &mut self,
        memory: &mut Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let angle_rates = kinematics::r(&measured.angles) * measured.rates;
        (memory.known, memory.turn) = (measured.known_moment, measured.turn);
        memory.scheduled = measured.scheduled;
        self.set.observe(memory, &angle_rates);
        let within = tick % self.design.ratio as u64;
        let state = join(&measured.angles, &angle_rates);
        let left_behind = within == 0 && self.optimise(memory, time, &state, reference);

        let (k, nominal) = (self.settings.feedback, memory.plan.accelerations[0]);
        let elapsed = within as f64 * self.settings.period_feedback;
        memory.nominal = plan::advance(&memory.plan.states[0], &nominal, elapsed);
        let (angles, rates) = split(&(state - memory.nominal)); // O_e
        let commanded = nominal + angles * k.k1 + rates * k.k2 + self.set.compensation(memory);
        let moment = self.set.moment(&measured.angles, &angle_rates, &commanded);

        let deviation = [angles, rates];
        let command = Command { nominal, commanded, moment };
        let tick = Tick { measured, angle_rates, within, deviation, command, left_behind };
        self.set.supervise(memory, &tick);
        moment
    }

    fn explained(&self) -> Option<Explained> {
        self.set.explained()
    }

    /// The paper's sets leave the limit to the optimisation. Without a solution, and with the
    /// robust set, the command is limited as well.
    fn limit(&self, memory: &Memory) -> f64 {
        self.set.limit(memory)
    }

    fn limited(&mut self, memory: &mut Memory, applied: &Vector3<f64>) {
        memory.observed.limit(&self.settings.body, applied);
    }
}
