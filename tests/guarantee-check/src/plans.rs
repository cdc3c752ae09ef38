//! The check of plans that are recorded with drawn settings.

use clap::Args;
use guarantee_check::draws;
use guarantee_check::tally::{Tally, check_flights};

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
}

impl Plans {
    /// Checks the plans and prints the outcomes. The result is whether all were confirmed.
    pub(crate) fn run(&self) -> Result<bool, String> {
        let draw = if self.slow_errors { draws::with_slow_errors } else { draws::accepted };
        let mut total = Tally::default();
        for seed in self.seed..self.seed + self.draws {
            let Some(settings) = draw(seed) else { continue };
            let seeds = seed * self.flights..(seed + 1) * self.flights;
            let tally = check_flights(&settings, seeds, self.duration)
                .map_err(|error| format!("draw {seed}: {error}"))?;
            if !tally.confirmed() {
                print!("draw {seed}: {settings:?}\n{}", report("", &tally));
            }
            total.add(tally);
        }
        print!("{}", report("all draws", &total));
        // A draw may leave no accepted plan.
        Ok(total.confirmed())
    }
}

/// Returns the outcomes of the checks of plans as lines.
pub(crate) fn report(title: &str, tally: &Tally) -> String {
    let Tally { plans, not_confirmed, .. } = tally;
    let mut lines = format!("{title}: {plans} plans, {not_confirmed} not confirmed\n");
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
    use control::crmpc::{Constraints, Settings};
    use guarantee_check::flights::Flight;
    use guarantee_check::plan::PlanCheck;
    use guarantee_check::tally::Refuted;

    #[test]
    fn a_plan_that_is_not_confirmed_is_named_with_its_flight() {
        let good = Tally { plans: 3, ..Tally::default() };
        assert!(good.confirmed() && !report("all", &good).contains("NOT"));
        assert!(report("all", &good).starts_with("all: 3 plans, 0 not"));
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
        // Nothing was checked.
        assert!(!Tally::default().confirmed());
    }
}
