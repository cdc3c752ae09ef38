//! Looks for the optimisation that takes longest, of CRMPC with either set and of DLMPC's outer layer:
//!
//! ```text
//! cargo run --release -p control --example worst_time -- random LAW FIRST COUNT [SIZE [BUDGET_MS]]
//! cargo run --release -p control --example worst_time -- search LAW FIRST COUNT EVALUATIONS [SIZE]
//! cargo run --release -p control --example worst_time -- one LAW SEED [SIZE]
//! ```
//!
//! A case is a reference, a start, and a second state to which the vehicle is kicked one optimisation later: errors of up to 15 deg and rates of up to
//! 4.5 deg/s, both times SIZE. Three optimisations of it count: the first one (cold), the one after the kick, and the one that follows.
//! `random` draws COUNT cases from seed FIRST on, `search` starts COUNT searches by CMA-ES for the most iterations. Each optimisation is repeated from the same
//! memory, and the smallest time counts. `one` does a single case once, for a profiler.

#[path = "../tests/harness/mod.rs"]
mod harness;

use cmaes::{CMAESOptions, DVector};
use control::crmpc::Constraints;
use control::report::{Report, Status};
use control::{Controller, Crmpc, Dlmpc, Measurement, crmpc, dlmpc};
use harness::flight::Random;
use harness::{in_parallel, settings};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use vehicle::kinematics;
use vehicle::reference::Profile;
use vehicle::scenario::Scenario;

/// Repetitions of each optimisation.
const REPETITIONS: usize = 5;
/// Errors of the angles and rates at most, deg and deg/s.
const ERRORS: (f64, f64) = (15.0, 4.5);
/// Numbers of size 1 that make a case.
const UNKNOWNS: usize = 22;
/// The optimisations of a case.
const SITUATIONS: [&str; 3] = ["cold", "after a kick", "the next one"];

/// A controller that optimises at some of its ticks.
trait Optimising: Controller {
    fn report(memory: &Self::Memory) -> Report;
    /// Ticks per optimisation.
    fn ratio(&self) -> u64;
}

impl Optimising for Crmpc {
    fn report(memory: &crmpc::Memory) -> Report {
        memory.report
    }
    fn ratio(&self) -> u64 {
        self.design().ratio as u64
    }
}

impl Optimising for Dlmpc {
    fn report(memory: &dlmpc::Memory) -> Report {
        memory.report
    }
    fn ratio(&self) -> u64 {
        self.ratio()
    }
}

/// What to optimise.
struct Case {
    /// The time that the reference has at the start, s.
    time: f64,
    reference: Profile,
    /// Errors of the angles, rad, and x_ω, rad/s: at the start, and after the kick.
    states: [(Vector3<f64>, Vector3<f64>); 2],
}

fn degrees(values: [f64; 3]) -> Vector3<f64> {
    Vector3::from(values.map(f64::to_radians))
}

impl Case {
    fn of(x: &[f64], size: f64) -> Self {
        let at = |i: usize| x[i].clamp(-1.0, 1.0);
        let three = |i: usize| Vector3::new(at(i), at(i + 1), at(i + 2));
        let mean = degrees([10.0, 0.0, -30.0]) + three(2).component_mul(&degrees([5.0, 3.0, 20.0]));
        let reference = match at(1) {
            paper if paper < 0.0 => Scenario::crmpc2022().reference,
            sine if sine < 0.5 => {
                let amplitude = three(5).component_mul(&degrees([3.0, 1.0, 6.0]));
                Profile::sine(mean, amplitude, 0.45 + 0.35 * at(8), 3.15 * at(9))
            }
            _ => Profile::step(mean, mean + three(5).component_mul(&degrees([5.0, 3.0, 16.0])), 25.0),
        };
        // In the ball.
        let vector =
            |i: usize, length: f64| three(i) * (size * length.to_radians() / three(i).norm().max(1.0));
        let states = [10, 16].map(|i| (vector(i, ERRORS.0), vector(i + 3, ERRORS.1)));
        Self { time: 25.0 + 25.0 * at(0), reference, states }
    }

    fn random(seed: u64, size: f64) -> Self {
        let random = &mut Random::new(seed);
        let x: Vec<f64> = (0..UNKNOWNS).map(|_| random.between(-1.0, 1.0)).collect();
        Self::of(&x, size)
    }

