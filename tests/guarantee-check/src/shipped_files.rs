//! The check of plans for the settings in a folder of experiments.

use crate::plans::report;
use clap::Args;
use control::crmpc::{Constraints, Design, Settings};
use guarantee_check::shipped::{Scan, Shipped};
use guarantee_check::tally::{Tally, check_flights};
use std::path::PathBuf;

/// Options for the check of plans with the settings in a folder.
#[derive(Args)]
pub(crate) struct ShippedFiles {
    /// Folder of experiments, studies and campaigns.
    folder: PathBuf,
    /// Number of flights for each set of settings.
    #[arg(long, default_value_t = 4)]
    flights: u64,
    /// Duration of each flight, s.
    #[arg(long, default_value_t = 10.0)]
    duration: f64,
}

impl ShippedFiles {
    /// Checks the plans and prints the outcomes. The result is whether all were confirmed.
    pub(crate) fn run(&self) -> Result<bool, String> {
        let scan = Scan::new(&self.folder)?;
        let [experiments, studies, campaigns] = scan.read;
        println!("{experiments} experiments, {studies} studies and {campaigns} campaigns read.");
        for (file, reason) in &scan.left_out {
            println!("Left out: {}: {}", file.display(), reason.lines().next().unwrap_or_default());
        }
        let mut done: Vec<(Settings, Option<Tally>)> = Vec::new();
        let mut confirmed = true;
        for Shipped { file, place, settings } in &scan.shipped {
            let earlier = done.iter().find(|(other, _)| other == settings);
            let (tally, new) = match earlier {
                Some((_, tally)) => (tally.clone(), false),
                None => (self.check(settings)?, true),
            };
            let title = format!("{} {place}", file.display());
            match &tally {
                None => println!("{title}: no guarantee is given"),
                Some(_) if !new => println!("{title}: as above"),
                Some(tally) => report(&title, tally),
            }
            confirmed &= tally.as_ref().is_none_or(Tally::confirmed);
            if new {
                done.push((*settings, tally));
            }
        }
        Ok(confirmed)
    }

    /// Checks the plans of settings whose guarantee can be in force, and of no others.
    fn check(&self, settings: &Settings) -> Result<Option<Tally>, String> {
        let given = settings.constraints == Constraints::Robust
            && Design::new(settings).is_ok_and(|design| design.accepted_share >= 1.0);
        given.then(|| check_flights(settings, 0..self.flights, self.duration)).transpose()
    }
}
