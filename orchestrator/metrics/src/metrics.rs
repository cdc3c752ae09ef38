//! The metrics that an experiment asks for. They are computed during the run, and written to
//! `metrics.json`.

use crate::guarantee::{GuaranteeRecord, GuaranteeSignals, wrong_delay};
use crate::measure::{self, Gauge};
use cosim::error::Error;
use cosim::experiment::{self, Guarantee, Margins, Observe};
use cosim::pacing::RealTime;
use cosim::run::{Observer, Sample};
use cosim::signal::{Resolved, Signal, common_unit};
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Value of a metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// An integer number, such as a count.
    Count(u64),
    /// A real number in the unit of the metric.
    Number(f64),
    /// A truth value, for yes or no.
    Flag(bool),
    /// A text, such as the item of an enumeration.
    Text(String),
}

impl Value {
    /// Returns the value as a number, with 1 and 0 for yes and no; `None` if it is a text.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Number(number) => Some(*number),
            Self::Flag(is) => Some(f64::from(u8::from(*is))),
            Self::Text(_) => None,
        }
    }
}

/// The metrics of a run. A metric is `None` (null) if the FMUs lack a variable that it needs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Metrics that the experiment asks for, and those of the guarantee, by name.
    #[serde(flatten)]
    pub asked: BTreeMap<String, Option<Value>>,
    /// Simulated time divided by elapsed time.
    pub real_time_factor: Option<f64>,
    /// Elapsed wall-clock time, s.
    pub wall_s: f64,
    /// Largest delay of a feedback loop in addition to the delays inside the FMUs, s; null if there
    /// is no loop.
    pub loop_delay_s: Option<f64>,
    /// Number of communication points that the run reached.
    pub samples: u64,
    /// Whether the run reached its end and did not miss its goal. A loss ends a single run, but
    /// not the runs of a study.
    pub completed: bool,
    /// First time at which the run was lost, s; null if it never was, or if the experiment does not
    /// say when it is.
    pub lost_at: Option<f64>,
    /// Mean computing time of each component per step of its own, µs, if it was measured.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub step_us: BTreeMap<String, f64>,
    /// Timing of the run against the wall clock, if it was paced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_time: Option<RealTime>,
    /// Units of those metrics that have one, by name.
    #[serde(skip)]
    pub units: BTreeMap<String, String>,
}

/// Names of the metrics that every run has.
const ALWAYS: [&str; 6] =
    ["real_time_factor", "wall_s", "loop_delay_s", "samples", "completed", "lost_at"];

/// Metrics that depend on the machine, or are texts.
const NOT_RECORDED: [&str; 4] =
    ["real_time_factor", "wall_s", "guarantee_status", "guarantee_unfounded"];

/// Further names in `metrics.json`, which hold more than one number.
const GROUPS: [&str; 2] = ["step_us", "real_time"];

impl Metrics {
    /// Returns the names of the metrics that runs of an experiment have.
    pub fn names(observe: &Observe) -> Vec<String> {
        let guarantee = observe.guarantee.iter().flat_map(guarantee_names);
        let margins = observe.margins.iter().flat_map(|_| margin_names());
        ALWAYS
            .map(String::from)
            .into_iter()
            .chain(observe.metrics.keys().cloned())
            .chain(guarantee)
            .chain(margins)
            .collect()
    }

    /// Returns the names of the metrics that are numbers, and depend on the experiment alone and
    /// not on the machine.
    pub fn reproducible_names(observe: &Observe) -> Vec<String> {
        let mut names = Self::names(observe);
        names.retain(|name| !NOT_RECORDED.contains(&name.as_str()));
        names
    }

