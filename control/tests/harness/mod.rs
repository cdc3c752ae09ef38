//! A closed loop of the scenario of Chai 2022 in one process, for tests, examples and benchmarks.
#![allow(dead_code, unreachable_pub, unused_imports)] // Each user needs a part of it.

pub mod draws;
pub mod entry;
pub mod faulted;
pub mod flight;
pub mod navigated;
pub mod norm_constraints;
pub mod platform;
pub mod recording;

pub use control::closed_loop::CHECK;
use control::closed_loop::{Summary, fly};
use control::crmpc::{Constraints, GuaranteeStatus, Memory, Settings, SolverStatus};
use control::lqr::LqrSettings;
use control::report::SolverReport;
use control::{Controller, Crmpc, Delayed, Dlmpc, Lqr, Measurement, dlmpc};
use nalgebra::Vector3;
use vehicle::disturbance::{Disturbance, DisturbanceKind};
use vehicle::scenario::Scenario;

/// Time between two evaluations of every controller here, that of Chai 2022, section 5.1, s.
pub const FEEDBACK: f64 = 0.04;

/// Returns the settings of Chai 2022 with these sets, and with the gain K that belongs to them.
pub fn settings(constraints: Constraints) -> Settings {
    Settings::new(constraints).resolved().unwrap()
}

/// Returns the regulator of the comparison, with the weights of CRMPC.
pub fn lqr() -> Lqr {
    let Settings { body, p, q, period_feedback: period, .. } = settings(Constraints::Robust);
    Lqr::new(LqrSettings { body, period, p, q }).unwrap()
}

/// A controller that optimises at some of its ticks.
pub trait Optimising: Controller {
    /// Returns the report of the last optimisation.
    fn report(memory: &Self::Memory) -> SolverReport;
    /// Returns the number of ticks per optimisation.
    fn ratio(&self) -> u64;
}

impl Optimising for Crmpc {
    /// Returns the report of the last optimisation.
    fn report(memory: &Memory) -> SolverReport {
        memory.report
    }
    fn ratio(&self) -> u64 {
        self.design().ratio as u64
    }
}

impl Optimising for Delayed<Crmpc> {
    /// Returns the report of the last optimisation.
    fn report(memory: &Self::Memory) -> SolverReport {
        memory.inner.report
    }
    fn ratio(&self) -> u64 {
        self.inner().ratio()
    }
}

impl Optimising for Dlmpc {
    /// Returns the report of the last optimisation.
    fn report(memory: &dlmpc::Memory) -> SolverReport {
        memory.report
    }
    fn ratio(&self) -> u64 {
        self.ratio()
    }
}

/// Returns the disturbance of the scenario with another kind.
pub fn disturbance(kind: DisturbanceKind) -> Disturbance {
    Disturbance { kind, ..Scenario::crmpc2022().disturbance }
}

/// Figures of merit of one run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Root mean square over the ticks of ‖Θ − Θ_r‖, deg: the EMS of the paper. All figures are
    /// infinite if the attitude was lost.
    pub ems_deg: f64,
    /// Root mean square over the ticks of ‖m‖ relative to its limit: the CMS of the paper.
    pub cms: f64,
    /// Largest ‖ω‖ relative to its limit, checked every [`CHECK`].
    pub rate: f64,
    /// Largest ‖m‖ relative to its limit.
    pub moment: f64,
}

/// Flies a case with a new memory.
pub fn flown<C: Controller>(law: &mut C, case: &Case) -> Outcome {
    let (mut memory, disturbance) = (law.memory(), case.disturbance.clone());
    simulate(law, &mut memory, case.inertia_scale, disturbance, |_, _, _| {})
}

/// Additional results of a run of CRMPC.
#[derive(Clone, Debug)]
pub struct Kept {
    /// Number of samples at which no optimum was found.
    pub fallbacks: u32,
    /// Share of the ticks at which the guarantee was in force.
    pub in_force: f64,
    /// Whether ‖ω‖ or |β| exceeded its bound at a tick before which the guarantee was in force.
    pub broken: bool,
    /// Number of times that the guarantee was withdrawn. If the assumptions were true, each time is
    /// a failure of the guarantee.
    pub withdrawn: u32,
}

/// Simulates the loop over the whole scenario (50 s); `observe` receives memory, tick and
/// measurement after each update.
pub fn simulate<C: Controller>(
    controller: &mut C,
    memory: &mut C::Memory,
    inertia_scale: f64,
    disturbance: Disturbance,
    mut observe: impl FnMut(&C::Memory, u64, &Measurement),
) -> Outcome {
    let scenario = Scenario { inertia_scale, disturbance, ..Scenario::crmpc2022() };
    let flown = fly(controller, memory, FEEDBACK, &scenario, |sample| {
        observe(sample.memory, sample.tick, &sample.measured);
    });
    let Ok(Summary { error_rms, moment_rms, largest_rate, largest_moment }) = flown else {
        let lost = f64::INFINITY;
        return Outcome { ems_deg: lost, cms: lost, rate: lost, moment: lost };
    };
    Outcome {
        ems_deg: error_rms.to_degrees(),
        cms: moment_rms / scenario.limit_moment,
        rate: largest_rate / scenario.limit_rate,
        moment: largest_moment / scenario.limit_moment,
    }
}

