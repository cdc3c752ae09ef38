//! The law over the robust set: the search for a plan that satisfies the conditions of the theorem
//! (docs/guarantee.md), and the command that follows from it.

use super::certificate::Certified;
use super::{Beginning, Robust};
use crate::controller::Measurement;
use crate::crmpc::feedback::{Feedback, Tick};
use crate::crmpc::guarantee::BRAKING;
use crate::crmpc::memory::Memory;
use crate::crmpc::planner::Planner;
use crate::crmpc::settings::{InitialState, Settings};
use crate::crmpc::state::split;
use crate::crmpc::supervision::{Contradiction, GuaranteeStatus};
use crate::crmpc::terminal;
use crate::linearise;
use crate::mpc::OptimiserReport;
use crate::report::SolverStatus;
use nalgebra::{Vector3, Vector6};
use vehicle::kinematics;
use vehicle::reference::Reference;

/// Shares of the tightening that are tried if no plan is certified.
const LESS: [f64; 2] = [0.5, 0.0];
/// Number of steps from a kept plan towards the optimum without constraints that are tried: the
/// first covers half of the way, each further one half as much as the one before.
const HALVINGS: usize = 12;

/// Use of the previous plan in an optimisation.
#[derive(Clone, Copy, PartialEq)]
enum Before {
    /// There is no previous plan.
    Nothing,
    /// The vehicle is no further from it than the assumptions explain.
    Followed,
    /// The vehicle is further from it than the assumptions explain. The plan is then useless, and
    /// bounds about it would be misleading.
    LeftBehind,
}

impl Robust {
    /// Evaluates the law at a tick. Returns the moment that it commands, N m.
    pub(in crate::crmpc) fn command(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        tick: &Tick,
    ) -> Vector3<f64> {
        self.observe(memory, tick);
        let found = if tick.within == 0 { self.optimise(planner, memory, tick) } else { None };
        // Without guarantee no plan reserves moment for the disturbance, so that the command
        // compensates for it at once.
        let compensates = self.settings.observer.active && !memory.assured();
        let compensation =
            if compensates { -memory.observed.disturbance } else { Vector3::zeros() };
        let feedback = Feedback::new(&self.settings, memory, tick, &compensation);
        let moment = self.moment(tick, &feedback.commanded);
        self.judge(memory, tick, &feedback, &moment, found);
        moment
    }

    /// Takes the rates that were measured at a tick, before it is planned.
    fn observe(&self, memory: &mut Memory, tick: &Tick) {
        memory.pending = memory.pending.saturating_sub(1);
        memory.recent_bound = self.recent_bound(memory);
        memory.acting.ticks = memory.acting.ticks.saturating_sub(1);
        let Self { settings, design, .. } = self;
        let Measurement { angles, known_moment, stale, .. } = tick.measured;
        let by_known = || kinematics::r(angles) * settings.body.inverse * known_moment;
        let observable = &design.tightening.observable;
        memory.observed.observe(settings, observable, &tick.angle_rates, *stale, by_known);
    }

    /// Returns the moment for an acceleration, N m. It is exact in the middle of the period over
    /// which the moment is held, so that the effects of a changing f on the rate cancel over the
    /// period (docs/proof.md, "The law").
    fn moment(&self, tick: &Tick, acceleration: &Vector3<f64>) -> Vector3<f64> {
        let half = 0.5 * self.settings.period_feedback;
        let angles = tick.measured.angles + (tick.angle_rates + acceleration * (0.5 * half)) * half;
        let angle_rates = tick.angle_rates + acceleration * half;
        linearise::moment(&self.settings.body, &angles, &angle_rates, acceleration)
    }

    /// Plans from the measured state on. Returns the contradiction if a guarantee was given and the
    /// vehicle is further from the plan before than the assumptions explain.
    fn optimise(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        tick: &Tick,
    ) -> Option<Contradiction> {
        let assured = memory.assured();
        let shift = if assured { memory.observed.shift(&self.settings) } else { Vector3::zeros() };
        planner.begin(&mut self.stages, memory, tick, shift);
        self.terms = self.terms(memory);
        self.turn = self.needed_by_turn(&memory.turn);
        let before = if memory.started {
            self.shift(memory);
            self.before(memory, &tick.state)
        } else {
            memory.start(self.settings.horizon);
            Before::Nothing
        };
        let contradicted = assured && before == Before::LeftBehind;
        if contradicted {
            memory.guarantee = GuaranteeStatus::Exceeded;
        }
        let report = self.plan(planner, memory, before);
        planner.end(memory, &report);
        memory.planned = tick.time;
        if self.settings.shows_plan {
            self.show(memory);
        }
        contradicted.then_some(Contradiction::Deviation)
    }