    /// The reports of the optimisations.
    fn optimise<C: Optimising>(&self, law: &mut C, repetitions: usize) -> [Report; 3] {
        let (period, ratio) = (law.period(), law.ratio());
        let mut memory = law.memory();
        let begin = (self.time / period).round() as u64 / ratio * ratio;
        let reference = |time: f64| self.reference.at(time);
        let [first, kicked] = self.states;
        let mut state = (reference(begin as f64 * period).angles + first.0, first.1);
        [0, 1, 2].map(|number| {
            let tick = begin + number * ratio;
            let time = tick as f64 * period;
            if number == 1 {
                state = (reference(time).angles + kicked.0, kicked.1);
            }
            let measured = |(angles, rates): (Vector3<f64>, Vector3<f64>)| Measurement {
                angles,
                rates: kinematics::r_inverse(&angles) * rates,
                ..Measurement::default()
            };
            let before = memory.clone();
            let mut best = f64::INFINITY;
            for _ in 0..repetitions {
                memory.clone_from(&before);
                law.update(&mut memory, tick, time, &measured(state), &reference);
                best = best.min(C::report(&memory).time);
            }
            for tick in tick + 1..tick + ratio {
                law.update(&mut memory, tick, tick as f64 * period, &measured(state), &reference);
            }
            // About so far does it come until the next one.
            state.0 += state.1 * (ratio as f64 * period);
            Report { time: best, ..C::report(&memory) }
        })
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = |i: usize| arguments.get(i).map_or("", String::as_str);
    let number = |i: usize| text(i).parse::<f64>().ok();
    let crmpc = |constraints: Constraints, budget: f64| {
        let mut settings = settings(constraints);
        settings.solver.time_budget = budget;
        Crmpc::new(settings).unwrap()
    };
    let dlmpc = |mut settings: dlmpc::Settings, budget: f64| {
        settings.solver.time_budget = budget;
        Dlmpc::new(settings).unwrap()
    };
    for law in ["robust", "paper", "dlmpc"] {
        if text(1) != law && text(1) != "all" {
            continue;
        }
        match law {
            "robust" => go(law, text(0), number, |budget| crmpc(Constraints::Robust, budget)),
            "paper" => go(law, text(0), number, |budget| crmpc(Constraints::Paper, budget)),
            // The tuned settings have the same outer layer.
            _ => go(law, text(0), number, |budget| dlmpc(dlmpc::Settings::published(), budget)),
        }
    }
}

fn go<C: Optimising>(
    name: &str,
    what: &str,
    number: impl Fn(usize) -> Option<f64>,
    new: impl Fn(f64) -> C + Sync,
) {
    let (first, count) = (number(2).unwrap_or(0.0) as u64, number(3).unwrap_or(1.0) as u64);
    let seeds: Vec<u64> = (first..first + count).collect();
    match what {
        "random" => {
            let (size, budget) = (number(4).unwrap_or(1.0), number(5).unwrap_or(0.0) * 1e-3);
            // One after the other, as times of two at once disturb each other.
            let law = &mut new(budget);
            let repetitions = if budget > 0.0 { 1 } else { REPETITIONS };
            let reports: Vec<[Report; 3]> =
                seeds.iter().map(|&seed| Case::random(seed, size).optimise(law, repetitions)).collect();
            for (situation, title) in SITUATIONS.iter().enumerate() {
                let own: Vec<Report> = reports.iter().map(|reports| reports[situation]).collect();
                print(&format!("{name}, {title}"), &seeds, &own);
            }
        }
        "search" => {
            let (evaluations, size) = (number(4).unwrap_or(1000.0) as usize, number(5).unwrap_or(1.0));
            let worst = in_parallel(&seeds, |&seed| search(&mut new(0.0), seed, evaluations, size));
            for (situation, title) in SITUATIONS.iter().enumerate() {
                let own: Vec<Report> = worst.iter().map(|reports| reports[situation]).collect();
                print(&format!("{name}, {title}, worst of each search"), &seeds, &own);
            }
        }
        _ => {
            let reports = Case::random(first, number(3).unwrap_or(1.0)).optimise(&mut new(0.0), 1);
            for (title, report) in SITUATIONS.iter().zip(reports) {
                println!("{name}, {title}: {report:?}");
            }
        }
    }
}

/// The reports of the worst optimisations that a search found, one for each situation.
fn search<C: Optimising>(law: &mut C, seed: u64, evaluations: usize, size: f64) -> [Report; 3] {
    let random = &mut Random::new(seed);
    let start = DVector::from_fn(UNKNOWNS, |_, _| random.between(-1.0, 1.0));
    let mut worst = [Report::default(); 3];
    let situation = (seed % 3) as usize;
    let objective = |x: &DVector<f64>| {
        let reports = Case::of(x.as_slice(), size).optimise(law, 1);
        for (worst, report) in worst.iter_mut().zip(reports) {
            if report.iterations > worst.iterations {
                *worst = report;
            }
        }
        -f64::from(reports[situation].iterations)
    };
    if let Ok(mut state) =
        CMAESOptions::new(start, 0.5).seed(seed).max_function_evals(evaluations).build(objective)
    {
        state.run();
    }
    worst
}

fn print(title: &str, seeds: &[u64], reports: &[Report]) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for report in reports {
        *counts.entry(format!("{:?}", report.status)).or_default() += 1;
    }
    println!("{title}: {counts:?}");
    let line = |of: &str, taken: &dyn Fn(&Report) -> bool| {
        let mut own: Vec<(&u64, &Report)> =
            seeds.iter().zip(reports).filter(|(_, report)| taken(report)).collect();
        if own.is_empty() {
            return;
        }
        let mean = |value: fn(&Report) -> f64| {
            own.iter().map(|(_, report)| value(report)).sum::<f64>() / own.len() as f64
        };
        let (mean_iterations, mean_ms) = (mean(|r| f64::from(r.iterations)), mean(|r| r.time * 1e3));
        let last = (own.len() - 1) as f64;
        let place = |share: f64| (last * share).round() as usize;
        own.sort_by_key(|(_, report)| report.iterations);
        let iterations = [0.99, 0.999, 1.0].map(|share| own[place(share)].1.iterations);
        let most: Vec<u64> = own.iter().rev().take(5).map(|(seed, _)| **seed).collect();
        own.sort_by(|a, b| a.1.time.total_cmp(&b.1.time));
        let ms = [0.99, 0.999, 1.0].map(|share| own[place(share)].1.time * 1e3);
        println!(
            "  {of:22} {:6}: iterations mean {mean_iterations:.2}, p99 {}, p99.9 {}, most {} (seeds {most:?}); \
             ms mean {mean_ms:.3}, p99 {:.3}, p99.9 {:.3}, worst {:.3}",
            own.len(),
            iterations[0],
            iterations[1],
            iterations[2],
            ms[0],
            ms[1],
            ms[2],
        );
    };
    line("all", &|_| true);
    line("with an optimum", &|report| !matches!(report.status, Status::Fallback | Status::Kept));
    line("by the cone solver", &|report| report.status == Status::Cone);
    line("without", &|report| matches!(report.status, Status::Fallback | Status::Kept));
}
