//! The sets of Chai 2022 as printed: ‖x̃_ω‖ ≤ x̄_tube, ‖ũ‖ ≤ ū_tube (21) and ‖Ẽ_N‖_G ≤ ε (13).

use super::design::Design;
use super::memory::Memory;
use super::plan::Plan;
use super::planner::Planner;
use super::set::{Bounds, ConstraintSet, Planned, ROUNDING, Tick, norm_constraint};
use super::settings::{InitialState, Settings};
use super::stages::{Point, Stages};
use super::supervision::Contradiction;
use super::terminal;
use crate::error::DesignError;
use crate::linearise::{self, InverseKinematics};
use crate::mpc::{self, Bounded, ErrorTrajectory, NormConstraint, StageConstraints, State};
use crate::report::SolverStatus;
use nalgebra::{Matrix3, Vector3, Vector6};
use std::ops::Range;
use vehicle::reference::Reference;

/// Share by which a window of the horizon is wider than the violated intervals, at each end.
const WINDOW_MARGIN: f64 = 0.5;

/// The paper's sets, whose bounds are constants.
#[derive(Clone, Debug)]
pub(super) struct Paper {
    settings: Settings,
    stages: Stages,
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

    /// Returns the acceleration under the terminal law (14), rad/s².
    fn terminal_law(&self, state: &Vector6<f64>, reference: &Reference) -> Vector3<f64> {
        terminal::acceleration(&self.settings, state, reference)
    }
}

impl ConstraintSet for Paper {
    fn stages_mut(&mut self) -> &mut Stages {
        &mut self.stages
    }

    fn window_margin(&self) -> f64 {
        WINDOW_MARGIN
    }

    fn bounds(&self, _held: &mpc::Bounds) -> Bounds {
        let n = self.stages.horizon();
        Bounds {
            rate: vec![self.x_tube; n],
            input: vec![self.u_tube; n],
            terminal: Some(self.epsilon),
        }
    }

    /// Plans by the optimum of (10), or by the shifted previous plan (31).
    fn plan(
        &mut self,
        planner: &mut Planner,
        memory: &mut Memory,
        measured: &Vector6<f64>,
        first: bool,
    ) -> Planned {
        let start = match self.settings.initial_state {
            InitialState::Nominal if !first => memory.plan.states[0],
            _ => *measured,
        };
        let report = planner.solve((self, &self.stages), memory, &start, first);
        if report.status != SolverStatus::Fallback {
            planner.follow_optimum(&self.stages, memory, &start);
            return Planned { report, left_behind: false };
        }
        if first {
            let law = |state: &_, reference: &_| self.terminal_law(state, reference);
            memory.plan.roll_out(start, &self.stages, law);
        }
        let report = planner.keep(
            (self, &self.stages),
            memory,
            &start,
            (SolverStatus::Fallback, report.iterations),
        );
        Planned { report, left_behind: false }
    }

    fn beyond_the_horizon(&self, plan: &Plan) -> Vector3<f64> {
        let n = self.stages.horizon();
        self.terminal_law(&plan.states[n], &self.stages.references[n - 1])
    }

    fn moment(
        &self,
        angles: &Vector3<f64>,
        angle_rates: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        linearise::moment(&self.settings.body, angles, angle_rates, acceleration)
    }

    fn supervise(&self, memory: &mut Memory, _tick: &Tick) {
        let period = self.settings.period_feedback;
        memory.supervision.judge(memory.guarantee, Contradiction::None, period);
    }

    /// The limit is left to the optimisation, unless it has no solution.
    fn limit(&self, memory: &Memory) -> f64 {
        if memory.report.status == SolverStatus::Fallback {
            self.settings.limit_moment
        } else {
            f64::INFINITY
        }
    }
}

impl Bounded<2> for Paper {
    fn constrains_states(&self) -> bool {
        true
    }

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
