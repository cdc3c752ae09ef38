//! Flies CRMPC with the robust set without and with a delay, side by side, and compares the
//! computing times:
//!
//! ```text
//! cargo run --release -p reentry-control --example loop_times -- ARGUMENTS
//!     KIND FIRST COUNT [REPETITIONS [K1 K2 [DELAYS [BOUND]]]]
//! ```
//!
//! Each flight is that of Chai 2022 (50 s, inertia + 5 %) with seed or case FIRST to FIRST +
//! COUNT − 1 of the disturbances KIND: `white`, `corners` (constant), `square` or `adversaries`.
//! The loops of a case take turns, REPETITIONS times (5 by default), and each optimisation counts
//! with the smallest of its times, because other load on the machine can only add to them. DELAYS
//! are given in s, separated by commas; `0,0.04` by default. BOUND is the disturbance bound, in
//! deg/s², 2 by default. The counts of iterations repeat
//! exactly, the times do not: compare the loops of one run.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::crmpc::{Constraints, Settings};
use control::error_dynamics::Gain;
use control::report::SolverStatus;
use harness::flight::{Flight, Shown, Waveform};
use nalgebra::Vector3;

/// Number of flights of each loop, if the arguments give none.
const REPETITIONS: usize = 5;
/// Relative inertia error of the vehicle.
const INERTIA_SCALE: f64 = 1.05;

/// One optimisation of a flight.
#[derive(Clone, Copy)]
struct Optimisation {
    ms: f64,
    iterations: u32,
    residual: f64,
    status: SolverStatus,
    /// Time in the flight, s.
    at: f64,
}

/// The optimisations of all flights of one loop, and the flights' results.
#[derive(Default)]
struct Flown {
    optimisations: Vec<Optimisation>,
    shown: Vec<Shown>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<f64>().ok());
    let (Some(kind), Some(first), Some(count)) = (arguments.first(), number(1), number(2)) else {
        eprintln!("usage: loop_times KIND FIRST COUNT [REPETITIONS [K1 K2 [DELAYS [BOUND]]]]");
        std::process::exit(2);
    };
    let repetitions = number(3).map_or(REPETITIONS, |count| count as usize);
    let delays: Vec<f64> = arguments
        .get(6)
        .map_or("0,0.04", String::as_str)
        .split(',')
        .map(|text| text.parse().unwrap_or_else(|_| panic!("'{text}' is not a delay")))
        .collect();
    let mut settings = Settings::new(Constraints::Robust);
    if let (Some(k1), Some(k2)) = (number(4), number(5)) {
        settings.feedback = Gain { k1, k2 };
    }
    if let Some(bound) = number(7) {
        settings.disturbance_bound = bound.to_radians();
    }
    let mut flights: Vec<Flown> = delays.iter().map(|_| Flown::default()).collect();
    for case in first as u64..(first + count) as u64 {
        let mut best: Vec<Vec<Optimisation>> = vec![Vec::new(); delays.len()];
        for repetition in 0..repetitions {
            for ((&delay, best), flown) in delays.iter().zip(&mut best).zip(&mut flights) {
                let (optimisations, shown) = fly(&Settings { delay, ..settings }, kind, case);
                if repetition == 0 {
                    *best = optimisations;
                    flown.shown.push(shown);
                } else {
                    for (best, again) in best.iter_mut().zip(optimisations) {
                        best.ms = best.ms.min(again.ms);
                    }
                }
            }
        }
        for (flown, best) in flights.iter_mut().zip(best) {
            flown.optimisations.extend(best);
        }
    }
    let base = mean(&flights[0].optimisations, |o| o.ms);
    for (delay, flown) in delays.iter().zip(&mut flights) {
        print(*delay, flown, base);
    }
}

