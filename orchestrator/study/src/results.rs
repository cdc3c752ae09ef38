//! Results of a study's runs, and the references of the form `run.metric` to them.

use crate::curves::{Curves, Series, Spread, widen};
use crate::definition::Study;
use crate::runs::Run;
use crate::values::Quantity;
use cosim::signal::Signal;
use cosim::system::Parameters;
use cosim_metrics::metrics::Metrics;
use fmi_master::names;
use std::collections::BTreeMap;
use sweep::parts::PartResult;
use sweep::table::CaseTable;

/// Column of the messages of cases that an instance refused.
pub(crate) const FAILED: &str = "failed";

/// Results of one run of the study.
#[derive(Clone, Debug, Default)]
pub struct RunResult {
    /// Tables of the run's parts in order, with a row for each case.
    pub parts: Vec<CaseTable>,
    /// Signals of the first case.
    pub series: Series,
    /// Parameters of all components in the first case.
    pub parameters: Parameters,
    /// Bands of signals over all cases, one for each signal that is drawn as a band.
    pub spread: BTreeMap<Signal, Spread>,
}

impl RunResult {
    /// Adds the results of the next part.
    ///
    /// # Errors
    /// Returns an error if the curves are not what this program writes.
    pub(crate) fn push(&mut self, part: PartResult) -> serde_json::Result<()> {
        let Curves { series, parameters, spread } = serde_json::from_str(&part.curves)?;
        self.parts.push(part.rows);
        if let Some(series) = series {
            (self.series, self.parameters) = (series, parameters);
        }
        widen(&mut self.spread, spread);
        Ok(())
    }

    /// Returns the number of cases.
    pub fn cases(&self) -> usize {
        self.parts.iter().map(CaseTable::rows).sum()
    }

    /// Returns why cases failed, in order.
    pub(crate) fn failures(&self) -> Vec<&String> {
        let told = self.parts.iter().flat_map(|part| part.texts(FAILED));
        told.filter(|message| !message.is_empty()).collect()
    }

    /// Returns the column with this name: the number of each case, or `None` where it is missing.
    pub fn column(&self, name: &str) -> Vec<Option<f64>> {
        let of_part = |part: &CaseTable| {
            let column = part.column(name);
            let number = |row| column.and_then(|values| values.number(row));
            (0..part.rows()).map(number).collect::<Vec<_>>()
        };
        self.parts.iter().flat_map(of_part).collect()
    }

    /// Returns the value of a metric for each case, or all parameters that it names.
    pub(crate) fn numbers(&self, metric: &Metric) -> Vec<Option<f64>> {
        match metric {
            Metric::Parameter(component, pattern) => {
                let parameters = self.parameters.get(component).into_iter().flatten();
                let fitting = parameters.filter(|(name, _)| names::matches(pattern, name));
                fitting.filter_map(|(_, value)| value.as_f64()).map(Some).collect()
            }
            Metric::Column { name, is_time } => {
                let mut numbers = self.column(name);
                if *is_time {
                    numbers.truncate(1);
                }
                numbers
            }
        }
    }
}

/// A metric, which is a number for each case of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Metric {
    /// A column of the run's table.
    Column {
        /// Name of the column.
        name: String,
        /// Whether it is a computing time, which differs from run to run and is taken from the
        /// first case only.
        is_time: bool,
    },
    /// Parameters of a component, in SI units, written as `parameter.COMPONENT.NAME`; a `*` at the
    /// end matches several parameters.
    Parameter(String, String),
}

impl Metric {
    /// Parses the name of a metric of a run: a key of `metrics.json`, `step_us.COMPONENT`,
    /// `parameter.COMPONENT.NAME`, `measure.ID`, or `within.ID` with `share`, `largest` or `ratio`.
    ///
    /// # Errors
    /// Returns an error if there is no such metric.
    pub(crate) fn parse(text: &str, run: &Run) -> Result<Self, String> {
        if let Some((component, name)) = text.strip_prefix("parameter.").and_then(names::split) {
            return Ok(Self::Parameter(component.into(), name.into()));
        }
        let column = |is_time| Ok(Self::Column { name: text.to_string(), is_time });
        if text.starts_with("step_us.") && run.timed {
            return column(true);
        }
        let measured = run.measures.iter().map(|id| format!("measure.{}", id.get_ref()));
        let within = run.within.iter().flat_map(|id| {
            ["share", "largest", "ratio"].map(|what| format!("within.{}.{what}", id.get_ref()))
        });
        let metrics = Metrics::reproducible_names(&run.observe);
        let metrics: Vec<String> = metrics.into_iter().chain(measured).chain(within).collect();
        if metrics.iter().any(|name| name == text) {
            return column(run.observe.metrics.get(text).is_some_and(|measure| measure.timing));
        }
        let hint = names::hint(text, metrics.iter().map(String::as_str));
        Err(format!("the run \"{}\" has no metric \"{text}\"{hint}", run.id.get_ref()))
    }
}

