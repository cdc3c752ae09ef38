//! Searches for the slowest optimisation, of CRMPC with either set and of DLMPC's outer layer:
//!
//! ```text
//! cargo run --release -p reentry-control --example worst_time -- ARGUMENTS
//!     random LAW FIRST COUNT [SIZE [BUDGET_MS]]
//!     search LAW FIRST COUNT EVALUATIONS [SIZE]
//!     list LAW FIRST COUNT
//!     one LAW SEED [SIZE]
//!     jumps LAW FIRST COUNT
//! ```
//!
//! LAW is `robust`, `delayed` (the robust set in a loop with a declared delay of 0.04 s), `paper`,
//! `dlmpc` or `all`.
//!
//! A case is a reference, a start, and a second state to which the vehicle is kicked one
//! optimisation later. Its errors are up to 15 deg and its rates up to 4.5 deg/s, both times SIZE.
//! Three optimisations of a case count: the first one (cold), the one after the kick, and the one
//! that follows. `random` draws COUNT cases from seed FIRST on, and `search` starts COUNT searches
//! by CMA-ES for the most iterations. Each optimisation is repeated from the same memory, and the
//! smallest time counts. `list` prints the cases with the most iterations for
//! control/tests/data/worst_draws.csv. `one` runs a single case once, for a profiler. `jumps` flies
//! COUNT short flights of `robust` or `delayed` into whose horizon a jump of the reference enters
//! while the previous plan is followed.

#[path = "../tests/harness/mod.rs"]
mod harness;

use cmaes::{CMAESOptions, DVector};
use control::crmpc::Constraints;
use control::delay::Latency;
use control::report::{SolverReport, SolverStatus};
use control::{Crmpc, Delayed, Dlmpc, dlmpc};
use harness::draws::{Case, UNKNOWNS};
use harness::flight::{Flight, Random};
use harness::{FEEDBACK, Optimising, in_parallel, settings};
use std::collections::BTreeMap;
use vehicle::profile::Profile;

