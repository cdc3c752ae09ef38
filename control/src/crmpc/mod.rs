//! Centralised robust MPC of Chai et al. (2022): an optimisation plans a nominal trajectory, and a
//! feedback law keeps the vehicle near it.

mod design;
mod feedback;
mod guarantee;
mod horizon;
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

pub use crate::report::{SolverReport, SolverStatus};
pub use design::{
    Design, PaperConstants, held_terminal_weight, step_response_peak, terminal_weight,
};
pub use guarantee::{Assessment, Deviation, Tightening};
#[doc(hidden)]
pub use guarantee::{
    BRAKING, CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, Domain, FOURTH, Lemmas, TURN,
};
pub use horizon::{POINTS, PlanPoint, points};
pub use memory::{Acting, Instead, Margins, Memory, Tracked};
pub use observer::Observed;
pub use plan::{Plan, Terms};
pub use set::{Bounds, Posed};
pub use settings::{Constraints, Guarantee, InitialState, ObserverSettings, Settings};
pub use supervision::{Contradiction, GuaranteeStatus, Supervision};

use crate::controller::{Controller, Explained, Measurement, ReferenceAt};
use crate::error::DesignError;
use feedback::Tick;
use nalgebra::Vector3;
use paper::Paper;
use planner::Planner;
use robust::Robust;

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
    planner: Planner,
    law: Law,
}

/// The two laws that follow the planner's nominal trajectories: by the sets that the limits need,
/// with their guarantee, and by those of the paper.
enum Law {
    Robust(Box<Robust>),
    Paper(Box<Paper>),
}

impl Law {
    // As a separate function, this does not add its need of stack to that of the planner.
    #[inline(never)]
    fn new(settings: &Settings, design: &Design) -> Result<Self, DesignError> {
        Ok(match settings.constraints {
            Constraints::Robust => Self::Robust(Box::new(Robust::new(settings, design))),
            Constraints::Paper => Self::Paper(Box::new(Paper::new(settings, design)?)),
        })
    }
}

impl Crmpc {
    /// Designs the controller and sets up its solver.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let design = Design::new(&settings)?;
        let settings = Settings { feedback: design.feedback, ..settings };
        let law = Law::new(&settings, &design)?;
        let planner = Planner::new(&settings, &design)?;
        Ok(Self { settings, design, planner, law })
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
    pub fn posed(&self) -> Posed {
        let Planner { optimiser, start, .. } = &self.planner;
        let (held, linearisation_point) = optimiser.last_pass();
        let (bounds, stages) = match &self.law {
            // The first state is given, so that it has no bound.
            Law::Robust(law) => (
                Bounds {
                    rate: held.state[1..].to_vec(),
                    input: held.input.clone(),
                    terminal: None,
                },
                &law.stages,
            ),
            Law::Paper(law) => (law.bounds(), &law.stages),
        };
        Posed {
            start: *start,
            bounds,
            references: stages.references.clone(),
            cost: *optimiser.cost(),
            linearisation_point: linearisation_point.clone(),
        }
    }

    /// Returns the number of points at which the plan is shown.
    fn points_shown(&self) -> usize {
        if self.settings.shows_plan { POINTS } else { 0 }
    }
}

impl Controller for Crmpc {
    type Memory = Memory;

    fn memory(&self) -> Memory {
        Memory {
            plan: Plan::new(self.settings.horizon),
            moment_left: match self.law {
                Law::Robust(_) => self.design.assessment.moment_left,
                Law::Paper(_) => 0.0,
            },
            turn_time: match self.law {
                Law::Robust(_) => self.design.turn_time(&self.settings),
                Law::Paper(_) => 0.0,
            },
            gain: self.settings.feedback,
            shown: vec![PlanPoint::default(); self.points_shown()],
            ..Memory::default()
        }
    }

    fn fits(&self, memory: &Memory) -> bool {
        let (n, Plan { states, accelerations, multipliers, .. }) =
            (self.settings.horizon, &memory.plan);
        states.len() == n + 1
            && accelerations.len() == n
            && multipliers.len() == n
            && memory.shown.len() == self.points_shown()
    }

    fn command(
        &mut self,
        memory: &mut Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        (memory.known, memory.turn) = (measured.known_moment, measured.turn);
        memory.scheduled = measured.scheduled;
        let tick = Tick::new(tick % self.design.ratio as u64, time, measured, reference);
        match &mut self.law {
            Law::Robust(law) => law.command(&mut self.planner, memory, &tick),
            Law::Paper(law) => law.command(&mut self.planner, memory, &tick),
        }
    }

    fn explained(&self) -> Option<Explained> {
        match self.law {
            Law::Robust(_) => Some(self.design.tightening.explained),
            Law::Paper(_) => None,
        }
    }

    /// The paper's sets leave the limit to the optimisation. Without a solution, and with the
    /// robust set, the command is limited as well.
    fn limit(&self, memory: &Memory) -> f64 {
        match self.law {
            Law::Paper(_) if memory.report.status != SolverStatus::Fallback => f64::INFINITY,
            _ => self.settings.limit_moment,
        }
    }

    fn limited(&mut self, memory: &mut Memory, applied: &Vector3<f64>) {
        memory.observed.limit(&self.settings.body, applied);
    }
}
