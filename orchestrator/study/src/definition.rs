//! A study as its file describes it, with all of its parts.

use crate::comparisons::{Claim, ComparisonTable, Overview};
use crate::drawings::{Figure, Panel};
use crate::grid::Grid;
use crate::runs::{Assumption, Run, Within};
use crate::values::{Quantity, Values};
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{Experiment, Measure, Record};
use cosim::signal::Signal;
use fmi_master::names;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::Spanned;

/// A study as its file describes it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Title of the study, in one line.
    pub title: String,
    /// Reference to the paper, as it is to be cited.
    pub paper: String,
    /// Summary of the study, in paragraphs that are separated by empty lines.
    pub summary: String,
    /// Files of published and computed values, with paths relative to the study.
    #[serde(rename = "values")]
    pub value_files: Vec<PathBuf>,
    /// Abbreviations that the page uses, with their meaning.
    #[serde(default)]
    pub terms: BTreeMap<String, String>,
    /// Gaps in the paper, each with the assumption that fills it here.
    #[serde(default, rename = "assumption")]
    pub assumptions: Vec<Assumption>,
    /// Runs of the study.
    #[serde(default, rename = "run")]
    pub runs: Vec<Run>,
    /// Grids of candidates and scenarios, whose runs are added to `runs` when the study is read.
    #[serde(default, rename = "grid")]
    pub(crate) grids: Vec<Grid>,
    /// Lists of signals that the other keys refer to, by name.
    #[serde(default)]
    pub signals: BTreeMap<String, Vec<Signal>>,
    /// Bounds on signals, which runs are compared with.
    #[serde(default)]
    pub within: Vec<Within>,
    /// Numbers that are computed from the signals of runs.
    #[serde(default, rename = "measure")]
    pub measures: Vec<Measure>,
    /// Figures of the report, of which the first stands at the top of the page.
    #[serde(default, rename = "figure")]
    pub figures: Vec<Figure>,
    /// Tables that compare numbers of the paper with ours.
    #[serde(default, rename = "table")]
    pub tables: Vec<ComparisonTable>,
    /// Tables that show metrics of several runs.
    #[serde(default, rename = "overview")]
    pub overviews: Vec<Overview>,
    /// Claims of the paper, with the checks that decide on them.
    #[serde(default, rename = "claim")]
    pub claims: Vec<Claim>,
    /// Largest number of cases of a run, if it is smaller than the file says. This is not a key of
    /// a study file.
    #[serde(skip)]
    pub(crate) most_cases: Option<u64>,
    /// Values that were read from the files. This is not a key of a study file.
    #[serde(skip)]
    pub values: Values,
    /// The study file, together with the files that it extends. This is not a key of a study file.
    #[serde(skip)]
    pub source: Source,
}

impl Study {
    /// Returns the run with this id.
    pub fn run(&self, id: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.id.get_ref() == id)
    }

    /// Returns the runs whose curves a panel shows.
    pub fn runs_of<'a>(
        &'a self,
        figure: &'a Figure,
        panel: &'a Panel,
    ) -> impl Iterator<Item = &'a Run> {
        let ids = panel.runs.as_ref().unwrap_or(&figure.runs);
        ids.iter().filter_map(|id| self.run(id.get_ref()))
    }

    /// Returns the panels that show a run.
    pub(crate) fn panels_of(&self, run: &Run) -> impl Iterator<Item = &Panel> {
        self.figures.iter().flat_map(|figure| {
            let shows =
                |panel: &&Panel| self.runs_of(figure, panel).any(|shown| shown.id == run.id);
            figure.panels.iter().filter(shows)
        })
    }

    /// Returns an error that refers to no line of the file.
    pub(crate) fn fault(&self, message: impl Into<String>) -> Error {
        self.source.error(&(0..0), message)
    }

    /// Returns an error that says what is wrong with a run.
    pub(crate) fn run_fault(&self, run: &Run, message: &str) -> Error {
        let message = format!("[[run]] {}: {message}", run.id.get_ref());
        self.source.error(&run.id.span(), message)
    }

    fn list(&self, name: &Spanned<String>) -> &[Signal] {
        self.signals.get(name.get_ref()).map(Vec::as_slice).unwrap_or_default()
    }

    /// Returns the bounds that a run is compared with, each with its signals.
    pub fn bounds_of<'a>(
        &'a self,
        run: &'a Run,
    ) -> impl Iterator<Item = (&'a Within, &'a [Signal])> {
        let named =
            |id: &Spanned<String>| self.within.iter().find(|within| within.id == *id.get_ref());
        run.within.iter().filter_map(named).map(|within| (within, self.list(&within.signals)))
    }

    /// Returns the measures that a run has, each with its signals.
    pub fn measures_of<'a>(
        &'a self,
        run: &'a Run,
    ) -> impl Iterator<Item = (&'a Measure, &'a [Signal])> {
        let named =
            |id: &Spanned<String>| self.measures.iter().find(|measure| measure.id == *id.get_ref());
        run.measures.iter().filter_map(named).map(|measure| (measure, self.list(&measure.signals)))
    }

    /// Returns a number as it is written, or the value with this name.
    ///
    /// # Errors
    /// Returns an error if there is no such value.
    pub fn number(&self, quantity: &Quantity) -> Result<f64, Error> {
        self.values.number(quantity).map_err(|message| self.fault(message))
    }

    /// Returns the experiment of a run with the changes that the run makes to it. It records
    /// nothing.
    ///
    /// # Errors
    /// Returns an error if the experiment cannot be read, or lacks what the run changes in it.
    pub fn experiment(&self, run: &Run) -> Result<Experiment, Error> {
        let mut experiment = Experiment::load(&self.source.beside(&run.experiment))?;
        let fault = |message: String| self.run_fault(run, &message);
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
