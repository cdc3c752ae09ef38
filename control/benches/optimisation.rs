//! Time of one optimisation of CRMPC and of DLMPC's outer layer on the scenario of Chai 2022
//! (white noise, inertia + 5 %).
//!
//! First the distribution over every sample of 50 s is printed, with the shortcuts that come before
//! the whole horizon, and without them. Each sample is repeated from the same memory, and the
//! smallest time counts, because other load on the machine can only add to it. Then Criterion times
//! single samples of CRMPC.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::crmpc::{self, Constraints};
use control::dlmpc;
use control::mpc::{Method, SolverSettings};
use control::report::SolverStatus;
use control::{Crmpc, Dlmpc, Measurement};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use harness::{FEEDBACK, Optimising, disturbance, settings, simulate};
use std::hint::black_box;
use vehicle::disturbance::DisturbanceKind;
use vehicle::scenario::Scenario;

/// Number of repetitions of each sample.
const REPETITIONS: usize = 20;

/// Input of one tick of the run, and the result of its optimisation.
struct Tick<Memory> {
    number: u64,
    before: Memory,
    measured: Measurement,
    status: SolverStatus,
}

fn run<C: Optimising>(controller: &mut C) -> Vec<Tick<C::Memory>> {
    let mut before = controller.memory();
    let mut memory = controller.memory();
    let mut ticks = Vec::new();
    simulate(
        controller,
        &mut memory,
        1.05,
        disturbance(DisturbanceKind::White),
        |after, number, &measured| {
            ticks.push(Tick {
                number,
                before: before.clone(),
                measured,
                status: C::report(after).status,
            });
            before.clone_from(after);
        },
    );
    ticks
}

fn update<C: Optimising>(
    controller: &mut C,
    tick: &Tick<C::Memory>,
    scenario: &Scenario,
    memory: &mut C::Memory,
) {
    let time = tick.number as f64 * FEEDBACK;
    let reference = |time| scenario.reference.at(time);
    black_box(controller.update(memory, tick.number, time, black_box(&tick.measured), &reference));
}

fn print_distribution<C: Optimising>(name: &str, controller: &mut C, ticks: &[Tick<C::Memory>]) {
    let scenario = Scenario::crmpc2022();
    let ratio = controller.ratio();
    let mut times_ms: Vec<f64> = ticks
        .iter()
        .filter(|tick| tick.number % ratio == 0)
        .map(|tick| {
            let time = |_| {
                let mut memory = tick.before.clone();
                update(controller, tick, &scenario, &mut memory);
                C::report(&memory).time * 1e3
            };
            (0..REPETITIONS).map(time).fold(f64::INFINITY, f64::min)
        })
        .collect();
    let mut iterations = 0;
    let mut worst: (f64, u32) = (0.0, 0);
    let mut counts = std::collections::BTreeMap::new();
    for tick in ticks.iter().filter(|tick| tick.number % ratio == 0) {
        let mut memory = tick.before.clone();
        update(controller, tick, &scenario, &mut memory);
        let report = C::report(&memory);
        iterations += report.iterations;
        worst = (worst.0.max(report.residual), worst.1.max(report.iterations));
        *counts.entry(format!("{:?}", report.status)).or_insert(0) += 1;
    }
    println!("iterations {iterations}, residual, most {worst:?} {counts:?}");
    let first = times_ms[0];
    let mean = times_ms.iter().sum::<f64>() / times_ms.len() as f64;
    times_ms.sort_by(f64::total_cmp);
    let at = |share: f64| times_ms[((times_ms.len() - 1) as f64 * share).round() as usize];
    println!(
        "{name}: {} optimisations, smallest of {REPETITIONS} repetitions each, ms: first {first:.3}, mean {mean:.3}, \
         median {:.3}, p99 {:.3}, worst {:.3}",
        times_ms.len(),
        at(0.5),
        at(0.99),
        at(1.0),
    );
}

/// The solvers and shortcuts that are compared.
const WAYS: [(&str, SolverSettings); 3] = [
    ("shortcuts, then riccati", WAY),
    ("riccati", SolverSettings { shortcuts: false, ..WAY }),
    ("cone", SolverSettings { shortcuts: false, method: Method::Cone, ..WAY }),
];
const WAY: SolverSettings = SolverSettings {
    method: Method::Riccati,
    max_iterations: 50,
    shortcuts: true,
    time_budget: 0.0,
    iteration_budget: 0,
};

/// Prints the distributions of one controller over the samples of one run.
fn print_all<C: Optimising>(name: &str, new: impl Fn(SolverSettings) -> C) {
    let ticks = run(&mut new(WAY));
    for (way, settings) in WAYS {
        print_distribution(&format!("{name}, {way}"), &mut new(settings), &ticks);
    }
}

fn distributions() {
    for (name, constraints) in
        [("CRMPC robust", Constraints::Robust), ("CRMPC paper", Constraints::Paper)]
    {
        print_all(name, |solver| {
            Crmpc::new(crmpc::Settings { solver, ..settings(constraints) }).unwrap()
        });
    }
    let (published, tuned) = (dlmpc::Settings::published(), dlmpc::Settings::tuned());
    for (name, settings) in [("DLMPC published", published), ("DLMPC tuned", tuned)] {
        print_all(name, |solver| Dlmpc::new(dlmpc::Settings { solver, ..settings }).unwrap());
    }
}

fn optimisations(criterion: &mut Criterion) {
    distributions();
    let scenario = Scenario::crmpc2022();
    for (name, constraints) in [("robust", Constraints::Robust), ("paper", Constraints::Paper)] {
        let mut controller = Crmpc::new(settings(constraints)).unwrap();
        let ticks = run(&mut controller);
        let ratio = controller.ratio();
        let mut group = criterion.benchmark_group(name);
        let after = |time: f64, status: SolverStatus| {
            let first = (time / FEEDBACK).round() as u64;
            let mut optimised =
                ticks.iter().filter(|tick| tick.number >= first && tick.number % ratio == 0);
            optimised.find(|tick| tick.status == status)
        };
        let situations = [
            ("first optimisation", Some(&ticks[0])),
            ("start of the manoeuvre", after(0.2, SolverStatus::Constrained)),
            ("jump at the end of the horizon", after(5.0, SolverStatus::Constrained)),
            ("jump within the horizon", after(12.0, SolverStatus::Constrained)),
            ("unconstrained optimum", after(40.0, SolverStatus::Unconstrained)),
            ("feedback between optimisations", Some(&ticks[1])),
        ];
        for (situation, tick) in situations {
            let Some(tick) = tick else { continue };
            group.bench_function(situation, |bencher| {
                bencher.iter_batched_ref(
                    || tick.before.clone(),
                    |memory| update(&mut controller, tick, &scenario, memory),
                    BatchSize::SmallInput,
                );
            });
        }
        if let Some(tick) = after(0.2, SolverStatus::Constrained) {
            let cone = SolverSettings { shortcuts: false, method: Method::Cone, ..WAY };
            let mut whole =
                Crmpc::new(crmpc::Settings { solver: cone, ..settings(constraints) }).unwrap();
            group.bench_function("whole horizon", |bencher| {
                bencher.iter_batched_ref(
                    || tick.before.clone(),
                    |memory| update(&mut whole, tick, &scenario, memory),
                    BatchSize::SmallInput,
                );
            });
        }
        group.finish();
    }
}

criterion_group!(benches, optimisations);
criterion_main!(benches);
