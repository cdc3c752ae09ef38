//! Centralised robust MPC of Chai et al. (2022): optimisation of a nominal motion, feedback law around it.
//!
//! Prediction is in x̃ = (Θ̃, x̃_ω), where the nominal model (7) under ũ = a − f is an exact double integrator; the error
//! E = x̃ − x_r is formed afterwards, so that a jump of the reference is seen in the preview and never enters the dynamics.

mod design;
mod plan;
mod sets;

pub use crate::report::{Report, Status};
pub use design::{
    Constraints, Design, InitialState, PaperConstants, Settings, Tightening, step_response_peak,
    terminal_weight,
};
pub use plan::Plan;
pub use sets::Bounds;

use crate::controller::{Controller, Measurement, ReferenceAt};
use crate::error::DesignError;
use crate::linearise;
use crate::mpc::{Chain, Cost, Layout, Motion, Optimiser, State, per_axis};
use crate::sampled::InvariantSet;
use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};
use sets::Sets;
use std::time::Instant;
use vehicle::kinematics;
use vehicle::reference::Reference;

/// What CRMPC carries from tick to tick.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// The plan in force; it starts at the last optimisation.
    pub plan: Plan,
    /// Whether `plan` holds anything yet.
    pub started: bool,
    /// Outcome of the last optimisation.
    pub report: Report,
    /// Nominal state (Θ̃, x̃_ω) at the last tick.
    pub nominal: Vector6<f64>,
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        let Self { plan, started, report, nominal } = self;
        Self { plan: plan.clone(), started: *started, report: *report, nominal: *nominal }
    }

    // The derived version would allocate a new plan at every tick.
    fn clone_from(&mut self, source: &Self) {
        self.plan.clone_from(&source.plan);
        self.started = source.started;
        self.report = source.report;
        self.nominal = source.nominal;
    }
}

/// The controller: settings, offline design, solvers and scratch space. Everything that matters later is in [`Memory`].
pub struct Crmpc {
    settings: Settings,
    design: Design,
    chain: Chain<2>,
    sets: Sets,
    optimiser: Optimiser<2>,
    // Scratch of one optimisation.
    affine: Vec<State<2>>,
    previous: Motion<2>,
}

/// The first optimisation has converged when no state moves by more than this (rad, rad/s) between passes.
const STANDSTILL: f64 = 1e-6;
/// Typical angle error, by which the cone solver's unknowns are scaled, rad.
const ANGLE_SCALE: f64 = 0.1;
/// Disturbance bound (rad/s²) that the invariant set has at least, so that it keeps an inside.
const SMALLEST_DISTURBANCE: f64 = 1e-5;

