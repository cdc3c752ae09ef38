//! Parts of a campaign, which are kept as those of any sweep.

use crate::definition::kept_column;
use crate::flight::{Flight, table};
use crate::plan::Plan;
use cosim::error::Error as Single;
use cosim_metrics::progress::Parts;
use std::ops::Range;
use std::path::Path;
use sweep::error::Error;
use sweep::parts::{self, PartResult, Store};
use sweep::table::{CaseTable, Values};

/// Number of cases in a part beyond the first `FEW` cases.
pub const LENGTH: u64 = 250;

/// Number of cases that are flown in parts of a tenth of this length, so that a small campaign has
/// work for all cores and loses little when it ends early.
const FEW: u64 = 2500;

/// Returns the parts of a campaign of `cases` cases. The parts of a smaller one are the first of
/// them, except for its last.
pub fn parts(cases: u64) -> impl Iterator<Item = Range<u64>> {
    let others = parts::parts(cases, LENGTH).skip_while(|part| part.start < FEW);
    parts::parts(cases.min(FEW), LENGTH / 10).chain(others)
}

/// Returns the parts that are kept in the folder of the results.
pub fn store<'a>(plan: &'a Plan, out: &Path) -> Store<'a> {
    Store { folder: out.join("parts"), keys: &plan.sweep.keys }
}

/// Returns the number of cases that broke each limit.
pub fn broken(plan: &Plan, rows: &CaseTable) -> Vec<u64> {
    let limits = plan.campaign.limits.iter();
    let broken = limits.map(|limit| match rows.column(&kept_column(&limit.id)) {
        Some(Values::Flag(flags)) => flags.iter().filter(|is_kept| !**is_kept).count() as u64,
        _ => 0,
    });
    broken.collect()
}

/// Names the case in which an FMU could not be flown.
pub fn of_case(case: u64, error: Single) -> Error {
    match error {
        source @ Single::Call { .. } => Error::Case { case, more: 0, source: Box::new(source) },
        error => error.into(),
    }
}

/// Flies a part and keeps its results. Returns the number of cases that broke each limit.
///
/// # Errors
/// Returns an error if the work was asked to end, if a case could not be flown, or if the file
/// cannot be written.
pub fn fly(
    plan: &Plan,
    out: &Path,
    part: &Range<u64>,
    flight: &mut Flight,
    progress: &Parts,
) -> Result<Vec<u64>, Error> {
    let mut rows = Vec::with_capacity((part.end - part.start) as usize);
    for case in part.clone() {
        rows.push(flight.fly(case).map_err(|error| of_case(case, error))?);
        progress.advance(1);
    }
    let rows = table(plan, &rows);
    let broken = broken(plan, &rows);
    let result = PartResult { rows, units: plan.units(), curves: String::new() };
    store(plan, out).write(part, result)?;
    Ok(broken)
}

#[cfg(test)]
mod tests {
    use super::parts;

    #[test]
    fn parts_follow_one_another_and_do_not_change_when_cases_are_added() {
        for cases in [1, 25, 1100, 2500, 2510, 10_000] {
            let some: Vec<_> = parts(cases).collect();
            let more: Vec<_> = parts(20_000).take(some.len()).collect();
            assert_eq!((some[0].start, some[some.len() - 1].end), (0, cases));
            assert!(some.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!(some[..some.len() - 1], more[..some.len() - 1]);
        }
        let lengths: Vec<u64> = parts(3000).map(|part| part.end - part.start).collect();
        assert_eq!((lengths.len(), lengths[99], lengths[100]), (102, 25, 250));
    }
}
