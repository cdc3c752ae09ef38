//! The sets of Chai 2022 as printed: ‖x̃_ω‖ ≤ x̄_tube, ‖ũ‖ ≤ ū_tube (21) and ‖Ẽ_N‖_G ≤ ε (13).

use super::design::Design;
use super::feedback::{Feedback, Tick};
use super::horizon::{PlanPoint, points};
use super::memory::Memory;
use super::planner::Planner;
use super::set::{Bounds, ROUNDING, norm_constraint};
use super::settings::{InitialState, Settings};
use super::stages::{Point, Stages};
use super::supervision::Contradiction;
use super::terminal;
use crate::error::DesignError;
use crate::linearise::{self, InverseKinematics};
use crate::mpc::{self, Bounded, ErrorTrajectory, NormConstraint, StageConstraints, State};
use crate::report::SolverStatus;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// The paper's sets, whose bounds are constants.
#[derive(Clone, Debug)]
pub(super) struct Paper {
    settings: Settings,
    pub stages: Stages,
    /// Bound x̄_tube of (21), rad/s.
    x_tube: f64,
    /// Bound ū_tube of (21), rad/s².
    u_tube: f64,
    /// Terminal radius ε = min(ε₁, ε₂) of (13).
    epsilon: f64,
    /// Ratio of the largest to the smallest moment of inertia.
    inertia_ratio: f64,
}

impl Paper {
    /// # Errors
    /// Returns an error that names the empty set, or the gain whose eigenvalues are not real.
    pub(super) fn new(settings: &Settings, design: &Design) -> Result<Self, DesignError> {
        let paper = design.paper.ok_or(DesignError::NotReal { name: "feedback" })?;
        let (x_tube, u_tube, epsilon) =
            (paper.x_tube, paper.u_tube, paper.epsilon1.min(paper.epsilon2));
        for (name, value) in [("x_tube", x_tube), ("u_tube", u_tube), ("epsilon", epsilon)] {
            if value.is_nan() || value <= 0.0 {
                return Err(DesignError::EmptySet { name, value });
            }
        }
        let Settings { horizon, body, period_optimisation, .. } = *settings;
        Ok(Self {
            settings: *settings,
            stages: Stages::new(horizon, body, period_optimisation),
            x_tube,
            u_tube,
            epsilon,
            inertia_ratio: design.inertia_ratio,
        })
    }

    /// Returns the bounds of every optimisation.
    pub(super) fn bounds(&self) -> Bounds {
        let n = self.settings.horizon;
        Bounds {
            rate: vec![self.x_tube; n],
            input: vec![self.u_tube; n],
            terminal: Some(self.epsilon),
        }
    }

    /// Evaluates the law at a tick. Returns the moment that it commands, N m.
    pub(super) fn command(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        tick: &Tick,
    ) -> Vector3<f64> {
        if tick.within == 0 {
            self.optimise(planner, memory, tick);
        }
        let Feedback { commanded, .. } =
            Feedback::new(&self.settings, memory, tick, &Vector3::zeros());
        let Settings { body, period_feedback, .. } = &self.settings;
        memory.supervision.judge(memory.guarantee, Contradiction::None, *period_feedback);
        linearise::moment(body, &tick.measured.angles, &tick.angle_rates, &commanded)
    }

    /// Plans by the optimum of (10), or by the shifted previous plan (31).
    fn optimise(&mut self, planner: &mut Planner, memory: &mut Memory, tick: &Tick) {
        planner.begin(&mut self.stages, memory, tick, Vector3::zeros());
        let Settings { horizon: n, initial_state, period_optimisation: h, .. } = self.settings;
        let first = !memory.started;
        if first {
            memory.start(n);
        } else {
            let (last, reference) = (&memory.plan.states[n], &self.stages.references[n - 1]);
            let a = terminal::acceleration(&self.settings, last, reference);
            memory.plan.shift(&a, h);
        }
        let start = match initial_state {
            InitialState::Nominal if !first => memory.plan.states[0],
            _ => tick.state,
        };
        let mut report = planner.solve(self, &self.stages, memory, &start, first);
        if report.status == SolverStatus::Fallback {
            if first {
                let law = |state: &_, reference: &_| {
                    terminal::acceleration(&self.settings, state, reference)
                };
                memory.plan.roll_out(start, &self.stages, law);
            }
            report = planner.keep(self, &self.stages, memory, &start, report);
        } else {
            planner.follow_optimum(&self.stages, memory, &start);
        }
        planner.end(memory, &report);
        memory.planned = tick.time;
        if self.settings.shows_plan {
            self.show(memory);
        }
    }

