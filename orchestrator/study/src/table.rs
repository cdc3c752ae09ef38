//! The numbers of a run as a table with a row for each case. The columns have the names by which a
//! study refers to them.

use cosim_metrics::metrics::Value;
use std::collections::{BTreeMap, BTreeSet};
use sweep::cases::Sweep;
use sweep::flight::{Flown, columns};
use sweep::table::{CaseTable, Column, Values};

/// Makes the table of cases that were flown.
pub(crate) fn table(sweep: &Sweep, cases: &[Flown]) -> CaseTable {
    let numbered: Vec<_> =
        cases.iter().map(|flown| (flown.case, flown.values.as_slice())).collect();
    let mut columns = columns(sweep, &numbered);
    let rows: Vec<BTreeMap<String, Option<Value>>> = cases.iter().map(row).collect();
    let names: BTreeSet<&String> = rows.iter().flat_map(BTreeMap::keys).collect();
    columns.extend(names.into_iter().map(|name| {
        let cells: Vec<Option<&Value>> =
            rows.iter().map(|row| row.get(name).and_then(Option::as_ref)).collect();
        Column { name: name.clone(), values: values(&cells) }
    }));
    CaseTable { columns }
}

fn row(flown: &Flown) -> BTreeMap<String, Option<Value>> {
    let metrics = &flown.metrics;
    let mut row = metrics.asked.clone();
    row.insert("samples".into(), Some(Value::Count(metrics.samples)));
    row.insert("completed".into(), Some(Value::Flag(metrics.completed)));
    row.insert("lost_at".into(), metrics.lost_at.map(Value::Number));
    row.insert("loop_delay_s".into(), metrics.loop_delay_s.map(Value::Number));
    let times = metrics.step_us.iter();
    row.extend(times.map(|(name, time)| (format!("step_us.{name}"), Some(Value::Number(*time)))));
    row
}

/// Returns the values of a column. If they are of different kinds, they become numbers.
fn values(cells: &[Option<&Value>]) -> Values {
    if cells.iter().any(|cell| matches!(cell, Some(Value::Text(_)))) {
        let texts = cells.iter().map(|cell| match cell {
            Some(Value::Text(text)) => text.clone(),
            _ => String::new(),
        });
        return Values::Text(texts.collect());
    }
    let flags = cells.iter().map(|cell| match cell {
        Some(Value::Flag(is)) => Some(*is),
        _ => None,
    });
    let counts = cells.iter().map(|cell| match cell {
        Some(Value::Count(count)) => i64::try_from(*count).ok(),
        _ => None,
    });
    if let Some(flags) = flags.collect() {
        Values::Flag(flags)
    } else if let Some(counts) = counts.collect() {
        Values::Integer(counts)
    } else {
        Values::Real(cells.iter().map(|cell| cell.and_then(Value::number)).collect())
    }
}
