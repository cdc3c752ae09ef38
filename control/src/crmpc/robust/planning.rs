//! How a plan is found that satisfies the conditions of the theorem (docs/guarantee.md), and the
//! rest of what CRMPC does with the robust set.

use super::Robust;
use super::certificate::Certified;
use crate::controller::Explained;
use crate::crmpc::guarantee::{self, Onset};
use crate::crmpc::memory::Memory;
use crate::crmpc::plan::Plan;
use crate::crmpc::planner::Planner;
use crate::crmpc::set::{Bounds, ConstraintSet, Planned, Tick};
use crate::crmpc::settings::InitialState;
use crate::crmpc::stages::Stages;
use crate::crmpc::state::split;
use crate::crmpc::supervision::GuaranteeStatus;
use crate::crmpc::terminal;
use crate::linearise;
use crate::mpc::{self, Nonlinearity};
use crate::report::SolverStatus;
use nalgebra::{Vector3, Vector6};

/// Shares of the tightening that are tried if no plan is certified.
const LESS: [f64; 2] = [0.5, 0.0];
/// Number of steps from a kept plan towards the optimum without constraints that are tried: the
/// first covers half of the way, each further one half as much as the one before.
const HALVINGS: usize = 12;
/// Share by which a window of the horizon is wider than the violated intervals, at each end. Most
/// intervals of a window are near their bounds, and an iteration costs more than with the paper's
/// set.
const WINDOW_MARGIN: f64 = 0.25;

impl Robust {
    /// Returns whether the vehicle is further from the plan than the assumptions explain. The plan
    /// is then useless: the guarantee ends, and bounds about the plan would be misleading. If the
    /// design does not hold anyway, the plan still serves as a guess, and the result is `false`.
    fn is_left_behind(&self, memory: &mut Memory, measured: &Vector6<f64>) -> bool {
        let (angles, rates) = split(&(measured - memory.plan.states[0]));
        let gain = self.settings.feedback;
        let left = self.design.accepted_share >= 1.0
            && !self.explains(memory, 0, &angles, &rates, &(angles * gain.k1 + rates * gain.k2));
        if memory.assured() && left {
            memory.guarantee = GuaranteeStatus::Exceeded;
        }
        left
    }

    /// Returns the part of the rate limit that the trajectory's turn needs while a plan is followed
    /// that begins with these rates of it (rad/s): the theorem bounds ‖ω + w‖.
    fn needed_by_turn(&self, turn: &Vector3<f64>) -> f64 {
        let is_told = *turn != Vector3::zeros();
        if is_told { turn.norm() + self.settings.turn_change } else { 0.0 }
    }

