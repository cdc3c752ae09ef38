//! Tables of numbers.

use crate::comparisons::{ComparisonRow, ComparisonTable, Overview};
use crate::results::{Numbers, Results};
use crate::texts::{difference, several, signed};
use crate::values::{Quantity, ValueKind};
use cosim_report::page::table;
use maud::{Markup, html};
use sweep::texts::shown;

/// Rows and columns of the table on the first screen.
const ROWS: usize = 9;
const COLUMNS: usize = 4;

/// Returns the first rows and columns of an overview.
pub(super) fn small(full: &Overview, results: &Results) -> Markup {
    let mut part = full.clone();
    part.runs.truncate(ROWS);
    part.metrics.truncate(COLUMNS);
    part.note.clear();
    let is_part = part.runs.len() < full.runs.len() || part.metrics.len() < full.metrics.len();
    html! {
        (rows(&part, results, &one))
        @if is_part { p.note.on-screen { a href="#tables" { "All rows and columns" } } }
    }
}

pub(crate) fn comparison(compared: &ComparisonTable, results: &Results) -> Result<Markup, String> {
    let headings = ["Quantity", "To compare", "Ours", "Difference", "Remark"];
    let rows = compared.rows.iter().map(|compared| row(compared, results));
    let rows = rows.collect::<Result<Vec<_>, _>>()?;
    Ok(html! {
        (table(&headings, rows))
        @if !compared.note.is_empty() { p.note { (compared.note) } }
    })
}

fn row(row: &ComparisonRow, results: &Results) -> Result<Vec<Markup>, String> {
    let ours = results.numbers(&row.ours)?;
    let paper = row.paper.as_ref().map(|paper| results.study.values.number(paper)).transpose()?;
    let origin = match &row.paper {
        Some(Quantity::Named(id)) => results.study.values.find(id).map(|value| &value.source),
        _ => None,
    };
    let difference = paper.map(|paper| {
        let absolute = ours.mean() - paper;
        // A difference that stems from the rounding of a mean counts as none.
        if absolute.abs() <= 1e-12 * paper.abs() {
            return "0".to_string();
        }
        format!("{} ({})", signed(absolute), difference(&Numbers(vec![ours.mean() / paper - 1.0])))
    });
    Ok(vec![
        html! { span title=[origin] { (row.label) } },
        html! { (paper.map_or("–".into(), shown)) },
        html! { (several(&ours)) },
        html! { (difference.as_deref().unwrap_or("–")) },
        html! { span.remark { (row.note) } },
    ])
}

/// Returns all rows and columns of an overview.
pub(super) fn overview(overview: &Overview, results: &Results) -> Markup {
    rows(overview, results, &|numbers, _| several(numbers))
}

/// Returns the number that stands for all cases: their mean, or the one that is nearest to a limit.
fn one(numbers: &Numbers, limit: Option<f64>) -> String {
    let largest = numbers.0.iter().copied().reduce(f64::max);
    let number = if limit.is_some() { largest } else { largest.map(|_| numbers.mean()) };
    number.map_or("–".into(), shown)
}

fn rows(
    overview: &Overview,
    results: &Results,
    cell: &dyn Fn(&Numbers, Option<f64>) -> String,
) -> Markup {
    let mut rows = Vec::new();
    for id in &overview.runs {
        let Some(run) = results.study.run(id.get_ref()) else { continue };
        let numbers = overview.metrics.iter().map(|column| {
            let reference = format!("{}.{}", id.get_ref(), column.of.metric);
            let numbers = results.numbers(&reference).into_iter().flat_map(|numbers| numbers.0);
            Numbers(numbers.map(|number| number * column.of.factor).collect())
        });
        rows.push((run, numbers.collect::<Vec<_>>()));
    }
    html! {
        div.scroll { table.numbers.overview {
            thead { tr { th { "Run" } @for column in &overview.metrics { th { (column.label) } } } }
            tbody {
                @for (place, (run, numbers)) in rows.iter().enumerate() {
                    @if !run.group.is_empty() && (place == 0 || rows[place - 1].0.group != run.group) {
                        tr.group { th colspan=(overview.metrics.len() + 1) { (run.group) } }
                    }
                    tr {
                        td {
                            span.swatch style=(format!("background:{}", run.color)) {} " "
                            (run.label)
                        }
                        @for (column, numbers) in overview.metrics.iter().zip(numbers) {
                            @if is_beyond(numbers, column.limit) {
                                td.beyond title="beyond the limit" { (cell(numbers, column.limit)) }
                            } @else { td { (cell(numbers, column.limit)) } }
                        }
                    }
                }
            }
        } }
        @if !overview.note.is_empty() { p.note { (overview.note) } }
    }
}

/// Returns whether one of these numbers is beyond a limit, which is met up to rounding.
fn is_beyond(numbers: &Numbers, limit: Option<f64>) -> bool {
    limit.is_some_and(|limit| numbers.0.iter().any(|number| *number > limit * (1.0 + 1e-9)))
}

pub(super) fn all_values(results: &Results) -> Markup {
    let kind = |kind| match kind {
        ValueKind::Table => "table",
        ValueKind::Text => "text",
        ValueKind::Figure => "figure, read off",
        ValueKind::Computed => "not printed, computed",
    };
    let rows = results.study.values.0.iter().map(|value| {
        vec![
            html! { code { (value.id) } },
            html! { (shown(value.value)) " " (value.unit) },
            html! { (kind(value.kind)) },
            html! { (value.source) },
        ]
    });
    table(&["Id", "Value", "Printed in", "Source"], rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_beyond_a_limit_is_marked() {
        let beyond = |values: &[f64]| is_beyond(&Numbers(values.to_vec()), Some(5.0));
        assert!(beyond(&[4.0, 5.1]) && !beyond(&[4.0, 5.0 + 1e-12]) && !beyond(&[]));
        assert!(!is_beyond(&Numbers(vec![9.0]), None));
    }
}