/// Runs CRMPC once from the start with a new controller.
pub fn run(settings: &Settings, inertia_scale: f64, disturbance: Disturbance) -> (Outcome, Kept) {
    let mut memory = Memory::default();
    let mut controller = Crmpc::new(*settings).unwrap();
    let (mut ticks, mut in_force, mut broken, mut before) = (0u32, 0u32, false, false);
    let outcome = simulate(
        &mut controller,
        &mut memory,
        inertia_scale,
        disturbance,
        |memory, _, measured| {
            assert_ne!(memory.report.status, SolverStatus::None);
            let now = memory.guarantee == GuaranteeStatus::InForce;
            ticks += 1;
            in_force += u32::from(now);
            broken |= before
                && (measured.rates.norm() > settings.limit_rate
                    || measured.angles.y.abs() > settings.sideslip_domain);
            before = now;
        },
    );
    let in_force = f64::from(in_force) / f64::from(ticks);
    let Memory { supervision, report, .. } = memory;
    (outcome, Kept { fallbacks: report.fallbacks, in_force, broken, withdrawn: supervision.ended })
}

/// Definition of a run: a name for messages, the vehicle's inertia and the disturbance.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name of the case for messages.
    pub name: String,
    /// Ratio of the vehicle's inertia to the one that the controller uses.
    pub inertia_scale: f64,
    /// Disturbance of the run.
    pub disturbance: Disturbance,
}

/// Both inertia errors of 5 % that the paper names.
pub const INERTIA_SCALES: [f64; 2] = [0.95, 1.05];

/// Returns the cases with both inertia errors.
pub fn cases(disturbances: impl IntoIterator<Item = (String, Disturbance)>) -> Vec<Case> {
    let both = |(name, disturbance): (String, Disturbance)| {
        INERTIA_SCALES.map(|inertia_scale| Case {
            name: format!("{name}, inertia x {inertia_scale}"),
            inertia_scale,
            disturbance: disturbance.clone(),
        })
    };
    disturbances.into_iter().flat_map(both).collect()
}

/// Returns the cases of white noise with these seeds.
pub fn white(seeds: std::ops::RangeInclusive<u64>, period: f64) -> Vec<Case> {
    cases(seeds.map(|seed| {
        let disturbance = Disturbance { seed, period, ..disturbance(DisturbanceKind::White) };
        (format!("white noise every {period} s, seed {seed}"), disturbance)
    }))
}

/// Returns the cases with Δ at each corner of its box.
pub fn constant() -> Vec<Case> {
    let signs = |i: u32| [0, 1, 2].map(|bit| if i >> bit & 1 == 0 { 1.0 } else { -1.0 });
    cases((0..8).map(|i| {
        let direction = Vector3::from(signs(i));
        let name = format!("constant along {:?}", signs(i));
        (name, Disturbance { direction, ..disturbance(DisturbanceKind::Constant) })
    }))
}

/// Returns the cases with square waves between opposite corners of the box, for each of these
/// periods.
pub fn square(periods: &[f64]) -> Vec<Case> {
    let directions = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    let waves = periods
        .iter()
        .flat_map(|&period| directions.map(|(y, z)| (period, Vector3::new(1.0, y, z))));
    cases(waves.map(|(square_period, direction)| {
        let name = format!("square wave of {square_period} s along {:?}", direction.as_slice());
        (name, Disturbance { square_period, direction, ..disturbance(DisturbanceKind::Square) })
    }))
}

/// Returns the cases of disturbances that depend on the state and are chosen again every `period`.
pub fn adversaries(period: f64) -> Vec<Case> {
    let kinds = [DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment];
    cases(kinds.map(|kind| {
        (format!("{kind:?} every {period} s"), Disturbance { period, ..disturbance(kind) })
    }))
}

/// Applies `work` to all items on all processors and returns the results in the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads =
        std::thread::available_parallelism().map_or(1, usize::from).min(items.len().max(1));
    let chunk = items.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let handles: Vec<_> = items
            .chunks(chunk)
            .map(|chunk| scope.spawn(|| chunk.iter().map(&work).collect::<Vec<_>>()))
            .collect();
        handles.into_iter().flat_map(|handle| handle.join().unwrap()).collect()
    })
}

/// Measurements that no controller may remember after the tick is evaluated again.
pub fn garbage() -> [Measurement; 4] {
    let measured = |angles, rates| Measurement { angles, rates, ..Measurement::default() };
    let uniform = Vector3::repeat;
    [
        measured(Vector3::new(0.5, -0.4, 1.0), Vector3::new(0.2, -0.3, 0.1)),
        measured(uniform(f64::NAN), uniform(f64::NAN)),
        measured(uniform(1.0), uniform(f64::INFINITY)),
        measured(uniform(1e300), uniform(-1e300)),
    ]
}