impl Crmpc {
    /// Designs the controller and sets its solver up.
    ///
    /// # Errors
    /// Names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let design = Design::new(&settings)?;
        let sets = Sets::new(&settings, &design)?;
        let Settings { horizon: n, period_optimisation: h, p, q, .. } = settings;
        let start = (settings.initial_state == InitialState::Tube).then(|| {
            let normals = design.invariant.as_ref().map(InvariantSet::normals).unwrap_or_default();
            let disturbance = design.tightening.disturbance;
            std::array::from_fn(|i| {
                normals.iter().map(|n| n / disturbance[i].max(SMALLEST_DISTURBANCE)).collect()
            })
        });
        let chain = Chain::new(h);
        // (10), sampled: Σ h (EᵀPE + vᵀQv) + E_NᵀG E_N
        let cost = Cost {
            state: [Vector3::new(p[0], p[1], p[2]) * h, Vector3::new(p[3], p[4], p[5]) * h],
            input: Vector3::from(q) * h,
            end: per_axis(&design.g),
        };
        let layout = Layout {
            chain,
            cost,
            horizon: n,
            state_balls: true,
            terminal: true,
            start,
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
            previous: Motion::new(n),
        })
    }

    /// The offline design.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// The bounds that the last optimisation was under, for benchmarks and tests that solve the same problem otherwise.
    pub fn bounds(&self) -> Bounds {
        self.sets.bounds()
    }

    /// One optimisation at `time` from the measured state (Θ, x_ω): leaves the plan and the report in `memory`.
    fn optimise(&mut self, memory: &mut Memory, time: f64, measured: Vector6<f64>, reference: ReferenceAt) {
        let clock = Instant::now();
        self.preview(time, reference);
        let first = !memory.started;
        if first {
            memory.plan.resize(self.settings.horizon);
            memory.started = true;
        } else {
            self.shift(&mut memory.plan);
        }

        let start = match self.settings.initial_state {
            InitialState::Nominal if !first => memory.plan.states[0],
            _ => measured,
        };
        let error = error(&start, &self.sets.references[0]);
        let previous = (!first).then(|| {
            memory.plan.errors(&self.sets.references, &mut self.previous);
            (&self.previous, &memory.plan.multipliers[..])
        });
        let mut report = self.optimiser.optimise(&mut self.sets, &error, &self.affine, previous);
        if report.status == Status::Fallback {
            if first {
                self.follow_terminal_law(&mut memory.plan, start);
            }
            memory.plan.errors(&self.sets.references, &mut self.previous);
            let Self { optimiser, sets, affine, previous, .. } = self;
            report = optimiser.fall_back(sets, &error, affine, previous, report.iterations);
        } else {
            let start = (self.settings.initial_state != InitialState::Tube).then_some(start);
            let motion = self.optimiser.motion();
            memory.plan.follow(motion, start, &self.sets.references, self.settings.period_optimisation);
            memory.plan.multipliers.clear();
            memory.plan.multipliers.extend(self.optimiser.multipliers());
        }
        memory.report.record(&report, clock);
    }

    /// References at the prediction times, and d_k = A x_r,k + B Θ̈_r,k − x_r,k+1.
    fn preview(&mut self, time: f64, reference: ReferenceAt) {
        let h = self.settings.period_optimisation;
        for (k, slot) in self.sets.references.iter_mut().enumerate() {
            *slot = reference(time + k as f64 * h);
        }
        for (d, pair) in self.affine.iter_mut().zip(self.sets.references.windows(2)) {
            let moved = self.chain.advance(&[pair[0].angles, pair[0].rates], &pair[0].accelerations);
            *d = [moved[0] - pair[1].angles, moved[1] - pair[1].rates];
        }
        self.sets.renew();
    }

    /// (31): drops the first interval and appends one under the terminal law (14), a = K̃ E + Θ̈_r.
    fn shift(&self, plan: &mut Plan) {
        let n = self.settings.horizon;
        let last = *plan.states.last().unwrap_or(&Vector6::zeros());
        plan.states.rotate_left(1);
        plan.accelerations.rotate_left(1);
        plan.multipliers.rotate_left(1);
        plan.multipliers[n - 1] = [0.0; 2];
        let a = self.terminal_acceleration(&last, &self.sets.references[n - 1]);
        plan.accelerations[n - 1] = a;
        plan.states[n] = plan::advance(&last, &a, self.settings.period_optimisation);
    }

    /// The acceleration under the terminal law (14): ũ^f = −f + K̃ Ẽ + Θ̈_r, hence a = K̃ Ẽ + Θ̈_r.
    fn terminal_acceleration(&self, state: &Vector6<f64>, reference: &Reference) -> Vector3<f64> {
        let gain = self.settings.terminal;
        let angles = state.fixed_rows::<3>(0) - reference.angles;
        let rates = state.fixed_rows::<3>(3) - reference.rates;
        angles * gain.k1 + rates * gain.k2 + reference.accelerations
    }

    fn follow_terminal_law(&self, plan: &mut Plan, start: Vector6<f64>) {
        plan.states[0] = start;
        for k in 0..self.settings.horizon {
            plan.accelerations[k] = self.terminal_acceleration(&plan.states[k], &self.sets.references[k]);
            plan.states[k + 1] =
                plan::advance(&plan.states[k], &plan.accelerations[k], self.settings.period_optimisation);
        }
    }
}

impl Controller for Crmpc {
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
        let angle_rates = kinematics::r(&measured.angles) * measured.rates;
        let within = tick % self.design.ratio as u64;
        if within == 0 {
            self.optimise(memory, time, join(&measured.angles, &angle_rates), reference);
        }
        let a = memory.plan.accelerations[0];
        memory.nominal =
            plan::advance(&memory.plan.states[0], &a, within as f64 * self.settings.period_feedback);
        // (20): with ũ* = a − f(x̃*), u = K O_e − f(x) + a, and m = I R⁻¹ u.
        let (nominal_angles, nominal_rates) = split(&memory.nominal);
        let gain = self.settings.feedback;
        let feedback = (measured.angles - nominal_angles) * gain.k1 + (angle_rates - nominal_rates) * gain.k2;
        let moment = linearise::moment(&self.settings.body, &measured.angles, &angle_rates, &(a + feedback));
        // Without a solution nothing keeps the moment within its limit.
        let excess = moment.norm() / self.settings.limit_moment;
        if memory.report.status == Status::Fallback && excess > 1.0 { moment / excess } else { moment }
    }
}

/// E = x̃ − x_r.
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
