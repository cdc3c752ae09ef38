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
        let mut done: Vec<&Settings> = Vec::new();
        // A folder without a guarantee confirms nothing.
        let (mut confirmed, mut is_any) = (true, false);
        for Shipped { file, place, settings } in &scan.shipped {
            let title = format!("{} {place}", file.display());
            if done.contains(&settings) {
                println!("{title}: as above");
                continue;
            }
            done.push(settings);
            let Some(tally) = self.check(settings)? else {
                println!("{title}: no guarantee is given");
                continue;
            };
            print!("{}", report(&title, &tally));
            (confirmed, is_any) = (confirmed && tally.confirmed(), true);
        }
        println!("{}", verdict(confirmed, is_any));
        Ok(confirmed && is_any)
    }

    /// Checks the plans of settings whose guarantee can be in force, and of no others.
    fn check(&self, settings: &Settings) -> Result<Option<Tally>, String> {
        let given = settings.constraints == Constraints::Robust
            && Design::new(settings).is_ok_and(|design| design.accepted_share >= 1.0);
        given.then(|| check_flights(settings, 0..self.flights, self.duration)).transpose()
    }
}

/// Returns the verdict of all checks.
fn verdict(confirmed: bool, is_any: bool) -> &'static str {
    match (is_any, confirmed) {
        (false, _) => "No guarantee is given, so that NO plan was checked.",
        (_, true) => "Every plan is confirmed.",
        (_, false) => "NOT every plan is confirmed.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_a_guarantee_and_a_plan_that_is_not_confirmed_are_told() {
        assert_eq!(verdict(true, true), "Every plan is confirmed.");
        assert_eq!(verdict(false, true), "NOT every plan is confirmed.");
        assert!(verdict(true, false).contains("NO plan was checked"));
        let folder = std::env::temp_dir().join(format!("no-guarantee-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let files = ShippedFiles { folder: folder.clone(), flights: 1, duration: 1.0 };
        assert_eq!(files.run(), Ok(false));
        std::fs::remove_dir(folder).unwrap();
    }
}
