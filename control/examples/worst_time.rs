//! Times of random optimisations, of CRMPC with either set and of DLMPC's outer layer:
//!
//! ```text
//! cargo run --release -p reentry-control --example worst_time -- ARGUMENTS
//!     random LAW FIRST COUNT [SIZE [BUDGET_MS]]
//!     list LAW FIRST COUNT
//! ```
//!
//! LAW is `robust`, `delayed` (the robust set in a loop with a declared delay of 0.04 s), `paper`,
//! `dlmpc` or `all`.
//!
//! A case is a reference, a start, and a second state to which the vehicle is kicked one
//! optimisation later. Its errors are up to 15 deg and its rates up to 4.5 deg/s, both times SIZE.
//! Three optimisations of a case count: the first one (cold), the one after the kick, and the one
//! that follows. `random` draws COUNT cases from seed FIRST on. Each optimisation is repeated from
//! the same memory, and the smallest time counts; with a budget it is timed once. `list` prints the
//! cases with the most iterations for control/tests/data/worst_draws.csv.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::crmpc::Constraints;
use control::delay::Latency;
use control::report::SolverReport;
use control::{Crmpc, Delayed, Dlmpc, dlmpc};
use harness::draws::Case;
use harness::{FEEDBACK, Optimising, settings};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Number of repetitions of each optimisation.
const REPETITIONS: usize = 5;
/// Number of cases that are listed for each law.
const LISTED: usize = 40;
/// Delay of the loop `delayed`, s.
const DELAY: f64 = 0.04;
/// Names of the three optimisations of a case.
const SITUATIONS: [&str; 3] = ["cold", "after a kick", "the next one"];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = |i: usize| arguments.get(i).map_or("", String::as_str);
    let number = |i: usize| text(i).parse::<f64>().ok();
    let (first, count) = (number(2).unwrap_or(0.0) as u64, number(3).unwrap_or(1.0) as u64);
    let (size, budget) = (number(4).unwrap_or(1.0), number(5).unwrap_or(0.0) * 1e-3);
    let crmpc = |constraints: Constraints, delay: f64| {
        let mut settings = settings(constraints);
        (settings.solver.time_budget, settings.delay) = (budget, delay);
        settings
    };
    for law in ["robust", "delayed", "paper", "dlmpc"] {
        if text(1) != law && text(1) != "all" {
            continue;
        }
        let go = Go { name: law, lists: text(0) == "list", first, count, size, budget };
        match law {
            "robust" => go.with(Crmpc::new(crmpc(Constraints::Robust, 0.0)).unwrap()),
            "delayed" => {
                let settings = crmpc(Constraints::Robust, DELAY);
                let (law, latency) =
                    (Crmpc::new(settings).unwrap(), Latency { measurement: 0.0, action: DELAY });
                let limit = settings.limit_moment;
                go.with(Delayed::new(law, settings.body, FEEDBACK, latency, limit).unwrap());
            }
            "paper" => go.with(Crmpc::new(crmpc(Constraints::Paper, 0.0)).unwrap()),
            // The tuned settings have the same outer layer.
            _ => {
                let mut settings = dlmpc::Settings::published();
                settings.solver.time_budget = budget;
                go.with(Dlmpc::new(settings).unwrap());
            }
        }
    }
}

/// What is to be done with each law.
struct Go {
    name: &'static str,
    lists: bool,
    first: u64,
    count: u64,
    size: f64,
    /// Time budget, s; 0 for none.
    budget: f64,
}

impl Go {
    /// Optimises the cases one after the other, as the times of two at once would disturb each
    /// other.
    fn with<C: Optimising>(&self, mut law: C) {
        let repetitions = if self.lists || self.budget > 0.0 { 1 } else { REPETITIONS };
        let mut cases: Vec<(u64, [SolverReport; 3])> = (self.first..self.first + self.count)
            .map(|seed| (seed, Case::random(seed, self.size).optimise(&mut law, repetitions)))
            .collect();
        if self.lists {
            let most = |reports: &[SolverReport; 3]| reports.iter().map(|r| r.iterations).max();
            cases.sort_by_key(|(_, reports)| Reverse(most(reports)));
            for (seed, reports) in cases.iter().take(LISTED) {
                let [cold, kicked, next] = reports.map(|report| report.iterations);
                println!("{},{seed},{cold},{kicked},{next}", self.name);
            }
            return;
        }
        for (situation, title) in SITUATIONS.iter().enumerate() {
            let reports: Vec<SolverReport> =
                cases.iter().map(|(_, reports)| reports[situation]).collect();
            print(&format!("{}, {title}", self.name), &reports);
        }
    }
}

fn print(title: &str, reports: &[SolverReport]) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for report in reports {
        *counts.entry(format!("{:?}", report.status)).or_default() += 1;
    }
    let places = [0.99, 0.999, 1.0].map(|share| ((reports.len() - 1) as f64 * share).round());
    let mut iterations: Vec<u32> = reports.iter().map(|report| report.iterations).collect();
    iterations.sort_unstable();
    let mut ms: Vec<f64> = reports.iter().map(|report| report.time * 1e3).collect();
    ms.sort_by(f64::total_cmp);
    let iterations = places.map(|place| iterations[place as usize]);
    let ms = places.map(|place| ms[place as usize]);
    println!("{title}: {counts:?}; p99, p99.9 and most: iterations {iterations:?}, ms {ms:.3?}");
}
