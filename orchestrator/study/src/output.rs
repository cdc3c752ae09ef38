//! Writes the figures, the numbers and the page of a study.

use crate::claims::{self, Checked};
use crate::comparisons::{Check, Claim};
use crate::definition::Study;
use crate::drawings::Figure;
use crate::results::{Results, RunResult};
use crate::runs::Run;
use crate::{figures, origin, page};
use cosim::error::Error;
use cosim::files;
use cosim_report::figure::{self, svg};
use fmi_master::quantity::rounded;
use maud::Markup;
use serde_json::{Value, json};
use std::path::Path;
use sweep::table::CaseTable;

/// A claim in our words, with its verdict.
pub(crate) type Judgement = (String, claims::Verdict);

/// Everything that a report says of results.
pub(crate) struct Report {
    /// Outcomes of the claims.
    pub judged: Vec<claims::Judged>,
    pub figures: Vec<figure::Figure>,
    /// Tables that compare with the paper.
    pub tables: Vec<Markup>,
}

impl Report {
    /// Judges, draws and tabulates the results.
    ///
    /// # Errors
    /// Returns an error if the study names an item that does not exist.
    pub(crate) fn new(results: &Results) -> Result<Self, String> {
        let Study { claims, figures, tables, .. } = results.study;
        let judged = claims.iter().map(|claim| claims::judge(claim, results));
        let tables = tables.iter().map(|table| page::comparison(table, results));
        let figures = figures.iter().map(|figure| figures::figure(figure, results));
        Ok(Self {
            judged: judged.collect::<Result<_, _>>()?,
            tables: tables.collect::<Result<_, _>>()?,
            figures: figures.collect::<Result<_, _>>()?,
        })
    }

    /// Writes the figures, the numbers and the page.
    ///
    /// # Errors
    /// Returns an error if a file cannot be written.
    pub(crate) fn write(&self, results: &Results, out: &Path) -> Result<(), Error> {
        for (Figure { id, .. }, drawn) in results.study.figures.iter().zip(&self.figures) {
            svg::write(drawn, &out.join(format!("figures/{id}.svg")))?;
        }
        files::write(&out.join("results.json"), numbers(results, &self.judged))?;
        let origin = origin::origin();
        let page = page::page(results, &self.judged, &self.figures, &self.tables, &origin);
        files::write(&out.join("report.html"), page)
    }
}

/// Returns all numbers as JSON for other programs.
fn numbers(results: &Results, judged: &[claims::Judged]) -> String {
    let study = results.study;
    let run = |(run, result): (&Run, &RunResult)| {
        let entry = json!({
            "label": run.label,
            "experiment": run.experiment,
            "fmu": run.fmu,
            "set": run.set,
            "unset": run.unset,
            "members": members(result),
        });
        (run.id.get_ref().clone(), entry)
    };
    let check = |(check, checked): (&Check, &Checked)| {
        json!({
            "label": check.label,
            "left": checked.left.0,
            "right": checked.right.0,
            "difference": checked.difference.0,
            "held": checked.held,
            "of": checked.pairs,
            "probability": checked.probability(),
        })
    };
    let claim = |(claim, judged): (&Claim, &claims::Judged)| {
        let checks: Vec<Value> = claim.checks.iter().zip(&judged.checks).map(check).collect();
        json!({ "says": claim.says, "verdict": judged.verdict, "checks": checks })
    };
    let runs: serde_json::Map<String, Value> = results.pairs().map(run).collect();
    let claims: Vec<Value> = study.claims.iter().zip(judged).map(claim).collect();
    let document =
        json!({ "title": study.title, "values": study.values.0, "runs": runs, "claims": claims });
    let mut text = serde_json::to_string_pretty(&document).unwrap_or_default();
    text.push('\n');
    text
}

/// Returns the numbers of each case, by the names of the study's references.
fn members(result: &RunResult) -> Vec<Value> {
    let row = |part: &CaseTable, row: usize| {
        let cells =
            part.columns.iter().map(|column| (column.name.clone(), column.values.json(row)));
        cells.collect::<Value>()
    };
    let parts = result.parts.iter();
    parts.flat_map(|part| (0..part.rows()).map(move |at| row(part, at))).collect()
}

/// Describes a quick look, the runs that are lost, and those whose seeds have no effect, for example
/// that of a constant disturbance.
pub(crate) fn notes(results: &Results) -> Vec<String> {
    let mut notes = Vec::from_iter(page::quickly(results.study));
    for (run, result) in results.pairs() {
        let id = run.id.get_ref();
        let count = result.cases();
        let lost: Vec<f64> = result.column("lost_at").into_iter().flatten().collect();
        if let Some(first) = lost.iter().copied().reduce(f64::min) {
            let time = rounded(first);
            let what = run.observe.loss.as_ref().map_or("run", |loss| &loss.what);
            notes.push(format!(
                "{id}: the {what} is lost in {} of {count} runs, at t = {time} s or later",
                lost.len()
            ));
        }
        if count > 1 && result.failures().is_empty() && is_constant(run, result) {
            let seeds: Vec<&str> = run.seeds.iter().map(|seed| seed.get_ref().as_str()).collect();
            let seeds = seeds.join(" and ");
            notes.push(format!("{id}: {seeds} has no effect, all {count} runs are the same"));
        }
    }
    notes
}

/// Returns whether all cases of a run have the same results, apart from computing times.
fn is_constant(run: &Run, result: &RunResult) -> bool {
    let metrics = run.observe.metrics.iter().filter(|(_, measure)| !measure.timing);
    let measures = run.measures.iter().map(|id| format!("measure.{}", id.get_ref()));
    metrics.map(|(name, _)| name.clone()).chain(measures).all(|name| {
        let numbers = result.column(&name);
        numbers.iter().all(|number| *number == numbers[0])
    })
}
