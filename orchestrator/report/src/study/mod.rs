//! A paper's comparison as data: which experiments are run, over which seeds; what is drawn and tabulated of them; what the
//! paper prints; and what it claims. `orchestrator reproduce` runs it and writes the report.
//!
//! All keys stand in docs/studies.md, and in `orchestrator/schema/study.json` for editors.

pub mod claims;
pub mod figures;
pub mod grid;
pub mod page;
pub mod part;
pub mod reproduce;
pub mod results;
pub mod template;
pub mod values;

use cosim::document::Source;
use cosim::error::Error;
use crate::metrics::Metrics;
use cosim::experiment::{Experiment, Measure, Record, Scaled};
use crate::figure::Color;
use fmu_import::names;
use grid::Grid;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use cosim::signal::Signal;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::{Spanned, Value};
use values::{Quantity, Values};

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
    grids: Vec<Grid>,
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

/// One line of the scenario.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fact {
    /// What it is.
    pub what: String,
    /// Its value, with unit.
    pub value: String,
    /// Where it comes from.
    #[serde(default)]
    pub source: String,
}

/// A gap in the paper, and what fills it here.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assumption {
    /// What the paper does not say.
    pub silent: String,
    /// What is taken instead.
    pub taken: String,
}

/// An experiment that is run, once or for several values of a parameter.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Short name.
    #[schemars(with = "String")]
    pub id: Spanned<String>,
    /// Name in legends and tables.
    pub label: String,
    /// Colour of its curves.
    pub color: Color,
    /// Heading of its rows in an overview; none if it is empty.
    #[serde(default)]
    pub group: String,
    /// Experiment file, beside the study.
    pub experiment: PathBuf,
    /// Components that are other FMUs than in the experiment.
    #[serde(default)]
    pub fmu: BTreeMap<String, String>,
    /// Parameters that differ from the experiment's.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, cosim::experiment::Scalar>")]
    pub set: BTreeMap<String, Value>,
    /// Parameters of the experiment that are left at the FMU's own value.
    #[serde(default)]
    pub unset: Vec<String>,
    /// A parameter that takes several values.
    pub vary: Option<Vary>,
    /// Whether its first run has the machine for itself.
    #[serde(default)]
    pub timed: bool,
    /// Bounds that it is held against, by id.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub within: Vec<Spanned<String>>,
    /// Further numbers that are taken of it, by id.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub measures: Vec<Spanned<String>>,
    /// Names of the metrics that its experiment asks for; no key of a study file.
    #[serde(skip)]
    pub metrics: Vec<String>,
    /// Those that are computing times; no key of a study file.
    #[serde(skip)]
    pub timings: Vec<String>,
}

/// Values `first`, `first` + 1, … of a parameter.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// `component.parameter`, or several of them that take the same values.
    pub parameter: Parameters,
    /// The first value.
    pub first: i32,
    /// How many.
    pub count: u32,
}

impl Vary {
    /// How many values there are of at most so many, of which one is the least.
    fn limited(&self, members: Option<u32>) -> u32 {
        members.map_or(self.count, |limit| self.count.min(limit.max(1)))
    }
}

/// One parameter or several.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(untagged)]
pub enum Parameters {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

impl Parameters {
    /// All of them.
    pub fn all(&self) -> &[String] {
        match self {
            Self::One(parameter) => std::slice::from_ref(parameter),
            Self::Several(parameters) => parameters,
        }
    }
}

/// A bound on the magnitude of signals.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Within {
    /// Short name.
    pub id: String,
    /// A list of signals: all of them must be within the bound for a sample to count.
    #[schemars(with = "String")]
    pub signals: Spanned<String>,
    /// The bound.
    pub bound: Quantity,
}

/// A figure with its panels.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Name of its files.
    pub id: String,
    /// One line.
    pub title: String,
    /// What there is to see.
    #[serde(default)]
    pub caption: String,
    /// Panels side by side.
    #[serde(default = "one")]
    pub columns: usize,
    /// Whose curves are drawn.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// The panels, row by row.
    #[serde(rename = "panel")]
    pub panels: Vec<Panel>,
}

fn one() -> usize {
    1
}

fn paper() -> String {
    "Paper".into()
}

fn ours() -> String {
    "Ours".into()
}