    /// Returns a metric as a number, with 1 and 0 for yes and no; `None` if it has no value or is a
    /// text.
    pub fn number(&self, name: &str) -> Option<f64> {
        match name {
            "real_time_factor" => self.real_time_factor,
            "wall_s" => Some(self.wall_s),
            "loop_delay_s" => self.loop_delay_s,
            "samples" => Some(self.samples as f64),
            "completed" => Some(f64::from(u8::from(self.completed))),
            "lost_at" => self.lost_at,
            _ => self.asked.get(name)?.as_ref()?.number(),
        }
    }

    /// Returns the metrics without computing times, which differ from run to run.
    #[must_use]
    pub fn without_times(&self, observe: &Observe) -> Self {
        let mut metrics = Self { step_us: BTreeMap::new(), ..self.clone() };
        metrics
            .asked
            .retain(|name, _| observe.metrics.get(name).is_none_or(|measure| !measure.timing));
        metrics
    }

    /// Returns a metric as a text; `None` if it is not a text.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.asked.get(name)?.as_ref()? {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// Returns the names of the metrics of a loop's stability margins.
fn margin_names() -> impl Iterator<Item = String> {
    Margins::NAMES.iter().map(|(name, _)| (*name).to_string())
}

/// Returns the names of the metrics of a guarantee.
fn guarantee_names(guarantee: &Guarantee) -> Vec<String> {
    let margins = guarantee.margins.keys().map(|name| margin(name));
    let broken = guarantee.keeps.iter().map(|_| "broken".into());
    let unfounded = guarantee.assumes.iter().flat_map(|_| ["unfounded", "unfounded_at"]);
    let names = ["share", "lost_at", "status"].into_iter().chain(unfounded).map(String::from);
    let late = guarantee.late.iter().map(|_| "late_at".into());
    let names = names.chain(margins).chain(broken).chain(late);
    names.map(|name| format!("guarantee_{name}")).collect()
}

fn margin(name: &str) -> String {
    format!("{name}_margin_min")
}

/// An observer that computes the metrics of a run.
pub struct Meters {
    gauges: BTreeMap<String, Option<Gauge>>,
    /// Guarantee that the experiment names, if any, and its record, if the FMUs have its
    /// variables.
    guarantee: (Option<Guarantee>, Option<GuaranteeRecord>),
    loss: Option<Loss>,
    goal: Option<Loss>,
    /// Communication point at which the run stops because its user asks for it, so that its goal
    /// may be far.
    cut_off: Option<u64>,
    samples: u64,
    completed: bool,
}

/// Bound beyond which a run counts as lost, or its goal as missed.
struct Loss {
    what: String,
    /// Names of the list of signals and of the section that gives the bound.
    list: String,
    section: String,
    signals: Vec<Resolved>,
    beyond: f64,
    ends_run: bool,
    /// First time at which the bound was exceeded, s.
    at: Option<f64>,
    /// Values of the last sample.
    before: Vec<f64>,
    /// How far what is controlled has moved away from its reference, in the unit of the signals.
    away: f64,
}

/// Part of the bound by which a motion must have led away from the reference for a loss.
const MOTION: f64 = 0.5;

impl Loss {
    /// Creates the bound of a section of the experiment; `None` if it has none, or if an FMU that
    /// was exchanged lacks the signals.
    fn new(
        section: &str,
        verb: &str,
        observe: &Observe,
        asked: Option<&experiment::Loss>,
        system: &mut System,
    ) -> Result<Option<Self>, Error> {
        let section = format!("[observe.{section}]");
        let fault = |problem| Error::experiment(format!("{section} {problem}"));
        let Some(experiment::Loss { what, signals: list, beyond }) = asked else { return Ok(None) };
        let (list, beyond) = (list.clone(), *beyond);
        if beyond.is_nan() || beyond <= 0.0 {
            return Err(fault(format!("beyond = {beyond}, but it must be above 0")));
        }
        let signals = observe.list(&list).map_err(fault)?;
        if system.lost_by_exchange(signals.iter().flat_map(Signal::paths)) {
            return Ok(None);
        }
        let signals = signals.iter().map(|signal| system.resolve(signal));
        let signals: Vec<_> = signals.collect::<Result<_, _>>().map_err(fault)?;
        common_unit(&signals).map_err(fault)?;
        let what = format!("{what} {verb}");
        let (ends_run, at, before, away) = (false, None, Vec::new(), 0.0);
        Ok(Some(Self { what, list, section, signals, beyond, ends_run, at, before, away }))
    }