    /// Shifts the plan by one step as in (31). Beyond the horizon it brakes, α̈ = −κ α̇,
    /// β̈ = −κ_β β̇ and σ̈ = −κ σ̇ (step 6 of the proof).
    fn shift(&self, memory: &mut Memory) {
        let Settings { horizon, period_optimisation, .. } = self.settings;
        let plan = &mut memory.plan;
        let braking = Vector3::new(BRAKING, plan.braking, BRAKING);
        let a = -plan.states[horizon].fixed_rows::<3>(3).component_mul(&braking);
        plan.shift(&a, period_optimisation);
        memory.age = memory.age.saturating_add(self.design.ratio as u32);
    }

    /// Returns the use of the shifted plan in an optimisation from the measured state. If the
    /// design does not hold anyway, the plan still serves as a guess.
    fn before(&self, memory: &Memory, measured: &Vector6<f64>) -> Before {
        let (angles, rates) = split(&(measured - memory.plan.states[0]));
        let gain = self.settings.feedback;
        let feedback = angles * gain.k1 + rates * gain.k2;
        if self.design.accepted_share >= 1.0
            && !self.explains(memory, 0, &[angles, rates], &feedback)
        {
            Before::LeftBehind
        } else {
            Before::Followed
        }
    }

    /// Returns the part of the rate limit that the trajectory's turn w (rad/s) needs while a plan
    /// is followed: ‖w‖ + c_w, as the theorem bounds ‖ω + w‖. Without a turn it needs nothing.
    fn needed_by_turn(&self, turn: &Vector3<f64>) -> f64 {
        let is_told = *turn != Vector3::zeros();
        if is_told { turn.norm() + self.settings.turn_change } else { 0.0 }
    }

    /// Returns the beginning of a nominal trajectory at the measured state.
    fn anew(&self, measured: &Vector6<f64>) -> Beginning {
        Beginning { state: *measured, age: 0, level: self.terms.level }
    }

    /// Returns the beginning of the present plan, if it goes on. It assumes a disturbance no
    /// smaller than the one that drives the deviation already.
    fn going_on(&self, memory: &Memory) -> Beginning {
        let plan = &memory.plan;
        let level = self.terms.level.min(plan.terms.level);
        Beginning { state: plan.states[0], age: memory.age, level }
    }

    /// Returns the beginnings that are tried, in this order.
    fn beginnings(&self, memory: &Memory, measured: &Vector6<f64>) -> [Option<Beginning>; 2] {
        let (anew, going_on) = (self.anew(measured), self.going_on(memory));
        match self.settings.initial_state {
            InitialState::Nominal if memory.assured() => [Some(going_on), None],
            InitialState::Measured if memory.assured() => [Some(anew), Some(going_on)],
            _ => [Some(anew), None],
        }
    }

    /// Finds a plan that satisfies the conditions of the theorem. The first choice is the optimum
    /// from the measured state, the second the optimum from the state that the previous plan
    /// predicted. The last is the previous plan itself, which satisfies the conditions if it did
    /// before and the vehicle is no further from it than the assumptions explain, or, without one, a
    /// plan that brakes. Without such a plan the limits are violated as little as possible.
    fn plan(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        before: Before,
    ) -> OptimiserReport {
        if !self.credible(memory) {
            return self.violate_least(planner, memory, 0);
        }
        let assured = memory.assured();
        let mut iterations = 0;
        for beginning in self.beginnings(memory, &planner.measured).into_iter().flatten() {
            self.begin(&beginning, 1.0);
            // If the last optimisation has not begun at the measured state either, this one will
            // hardly find an optimum there.
            self.another = assured && beginning.age == 0 && memory.age > self.design.ratio as u32;
            let report = self.optimum(planner, memory, &beginning, before);
            iterations += report.iterations;
            if report.status != SolverStatus::Fallback {
                return OptimiserReport { iterations, ..report };
            }
        }
        if memory.assured() {
            self.go_towards_the_optimum(planner, memory);
            self.terms = memory.plan.terms;
            return self.keep(planner, memory, (SolverStatus::Kept, iterations));
        }
        self.violate_least(planner, memory, iterations)
    }