    /// Returns what a nominal trajectory follows on that begins at the measured state.
    fn onset_anew(&self, memory: &Memory, measured: &Vector6<f64>) -> Onset {
        let Some(switching) = &self.design.tightening.switching else { return Onset::default() };
        let at_rest = || {
            let (angles, rates) = split(measured);
            self.settings.body.drift(&angles, &rates)
        };
        let allowed = memory.plan.begins_with(switching).z
            + self.design.at_level(memory.plan.terms.level).pulse(memory.age as usize);
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

    /// Returns where the present plan is, since how many ticks it has been followed, what it
    /// follows on, and the level of the disturbance: not less of it than what drives the deviation
    /// already.
    fn goes_on(&self, memory: &Memory) -> (Vector6<f64>, u32, Onset, usize) {
        let Plan { states, terms, .. } = &memory.plan;
        let level = self.terms.level.min(terms.level);
        (states[0], memory.age, self.onset_going_on(memory), level)
    }

    /// Finds a plan that satisfies the conditions of the theorem. The first choice is the optimum
    /// from the measured state, the second the optimum from the state that the previous plan
    /// predicted. The last is the previous plan itself, which satisfies the conditions if it did
    /// before and the vehicle is no further from it than the assumptions explain. Without such a
    /// plan the limits are violated as little as possible.
    fn plan_by_the_theorem(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        anew: bool,
    ) -> mpc::OptimiserReport {
        let assured = memory.assured();
        if !self.credible(memory) {
            return self.violate_least(planner, memory, measured, 0);
        }
        let level = self.terms.level;
        let anew_from = (*measured, 0, self.onset_anew(memory, measured), level);
        let goes_on = self.goes_on(memory);
        let starts = match self.settings.initial_state {
            InitialState::Nominal if assured => [Some(goes_on), None],
            InitialState::Measured if assured => [Some(anew_from), Some(goes_on)],
            _ => [Some(anew_from), None],
        };
        let mut iterations = 0;
        for (start, age, onset, level) in starts.into_iter().flatten() {
            self.begin(age as usize, 1.0, &onset, level);
            // If the last optimisation has not begun at the measured state either, this one will
            // hardly find an optimum there.
            self.another = assured && age == 0 && memory.age > self.design.ratio as u32;
            let (report, certified) = self.certified(planner, memory, &start, anew);
            iterations += report.iterations;
            let solved = report.status != SolverStatus::Fallback;
            // Linearised constraints serve for comparison, so their optimum is accepted without
            // guarantee.
            let taken = !assured || self.settings.solver.nonlinearity == Nonlinearity::Frozen;
            if certified.is_some() || solved && taken {
                planner.follow_optimum(&self.stages, memory, &start);
                (memory.age, memory.plan.onset) = (age, onset);
                self.take_over(planner, memory, certified);
                return mpc::OptimiserReport { iterations, ..report };
            }
        }
        if assured {
            self.go_towards_the_optimum(planner, memory);
            self.terms = memory.plan.terms;
            let report = planner.keep(
                (self, &self.stages),
                memory,
                measured,
                (SolverStatus::Kept, iterations),
            );
            memory.margins = self.margins(&planner.previous);
            return report;
        }
        self.violate_least(planner, memory, measured, iterations)
    }

    /// Returns the optimum from `start`, with its certificate if it satisfies the conditions of the
    /// theorem.
    fn certified(
        &self,
        planner: &mut Planner,
        memory: &Memory,
        start: &Vector6<f64>,
        first: bool,
    ) -> (mpc::OptimiserReport, Option<Certified>) {
        let report = planner.solve((self, &self.stages), memory, start, first);
        if report.status == SolverStatus::Fallback {
            return (report, None);
        }
        (report, self.certify(planner.optimiser.trajectory(), report.settled))
    }

    /// Follows the trajectory that has just become the plan, under guarantee if it is certified.
    fn take_over(&self, planner: &Planner, memory: &mut Memory, certified: Option<Certified>) {
        self.note_terms(memory);
        let Some(Certified { margins, braking }) = certified else {
            memory.margins = self.margins(planner.optimiser.trajectory());
            memory.guarantee = self.without_guarantee(memory);
            return;
        };
        (memory.margins, memory.plan.braking) = (margins, braking);
        if !memory.assured() {
            memory.guarantee = GuaranteeStatus::Pending;
            memory.pending = self.design.delay_ticks;
        }
    }

    /// Moves the certified plan towards the optimum without constraints as far as that is
    /// certified, so that a plan that is kept repeatedly still leads to the reference.
    fn go_towards_the_optimum(&mut self, planner: &mut Planner, memory: &mut Memory) {
        let (_, age, onset, level) = self.goes_on(memory);
        self.begin(age as usize, 1.0, &onset, level);
        planner.solve_without_constraints(&self.stages, &memory.plan);
        for _ in 0..HALVINGS {
            planner.optimiser.halve_the_way_to(&planner.previous);
            if let Some(certified) = self.certify(planner.optimiser.trajectory(), false) {
                let start = memory.plan.states[0];
                planner.follow_optimum(&self.stages, memory, &start);
                self.take_over(planner, memory, Some(certified));
                return;
            }
        }
        // The plan itself may serve for what its inputs have become since it was certified.
        if memory.plan.terms != self.terms
            && let Some(certified) = self.certify(&planner.previous, false)
        {
            self.take_over(planner, memory, Some(certified));
        }
    }

    /// Plans by the optimum with less tightening, or by the terminal law from the measured state
    /// within the available moment.
    fn violate_least(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        tried: u32,
    ) -> mpc::OptimiserReport {
        memory.guarantee = self.without_guarantee(memory);
        let onset = self.onset_anew(memory, measured);
        self.terms = self.terms(memory);
        let level = self.terms.level;
        (memory.age, memory.plan.onset, memory.plan.terms) = (0, onset, self.terms);
        let mut iterations = tried;
        for share in LESS {
            if planner.optimiser.is_exhausted() {
                break;
            }
            self.begin(0, share, &onset, level);
            let report = planner.solve((self, &self.stages), memory, measured, true);
            iterations += report.iterations;
            if report.status != SolverStatus::Fallback {
                planner.follow_optimum(&self.stages, memory, measured);
                memory.margins = self.margins(planner.optimiser.trajectory());
                return mpc::OptimiserReport { iterations, ..report };
            }
        }
        let settings = self.settings_of_plan();
        let law = |state: &_, reference: &_| {
            terminal::acceleration_within_limits(&settings, state, reference)
        };
        memory.plan.roll_out(*measured, &self.stages, law);
        let report = planner.keep(
            (self, &self.stages),
            memory,
            measured,
            (SolverStatus::Fallback, iterations),
        );
        memory.margins = self.margins(&planner.previous);
        report
    }

    /// Returns the reason why a plan is not certified.
    fn without_guarantee(&self, memory: &Memory) -> GuaranteeStatus {
        if self.design.accepted_share < 1.0 {
            GuaranteeStatus::Refused
        } else if self.credible(memory) {
            GuaranteeStatus::Uncertified
        } else {
            GuaranteeStatus::Exceeded
        }
    }
}

impl ConstraintSet for Robust {
    fn stages_mut(&mut self) -> &mut Stages {
        &mut self.stages
    }