/// Returns the optimisations of one flight, each with its time in this flight, and its results.
fn fly(settings: &Settings, kind: &str, case: u64) -> (Vec<Optimisation>, Shown) {
    let corner = |case: u64| {
        Vector3::from([0, 1, 2].map(|bit| if case >> bit & 1 == 0 { 1.0 } else { -1.0 }))
    };
    let (disturbance, hold) = match kind {
        "white" => (Waveform::White, 0.04),
        "corners" => (Waveform::Constant(corner(case)), 0.04),
        // Periods of 0.16 s to 20.5 s.
        "square" => {
            (Waveform::Square(0.16 * 2.0_f64.powi((case / 4) as i32), corner(case % 4)), 0.01)
        }
        "adversaries" => {
            let sign = if (case / 2).is_multiple_of(2) { 1.0 } else { -1.0 };
            let waveform =
                if case.is_multiple_of(2) { Waveform::AlongRate } else { Waveform::AlongMoment };
            (waveform(sign), if (case / 4).is_multiple_of(2) { 0.01 } else { 0.04 })
        }
        _ => panic!("'{kind}' is not white, corners, square or adversaries"),
    };
    let flight = Flight {
        inertia_scale: INERTIA_SCALE,
        disturbance,
        hold,
        seed: case,
        ..Flight::new(settings)
    };
    let (mut optimisations, mut solves) = (Vec::new(), 0);
    let shown = flight.fly_seen(|memory, tick, _, _| {
        let report = &memory.report;
        if report.solves > solves {
            solves = report.solves;
            optimisations.push(Optimisation {
                ms: report.time * 1e3,
                iterations: report.iterations,
                residual: report.residual,
                status: report.status,
                at: tick as f64 * settings.period_feedback,
            });
        }
    });
    (optimisations, shown)
}

fn mean<T>(items: &[T], value: impl Fn(&T) -> f64) -> f64 {
    items.iter().map(value).sum::<f64>() / items.len() as f64
}

fn print(delay: f64, flown: &mut Flown, base: f64) {
    let Flown { optimisations, shown } = flown;
    let count = |status: SolverStatus| optimisations.iter().filter(|o| o.status == status).count();
    let (kept_plans, fallbacks) = (count(SolverStatus::Kept), count(SolverStatus::Fallback));
    let active = optimisations.iter().filter(|o| o.iterations > 0).count();
    let iterations: u32 = optimisations.iter().map(|o| o.iterations).sum();
    let mean_ms = mean(optimisations, |o| o.ms);
    let residual = optimisations
        .iter()
        .filter(|o| o.status != SolverStatus::Kept)
        .map(|o| o.residual)
        .fold(0.0, f64::max);
    optimisations.sort_by_key(|o| std::cmp::Reverse(o.iterations));
    let most: Vec<String> = optimisations
        .iter()
        .take(4)
        .map(|o| format!("{} at {:.1} s", o.iterations, o.at))
        .collect();
    optimisations.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let place = |share: f64| {
        let index = ((optimisations.len() - 1) as f64 * share).round() as usize;
        optimisations[index].ms
    };
    let largest = |value: fn(&Shown) -> f64| shown.iter().map(value).fold(0.0, f64::max);
    let flights = shown.len() as f64;
    println!(
        "delay {delay} s: ms mean {mean_ms:.4} ({:.2} of the first loop), median {:.4}, p99 {:.3}, p99.9 {:.3}, worst {:.3}; \
         iterations per flight {:.1} in {:.1} optimisations, most {}",
        mean_ms / base,
        place(0.5),
        place(0.99),
        place(0.999),
        place(1.0),
        f64::from(iterations) / flights,
        active as f64 / flights,
        most.join(", "),
    );
    println!(
        "    kept {kept_plans}, fallbacks {fallbacks}, residual {residual:.1e}; EMS mean {:.4}, largest {:.3} deg; in force {:.2} % at least; \
         rate up to {:.4}, moment up to {:.4} of the limit; guarantee ended in {} flights",
        mean(shown, |shown| shown.ems_deg),
        largest(|shown| shown.ems_deg),
        100.0 * shown.iter().map(|shown| shown.in_force).fold(1.0, f64::min),
        largest(|shown| shown.rate_at_all),
        largest(|shown| shown.moment),
        shown.iter().filter(|shown| shown.withdrawn.is_some()).count(),
    );
}