    /// Follows the optimum from this beginning if it is certified, or if no guarantee ends with it.
    /// Otherwise the report is that of a fallback.
    fn optimum(
        &self,
        planner: &mut Planner,
        memory: &mut Memory,
        beginning: &Beginning,
        before: Before,
    ) -> OptimiserReport {
        let Beginning { state, age, .. } = beginning;
        let about_itself = before != Before::Followed;
        let report = planner.solve(self, &self.stages, memory, state, about_itself);
        if report.status == SolverStatus::Fallback {
            return report;
        }
        let certified = self.certify(planner.optimiser.trajectory(), report.settled);
        if certified.is_none() && (memory.assured() || self.brakes(planner, memory)) {
            return OptimiserReport { status: SolverStatus::Fallback, ..report };
        }
        planner.follow_optimum(&self.stages, memory, state);
        memory.age = *age;
        self.take_over(planner, memory, certified);
        report
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

    /// Begins a guarantee by a plan that brakes from the measured state, if that is certified where
    /// the optimum is not. Returns whether it is.
    fn brakes(&self, planner: &mut Planner, memory: &mut Memory) -> bool {
        let Self { settings, design, stages, .. } = self;
        let left = design.assessment.moment_left.max(0.0);
        let settings = Settings { limit_moment: left * settings.limit_moment, ..*settings };
        let law = |state: &Vector6<f64>, _: &_| {
            let here = Reference { angles: split(state).0, ..Reference::default() };
            terminal::acceleration_within_limits(&settings, state, &here)
        };
        memory.plan.roll_out(planner.measured, stages, law);
        memory.plan.errors(&stages.references, &mut planner.previous);
        (memory.age, memory.plan.shift) = (0, Vector3::zeros());
        let certified = self.certify(&planner.previous, false);
        if certified.is_some() {
            self.take_over(planner, memory, certified);
        }
        certified.is_some()
    }

    /// Moves the certified plan towards the optimum without constraints as far as that is
    /// certified, so that a plan that is kept repeatedly still leads to the reference.
    fn go_towards_the_optimum(&mut self, planner: &mut Planner, memory: &mut Memory) {
        let beginning = self.going_on(memory);
        self.begin(&beginning, 1.0);
        planner.solve_without_constraints(&self.stages, &memory.plan);
        for _ in 0..HALVINGS {
            planner.optimiser.halve_the_way_to(&planner.previous);
            let certified = self.certify(planner.optimiser.trajectory(), false);
            if certified.is_some() {
                planner.follow_optimum(&self.stages, memory, &beginning.state);
                self.take_over(planner, memory, certified);
                return;
            }
        }
        // The plan itself may be certified anew for inputs that have changed since its certificate.
        let is_outdated = memory.plan.terms != self.terms;
        let certified = is_outdated.then(|| self.certify(&planner.previous, false)).flatten();
        if certified.is_some() {
            self.take_over(planner, memory, certified);
        }
    }

    /// Plans by the optimum with less tightening, or by the terminal law from the measured state
    /// within the available moment.
    fn violate_least(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        tried: u32,
    ) -> OptimiserReport {
        let measured = planner.measured;
        memory.guarantee = self.without_guarantee(memory);
        self.terms = self.terms(memory);
        let beginning = self.anew(&measured);
        (memory.age, memory.plan.terms) = (0, self.terms);
        let mut iterations = tried;
        for share in LESS {
            if planner.optimiser.is_exhausted() {
                break;
            }
            self.begin(&beginning, share);
            let report = planner.solve(self, &self.stages, memory, &measured, true);
            iterations += report.iterations;
            if report.status != SolverStatus::Fallback {
                planner.follow_optimum(&self.stages, memory, &measured);
                memory.margins = self.margins(planner.optimiser.trajectory());
                return OptimiserReport { iterations, ..report };
            }
        }
        let settings = self.settings_of_plan();
        let law = |state: &_, reference: &_| {
            terminal::acceleration_within_limits(&settings, state, reference)
        };
        memory.plan.roll_out(measured, &self.stages, law);
        self.keep(planner, memory, (SolverStatus::Fallback, iterations))
    }

    /// Keeps the present plan, and returns the report on it with this status and these iterations.
    fn keep(
        &self,
        planner: &mut Planner,
        memory: &mut Memory,
        (status, iterations): (SolverStatus, u32),
    ) -> OptimiserReport {
        let (ended, measured) = (OptimiserReport::default(), planner.measured);
        let ended = OptimiserReport { status, iterations, ..ended };
        let report = planner.keep(self, &self.stages, memory, &measured, ended);
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
