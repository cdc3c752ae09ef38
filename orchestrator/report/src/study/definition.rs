//! A study as its file describes it.

use super::comparisons::{Claim, Overview, Table};
use super::drawings::{Figure, Panel};
use super::grid::Grid;
use super::runs::{Assumption, Fact, Run, Within};
use super::values::{Quantity, Values};
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{Experiment, Measure, Record};
use cosim::signal::Signal;
use fmu_import::names;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::Spanned;

/// A study as it is written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// One line.
    pub title: String,
    /// How to cite the paper.
    pub paper: String,
    /// Paragraphs, separated by an empty line.
    pub summary: String,
    /// Files of published and computed values, beside the study.
    #[serde(rename = "values")]
    pub value_files: Vec<PathBuf>,
    /// The scenario.
    #[serde(default, rename = "scenario")]
    pub scenario: Vec<Fact>,
    /// What the paper leaves open.
    #[serde(default, rename = "assumption")]
    pub assumptions: Vec<Assumption>,
    /// What is run.
    #[serde(default, rename = "run")]
    pub runs: Vec<Run>,
    /// Further runs, added to `runs` when the study is read.
    #[serde(default, rename = "grid")]
    pub(super) grids: Vec<Grid>,
    /// Lists of signals, by name.
    #[serde(default)]
    pub signals: BTreeMap<String, Vec<Signal>>,
    /// Bounds that runs are held against.
    #[serde(default)]
    pub within: Vec<Within>,
    /// Numbers that are taken of runs.
    #[serde(default, rename = "measure")]
    pub measures: Vec<Measure>,
    /// What is drawn.
    #[serde(default, rename = "figure")]
    pub figures: Vec<Figure>,
    /// Paper against ours.
    #[serde(default, rename = "table")]
    pub tables: Vec<Table>,
    /// Runs against metrics.
    #[serde(default, rename = "overview")]
    pub overviews: Vec<Overview>,
    /// What the paper claims.
    #[serde(default, rename = "claim")]
    pub claims: Vec<Claim>,
    /// The values of the files.
    #[serde(skip)]
    pub values: Values,
    /// The file, with those that it extends.
    #[serde(skip)]
    pub source: Source,
}

impl Study {
    /// The run with this id.
    pub fn run(&self, id: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.id.get_ref() == id)
    }

    /// The runs whose curves a panel shows.
    pub fn runs_of<'a>(&'a self, figure: &'a Figure, panel: &'a Panel) -> impl Iterator<Item = &'a Run> {
        let ids = panel.runs.as_ref().unwrap_or(&figure.runs);
        ids.iter().filter_map(|id| self.run(id.get_ref()))
    }

    fn list(&self, name: &Spanned<String>) -> &[Signal] {
        self.signals.get(name.get_ref()).map(Vec::as_slice).unwrap_or_default()
    }

    /// The bounds that a run is held against, each with its signals.
    pub fn bounds_of<'a>(&'a self, run: &'a Run) -> impl Iterator<Item = (&'a Within, &'a [Signal])> {
        let named = |id: &Spanned<String>| self.within.iter().find(|within| within.id == *id.get_ref());
        run.within.iter().filter_map(named).map(|within| (within, self.list(&within.signals)))
    }

    /// The numbers that are taken of a run, each with its signals.
    pub fn measures_of<'a>(&'a self, run: &'a Run) -> impl Iterator<Item = (&'a Measure, &'a [Signal])> {
        let named = |id: &Spanned<String>| self.measures.iter().find(|measure| measure.id == *id.get_ref());
        run.measures.iter().filter_map(named).map(|measure| (measure, self.list(&measure.signals)))
    }

    /// A number as it is written, or the value it names.
    ///
    /// # Errors
    /// If there is no such value.
    pub fn number(&self, quantity: &Quantity) -> Result<f64, Error> {
        self.values.number(quantity).map_err(|message| self.source.error(&(0..0), message))
    }

    /// The experiment of a run, with what the run sets, recording nothing.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn experiment(&self, run: &Run) -> Result<Experiment, Error> {
        let mut experiment = Experiment::load(&self.source.beside(&run.experiment))?;
        let fault = |message: String| {
            self.source.error(&run.id.span(), format!("[[run]] {}: {message}", run.id.get_ref()))
        };
        for (name, fmu) in &run.fmu {
            let hint = names::hint(name, experiment.components.keys().map(String::as_str));
            match experiment.components.get_mut(name) {
                Some(component) => component.fmu = Spanned::new(0..0, fmu.clone()),
                None => return Err(fault(format!("fmu: there is no component \"{name}\"{hint}"))),
            }
        }
        for target in &run.unset {
            experiment.unset(target).map_err(fault)?;
        }
        for (target, value) in &run.set {
            experiment.set(target, value.clone()).map_err(fault)?;
        }
        experiment.record = Record { variables: Vec::new(), every: 1 };
        Ok(experiment)
    }
}
