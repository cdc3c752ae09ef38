//! Measures the cost of the certificate of a plan, and whether it holds up to its edge:
//!
//! ```text
//! cargo run --release -p reentry-control --example certificate -- ARGUMENTS
//!     cost [COMMON TENSOR]
//!     edge PERIOD FIRST COUNT
//!     late FIRST COUNT
//! ```
//!
//! `cost` flies the scenario of Chai 2022 with white noise and with constant disturbances, and
//! prints EMS, kept plans and computing times; COMMON and TENSOR are the bounds on the inertia
//! error as a common factor and of the tensor. `edge` flies COUNT flights, with the seeds from
//! FIRST on, that begin just inside the set of certified states, optimising every PERIOD seconds.
//! `late` flies COUNT flights whose commands act up to 0.01 s earlier or later than after the
//! declared 0.04 s. A line shows each violation of the guarantee with its seed.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::Crmpc;
use control::crmpc::{Constraints, GuaranteeStatus, Memory, Settings, SolverStatus};
use control::error_dynamics::Gain;
use harness::flight::{Flight, optimised_every};
use harness::{Case, constant, in_parallel, settings, simulate, white};
use std::ops::Range;

/// Sums over the runs of one kind of disturbance.
#[derive(Default)]
struct Cost {
    ems_deg: f64,
    in_force: f64,
    kept_plans: u32,
    iterations: u64,
    /// Computing times of all optimisations, s.
    times: Vec<f64>,
}

/// Number of flights of each case whose computing times are compared.
const REPETITIONS: usize = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<f64>().ok());
    match arguments.first().map(String::as_str) {
        Some("cost") => {
            let published = settings(Constraints::Robust);
            cost(&Settings {
                inertia_error: number(1).unwrap_or(published.inertia_error),
                tensor_error: number(2).unwrap_or(published.tensor_error),
                ..published
            });
        }
        Some("edge") => {
            let [Some(period), Some(first), Some(count)] = [1, 2, 3].map(number) else { usage() };
            edge(period, first as u64, count as u64);
        }
        Some("late") => {
            let [Some(first), Some(count)] = [1, 2].map(number) else { usage() };
            late(first as u64, count as u64);
        }
        _ => usage(),
    }
}

fn usage() -> ! {
    eprintln!(
        "usage: certificate cost [COMMON TENSOR] | edge PERIOD FIRST COUNT | late FIRST COUNT"
    );
    std::process::exit(2);
}

fn cost(settings: &Settings) {
    for (name, cases) in [("white noise", white(1..=20, 0.04)), ("corners", constant())] {
        let mut cost = Cost::default();
        for case in &cases {
            // Each flight is repeated, and the shortest time of each optimisation counts.
            let first = cost.times.len();
            add(&mut cost, settings, case);
            for _ in 1..REPETITIONS {
                let mut again = Cost::default();
                add(&mut again, settings, case);
                for (time, again) in cost.times[first..].iter_mut().zip(again.times) {
                    *time = time.min(again);
                }
            }
        }
        let runs = cases.len() as f64;
        cost.times.sort_by(f64::total_cmp);
        let mean = cost.times.iter().sum::<f64>() / cost.times.len() as f64;
        let median = cost.times[cost.times.len() / 2];
        println!(
            "{name:12} {runs} runs: EMS {:.4}°, in force {:.2} %, {} kept plans, {} iterations, mean time {:.4} ms, median {:.4} ms",
            cost.ems_deg / runs,
            100.0 * cost.in_force / runs,
            cost.kept_plans,
            cost.iterations,
            1e3 * mean,
            1e3 * median
        );
    }
}

fn add(cost: &mut Cost, settings: &Settings, case: &Case) {
    let mut law = Crmpc::new(*settings).unwrap();
    let ratio = law.design().ratio as u64;
    let (mut memory, mut ticks, mut in_force) = (Memory::default(), 0u32, 0u32);
    let outcome = simulate(
        &mut law,
        &mut memory,
        case.inertia_scale,
        case.disturbance.clone(),
        |memory, tick, _| {
            ticks += 1;
            in_force += u32::from(memory.guarantee == GuaranteeStatus::InForce);
            if tick % ratio == 0 {
                cost.times.push(memory.report.time);
                cost.iterations += u64::from(memory.report.iterations);
                cost.kept_plans += u32::from(memory.report.status == SolverStatus::Kept);
            }
        },
    );
    cost.ems_deg += outcome.ems_deg;
    cost.in_force += f64::from(in_force) / f64::from(ticks);
}

fn edge(period: f64, first: u64, count: u64) {
    let settings = optimised_every(period);
    let flight = |seed: u64| Flight::at_the_edge(&settings, seed);
    fly(&format!("period {period} s"), first..first + count, flight);
}

/// Half of the flights begin at the edge, the others anywhere.
fn late(first: u64, count: u64) {
    let published = settings(Constraints::Robust);
    let settings = Settings {
        delay: 0.04,
        delay_error: 0.01,
        disturbance_bound: f64::to_radians(1.9),
        feedback: Gain { k1: -1.5, k2: -4.0 },
        ..published
    };
    fly("0.04 ± 0.01 s", first..first + count, |seed| {
        if seed % 2 == 0 {
            Flight::at_the_edge(&settings, seed)
        } else {
            Some(Flight::random(&settings, seed))
        }
    });
}

fn fly(name: &str, seeds: Range<u64>, flight: impl Fn(u64) -> Option<Flight> + Sync) {
    let seeds: Vec<u64> = seeds.collect();
    let shown = in_parallel(&seeds, |&seed| flight(seed).map(|flight| flight.fly()));
    let (mut flown, mut broken, mut withdrawn, mut lost, mut in_force) = (0, 0, 0, 0, 0.0);
    let mut largest = [0.0_f64; 3];
    for (seed, shown) in seeds.iter().zip(shown) {
        let Some(shown) = shown else { continue };
        flown += 1;
        broken += u32::from(shown.broken);
        withdrawn += u32::from(shown.withdrawn.is_some());
        lost += u32::from(shown.lost);
        in_force += shown.in_force;
        let values = [shown.sideslip, shown.rate, shown.moment];
        for (largest, value) in largest.iter_mut().zip(values) {
            *largest = largest.max(value);
        }
        if shown.broken || shown.withdrawn.is_some() || shown.lost {
            println!("seed {seed}: {shown:?}");
        }
    }
    let [sideslip, rate, moment] = largest;
    println!(
        "{name}: {flown} flights, {broken} broke a bound, {withdrawn} withdrawn, {lost} lost, in force {:.2} %; largest share of the bound on the sideslip {sideslip:.6}, rate {rate:.6}, moment {moment:.6}",
        100.0 * in_force / f64::from(flown)
    );
}