/// Numbers of the cases of a run, or a single number.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers(pub Vec<f64>);

impl Numbers {
    /// Returns the arithmetic mean, which is not a number if there are no numbers.
    pub fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }

    /// Returns the smallest and the largest of the numbers.
    pub fn extent(&self) -> (f64, f64) {
        self.0
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
    }

    /// Returns whether there are several numbers that differ.
    pub fn vary(&self) -> bool {
        self.0.iter().any(|value| *value != self.0[0])
    }
}

/// Results of all runs, in the order of the study.
pub struct Results<'a> {
    /// The study that was run.
    pub study: &'a Study,
    /// Results of each run of the study.
    pub runs: Vec<RunResult>,
}

/// Finds the run and the metric that `run.metric` refers to.
///
/// # Errors
/// Returns an error that names the missing run or metric.
pub(crate) fn resolve(study: &Study, reference: &str) -> Result<(usize, Metric), String> {
    let (id, metric) = names::split(reference)
        .ok_or_else(|| format!("\"{reference}\" does not have the form run.metric"))?;
    let place = study.runs.iter().position(|run| run.id.get_ref() == id).ok_or_else(|| {
        let hint = names::hint(id, study.runs.iter().map(|run| run.id.get_ref().as_str()));
        format!("\"{reference}\": there is no run \"{id}\"{hint}")
    })?;
    Ok((place, Metric::parse(metric, &study.runs[place])?))
}

/// Returns whether a quantity refers to `run.metric` rather than to a value.
pub(crate) fn is_reference(study: &Study, quantity: &Quantity) -> bool {
    match quantity {
        Quantity::Number(_) => false,
        Quantity::Named(name) => {
            study.values.find(name).is_none()
                && names::split(name).is_some_and(|(id, _)| study.run(id).is_some())
        }
    }
}

impl<'a> Results<'a> {
    /// Returns results in which no run has been flown, to check references to them.
    pub fn empty(study: &'a Study) -> Self {
        Self { study, runs: vec![RunResult::default(); study.runs.len()] }
    }

    /// Returns all runs with their results.
    pub fn pairs(&self) -> impl Iterator<Item = (&'a Run, &RunResult)> {
        self.study.runs.iter().zip(&self.runs)
    }

    /// Returns the results of the run with this id.
    pub fn run(&self, id: &str) -> Option<&RunResult> {
        self.pairs().find(|(run, _)| run.id.get_ref() == id).map(|(_, result)| result)
    }

    /// Says which runs have cases that failed, with the first message of each; nothing if none
    /// failed.
    pub(crate) fn failures(&self) -> Option<String> {
        let told = self.pairs().filter_map(|(run, result)| {
            let failures = result.failures();
            let (id, count) = (run.id.get_ref(), result.cases());
            let first = failures.first()?;
            Some(format!("{id}: {} of {count} cases failed: {first}", failures.len()))
        });
        Some(told.collect::<Vec<_>>().join("; ")).filter(|told| !told.is_empty())
    }

    /// Returns the numbers that `run.metric` refers to. There are none if the run has no such
    /// quantity.
    ///
    /// # Errors
    /// Returns an error if there is no such run or metric.
    pub fn numbers(&self, reference: &str) -> Result<Numbers, String> {
        Ok(Numbers(self.case_numbers(reference)?.into_iter().flatten().collect()))
    }

    /// Returns the number of each case that `run.metric` refers to. It is `None` if a case has
    /// no such quantity, for example a settling time if the error did not settle.
    ///
    /// # Errors
    /// Returns an error if there is no such run or metric.
    pub fn case_numbers(&self, reference: &str) -> Result<Vec<Option<f64>>, String> {
        let (place, metric) = resolve(self.study, reference)?;
        let result = &self.runs[place];
        let numbers = result.numbers(&metric);
        match &metric {
            // Before its first case the parameters of a run are not known.
            Metric::Parameter(component, pattern)
                if numbers.is_empty() && !result.parameters.is_empty() =>
            {
                let parameters = result.parameters.get(component).into_iter().flatten();
                let hint = names::hint(pattern, parameters.map(|(name, _)| name.as_str()));
                Err(format!("\"{reference}\": there is no such parameter{hint}"))
            }
            _ => Ok(numbers),
        }
    }

    /// Returns the number of each case that a reference denotes, or the single number of a value.
    ///
    /// # Errors
    /// Returns an error if the quantity refers to something that does not exist.
    pub fn quantity(&self, quantity: &Quantity) -> Result<Vec<Option<f64>>, String> {
        match quantity {
            Quantity::Named(name) if is_reference(self.study, quantity) => self.case_numbers(name),
            _ => self.study.values.number(quantity).map(|number| vec![Some(number)]),
        }
    }
}
