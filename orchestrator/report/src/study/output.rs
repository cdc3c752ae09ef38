//! Writes the figures, the numbers and the page of a study.

use super::claims;
use super::results::Results;
use super::{figures, page};
use crate::figure::{png, svg};
use cosim::error::Error;
use cosim::files;
use fmu_import::quantity::rounded;
use serde_json::{Value, json};
use std::path::Path;

/// A claim in our words, with its verdict.
pub(super) type Judgement = (String, claims::Verdict);

/// Writes the figures, the numbers and the page. Returns the verdicts and the names of the files.
pub(super) fn write(results: &Results, out: &Path) -> Result<(Vec<Judgement>, Vec<String>), Error> {
    let study = results.study;
    let fault = |message: String| study.source.error(&(0..0), message);
    let mut files = vec!["report.html".to_string(), "results.json".to_string()];
    let mut drawn = Vec::new();
    for figure in &study.figures {
        let picture = figures::figure(figure, results).map_err(fault)?;
        let path = out.join("figures").join(format!("{}.svg", figure.id));
        let text = svg::text(&picture).map_err(Error::file(&path))?;
        files::write(&path, &text)?;
        png::write(&text, &path.with_extension("png"))?;
        files.push(format!("figures/{}.svg, .png", figure.id));
        drawn.push(picture);
    }
    let judged = study
        .claims
        .iter()
        .map(|claim| claims::judge(claim, results))
        .collect::<Result<Vec<_>, _>>()
        .map_err(fault)?;
    files::write(&out.join("results.json"), numbers(results, &judged))?;
    let page = page::page(results, &judged, &drawn).map_err(fault)?;
    files::write(&out.join("report.html"), page)?;
    let verdicts =
        study.claims.iter().zip(&judged).map(|(c, j)| (c.says.clone(), j.verdict)).collect();
    Ok((verdicts, files))
}

/// Returns all numbers as JSON for other programs.
fn numbers(results: &Results, judged: &[claims::Judged]) -> String {
    let study = results.study;
    let runs: serde_json::Map<String, Value> = study
        .runs
        .iter()
        .zip(&results.runs)
        .map(|(run, result)| {
            let entry = json!({
                "label": run.label,
                "experiment": run.experiment,
                "fmu": run.fmu,
                "set": run.set,
                "unset": run.unset,
                "members": result.members,
                "samples": result.series.samples,
            });
            (run.id.get_ref().clone(), entry)
        })
        .collect();
    let claims: Vec<Value> = study
        .claims
        .iter()
        .zip(judged)
        .map(|(claim, judged)| {
            let checks: Vec<Value> = claim
                .checks
                .iter()
                .zip(&judged.checks)
                .map(|(check, checked)| {
                    json!({
                        "label": check.label,
                        "left": checked.left.0,
                        "right": checked.right.0,
                        "difference": checked.difference.0,
                        "held": checked.held,
                        "of": checked.pairs,
                    })
                })
                .collect();
            json!({ "says": claim.says, "verdict": judged.verdict, "checks": checks })
        })
        .collect();
    let document =
        json!({ "title": study.title, "values": study.values.0, "runs": runs, "claims": claims });
    let mut text = serde_json::to_string_pretty(&document).unwrap_or_default();
    text.push('\n');
    text
}

/// Describes the runs that lose the attitude, and the runs that vary a parameter without any
/// effect, for example the seed of a constant disturbance.
pub(super) fn notes(results: &Results) -> Vec<String> {
    let mut notes = Vec::new();
    for (run, result) in results.study.runs.iter().zip(&results.runs) {
        let (id, count) = (run.id.get_ref(), result.members.len());
        let lost: Vec<f64> =
            result.members.iter().filter_map(|member| member.metrics.lost_at).collect();
        if let Some(first) = lost.iter().copied().reduce(f64::min) {
            let time = rounded(first);
            let what = run.observe.loss.as_ref().map_or("run", |loss| &loss.what);
            notes.push(format!(
                "{id}: the {what} is lost in {} of {count} runs, at t = {time} s or later",
                lost.len()
            ));
        }
        if let (Some(vary), Some((first, others))) = (&run.vary, result.members.split_first())
            && !others.is_empty()
            && others.iter().all(|other| other.has_same_results(first, &run.observe))
        {
            let names = vary.parameter.names().join(" and ");
            notes.push(format!("{id}: {names} has no effect, all {count} runs are the same"));
        }
    }
    notes
}