/// A panel of a figure. Exactly one of `signal`, `signals`, `histogram`, `scatter` and `across` says what is drawn, or `points` alone.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Label of the vertical axis.
    pub label: String,
    /// Label of the horizontal axis, if it is not time.
    pub x_label: Option<String>,
    /// A heading above it.
    #[serde(default)]
    pub title: String,
    /// Instead of the figure's.
    #[schemars(with = "Option<Vec<String>>")]
    pub runs: Option<Vec<Spanned<String>>>,
    /// One curve for each run.
    pub signal: Option<Signal>,
    /// Several curves for each run.
    #[serde(default)]
    pub signals: Vec<Curve>,
    /// Drawn once, of the first run.
    pub reference: Option<Signal>,
    /// Whether the band of all values of `vary` is drawn.
    #[serde(default)]
    pub spread: bool,
    /// The metric of kind `p99` whose single values are counted, over a logarithmic axis.
    pub histogram: Option<String>,
    /// One dot for each value of `vary`.
    pub scatter: Option<Scatter>,
    /// Lines through the metrics of several runs.
    pub across: Option<Across>,
    /// Horizontal lines.
    #[serde(default)]
    pub bounds: Vec<Line>,
    /// Vertical lines.
    #[serde(default)]
    pub marks: Vec<Line>,
    /// Single points.
    #[serde(default)]
    pub points: Vec<Point>,
    /// Instead of the FMU's display unit.
    pub unit: Option<Scaled>,
    /// Part of the horizontal axis to show.
    pub x_range: Option<[f64; 2]>,
}

/// A curve of its own name and colour.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// What is drawn.
    pub of: Signal,
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    pub color: Color,
}

/// Metrics against each other.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Metric along the horizontal axis.
    pub x: String,
    /// Metric along the vertical axis.
    pub y: String,
}

/// Metrics of several runs against each other.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Across {
    /// Along the horizontal axis.
    pub x: Axis,
    /// Along the vertical axis.
    pub y: Axis,
    /// One line for each of these.
    pub lines: Vec<Through>,
}

/// A metric along an axis.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// The metric.
    pub of: String,
    /// The axis's unit for a value of 1.
    #[serde(default = "unscaled")]
    pub factor: f64,
}

/// A line through several runs: the mean of each run's metric.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Through {
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    pub color: Color,
    /// The runs, in their order.
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// Whether it is dashed.
    #[serde(default)]
    pub dashed: bool,
}

/// A straight line across a panel.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Where.
    pub at: Quantity,
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    #[serde(default)]
    pub color: Option<Color>,
    /// Whether it is drawn at the negative value too.
    #[serde(default)]
    pub symmetric: bool,
}

/// A single point.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: Quantity,
    /// Along the vertical axis.
    pub y: Quantity,
    /// Name in the legend.
    pub label: String,
    /// Its colour.
    pub color: Color,
}

/// Paper against ours.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// One line.
    pub title: String,
    /// What there is to know.
    #[serde(default)]
    pub note: String,
    /// Heading of what is compared with.
    #[serde(default = "paper")]
    pub against: String,
    /// Heading of ours.
    #[serde(default = "ours")]
    pub ours: String,
    /// Heading of a further column of ours; none if it is empty.
    #[serde(default)]
    pub beside: String,
    /// The rows.
    #[serde(rename = "row")]
    pub rows: Vec<Row>,
}

/// One quantity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// What it is, with unit.
    pub label: String,
    /// The value to compare with.
    pub paper: Option<Quantity>,
    /// `run.metric`.
    pub ours: String,
    /// `run.metric` of the further column.
    pub beside: Option<String>,
    /// Beside the numbers.
    #[serde(default)]
    pub note: String,
}

/// Runs against metrics.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Overview {
    /// One line.
    pub title: String,
    /// What there is to know.
    #[serde(default)]
    pub note: String,
    /// The rows.
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// The columns.
    pub metrics: Vec<Column>,
}

/// A column of an overview.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// The metric.
    pub of: String,
    /// Its heading, with unit.
    pub label: String,
    /// The heading's unit for a value of 1: parameters are in the units of the FMU's variables.
    #[serde(default = "unscaled")]
    pub factor: f64,
}

fn unscaled() -> f64 {
    1.0
}

