//! Behaviour of CRMPC's robust set if the disturbance exceeds its bound, compared with an LQR whose
//! moment is also scaled into the limit:
//!
//! ```text
//! cargo run --release -p reentry-control --example beyond_the_bound
//! ```
//!
//! The example prints a line for each size and family of disturbances, with the mean and largest
//! EMS of the three controllers, the largest ‖ω‖ relative to its limit, and the number of runs that
//! lost the attitude.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::Controller;
use control::crmpc::{Constraints, Guarantee, Settings};
use control::delay::{Delayed, Latency};
use harness::{
    Case, FEEDBACK, Kept, Outcome, adversaries, constant, in_parallel, lqr, run, settings,
    simulate, square,
};

/// Runs with an EMS above this count as lost, deg.
const LOST: f64 = 20.0;

fn main() {
    let published = settings(Constraints::Robust);
    println!(
        "{:5} {:14} {:>27} {:>27} {:>27}",
        "", "", "CRMPC, bound as it was", "CRMPC, best effort", "LQR"
    );
    for scale in [1.0, 1.2, 1.4, 1.7, 2.0] {
        let bound = scale * published.disturbance_bound;
        let told =
            Settings { disturbance_bound: bound, guarantee: Guarantee::BestEffort, ..published };
        let families = [
            ("constant", constant()),
            ("square waves", square(&[1.0, 4.0, 20.0])),
            ("adversaries", adversaries(0.04)),
        ];
        for (name, cases) in families {
            let larger = |case: &Case| {
                let mut disturbance = case.disturbance.clone();
                disturbance.bound = bound;
                disturbance
            };
            let robust = |settings: &Settings| {
                in_parallel(&cases, |case| run(settings, case.inertia_scale, larger(case)))
            };
            let regulated = in_parallel(&cases, |case| {
                let Settings { body, limit_moment, .. } = published;
                let latency = Latency::default();
                let mut law = Delayed::new(lqr(), body, FEEDBACK, latency, limit_moment).unwrap();
                let mut memory = law.memory();
                let outcome =
                    simulate(&mut law, &mut memory, case.inertia_scale, larger(case), |_, _, _| {});
                (outcome, Kept { fallbacks: 0, in_force: 0.0, broken: false, withdrawn: 0 })
            });
            let crmpc = [robust(&published), robust(&told)];
            let only = crmpc.each_ref().map(|outcomes| {
                let pairs = outcomes.iter().zip(&regulated);
                pairs
                    .filter(|((crmpc, _), (lqr, _))| crmpc.ems_deg > LOST && lqr.ems_deg <= LOST)
                    .count()
            });
            let [published, told] = crmpc.map(|outcomes| shown(&outcomes));
            println!(
                "{scale:5} {name:14} {published} {told} {}  lost by CRMPC alone: {only:?}",
                shown(&regulated)
            );
        }
    }
}

fn shown(outcomes: &[(Outcome, Kept)]) -> String {
    let mean =
        outcomes.iter().map(|(outcome, _)| outcome.ems_deg).sum::<f64>() / outcomes.len() as f64;
    let largest = outcomes.iter().map(|(outcome, _)| outcome.ems_deg).fold(0.0, f64::max);
    let rate = outcomes.iter().map(|(outcome, _)| outcome.rate).fold(0.0, f64::max);
    let lost = outcomes.iter().filter(|(outcome, _)| outcome.ems_deg > LOST).count();
    format!("{mean:6.2}° {largest:6.2}° {rate:7.3} {lost:3}")
}