    fn reset(&mut self) {
        (self.at, self.away) = (None, 0.0);
        self.before.clear();
    }

    /// Returns the norm of the signals in a sample.
    fn norm(&self, sample: &Sample) -> f64 {
        let squares = self.signals.iter().map(|signal| signal.value(sample.values).powi(2));
        squares.sum::<f64>().sqrt()
    }

    /// Notes the first time at which something is lost: the bound is exceeded, and not only because
    /// a command, or the start, is far. Of differences, the first variables must have moved away.
    fn observe_motion(&mut self, sample: &Sample) -> Result<(), Error> {
        let (norm, values) = (self.norm(sample), sample.values);
        let differs = self.signals.iter().all(|signal| signal.moved(values, values).is_some());
        if differs && !self.before.is_empty() && norm > 0.0 {
            let moved = self.signals.iter().map(|signal| {
                signal.moved(&self.before, values).unwrap_or(0.0) * signal.value(values)
            });
            self.away = (self.away + moved.sum::<f64>() / norm).max(0.0);
        }
        self.before.clear();
        self.before.extend_from_slice(values);
        // What is not a number is lost as well.
        if differs && self.away < MOTION * self.beyond && !norm.is_nan() {
            return Ok(());
        }
        self.observe(sample)
    }

    /// Notes the first time at which the bound is exceeded.
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        // A norm that is not a number also exceeds it.
        if self.at.is_some() || self.norm(sample) <= self.beyond {
            return Ok(());
        }
        self.at = Some(sample.time);
        if !self.ends_run {
            return Ok(());
        }
        let unit = self.signals.first().map_or("", |signal| &signal.unit);
        let Self { list, section, beyond, .. } = self;
        let reason = format!("the norm of \"{list}\" exceeds {beyond} {unit} ({section})");
        Err(Error::Lost { what: self.what.clone(), time: sample.time, reason })
    }
}

impl Meters {
    /// Creates the meters that the experiment of a system asks for.
    ///
    /// # Errors
    /// Returns an error if the experiment names a variable that does not exist.
    pub fn new(system: &mut System) -> Result<Self, Error> {
        let observe = system.experiment.observe.clone();
        if let Some(fault) = observe.fault() {
            return Err(Error::experiment(fault));
        }
        let mut taken: Vec<String> =
            ALWAYS.iter().chain(&GROUPS).map(ToString::to_string).collect();
        taken.extend(observe.guarantee.iter().flat_map(guarantee_names));
        taken.extend(observe.margins.iter().flat_map(|_| margin_names()));
        let mut gauges = BTreeMap::new();
        for (name, measure) in &observe.metrics {
            let fault = |problem| Error::experiment(format!("[observe.metrics.{name}] {problem}"));
            if taken.contains(name) {
                return Err(fault(
                    "metrics.json already has an entry of this name: choose another one".into(),
                ));
            }
            gauges.insert(
                name.clone(),
                measure::gauge_for(measure, &observe, system).map_err(fault)?,
            );
        }
        let fault = |problem| Error::experiment(format!("[observe.guarantee] {problem}"));
        let guarantee = observe.guarantee.clone();
        let signals =
            guarantee.as_ref().map(|asked| GuaranteeSignals::find(asked, system)).transpose();
        let record = signals.map_err(fault)?.flatten().map(GuaranteeRecord::new);
        let loss = Loss::new("loss", "lost", &observe, observe.loss.as_ref(), system)?;
        let goal = Loss::new("goal", "missed", &observe, observe.goal.as_ref(), system)?;
        let cut_off = system.experiment.given.stop.map(|_| system.clock.ticks());
        let guarantee = (guarantee, record);
        let mut meters =
            Self { gauges, guarantee, loss, goal, cut_off, samples: 0, completed: false };
        meters.reset(system, &[]);
        Ok(meters)
    }

