//! This example flies closed loops of CRMPC and LQR over many disturbances, 50 s each, with both
//! inertia errors of 5 %:
//!
//! ```text
//! cargo run --release -p reentry-control --example campaign -- [SEEDS]
//! ```
//!
//! It prints one line for each controller and family of disturbances. The default is 200 seeds of
//! white noise.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::crmpc::Constraints;
use harness::{
    Case, Kept, Outcome, adversaries, constant, in_parallel, lqr, run, settings, simulate, square,
    white,
};

fn main() {
    let seeds = std::env::args().nth(1).map_or(Ok(200), |seeds| seeds.parse());
    let Ok(seeds) = seeds else {
        eprintln!("SEEDS must be a whole number");
        std::process::exit(2);
    };
    let families = [
        ("white noise", white(1..=seeds, 0.04)),
        ("white noise every 0.01 s", white(1..=seeds.min(20), 0.01)),
        ("constant", constant()),
        ("square waves", square(&[0.08, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 2.5, 4.0, 6.0, 10.0, 20.0])),
        ("along rate, against moment", adversaries(0.04)),
        ("the same every 0.01 s", adversaries(0.01)),
    ];
    println!(
        "{:7} {:27} {:>4} {:>9} {:>9} {:>9} {:>11} {:>9} {:>10} {:>6}  largest at",
        "",
        "",
        "runs",
        "mean EMS",
        "max EMS",
        "max rate",
        "max moment",
        "fallbacks",
        "in force",
        "broken"
    );
    for (name, cases) in &families {
        let crmpc = |constraints| {
            in_parallel(cases, |case| {
                run(&settings(constraints), case.inertia_scale, case.disturbance.clone())
            })
        };
        report("robust", name, cases, &crmpc(Constraints::Robust));
        report("paper", name, cases, &crmpc(Constraints::Paper));
        let regulated = in_parallel(cases, |case| {
            let disturbance = case.disturbance.clone();
            let outcome =
                simulate(&mut lqr(), &mut (), case.inertia_scale, disturbance, |(), _, _| {});
            (outcome, Kept { fallbacks: 0, in_force: 0.0, broken: false })
        });
        report("LQR", name, cases, &regulated);
    }
}

fn report(controller: &str, family: &str, cases: &[Case], outcomes: &[(Outcome, Kept)]) {
    let largest = |value: fn(&Outcome) -> f64| {
        let values = outcomes.iter().map(|(outcome, _)| value(outcome)).enumerate();
        values.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN))
    };
    let mean =
        outcomes.iter().map(|(outcome, _)| outcome.ems_deg).sum::<f64>() / outcomes.len() as f64;
    let fallbacks: u32 = outcomes.iter().map(|(_, kept)| kept.fallbacks).sum();
    let in_force = outcomes.iter().map(|(_, kept)| kept.in_force).fold(1.0, f64::min);
    let broken = outcomes.iter().filter(|(_, kept)| kept.broken).count();
    let (ems, (rate_case, rate), (moment_case, moment)) =
        (largest(|o| o.ems_deg).1, largest(|o| o.rate), largest(|o| o.moment));
    println!(
        "{controller:7} {family:27} {:4} {mean:8.4}° {ems:8.4}° {rate:9.4} {moment:11.4} {fallbacks:9} {:8.1} % {broken:6}  {} / {}",
        outcomes.len(),
        100.0 * in_force,
        cases[rate_case].name,
        cases[moment_case].name,
    );
}
