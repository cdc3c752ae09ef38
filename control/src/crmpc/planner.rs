//! The optimisation (10) of a nominal trajectory from a given state, and the plan that follows.
//!
//! The prediction is made in x̃ = (Θ̃, x̃_ω), where the nominal model (7) under ũ = a − f is an
//! exact double integrator. The error E = x̃ − x_r is formed afterwards, so that a jump of the
//! reference is seen in the preview and never enters the dynamics.

use super::design::Design;
use super::feedback::Tick;
use super::memory::{Instead, Memory, Tracked};
use super::plan::Plan;
use super::settings::{Constraints, Settings};
use super::stages::Stages;
use super::state::error;
use crate::clock::Instant;
use crate::error::DesignError;
use crate::mpc::{self, Bounded, Chain, Cost, ErrorTrajectory, Layout, Optimiser, State, per_axis};
use crate::report::SolverStatus;
use nalgebra::{Vector3, Vector6};
use std::f64::consts::PI;
use vehicle::reference::Reference;

/// Largest change of any state (rad, rad/s) between passes at which the first optimisation has
/// converged.
const STANDSTILL: f64 = 1e-8;
/// Typical angle error, by which the cone solver's unknowns are scaled, rad.
const ANGLE_SCALE: f64 = 0.1;
/// Largest distance at which a reference is followed as it is: a share of the way that the rate
/// limit leaves within the horizon, between two angles, rad.
const SHARE_OF_THE_WAY: f64 = 0.8;
const DISTANCES: [f64; 2] = [20.0 * PI / 180.0, 50.0 * PI / 180.0];
/// Number of optima that have to be found before a distance that a kept plan has halved is doubled
/// again, and the same for the four halvings that there are at most.
const HALVED_FOR: u32 = 5;
const LONGEST_HALVED: u32 = 4 * HALVED_FOR;
/// Share by which a window of the horizon is wider than the violated intervals, at each end. With
/// the robust set most intervals of a window are near their bounds, and an iteration costs more.
const PAPER_MARGIN: f64 = 0.5;
const ROBUST_MARGIN: f64 = 0.25;
/// Distance of a reference from the largest |β| at which a plan can rest, as a share of the bound: a
/// plan that moves there needs it.
const SIDESLIP_MARGIN: f64 = 0.01;

/// The optimiser with its scratch memory.
pub(super) struct Planner {
    pub optimiser: Box<Optimiser<2>>,
    /// The plan as errors from the reference.
    pub previous: ErrorTrajectory<2>,
    chain: Chain<2>,
    affine: Vec<State<2>>,
    /// Shift of the reference's angles by the observer, rad.
    shift: Vector3<f64>,
    /// Distance from the measured angles beyond which a reference is replaced, rad.
    pub reach: f64,
    /// Largest |β| of a reference that a plan can reach, rad.
    sideslip: f64,
    /// Reference that the present optimisation tracks, and why.
    tracked: Tracked,
    /// Measured state (Θ, x_ω) at the optimisation.
    pub measured: Vector6<f64>,
    /// State from which the last optimum was sought.
    pub start: Vector6<f64>,
    /// Beginning of the present optimisation.
    clock: Instant,
}

impl Planner {
    /// Sets up the optimisation (10).
    ///
    /// # Errors
    /// Returns the solver's message if it refuses the data.
    pub(super) fn new(settings: &Settings, design: &Design) -> Result<Self, DesignError> {
        let Settings { horizon: n, period_optimisation: h, p, q, .. } = *settings;
        let chain = Chain::new(h);
        // Cost (10), sampled: Σ h (EᵀPE + vᵀQv) + E_NᵀG E_N.
        let cost = Cost {
            state: [Vector3::new(p[0], p[1], p[2]) * h, Vector3::new(p[3], p[4], p[5]) * h],
            input: Vector3::from(q) * h,
            end: per_axis(&design.g),
        };
        // With the paper's sets the problem is that of the paper, whatever the reference.
        let is_of_paper = settings.constraints == Constraints::Paper;
        let layout = Layout {
            chain,
            cost,
            horizon: n,
            constrains_states: true,
            terminal: is_of_paper,
            margin: if is_of_paper { PAPER_MARGIN } else { ROBUST_MARGIN },
            scale: [ANGLE_SCALE, settings.limit_rate],
            standstill: STANDSTILL,
        };
        let optimiser = Optimiser::new(layout, settings.solver).map_err(DesignError::Solver)?;
        let way = design.assessment.rate_left * settings.limit_rate * n as f64 * h;
        let reach = (SHARE_OF_THE_WAY * way).clamp(DISTANCES[0], DISTANCES[1]);
        Ok(Self {
            optimiser: Box::new(optimiser),
            previous: ErrorTrajectory::new(n),
            chain,
            affine: vec![[Vector3::zeros(); 2]; n],
            shift: Vector3::zeros(),
            reach: if is_of_paper { f64::INFINITY } else { reach },
            sideslip: if is_of_paper {
                f64::INFINITY
            } else {
                reachable_sideslip(settings, design)
            },
            tracked: Tracked::default(),
            measured: Vector6::zeros(),
            start: Vector6::zeros(),
            clock: Instant::now(),
        })
    }

