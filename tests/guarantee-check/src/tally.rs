//! Checks the plans of many flights and counts the outcomes.

use crate::flights::{Flight, Recorded};
use crate::plan::{Left, PlanCheck, Verdict};
use control::crmpc::Settings;

/// A plan that was not confirmed.
#[derive(Clone, Debug)]
pub struct Refuted {
    /// Seed of the flight.
    pub seed: u64,
    /// The plan, with its age and time.
    pub recorded: Recorded,
    /// Result of its check.
    pub verdict: Verdict,
}

/// Outcomes of the checks of many plans.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Number of plans that were checked.
    pub plans: u64,
    /// Smallest share of each limit that any plan leaves unused; `None` without plans.
    pub left: Option<Left>,
    /// Number of plans that were not confirmed.
    pub not_confirmed: u64,
    /// The first few plans that were not confirmed.
    pub refuted: Vec<Refuted>,
}

/// Largest number of refuted plans in the report.
const SHOWN: usize = 10;

impl Tally {
    /// Adds the outcomes of another tally.
    pub fn add(&mut self, other: Self) {
        self.plans += other.plans;
        self.not_confirmed += other.not_confirmed;
        self.refuted.extend(other.refuted);
        self.refuted.truncate(SHOWN);
        self.left = self.left.into_iter().chain(other.left).reduce(|a, b| a.min(&b));
    }

    /// Whether plans were checked, and all of them confirmed.
    pub fn confirmed(&self) -> bool {
        self.plans > 0 && self.not_confirmed == 0
    }

    /// Checks a plan.
    fn record(&mut self, seed: u64, recorded: &Recorded, check: &PlanCheck) {
        let verdict = check.check(&recorded.plan, recorded.age);
        let left = Some(verdict.left);
        let failed = !verdict.confirmed();
        let refuted = failed.then(|| Refuted { seed, recorded: recorded.clone(), verdict });
        let refuted = refuted.into_iter().collect();
        self.add(Self { plans: 1, left, not_confirmed: failed.into(), refuted });
    }
}

/// Flies the flights with these seeds for `duration` (s) each, and checks every plan.
///
/// # Errors
/// Says why the settings cannot be flown or checked.
pub fn check_flights(
    settings: &Settings,
    seeds: impl Iterator<Item = u64>,
    duration: f64,
) -> Result<Tally, String> {
    let check = PlanCheck::new(settings)?;
    let mut tally = Tally::default();
    for seed in seeds {
        let flight = Flight::random(settings, seed, duration)?;
        flight.record(|plan| tally.record(seed, plan, &check)).map_err(|e| e.to_string())?;
    }
    Ok(tally)
}