    fn window_margin(&self) -> f64 {
        WINDOW_MARGIN
    }

    fn bounds(&self, held: &mpc::Bounds) -> Bounds {
        // The first state is given.
        Bounds { rate: held.state[1..].to_vec(), input: held.input.clone(), terminal: None }
    }

    fn moment_left(&self) -> f64 {
        self.design.assessment.moment_left
    }

    fn observe(&self, memory: &mut Memory, angle_rates: &Vector3<f64>) {
        memory.pending = memory.pending.saturating_sub(1);
        memory.recent_bound = self.recent_bound(memory);
        memory.acting.ticks = memory.acting.ticks.saturating_sub(1);
        let Memory { commands, observed, .. } = memory;
        let (settings, tightening) = (&self.settings, &self.design.tightening);
        let pulse = tightening
            .switching
            .as_ref()
            .map_or(0.0, |switching| commands.observe(settings, switching, observed));
        observed.observe(settings, &tightening.observable, angle_rates, pulse);
    }

    /// Without guarantee the command compensates for the disturbance instead.
    fn shift(&self, memory: &Memory) -> Vector3<f64> {
        if memory.assured() { memory.observed.shift(&self.settings) } else { Vector3::zeros() }
    }

    fn plan(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        first: bool,
    ) -> Planned {
        let was_assured = memory.assured();
        self.terms = self.terms(memory);
        self.turn = self.needed_by_turn(&memory.turn);
        if !first {
            memory.age = memory.age.saturating_add(self.design.ratio as u32);
        }
        let anew = first || self.is_left_behind(memory, measured);
        let report = self.plan_by_the_theorem(planner, memory, measured, anew);
        Planned { report, left_behind: was_assured && anew && !first }
    }

    /// Beyond the horizon the trajectory brakes.
    fn beyond_the_horizon(&self, plan: &Plan) -> Vector3<f64> {
        let last = &plan.states[self.stages.horizon()];
        let braking = Vector3::new(guarantee::BRAKING, plan.braking, guarantee::BRAKING);
        -last.fixed_rows::<3>(3).component_mul(&braking)
    }

    fn move_on(&self, plan: &mut Plan) {
        if let Some(switching) = &self.design.tightening.switching {
            plan.onset.carried = switching.next(&plan.begins_with(switching));
            plan.onset.before = plan.accelerations[0];
        }
    }

    /// Without guarantee the command compensates for the disturbance at once, because no plan
    /// reserves moment for it.
    fn compensation(&self, memory: &Memory) -> Vector3<f64> {
        let compensates = self.settings.observer.active && !memory.assured();
        if compensates { -memory.observed.disturbance } else { Vector3::zeros() }
    }

    /// The acceleration is exact in the middle of the period over which the moment is held, so that
    /// the effects of a changing f on the rate cancel over the period.
    fn moment(
        &self,
        angles: &Vector3<f64>,
        angle_rates: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        let half = 0.5 * self.settings.period_feedback;
        let angles = angles + (angle_rates + acceleration * (0.5 * half)) * half;
        let angle_rates = angle_rates + acceleration * half;
        linearise::moment(&self.settings.body, &angles, &angle_rates, acceleration)
    }

    fn supervise(&self, memory: &mut Memory, tick: &Tick) {
        self.judge(memory, tick);
    }

    fn limit(&self, _memory: &Memory) -> f64 {
        self.settings.limit_moment
    }

    fn explained(&self) -> Option<Explained> {
        Some(self.design.tightening.explained)
    }
}
