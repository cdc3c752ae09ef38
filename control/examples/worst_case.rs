//! Searches for flights in which the guarantee of the robust set fails, for each of several loops:
//!
//! ```text
//! cargo run --release -p reentry-control --example worst_case -- ARGUMENTS
//!     random LOOP FIRST COUNT
//!     search LOOP FIRST COUNT EVALUATIONS
//! ```
//!
//! `random` flies COUNT random flights with the seeds from FIRST on. `search` starts COUNT searches
//! for the worst disturbance, start and inertia by CMA-ES (N. Hansen, "The CMA evolution strategy:
//! a tutorial", arXiv:1604.00772), with EVALUATIONS flights each. LOOP is the name of a loop, or
//! `all`. A line shows each defect with its seed, from which it can be repeated.

#[path = "../tests/harness/mod.rs"]
mod harness;

use cmaes::{CMAESOptions, DVector};
use control::crmpc::{Constraints, Design, Settings};
use control::error_dynamics::Gain;
use control::mpc::SolverSettings;
use harness::flight::{Flight, Random, Shown, Sight, Waveform};
use harness::in_parallel;
use nalgebra::Vector3;

/// A loop in which the flights take place.
struct Loop {
    name: &'static str,
    /// Feedback gain K of the loop.
    gain: (f64, f64),
    /// Delay of the loop, s.
    delay: f64,
    /// Bounds on the errors of the angles (deg) and rates (deg/s).
    errors: (f64, f64),
    /// Whether the errors are those of the estimator, whose output is as old as the delay.
    estimator: bool,
    /// Time budget of the solver, ms; 0 for none.
    budget: f64,
}

const fn bare(name: &'static str, gain: (f64, f64), delay: f64) -> Loop {
    Loop { name, gain, delay, errors: (0.0, 0.0), estimator: false, budget: 0.0 }
}

const fn erroneous(name: &'static str, gain: (f64, f64), delay: f64, errors: (f64, f64)) -> Loop {
    Loop { errors, ..bare(name, gain, delay) }
}

/// A flight with more fallbacks than this is printed on a line of its own.
const MANY: u32 = 20;
/// Bounds on the errors of the estimator, deg and deg/s.
const ESTIMATED: (f64, f64) = (0.25, 0.25);

const LOOPS: [Loop; 10] = [
    bare("ideal", (-1.5, -4.0), 0.0),
    Loop { budget: 0.1, ..bare("ideal-budget-0.1-ms", (-1.5, -4.0), 0.0) },
    bare("ideal-printed-gain", (-5.0, -5.0), 0.0),
    bare("delay-0.04", (-1.5, -4.0), 0.04),
    bare("delay-0.117", (-1.5, -4.0), 0.117),
    erroneous("small-errors", (-1.5, -4.0), 0.0, (0.02, 0.02)),
    erroneous("errors", (-1.0, -2.0), 0.0, ESTIMATED),
    erroneous("errors-delay-0.04", (-0.5, -1.5), 0.04, ESTIMATED),
    Loop { estimator: true, ..erroneous("estimator", (-0.5, -1.5), 0.04, ESTIMATED) },
    Loop { estimator: true, ..erroneous("estimator-stiff", (-1.0, -2.0), 0.04, ESTIMATED) },
];

impl Loop {
    /// Returns the settings with the published disturbance bound, or with the largest that the
    /// design accepts if that is smaller.
    fn settings(&self) -> Option<Settings> {
        let (k1, k2) = self.gain;
        let robust = Settings::new(Constraints::Robust);
        let settings = Settings {
            solver: SolverSettings { time_budget: 1e-3 * self.budget, ..robust.solver },
            feedback: Gain { k1, k2 },
            delay: self.delay,
            angle_error: self.errors.0.to_radians(),
            rate_error: self.errors.1.to_radians(),
            ..robust
        };
        let with = |disturbance_bound| Settings { disturbance_bound, ..settings };
        let holds = |bound| Design::new(&with(bound)).is_ok();
        let (mut low, mut high) = (0.0, settings.disturbance_bound);
        if holds(high) {
            return Some(settings);
        }
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if holds(middle) { low = middle } else { high = middle }
        }
        holds(low).then(|| with(low))
    }

    fn random_flight(&self, settings: &Settings, seed: u64) -> Flight {
        let mut flight = Flight::random(settings, seed);
        if self.estimator {
            flight.sight = Sight::Estimator(seed);
            flight.age = self.delay;
            // The estimator knows the attitude at the start, and assumes that the vehicle rests.
            flight.rates = Vector3::zeros();
        }
        flight
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<u64>().ok());
    let (Some(first), Some(count)) = (number(2), number(3)) else {
        eprintln!(
            "usage: worst_case random LOOP FIRST COUNT | worst_case search LOOP FIRST COUNT EVALUATIONS"
        );
        std::process::exit(2);
    };
    let seeds: Vec<u64> = (first..first + count).collect();
    println!(
        "{:17} {:>10} {:>6} {:>7} {:>8} {:>8} {:>8} {:>7} {:>9} {:>5} {:>6} {:>9} {:>9} {:>9}",
        "",
        "bound",
        "runs",
        "assumed",
        "rate",
        "moment",
        "at all",
        "broken",
        "withdrawn",
        "lost",
        "fallb.",
        "in force",
        "mean EMS",
        "max EMS"
    );
    for each in LOOPS.iter().filter(|each| arguments[1] == "all" || arguments[1] == each.name) {
        let Some(settings) = each.settings() else {
            println!("{}: refused at every disturbance bound", each.name);
            continue;
        };
        if arguments[0] == "search" {
            search(each, &settings, &seeds, number(4).unwrap_or(1000) as usize);
            continue;
        }
        let shown = in_parallel(&seeds, |&seed| each.random_flight(&settings, seed).fly());
        for (seed, shown) in seeds.iter().zip(&shown) {
            if shown.defective() || shown.fallbacks > MANY {
                let Flight { disturbance, sight, .. } = each.random_flight(&settings, *seed);
                println!("  {} seed {seed}, {disturbance:?}, {sight:?}: {shown:?}", each.name);
            }
        }
        report(each.name, &settings, &seeds, &shown);
    }
}

