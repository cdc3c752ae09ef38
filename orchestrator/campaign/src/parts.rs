//! Parts of a campaign, which are kept as those of any sweep.

use crate::flight::{Flight, Row, kept_column, table};
use crate::plan::Plan;
use cosim::error::Error;
use std::ops::Range;
use std::path::{Path, PathBuf};
use sweep::parts::{self, PartResult, PartState};
use sweep::table::{CaseTable, Values};

/// Number of cases in a part.
pub const LENGTH: u64 = 250;

/// Returns the parts of the cases below `cases`.
pub fn parts(cases: u64) -> impl Iterator<Item = Range<u64>> {
    parts::parts(cases, LENGTH)
}

fn folder(out: &Path) -> PathBuf {
    out.join("parts")
}

/// Looks for a part.
pub fn find(plan: &Plan, out: &Path, part: &Range<u64>) -> PartState {
    parts::find(&folder(out), &plan.sweep.keys, part)
}

/// Reads the rows of a part.
///
/// # Errors
/// Returns an error if the file is missing or damaged.
pub fn rows(out: &Path, part: &Range<u64>) -> Result<CaseTable, Error> {
    Ok(parts::read(&folder(out), part)?.rows)
}

/// Returns the number of cases that broke each limit.
pub fn broken(plan: &Plan, rows: &CaseTable) -> Vec<u64> {
    let broken =
        plan.campaign.limits.iter().map(|limit| match rows.column(&kept_column(&limit.id)) {
            Some(Values::Flag(flags)) => flags.iter().filter(|is_kept| !**is_kept).count() as u64,
            _ => 0,
        });
    broken.collect()
}

/// Flies a part and keeps its results. `flown` is called after each case. Returns the number of
/// cases that broke each limit.
///
/// # Errors
/// Returns an error if the work was asked to end, or if the file cannot be written.
pub fn fly(
    plan: &Plan,
    out: &Path,
    part: &Range<u64>,
    flight: &mut Flight,
    mut flown: impl FnMut(&Row),
) -> Result<Vec<u64>, Error> {
    let mut rows = Vec::with_capacity((part.end - part.start) as usize);
    for case in part.clone() {
        let row = flight.fly(case)?;
        flown(&row);
        rows.push(row);
    }
    let rows = table(plan, &rows);
    let broken = broken(plan, &rows);
    let result = PartResult { rows, units: plan.units(), curves: String::new() };
    parts::write(&folder(out), &plan.sweep.keys, part, result)?;
    Ok(broken)
}