    /// Shows the plan in force. As the paper's sets bound other norms, the whole limits are left to
    /// it.
    fn show(&self, memory: &mut Memory) {
        let Memory { plan, shown, .. } = memory;
        let Settings { limit_rate, limit_moment, horizon, body, .. } = &self.settings;
        for (slot, k) in shown.iter_mut().zip(points(*horizon)) {
            let (here, begins) = (plan.point(k), plan.point(k.min(horizon - 1)));
            let moment = begins.motion(body).moment(&begins.acceleration);
            *slot = PlanPoint {
                rate: here.motion(body).rates.norm(),
                rate_bound: *limit_rate,
                moment: moment.norm(),
                moment_bound: *limit_moment,
            };
        }
    }
}

impl Bounded<2> for Paper {
    fn norm_constraints(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        _bounds: (f64, f64),
    ) -> StageConstraints<2> {
        let [angles, rates, a] = self.stages.nominal(k, state, input);
        let (kinematics, body) = (InverseKinematics::at(&angles), &self.settings.body);
        let at = kinematics.linearise(body, &rates, &a);
        StageConstraints {
            state: NormConstraint {
                value: rates / self.x_tube,
                by_state: [Matrix3::zeros(), Matrix3::from_diagonal_element(1.0 / self.x_tube)],
                by_input: Matrix3::zeros(),
            },
            input: norm_constraint(&kinematics.input_of_moment(body, &at.moment), self.u_tube),
        }
    }

    fn squares(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        _bounds: (f64, f64),
    ) -> (f64, f64) {
        let [angles, rates, a] = self.stages.nominal(k, state, input);
        let kinematics = InverseKinematics::at(&angles);
        let input = kinematics.input(&self.settings.body, &rates, &a) / self.u_tube;
        ((rates / self.x_tube).norm_squared(), input.norm_squared())
    }

    fn violated(
        &self,
        motion: &ErrorTrajectory<2>,
        intervals: Range<usize>,
        _bounds: &mut mpc::Bounds,
    ) -> Option<Range<usize>> {
        let exceeds = |value: f64, bound: f64| value > bound * (1.0 + ROUNDING);
        self.stages.first_and_last(motion, intervals, |_, here: &Point, next, (): &mut ()| {
            let Point { angles, rates, size, acceleration, pull, .. } = here;
            // The estimate of ‖u‖ needs no sines: mean time 0.015 → 0.009 ms, longest 0.049 →
            // 0.039.
            let estimate = linearise::input_bound(angles.y, *size, *pull, self.inertia_ratio);
            let input = || here.turned().input(&self.settings.body, rates, acceleration).norm();
            exceeds(next.size, self.x_tube)
                || exceeds(estimate, self.u_tube) && exceeds(input(), self.u_tube)
        })
    }

    // The wider tolerance shortens the longest first optimisation of 1500 random cases by a tenth.
    fn follows_at_first(&self) -> bool {
        true
    }

    /// Returns whether the full input over one interval cannot bring the rates down to the bound at
    /// its end.
    fn out_of_reach(&self, start: &State<2>) -> bool {
        let [angles, rates, _] = self.stages.nominal(0, start, &Vector3::zeros());
        let (body, h) = (&self.settings.body, self.stages.step);
        let kinematics = InverseKinematics::at(&angles);
        let coasting = rates - kinematics.input(body, &rates, &Vector3::zeros()) * h;
        coasting.norm() - h * self.u_tube > self.x_tube * (1.0 + ROUNDING)
    }

    fn terminal_radius(&self) -> Option<f64> {
        Some(self.epsilon)
    }
}
