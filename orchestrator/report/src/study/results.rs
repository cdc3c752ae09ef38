//! Results of a study's runs, and the references of the form `run.metric` to them.

use super::definition::Study;
use super::outcome::{Member, Outcome, Series, Spread};
use super::runs::Run;
use super::values::Quantity;
use crate::metrics::Metrics;
use cosim::signal::Signal;
use cosim::system::Parameters;
use fmu_import::names;
use std::collections::BTreeMap;

/// Results of one run of the study.
#[derive(Clone, Debug, Default)]
pub struct RunResult {
    /// Results of the members, one for each value of the parameter, in that order.
    pub members: Vec<Member>,
    /// Signals of the first member.
    pub series: Series,
    /// Parameters of all components in the first member.
    pub parameters: Parameters,
    /// Bands of signals over all members, one for each signal that is drawn as a band.
    pub spread: BTreeMap<Signal, Spread>,
}

impl RunResult {
    /// Adds the results of the next part.
    pub fn push(&mut self, part: Outcome) {
        self.members.extend(part.members);
        if let Some(series) = part.series {
            self.series = series;
            self.parameters = part.parameters;
        }
        for (signal, spread) in part.spread {
            match self.spread.get_mut(&signal) {
                Some(band) => band.widen(&spread.low, &spread.high),
                None => {
                    self.spread.insert(signal, spread);
                }
            }
        }
    }
}

/// A metric, which is a number for each member of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Metric {
    /// A metric by its name in `metrics.json`, with 1 or 0 for yes or no.
    Defined {
        /// Name of the metric in `metrics.json`.
        name: String,
        /// Whether the metric is a computing time.
        timing: bool,
    },
    /// Mean time spent in a component per step, µs, written as `step_us.COMPONENT`.
    StepTime(String),
    /// Parameters of a component, in SI units, written as `parameter.COMPONENT.NAME`; a `*` at the
    /// end stands for several parameters.
    Parameter(String, String),
    /// Share of samples within a bound, written as `within.ID.share`.
    Share(String),
    /// Largest magnitude of a signal, written as `within.ID.largest`.
    Largest(String),
    /// Largest magnitude as a multiple of the bound, written as `within.ID.ratio`.
    Ratio(String),
    /// A number that the study defines, written as `measure.ID`.
    Measure(String),
}

impl Metric {
    /// Parses the name of a metric of a run.
    ///
    /// # Errors
    /// Returns an error if there is no such metric.
    pub(super) fn parse(text: &str, run: &Run) -> Result<Self, String> {
        if let Some((id, what)) =
            text.strip_prefix("within.").and_then(|rest| rest.rsplit_once('.'))
        {
            let ids: Vec<&str> =
                run.within.iter().map(|within| within.get_ref().as_str()).collect();
            if !ids.contains(&id) {
                let hint = names::hint(id, ids.iter().copied());
                return Err(format!(
                    "the run \"{}\" has no within \"{id}\"{hint}",
                    run.id.get_ref()
                ));
            }
            return match what {
                "share" => Ok(Self::Share(id.into())),
                "largest" => Ok(Self::Largest(id.into())),
                "ratio" => Ok(Self::Ratio(id.into())),
                _ => {
                    Err(format!("\"{text}\": within.{id} has the metrics share, largest and ratio"))
                }
            };
        }
        if let Some(id) = text.strip_prefix("measure.") {
            let ids: Vec<&str> =
                run.measures.iter().map(|measure| measure.get_ref().as_str()).collect();
            if ids.contains(&id) {
                return Ok(Self::Measure(id.into()));
            }
            let hint = names::hint(id, ids.iter().copied());
            return Err(format!("the run \"{}\" has no measure \"{id}\"{hint}", run.id.get_ref()));
        }
        if let Some((component, name)) = text.strip_prefix("parameter.").and_then(names::split) {
            return Ok(Self::Parameter(component.into(), name.into()));
        }
        if let Some(component) = text.strip_prefix("step_us.") {
            return if run.timed {
                Ok(Self::StepTime(component.into()))
            } else {
                Err(format!("\"{text}\": the run \"{}\" is not timed", run.id.get_ref()))
            };
        }
        let metrics = Metrics::names(&run.observe);
        let names: Vec<&str> = metrics.iter().map(String::as_str).collect();
        if names.contains(&text) {
            return Ok(Self::Defined {
                name: text.into(),
                timing: run.observe.metrics.get(text).is_some_and(|measure| measure.timing),
            });
        }
        Err(format!("there is no metric \"{text}\"{}", names::hint(text, names.iter().copied())))
    }

