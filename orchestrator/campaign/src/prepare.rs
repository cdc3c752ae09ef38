//! Looks up what a campaign names: its experiment, its metrics and measures.

use crate::definition::Campaign;
use cosim::error::Error;
use cosim::experiment::{Experiment, Margins, Measure, MeasureKind, Observe, Overrides, Process};
use cosim::files;
use cosim::search::named::{Kind, find};
use cosim_metrics::metrics::{Meters, Metrics};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use sweep::vary::DesignKind;
use toml::Spanned;

/// Changes that the command line makes to a campaign.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Experiment in place of that of the campaign.
    pub experiment: Option<PathBuf>,
    /// Changes to the experiment.
    pub overrides: Overrides,
    /// Command that flies one case with these changes, in which `CASE` stands for its number.
    pub command: String,
}

/// A number that is recorded of each case.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Name of the metric or measure.
    pub name: String,
    /// The quantity in words.
    pub words: String,
    /// Unit of the number, or an empty text.
    pub unit: String,
    /// Number that replaces a missing value, if it means that something never happened, as with a
    /// settling time, or that there is no limit, as with a margin.
    pub missing: Option<f64>,
}

/// Reads the experiment of a campaign, with the settings of the campaign and the command line.
pub(crate) fn read_experiment(campaign: &Campaign, changes: &Changes) -> Result<Experiment, Error> {
    let source = &campaign.source;
    let span = campaign.experiment.span();
    let beside = source.beside(campaign.experiment.get_ref());
    let path = match &changes.experiment {
        Some(name) => find(name, Kind::Experiment)?,
        None if beside.is_file() => beside,
        None => find(campaign.experiment.get_ref(), Kind::Experiment)
            .map_err(|error| source.error(&span, error.to_string()))?,
    };
    let mut experiment = Experiment::load(&path)?;
    for (name, value) in &campaign.set {
        let outcome = experiment.set(name, value.get_ref().clone());
        outcome.map_err(|problem| source.error(&value.span(), format!("[set] {problem}")))?;
    }
    experiment.apply(&changes.overrides)?;
    Ok(experiment)
}

/// Returns the observations of each case: the metrics that the campaign names and its measures.
pub(crate) fn observe(campaign: &Campaign, experiment: &Observe) -> Result<Observe, Error> {
    let source = &campaign.source;
    let mut signals = experiment.signals.clone();
    signals.extend(campaign.signals.clone());
    let names = Metrics::reproducible_names(experiment);
    let names = || names.iter().map(String::as_str);
    source.check_names(&campaign.metrics, "metric of the experiment", names())?;
    let mut metrics = BTreeMap::new();
    for name in &campaign.metrics {
        let Some(measure) = experiment.metrics.get(name.get_ref()) else { continue };
        if measure.timing {
            let message = format!(
                "metrics: \"{}\" is a computing time, which differs from run to run",
                name.get_ref()
            );
            return Err(source.error(&name.span(), message));
        }
        metrics.insert(name.get_ref().clone(), measure.clone());
    }
    for measure in &campaign.measures {
        let lists = signals.keys().map(String::as_str);
        source.check_names([&measure.signals], "list of signals", lists)?;
        let id = &measure.id;
        if metrics.contains_key(id) || names().any(|name| name == id) {
            let message = format!("[[measure]] {id}: the experiment has a metric of this name");
            return Err(source.error(&measure.signals.span(), message));
        }
        metrics.insert(id.clone(), Measure { id: String::new(), ..measure.clone() });
    }
    for measure in metrics.values_mut() {
        measure.limit = None;
    }
    // Metrics that no measure computes belong to the guarantee or to the margins.
    let others = campaign.metrics.iter().map(Spanned::get_ref);
    let others = others.filter(|name| !experiment.metrics.contains_key(*name));
    let (of_margins, of_guarantee): (Vec<&String>, Vec<&String>) =
        others.partition(|name| Margins::is_metric(name));
    Ok(Observe {
        vehicle: None,
        signals,
        metrics,
        summary: Vec::new(),
        guarantee: experiment.guarantee.clone().filter(|_| !of_guarantee.is_empty()),
        margins: experiment.margins.clone().filter(|_| !of_margins.is_empty()),
        // The limits of a campaign judge its cases.
        goal: None,
        ..experiment.clone()
    })
}

/// Lists the numbers that are recorded: the metrics in the order of the file, then the measures.
pub(crate) fn recorded(campaign: &Campaign, observe: &Observe, meters: &Meters) -> Vec<Recorded> {
    let units = meters.metrics().units;
    let names = campaign.metrics.iter().map(|name| name.get_ref().clone());
    let names = names.chain(campaign.measures.iter().map(|measure| measure.id.clone()));
    names
        .map(|name| Recorded {
            unit: units.get(&name).cloned().or_else(|| Margins::unit(&name)).unwrap_or_default(),
            missing: missing(&name, observe),
            words: words(&name, observe),
            name,
        })
        .collect()
}

/// Returns the heading of a metric, or the words of its name.
fn words(name: &str, observe: &Observe) -> String {
    let headed = observe.metrics.get(name).filter(|measure| !measure.label.is_empty());
    headed.map_or_else(
        || name.replace(['_', '-'], " "),
        |measure| format!("{} {}", measure.label, measure.part).trim_end().to_string(),
    )
}

fn missing(name: &str, observe: &Observe) -> Option<f64> {
    let never = [MeasureKind::Settling, MeasureKind::Leaving];
    match observe.metrics.get(name) {
        Some(measure) => never.contains(&measure.kind).then_some(f64::INFINITY),
        None if name == "margin_gain_below" => Some(0.0),
        None => (name == "lost_at" || Margins::is_metric(name)).then_some(f64::INFINITY),
    }
}

/// Hashes what the campaign and the command line say about the cases. Experiment and FMUs count by
/// their content, wherever they are.
pub(crate) fn keys(campaign: &Campaign, observe: &Observe, changes: &Changes) -> String {
    let Campaign { set, vary, design, seed, cases, limits, .. } = campaign;
    let cases = cases.filter(|_| *design == DesignKind::Corners);
    let inputs = json!([set, vary, design, seed, cases, limits, observe]);
    // It is the same for a case in which process its instances run.
    let process = Process::default();
    let overrides = Overrides { fmu: Vec::new(), process, ..changes.overrides.clone() };
    files::digest(format!("{inputs}{overrides:?}"))
}