    /// Makes the run end when it is lost, and fail when it has missed its goal.
    #[must_use]
    pub fn ending_when_lost(mut self) -> Self {
        for bound in self.loss.iter_mut().chain(&mut self.goal) {
            bound.ends_run = true;
        }
        self
    }

    /// Forgets all samples, so that another run of the system can be measured, with these changes of
    /// its settings.
    pub fn reset(&mut self, system: &System, changes: &[(Target, SettingValue)]) {
        self.gauges.values_mut().flatten().for_each(Gauge::reset);
        if let (Some(asked), Some(record)) = &mut self.guarantee {
            record.reset();
            record.wrong_delay = wrong_delay(asked, system, changes);
        }
        for bound in self.loss.iter_mut().chain(&mut self.goal) {
            bound.reset();
        }
        (self.samples, self.completed) = (0, false);
    }

    /// Returns the number of communication points seen.
    pub fn seen(&self) -> u64 {
        self.samples
    }

    /// Returns the metrics of the communication points seen so far. Metrics that the observer
    /// cannot know are left out.
    pub fn metrics(&self) -> Metrics {
        let value = |gauge: &Gauge| {
            let value = gauge.value()?;
            Some(if gauge.counts() && value >= 0.0 {
                Value::Count(value as u64)
            } else {
                Value::Number(value)
            })
        };
        let gauges = self.gauges.iter();
        let mut asked: BTreeMap<_, _> =
            gauges.map(|(name, gauge)| (name.clone(), gauge.as_ref().and_then(value))).collect();
        if let (Some(guarantee), record) = &self.guarantee {
            asked.extend(guarantee_names(guarantee).into_iter().map(|name| (name, None)));
            if let Some(record) = record {
                let mut set = |name: &str, value: Option<Value>| {
                    asked.insert(format!("guarantee_{name}"), value);
                };
                set("share", record.share().map(Value::Number));
                set("lost_at", record.lost.map(|loss| Value::Number(loss.time)));
                set("status", record.status().map(|status| Value::Text(record.name_of(status))));
                for ((name, _), least) in record.signals.margins.iter().zip(&record.margins) {
                    set(&margin(name), least.map(Value::Number));
                }
                if !record.signals.keeps.is_empty() {
                    set("broken", Some(Value::Flag(record.broken)));
                }
                set("late_at", record.late.map(Value::Number));
                if let Some((time, what)) = &record.unfounded {
                    set("unfounded", Some(Value::Text(what.clone())));
                    set("unfounded_at", Some(Value::Number(*time)));
                }
            }
        }
        let units =
            self.gauges.iter().filter_map(|(name, gauge)| Some((name, gauge.as_ref()?.unit())));
        Metrics {
            asked,
            samples: self.samples,
            completed: self.completed,
            lost_at: self.loss.as_ref().and_then(|loss| loss.at),
            units: units.map(|(name, unit)| (name.clone(), unit.to_string())).collect(),
            ..Metrics::default()
        }
    }
}

impl Observer for Meters {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        for gauge in self.gauges.values_mut().flatten() {
            gauge.observe(sample)?;
        }
        if let Some(record) = &mut self.guarantee.1 {
            record.observe(sample)?;
        }
        self.samples += 1;
        self.completed |= sample.last;
        let is_end = sample.last && self.cut_off != Some(sample.tick);
        if let Some(goal) = self.goal.as_mut().filter(|_| is_end) {
            let outcome = goal.observe(sample);
            self.completed &= goal.at.is_none();
            outcome?;
        }
        self.loss.as_mut().map_or(Ok(()), |loss| loss.observe_motion(sample))
    }
}

#[cfg(test)]
mod tests;