/// A claim of the paper with the checks that decide on it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// What the paper claims, in our words.
    pub says: String,
    /// Where it does.
    pub source: String,
    /// Why it comes out as it does.
    #[serde(default)]
    pub remark: String,
    /// What decides.
    #[serde(rename = "check")]
    pub checks: Vec<Check>,
}

/// A comparison of two numbers, for each value of `vary`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// Under which circumstances.
    pub label: String,
    /// `run.metric`.
    pub left: String,
    /// How the left stands to the right.
    #[serde(default)]
    pub relation: Relation,
    /// `run.metric`, a value, or a number.
    pub right: Quantity,
    /// By at least this fraction of the right.
    pub by: Option<Quantity>,
}

/// How the left of a check stands to its right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// Not above it.
    #[default]
    Below,
    /// Not below it.
    Above,
}

/// A text with the numbers of runs in the places that ask for them.
fn counted(text: &str, runs: &[Run], members: Option<u32>) -> Result<Option<String>, String> {
    let mut parts = text.split("{runs:");
    let mut counted = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (id, rest) = part.split_once('}').ok_or("\"{runs:\" is not closed by a brace")?;
        let run = runs.iter().find(|run| run.id.get_ref() == id).ok_or_else(|| {
            let hint = names::hint(id, runs.iter().map(|run| run.id.get_ref().as_str()));
            format!("\"{{runs:{id}}}\": there is no [[run]] \"{id}\"{hint}")
        })?;
        counted += &run.vary.as_ref().map_or(1, |vary| vary.limited(members)).to_string();
        counted += rest;
    }
    Ok((counted != text).then_some(counted))
}