/// Number of repetitions of each optimisation.
const REPETITIONS: usize = 5;
/// Number of cases that are listed for each law.
const LISTED: usize = 40;
/// Delay of the loop `delayed`, s.
const DELAY: f64 = 0.04;
/// Time in a flight of `jumps` at which the jump enters the horizon, and its duration, s.
const ENTERS: f64 = 1.0;
const DURATION: f64 = 2.0;
/// Names of the three optimisations of a case.
const SITUATIONS: [&str; 3] = ["cold", "after a kick", "the next one"];

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
    for law in ["robust", "delayed", "paper", "dlmpc"] {
        if text(1) != law && text(1) != "all" {
            continue;
        }
        match law {
            "robust" | "delayed" if text(0) == "jumps" => jumps(law, number),
            "robust" => go(law, text(0), number, |budget| crmpc(Constraints::Robust, budget)),
            "delayed" => go(law, text(0), number, |budget| {
                let mut settings = settings(Constraints::Robust);
                (settings.solver.time_budget, settings.delay) = (budget, DELAY);
                let law = Crmpc::new(settings).unwrap();
                let latency = Latency::of_action(DELAY);
                Delayed::new(law, settings.body, FEEDBACK, latency, settings.limit_moment).unwrap()
            }),
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
            // The cases run one after the other, as the times of two at once would disturb each
            // other.
            let law = &mut new(budget);
            let repetitions = if budget > 0.0 { 1 } else { REPETITIONS };
            let reports: Vec<[SolverReport; 3]> = seeds
                .iter()
                .map(|&seed| Case::random(seed, size).optimise(law, repetitions))
                .collect();
            for (situation, title) in SITUATIONS.iter().enumerate() {
                let reports_of_situation: Vec<SolverReport> =
                    reports.iter().map(|reports| reports[situation]).collect();
                print(&format!("{name}, {title}"), &seeds, &reports_of_situation);
            }
        }
        "list" => {
            let law = &mut new(0.0);
            let most =
                |reports: &[SolverReport; 3]| reports.iter().map(|report| report.iterations).max();
            let mut ranked: Vec<(u64, [SolverReport; 3])> = seeds
                .iter()
                .map(|&seed| (seed, Case::random(seed, 1.0).optimise(law, 1)))
                .collect();
            ranked.sort_by_key(|(_, reports)| std::cmp::Reverse(most(reports)));
            for (seed, reports) in ranked.iter().take(LISTED) {
                let [cold, kicked, next] = reports.map(|report| report.iterations);
                println!("{name},{seed},{cold},{kicked},{next}");
            }
        }
        "search" => {
            let (evaluations, size) =
                (number(4).unwrap_or(1000.0) as usize, number(5).unwrap_or(1.0));
            let worst = in_parallel(&seeds, |&seed| search(&mut new(0.0), seed, evaluations, size));
            for (situation, title) in SITUATIONS.iter().enumerate() {
                let reports_of_situation: Vec<SolverReport> =
                    worst.iter().map(|reports| reports[situation]).collect();
                print(
                    &format!("{name}, {title}, worst of each search"),
                    &seeds,
                    &reports_of_situation,
                );
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

/// Flies from random states along a reference that jumps by a random step.
fn jumps(name: &str, number: impl Fn(usize) -> Option<f64>) {
    let (first, count) = (number(2).unwrap_or(0.0) as u64, number(3).unwrap_or(1.0) as u64);
    let mut settings = settings(Constraints::Robust);
    settings.delay = if name == "delayed" { DELAY } else { 0.0 };
    let jump = ENTERS + settings.horizon as f64 * settings.period_optimisation;
    let mut by_situation: [Vec<(u64, SolverReport)>; 3] = Default::default();
    for seed in first..first + count {
        let mut flight = Flight::random(&settings, seed);
        let random = &mut Random::new(seed);
        let degrees = |values: [f64; 3]| nalgebra::Vector3::from(values.map(f64::to_radians));
        let before = flight.reference.at(flight.reference_start).angles;
        let step = random.vector().component_mul(&degrees([10.0, 5.0, 30.0]));
        (flight.reference, flight.reference_start) =
            (Profile::step(before, before + step, jump), 0.0);
        flight.duration = DURATION;
        let mut best: Vec<(f64, SolverReport)> = Vec::new();
        for repetition in 0..REPETITIONS {
            let (mut solves, mut place) = (0, 0);
            flight.fly_seen(|memory, tick, _, _| {
                if memory.report.solves == solves {
                    return;
                }
                solves = memory.report.solves;
                if repetition == 0 {
                    best.push((tick as f64 * settings.period_feedback, memory.report));
                } else {
                    let time = &mut best[place].1.time;
                    *time = time.min(memory.report.time);
                }
                place += 1;
            });
        }
        for (time, report) in best {
            // The reference is seen from the time on at which the command acts.
            let seen = time + settings.delay + 1e-9 - ENTERS;
            let situation =
                usize::from(seen >= 0.0) + usize::from(seen >= settings.period_optimisation);
            by_situation[situation].push((seed, report));
        }
    }
    for (title, drawn) in
        ["before a jump enters", "as it enters", "afterwards"].iter().zip(by_situation)
    {
        let (seeds, reports): (Vec<u64>, Vec<SolverReport>) = drawn.into_iter().unzip();
        print(&format!("{name}, {title}"), &seeds, &reports);
    }
}

/// Returns the reports of the worst optimisations that a search found, one for each situation.
fn search<C: Optimising>(
    law: &mut C,
    seed: u64,
    evaluations: usize,
    size: f64,
) -> [SolverReport; 3] {
    let random = &mut Random::new(seed);
    let start = DVector::from_fn(UNKNOWNS, |_, _| random.between(-1.0, 1.0));
    let mut worst = [SolverReport::default(); 3];
    let situation = (seed % 3) as usize;
    let objective = |x: &DVector<f64>| {
        let reports = Case::from_numbers(x.as_slice(), size).optimise(law, 1);
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

fn print(title: &str, seeds: &[u64], reports: &[SolverReport]) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for report in reports {
        *counts.entry(format!("{:?}", report.status)).or_default() += 1;
    }
    println!("{title}: {counts:?}");
    let line = |name: &str, taken: &dyn Fn(&SolverReport) -> bool| {
        let mut selected: Vec<(&u64, &SolverReport)> =
            seeds.iter().zip(reports).filter(|(_, report)| taken(report)).collect();
        if selected.is_empty() {
            return;
        }
        let mean = |value: fn(&SolverReport) -> f64| {
            selected.iter().map(|(_, report)| value(report)).sum::<f64>() / selected.len() as f64
        };
        let (mean_iterations, mean_ms) =
            (mean(|r| f64::from(r.iterations)), mean(|r| r.time * 1e3));
        let last = (selected.len() - 1) as f64;
        let place = |share: f64| (last * share).round() as usize;
        selected.sort_by_key(|(_, report)| report.iterations);
        let iterations = [0.99, 0.999, 1.0].map(|share| selected[place(share)].1.iterations);
        let most: Vec<u64> = selected.iter().rev().take(5).map(|(seed, _)| **seed).collect();
        selected.sort_by(|a, b| a.1.time.total_cmp(&b.1.time));
        let ms = [0.99, 0.999, 1.0].map(|share| selected[place(share)].1.time * 1e3);
        println!(
            "  {name:22} {:6}: iterations mean {mean_iterations:.2}, p99 {}, p99.9 {}, most {} (seeds {most:?}); \
             ms mean {mean_ms:.3}, p99 {:.3}, p99.9 {:.3}, worst {:.3}",
            selected.len(),
            iterations[0],
            iterations[1],
            iterations[2],
            ms[0],
            ms[1],
            ms[2],
        );
    };
    line("all", &|_| true);
    line("with an optimum", &|report| {
        !matches!(report.status, SolverStatus::Fallback | SolverStatus::Kept)
    });
    line("by the cone solver", &|report| report.status == SolverStatus::Cone);
    line("without", &|report| matches!(report.status, SolverStatus::Fallback | SolverStatus::Kept));
}