    /// Begins an optimisation: computes the references at the prediction times, with angles shifted
    /// by `shift` (rad), and d_k = A x_r,k + B Θ̈_r,k − x_r,k+1.
    ///
    /// The sideslip of a reference is limited to what a plan can reach, so that an optimum leads to
    /// the nearest such reference instead of being refused.
    ///
    /// A reference that is too far from the measured angles is replaced by one at rest on the way
    /// to it: an artificial reference as in Limon et al., "MPC for tracking piecewise constant
    /// references", Automatica 44 (2008). From the far one the optimum without constraints would
    /// exceed the bounds by orders of magnitude, and no iteration would recover from that.
    ///
    /// As long as optima are not found or not certified, that point comes nearer, as a kept plan
    /// hardly leads on.
    pub(super) fn begin(
        &mut self,
        stages: &mut Stages,
        memory: &Memory,
        tick: &Tick,
        shift: Vector3<f64>,
    ) {
        let reach = self.reach / f64::from(1 << memory.halved_for.div_ceil(HALVED_FOR));
        self.clock = Instant::now();
        self.optimiser.begin();
        (self.measured, self.shift) = (tick.state, shift);
        for (k, slot) in stages.references.iter_mut().enumerate() {
            *slot = (tick.reference)(tick.time + k as f64 * stages.step);
            slot.angles += shift;
            let mut instead = Instead::None;
            if slot.angles.y.abs() > self.sideslip {
                slot.angles.y = self.sideslip.copysign(slot.angles.y);
                (slot.rates.y, slot.accelerations.y) = (0.0, 0.0);
                instead = Instead::Sideslip;
            }
            let measured = &tick.measured.angles;
            let way = slot.angles - measured;
            let distance = way.norm();
            if distance > reach {
                let mut angles = measured + way * (reach / distance);
                // A disturbance may have pushed the vehicle beyond what a plan can reach.
                if memory.halved_for > 0 {
                    angles.y = angles.y.clamp(-self.sideslip, self.sideslip);
                }
                *slot = Reference { angles, ..Reference::default() };
                instead = Instead::OnTheWay;
            }
            if k == 0 {
                self.tracked = Tracked { angles: slot.angles - shift, instead };
            }
        }
        for (d, pair) in self.affine.iter_mut().zip(stages.references.windows(2)) {
            let moved =
                self.chain.advance(&[pair[0].angles, pair[0].rates], &pair[0].accelerations);
            *d = [moved[0] - pair[1].angles, moved[1] - pair[1].rates];
        }
    }

    /// Returns the optimum from `start` with the bounds about the previous plan, or about itself if
    /// there is none (`first`).
    pub(super) fn solve(
        &mut self,
        set: &dyn Bounded<2>,
        stages: &Stages,
        memory: &Memory,
        start: &Vector6<f64>,
        first: bool,
    ) -> mpc::OptimiserReport {
        self.start = *start;
        let references = &stages.references;
        let error = error(start, &references[0]);
        let previous = (!first).then(|| {
            memory.plan.errors(references, &mut self.previous);
            // The optimum moves with the shifted reference.
            let moved = self.shift - memory.plan.shift;
            self.previous.states.iter_mut().for_each(|[angles, _]| *angles += moved);
            (&self.previous, &memory.plan.multipliers[..])
        });
        self.optimiser.optimise(set, &error, &self.affine, previous)
    }

    /// Leaves the optimum without constraints from the plan's first state in the optimiser.
    pub(super) fn solve_without_constraints(&mut self, stages: &Stages, plan: &Plan) {
        plan.errors(&stages.references, &mut self.previous);
        self.optimiser.without_constraints(&self.previous.states[0], &self.affine);
    }

    /// Makes the optimum the plan in force.
    pub(super) fn follow_optimum(
        &self,
        stages: &Stages,
        memory: &mut Memory,
        start: &Vector6<f64>,
    ) {
        let inputs = &self.optimiser.trajectory().inputs;
        memory.plan.follow(inputs, start, &stages.references, stages.step);
        memory.plan.shift = self.shift;
        memory.plan.multipliers.clear();
        memory.plan.multipliers.extend(self.optimiser.multipliers());
    }

    /// Keeps the present plan after an optimisation with the outcome `ended`. Returns the report.
    pub(super) fn keep(
        &mut self,
        set: &dyn Bounded<2>,
        stages: &Stages,
        memory: &Memory,
        start: &Vector6<f64>,
        ended: mpc::OptimiserReport,
    ) -> mpc::OptimiserReport {
        let error = error(start, &stages.references[0]);
        memory.plan.errors(&stages.references, &mut self.previous);
        self.optimiser.fall_back(set, &error, &self.affine, &self.previous, ended)
    }

    /// Ends the optimisation with this report.
    pub(super) fn end(&self, memory: &mut Memory, report: &mpc::OptimiserReport) {
        memory.tracked = self.tracked;
        memory.halved_for = match report.status {
            SolverStatus::Kept => (memory.halved_for + HALVED_FOR).min(LONGEST_HALVED),
            _ => memory.halved_for.saturating_sub(1),
        };
        memory.report.record(report, self.optimiser.is_exhausted(), self.clock);
    }
}

/// Returns the largest |β| of a reference that a plan can reach, rad: that of the guarantee less
/// every deviation.
fn reachable_sideslip(settings: &Settings, design: &Design) -> f64 {
    let deviation = design.tightening.forever().angle + design.tightening.tick(usize::MAX).bulge;
    (settings.sideslip_domain * (1.0 - SIDESLIP_MARGIN) - deviation).max(0.0)
}