    /// Returns whether the metric is a computing time, which differs from run to run and is taken
    /// from the first member only.
    fn is_time(&self) -> bool {
        match self {
            Self::Defined { timing, .. } => *timing,
            Self::StepTime(_) => true,
            _ => false,
        }
    }

    fn value_for(&self, member: &Member) -> Option<f64> {
        let within = |id: &String| member.within.get(id);
        match self {
            Self::Defined { name, .. } => member.metrics.number(name),
            // Parameters belong to the run, not to its members.
            Self::Parameter(..) => None,
            Self::StepTime(component) => member.metrics.step_us.get(component).copied(),
            Self::Share(id) => within(id).map(|w| w.inside as f64 / w.samples as f64),
            Self::Largest(id) => within(id).map(|w| w.largest),
            Self::Ratio(id) => within(id).map(|w| w.ratio),
            Self::Measure(id) => member.measures.get(id).copied().flatten(),
        }
    }
}

/// Numbers of the members of a run, or a single number.
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
pub(super) fn resolve(study: &Study, reference: &str) -> Result<(usize, Metric), String> {
    let (id, metric) = names::split(reference)
        .ok_or_else(|| format!("\"{reference}\" does not have the form run.metric"))?;
    let place = study.runs.iter().position(|run| run.id.get_ref() == id).ok_or_else(|| {
        let hint = names::hint(id, study.runs.iter().map(|run| run.id.get_ref().as_str()));
        format!("\"{reference}\": there is no run \"{id}\"{hint}")
    })?;
    Ok((place, Metric::parse(metric, &study.runs[place])?))
}

/// Returns whether a quantity refers to `run.metric` rather than to a value.
pub(super) fn is_reference(study: &Study, quantity: &Quantity) -> bool {
    match quantity {
        Quantity::Number(_) => false,
        Quantity::Named(name) => {
            study.values.find(name).is_none()
                && names::split(name).is_some_and(|(id, _)| study.run(id).is_some())
        }
    }
}

impl Results<'_> {
    /// Returns the results of the run with this id.
    pub fn run(&self, id: &str) -> Option<&RunResult> {
        self.study.runs.iter().position(|run| run.id.get_ref() == id).map(|place| &self.runs[place])
    }

    /// Returns the numbers that `run.metric` refers to. There are none if the run has no such
    /// quantity.
    ///
    /// # Errors
    /// Returns an error if there is no such run or metric.
    pub fn numbers(&self, reference: &str) -> Result<Numbers, String> {
        Ok(Numbers(self.member_numbers(reference)?.into_iter().flatten().collect()))
    }

    /// Returns the number of each member that `run.metric` refers to. It is `None` if a member has
    /// no such quantity, for example a settling time if the error did not settle.
    ///
    /// # Errors
    /// Returns an error if there is no such run or metric.
    pub fn member_numbers(&self, reference: &str) -> Result<Vec<Option<f64>>, String> {
        let (place, metric) = resolve(self.study, reference)?;
        let RunResult { members, parameters, .. } = &self.runs[place];
        if let Metric::Parameter(component, pattern) = &metric {
            let of_component = parameters.get(component).into_iter().flatten();
            let fitting = of_component.filter(|(name, _)| names::matches(pattern, name));
            let numbers: Vec<_> =
                fitting.filter_map(|(_, value)| value.as_f64()).map(Some).collect();
            let names =
                parameters.get(component).into_iter().flatten().map(|(name, _)| name.as_str());
            return if numbers.is_empty() {
                Err(format!(
                    "\"{reference}\": there is no such parameter{}",
                    names::hint(pattern, names)
                ))
            } else {
                Ok(numbers)
            };
        }
        let counted = if metric.is_time() { &members[..members.len().min(1)] } else { members };
        Ok(counted.iter().map(|member| metric.value_for(member)).collect())
    }

    /// Returns the number of each member that a reference stands for, or the single number of a
    /// value.
    ///
    /// # Errors
    /// Returns an error if the quantity refers to something that does not exist.
    pub fn quantity(&self, quantity: &Quantity) -> Result<Vec<Option<f64>>, String> {
        match quantity {
            Quantity::Named(name) if is_reference(self.study, quantity) => {
                self.member_numbers(name)
            }
            _ => self.study.values.number(quantity).map(|number| vec![Some(number)]),
        }
    }
}