impl Study {
    /// Reads a study and its files of values.
    ///
    /// # Errors
    /// If a file cannot be read, is no TOML, or names what is not there.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, None)
    }

    /// Reads a study with at most so many members of each run, and its files of values. `{runs:ID}` in its texts becomes the
    /// number of runs that there are of ID.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_with(path: &Path, members: Option<u32>) -> Result<Self, Error> {
        let source = Source::load(path)?;
        let fault = |(span, message): template::Fault| source.error(&span, message);
        let mut study: Self = source.read_with(|mut table| {
            template::expand(table.get_mut()).map_err(fault)?;
            let Self { runs, .. } = source.take(table.clone())?;
            let counted = |text: &str| counted(text, &runs, members);
            let mut values = table.get_mut().iter_mut();
            values.try_for_each(|(_, value)| template::rewrite(value, &counted)).map_err(fault)?;
            source.take(table)
        })?;
        study.source = source;
        for grid in std::mem::take(&mut study.grids) {
            let runs = grid.runs(&study)?;
            study.runs.extend(runs);
        }
        study.expand()?;
        for file in &study.value_files {
            study.values.load(&study.beside(file))?;
        }
        study.check()?;
        for vary in study.runs.iter_mut().filter_map(|run| run.vary.as_mut()) {
            vary.count = vary.limited(members);
        }
        study.learn_metrics();
        Ok(study)
    }

    /// Notes which metrics the experiments ask for. One that cannot be read is told of when it is to
    /// be run.
    fn learn_metrics(&mut self) {
        let mut known: BTreeMap<PathBuf, (Vec<String>, Vec<String>)> = BTreeMap::new();
        for index in 0..self.runs.len() {
            let path = self.beside(&self.runs[index].experiment);
            let (metrics, timings) = known.entry(path).or_insert_with_key(|path| {
                let observe = Experiment::load(path).map(|read| read.observe).unwrap_or_default();
                let timed = observe.metrics.iter().filter(|(_, measure)| measure.timing);
                let timed = timed.map(|(name, _)| name.clone()).collect();
                (Metrics::names(&observe), timed)
            });
            (self.runs[index].metrics, self.runs[index].timings) = (metrics.clone(), timings.clone());
        }
    }

    /// Puts the ids of runs in the place of patterns.
    fn expand(&mut self) -> Result<(), Error> {
        let ids: Vec<&str> = self.runs.iter().map(|run| run.id.get_ref().as_str()).collect();
        let panels = self.figures.iter_mut().flat_map(|figure| {
            let own = figure.panels.iter_mut().flat_map(|panel| {
                let lines = panel.across.iter_mut().flat_map(|across| &mut across.lines);
                lines.map(|line| &mut line.runs).chain(&mut panel.runs)
            });
            own.chain([&mut figure.runs])
        });
        for names in panels.chain(self.overviews.iter_mut().map(|overview| &mut overview.runs)) {
            *names = grid::expand(names, &ids).map_err(|name| {
                self.source.error(&name.span(), format!("no [[run]] fits \"{}\"", name.get_ref()))
            })?;
        }
        Ok(())
    }

    /// A file beside the study.
    pub fn beside(&self, file: &Path) -> PathBuf {
        self.source.path.parent().unwrap_or_else(|| Path::new(".")).join(file)
    }

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
        let mut experiment = Experiment::load(&self.beside(&run.experiment))?;
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

    /// Refuses a name that is not among `there`; `what` they are.
    fn known<'a>(
        &self,
        names: impl IntoIterator<Item = &'a Spanned<String>>,
        what: &str,
        there: impl Iterator<Item = &'a str> + Clone,
    ) -> Result<(), Error> {
        match names.into_iter().find(|name| there.clone().all(|other| other != name.get_ref())) {
            None => Ok(()),
            Some(name) => {
                let hint = names::hint(name.get_ref(), there);
                Err(self
                    .source
                    .error(&name.span(), format!("there is no {what} \"{}\"{hint}", name.get_ref())))
            }
        }
    }

    /// Everything that can be wrong without running anything.
    fn check(&self) -> Result<(), Error> {
        let ids: Vec<&str> = self.runs.iter().map(|run| run.id.get_ref().as_str()).collect();
        for (place, run) in self.runs.iter().enumerate() {
            let id = run.id.get_ref();
            let fault = |message: &str| {
                Err(self.source.error(&run.id.span(), format!("[[run]] id = \"{id}\": {message}")))
            };
            if id.is_empty() || !id.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') {
                return fault("letters, digits and - only");
            }
            if ids[..place].contains(&id.as_str()) {
                return fault("there is another run of that id");
            }
            if run.vary.as_ref().is_some_and(|vary| vary.count == 0) {
                return fault("vary.count = 0: at least 1");
            }
            self.known(&run.within, "[[within]]", self.within.iter().map(|within| within.id.as_str()))?;
            self.known(
                &run.measures,
                "[[measure]]",
                self.measures.iter().map(|measure| measure.id.as_str()),
            )?;
        }
        for within in &self.within {
            self.number(&within.bound)?;
        }
        for measure in &self.measures {
            if let Some(fault) = measure.fault() {
                let fault = format!("[[measure]] id = \"{}\": {fault}", measure.id);
                return Err(self.source.error(&(0..0), fault));
            }
        }
        let bounded = self.within.iter().map(|within| &within.signals);
        for list in bounded.chain(self.measures.iter().map(|measure| &measure.signals)) {
            self.known([list], "[signals]", self.signals.keys().map(String::as_str))?;
        }
        for figure in &self.figures {
            self.known(&figure.runs, "[[run]]", ids.iter().copied())?;
            for panel in &figure.panels {
                let through =
                    panel.across.iter().flat_map(|across| &across.lines).flat_map(|line| &line.runs);
                let named = panel.runs.iter().flatten().chain(through);
                self.known(named, "[[run]]", ids.iter().copied())?;
                let drawn = [
                    panel.signal.is_some(),
                    !panel.signals.is_empty(),
                    panel.histogram.is_some(),
                    panel.scatter.is_some(),
                    panel.across.is_some(),
                ];
                let count = drawn.iter().filter(|is| **is).count();
                if count != 1 && (count > 1 || panel.points.is_empty()) {
                    return Err(self.source.error(
                        &(0..0),
                        format!(
                            "[[figure]] id = \"{}\", panel \"{}\": exactly one of signal, signals, histogram, scatter, across, or points alone",
                            figure.id, panel.label
                        ),
                    ));
                }
                let lines = panel.bounds.iter().chain(&panel.marks).map(|line| &line.at);
                let points = panel.points.iter().flat_map(|point| [&point.x, &point.y]);
                for quantity in lines.chain(points) {
                    self.number(quantity)?;
                }
            }
        }
        for overview in &self.overviews {
            self.known(&overview.runs, "[[run]]", ids.iter().copied())?;
        }
        for quantity in self.tables.iter().flat_map(|table| &table.rows).filter_map(|row| row.paper.as_ref())
        {
            self.number(quantity)?;
        }
        Ok(())
    }
}
