//! The check of plans that are recorded with drawn settings.

use clap::Args;
use control::crmpc::Settings;
use guarantee_check::draws;
use guarantee_check::tally::{Tally, check_flights};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Options for the check of plans from random flights.
#[derive(Args)]
pub(crate) struct Plans {
    /// Number of draws of settings.
    #[arg(long, default_value_t = 100)]
    draws: u64,
    /// Number of flights per draw.
    #[arg(long, default_value_t = 8)]
    flights: u64,
    /// Duration of each flight, s.
    #[arg(long, default_value_t = 10.0)]
    duration: f64,
    /// Seed of the first draw.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Draw slow errors of the angles as well.
    #[arg(long)]
    slow_errors: bool,
    /// Number of threads.
    #[arg(long, default_value_t = 1)]
    threads: u64,
}

impl Plans {
    /// Checks the plans and prints the outcomes. The result is whether all were confirmed.
    pub(crate) fn run(&self) -> Result<bool, String> {
        let (next, total) = (AtomicU64::new(self.seed), Mutex::new(Tally::default()));
        let work = || -> Result<(), String> {
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= self.seed + self.draws {
                    return Ok(());
                }
                let draw = if self.slow_errors { draws::with_slow_errors } else { draws::accepted };
                let Some(settings) = draw(seed) else { continue };
                let tally = self.fly(&settings, seed)?;
                if !tally.confirmed() {
                    print!("draw {seed}: {settings:?}\n{}", report("", &tally));
                }
                total.lock().unwrap_or_else(PoisonError::into_inner).add(tally);
            }
        };
        let outcomes: Vec<Result<(), String>> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..self.threads).map(|_| scope.spawn(work)).collect();
            let joined = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
            joined
                .map(|outcome| outcome.unwrap_or_else(|_| Err("a thread failed".into())))
                .collect()
        });
        outcomes.into_iter().collect::<Result<(), String>>()?;
        let total = total.into_inner().unwrap_or_else(PoisonError::into_inner);
        print!("{}", report("all draws", &total));
        // A draw may leave no accepted plan.
        Ok(total.confirmed())
    }

    fn fly(&self, settings: &Settings, draw: u64) -> Result<Tally, String> {
        let first = draw * self.flights;
        check_flights(settings, first..first + self.flights, self.duration)
            .map_err(|error| format!("draw {draw}: {error}"))
    }
}

/// Returns the outcomes of the checks of plans as lines.
pub(crate) fn report(title: &str, tally: &Tally) -> String {
    let mut lines = format!(
        "{title}: {} plans ({} kept from the previous optimisation, {} on an older trajectory), {} not confirmed\n",
        tally.plans, tally.kept_plans, tally.aged, tally.not_confirmed
    );
    if tally.outside > 0 {
        lines.extend([format!(
            "  NOT CONFIRMED: {} begin outside of the set of `tube`\n",
            tally.outside
        )]);
    }
    if let Some(left) = &tally.left {
        lines.extend([format!(
            "  least left: sideslip {:.3} %, rate {:.3} %, moment {:.3} %\n",
            100.0 * left.sideslip,
            100.0 * left.rate,
            100.0 * left.moment
        )]);
    }
    for refuted in &tally.refuted {
        let (recorded, verdict) = (&refuted.recorded, &refuted.verdict);
        lines.extend([format!(
            "  NOT CONFIRMED: flight {}, {:.2} s, age {}: {verdict:?}\n",
            refuted.seed, recorded.time, recorded.age
        )]);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::crmpc::Constraints;
    use guarantee_check::flights::Flight;
    use guarantee_check::plan::PlanCheck;
    use guarantee_check::tally::Refuted;

    #[test]
    fn a_plan_that_is_not_confirmed_is_named_with_its_flight() {
        let good = Tally { plans: 3, ..Tally::default() };
        assert!(good.confirmed() && !report("all", &good).contains("NOT"));
        assert!(report("all", &good).starts_with("all: 3 plans (0 kept"));
        // A plan whose states do not follow from its accelerations is invalid.
        let settings = Settings::new(Constraints::Robust);
        let check = PlanCheck::new(&settings).unwrap();
        let mut refuted = Vec::new();
        let flight = Flight::random(&settings, 0, 1.0).unwrap();
        let observe = |recorded: &guarantee_check::flights::Recorded| {
            let mut recorded = recorded.clone();
            recorded.plan.states[1][0] += 1e-6;
            let verdict = check.check(&recorded.plan, recorded.age);
            refuted.push(Refuted { seed: 7, recorded, verdict });
        };
        flight.record(observe).unwrap();
        assert!(!refuted.is_empty() && refuted.iter().all(|one| !one.verdict.confirmed()));
        let bad = Tally { plans: 3, not_confirmed: 1, refuted: refuted[..1].to_vec(), ..good };
        let text = report("all", &bad);
        assert!(!bad.confirmed() && text.contains("1 not confirmed"), "{text}");
        assert!(
            text.contains("  NOT CONFIRMED: flight 7, 0.") && text.contains("consistent: false")
        );
        let outside = Tally { plans: 3, outside: 2, ..Tally::default() };
        assert!(!outside.confirmed());
        assert!(report("", &outside).contains("NOT CONFIRMED: 2 begin outside"));
        // Nothing was checked.
        assert!(!Tally::default().confirmed());
    }
}
