//! Parts of a campaign: consecutive cases, whose results share a file. A part with a valid file is
//! not flown again, whether this thread, an earlier run or another machine flew it.

use crate::flight::{Flight, Row, kept_column, table};
use crate::plan::Plan;
use crate::table::{CaseTable, Reader, Values, Writer};
use cosim::error::Error;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Number of cases in a part.
pub const LENGTH: u64 = 250;

/// Returns the parts of the cases below `cases`.
pub fn parts(cases: u64) -> impl Iterator<Item = Range<u64>> {
    (0..cases.div_ceil(LENGTH)).map(move |i| i * LENGTH..cases.min((i + 1) * LENGTH))
}

/// Returns the path of a part's file in the folder of a campaign's results.
pub fn path(out: &Path, part: &Range<u64>) -> PathBuf {
    out.join("parts").join(format!("{:010}-{:010}.parquet", part.start, part.end))
}

/// State of a part's file in the folder of the results.
#[derive(Clone, Debug, PartialEq)]
pub enum PartState {
    /// The file is valid: the number of cases that broke each limit.
    Whole(Vec<u64>),
    /// There is no such file.
    Missing,
    /// The file is damaged.
    Damaged,
    /// The file was made from other inputs, whose names are given.
    Other(Vec<String>),
}

/// Looks for a part.
pub fn find(plan: &Plan, out: &Path, part: &Range<u64>) -> PartState {
    let path = path(out, part);
    if !path.exists() {
        return PartState::Missing;
    }
    let Ok(reader) = Reader::open(&path) else { return PartState::Damaged };
    let keys = reader.metadata("keys").map(serde_json::from_str::<BTreeMap<String, String>>);
    let Some(Ok(keys)) = keys else { return PartState::Damaged };
    let mut others: Vec<String> = plan
        .keys
        .iter()
        .filter(|(name, key)| keys.get(*name) != Some(key))
        .map(|(name, _)| name.clone())
        .collect();
    others.extend(keys.keys().filter(|name| !plan.keys.contains_key(*name)).cloned());
    if !others.is_empty() {
        return PartState::Other(others);
    }
    match read(&reader, part) {
        Some(rows) => PartState::Whole(broken(plan, &rows)),
        None => PartState::Damaged,
    }
}

/// Reads the rows of a part that is whole.
fn read(reader: &Reader, part: &Range<u64>) -> Option<CaseTable> {
    if reader.rows() != part.end - part.start {
        return None;
    }
    let rows = reader.table().ok()?;
    let is_whole =
        reader.metadata("digest") == Some(&rows.digest()) && rows.rows() as u64 == reader.rows();
    is_whole.then_some(rows)
}

/// Reads the rows of a part.
///
/// # Errors
/// Returns an error if the file is missing or damaged.
pub fn rows(out: &Path, part: &Range<u64>) -> Result<CaseTable, Error> {
    let path = path(out, part);
    read(&Reader::open(&path)?, part).ok_or_else(|| {
        Error::experiment(format!(
            "{} is damaged: remove it, and its cases are flown again",
            path.display()
        ))
    })
}

/// Returns the number of cases that broke each limit.
fn broken(plan: &Plan, rows: &CaseTable) -> Vec<u64> {
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
    let keys =
        serde_json::to_string(&plan.keys).map_err(|error| Error::experiment(error.to_string()))?;
    let metadata = [("units", plan.units()), ("digest", rows.digest()), ("keys", keys)];
    let broken = broken(plan, &rows);
    let mut writer = Writer::create(&path(out, part), &metadata)?;
    writer.add(rows)?;
    writer.finish()?;
    Ok(broken)
}