fn report(name: &str, settings: &Settings, seeds: &[u64], outcomes: &[Shown]) {
    let largest = |value: fn(&Shown) -> f64| outcomes.iter().map(value).fold(0.0, f64::max);
    let count = |value: fn(&Shown) -> bool| outcomes.iter().filter(|shown| value(shown)).count();
    let mean =
        |value: fn(&Shown) -> f64| outcomes.iter().map(value).sum::<f64>() / outcomes.len() as f64;
    let worst = |value: fn(&Shown) -> f64| {
        let places = seeds.iter().zip(outcomes).max_by(|a, b| value(a.1).total_cmp(&value(b.1)));
        places.map_or(0, |(seed, _)| *seed)
    };
    println!(
        "{name:17} {:10.4} {:6} {:7} {:8.4} {:8.4} {:8.4} {:7} {:9} {:5} {:6} {:7.2} % {:8.3}° {:8.3}°  errors up to {:.3}°, {:.3}°/s; worst seeds {} and {}",
        settings.disturbance_bound.to_degrees(),
        outcomes.len(),
        count(|s| s.assumed),
        largest(|s| s.rate),
        largest(|s| s.moment),
        largest(|s| s.rate_at_all),
        count(|s| s.broken),
        count(|s| s.assumed && s.withdrawn.is_some()),
        count(|s| s.lost),
        outcomes.iter().map(|s| s.fallbacks).sum::<u32>(),
        100.0 * mean(|s| s.in_force),
        mean(|s| s.ems_deg),
        largest(|s| s.ems_deg),
        largest(|s| s.errors.0.to_degrees()),
        largest(|s| s.errors.1.to_degrees()),
        worst(|s| s.rate),
        worst(|s| s.moment),
    );
}

/// Number of pieces of the disturbance that a search chooses.
const PIECES: usize = 20;
/// Number of unknowns: start (six), inertia, and the mean length of a piece, then three components
/// and a length of each piece.
const UNKNOWNS: usize = 8 + 4 * PIECES;

/// Returns the flight that these numbers of size 1 define; the other values are those of `flight`.
fn decoded(flight: &Flight, x: &DVector<f64>) -> Flight {
    let limited = |i: usize| x[i].clamp(-1.0, 1.0);
    let of_three = |i: usize| Vector3::new(limited(i), limited(i + 1), limited(i + 2));
    let Settings { limit_rate, inertia_error, .. } = flight.settings;
    let span = Vector3::new(10.0, 8.0, 12.0).map(f64::to_radians);
    // The pieces last 0.2 to 2 s on average.
    let mean = 0.2 * 10.0_f64.powf(0.5 + 0.5 * limited(7));
    let mut end = 0.0;
    let pieces = (0..PIECES).map(|i| {
        let first = 8 + 4 * i;
        end += mean * (1.0 + 0.9 * limited(first + 3));
        (end, of_three(first))
    });
    let pieces: Vec<_> = pieces.collect();
    let reference = flight.reference.at(flight.reference_start).angles;
    let moves = !matches!(flight.sight, Sight::Estimator(_));
    Flight {
        angles: reference + of_three(0).component_mul(&span),
        rates: of_three(3) * (if moves { 0.7 * limit_rate } else { 0.0 }),
        inertia_scale: 1.0 + inertia_error * limited(6),
        duration: (end + 0.5).min(40.0),
        disturbance: Waveform::Segments(pieces),
        ..flight.clone()
    }
}

/// Returns the value that a search maximises. A failed guarantee counts more than any limit that is
/// kept.
fn badness(shown: &Shown) -> f64 {
    shown.rate.max(shown.moment) + f64::from(u8::from(shown.defective()))
}

fn search(each: &Loop, settings: &Settings, seeds: &[u64], evaluations: usize) {
    let results = in_parallel(seeds, |&seed| {
        let random = &mut Random::new(seed);
        let mut flight = each.random_flight(settings, seed);
        flight.hold = harness::CHECK;
        let start = DVector::from_fn(UNKNOWNS, |_, _| random.between(-1.0, 1.0));
        let mut worst = (f64::NEG_INFINITY, Shown::default());
        let (mut flights, mut defects, mut fallbacks) = (0, 0, 0);
        let objective = |x: &DVector<f64>| {
            let shown = decoded(&flight, x).fly();
            flights += 1;
            defects += u32::from(shown.defective());
            fallbacks += shown.fallbacks;
            if badness(&shown) > worst.0 {
                worst = (badness(&shown), shown);
            }
            -badness(&shown)
        };
        let options = CMAESOptions::new(start, 0.5).seed(seed).max_function_evals(evaluations);
        if let Ok(mut state) = options.build(objective) {
            state.run();
        }
        (flights, defects, fallbacks, worst.1)
    });
    for (seed, (flights, defects, fallbacks, worst)) in seeds.iter().zip(&results) {
        println!(
            "  {} search {seed}: {flights} flights, {defects} defects, {fallbacks} fallbacks, worst {worst:?}",
            each.name
        );
    }
    let flights: u32 = results.iter().map(|result| result.0).sum();
    let worst: Vec<Shown> = results.iter().map(|result| result.3).collect();
    println!("  {flights} flights; the worst of each search:");
    report(each.name, settings, seeds, &worst);
}
