//! One part of the work of a study: a run for some values of its parameter, from reading the
//! experiment to its stored results.

use super::definition::Study;
use super::outcome::{Compared, Member, MemberResult, Outcome, REPETITIONS, Series, Spread};
use super::runs::Run;
use crate::error::Error;
use crate::measure::{Gauge, larger};
use crate::metrics::{Meters, Metrics};
use cosim::check::check;
use cosim::error::Error as Single;
use cosim::experiment::Experiment;
use cosim::interrupt::Interrupt;
use cosim::master::{Observer, Sample};
use cosim::signal::{Resolved, Signal};
use cosim::system::Parameters;
use cosim::system::{Opened, System};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;
use toml::Value;

/// A part of a study's work: the members `range` of a run, counted from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Position of the run in the study.
    pub run: usize,
    /// Members of the run that belong to this part.
    pub range: Range<u32>,
}

/// Tolerance with which bounds count as met, because of rounding.
const ROUNDING: f64 = 1e-9;

/// Signals that the figures of a study need from a run.
#[derive(Clone, Debug, Default)]
pub(super) struct DrawnSignals {
    /// Signals that are drawn as lines.
    pub series: BTreeSet<Signal>,
    /// Signals that are drawn as bands.
    pub spread: BTreeSet<Signal>,
}

impl DrawnSignals {
    /// Collects the signals of a run that the study's figures draw.
    pub(super) fn collect(study: &Study, run: &Run) -> Self {
        let mut signals = Self::default();
        for figure in &study.figures {
            for panel in &figure.panels {
                if !study.runs_of(figure, panel).any(|drawn| drawn.id == run.id) {
                    continue;
                }
                let drawn =
                    panel.signal.iter().chain(panel.signals.iter().map(|curve| &curve.signal));
                let drawn: Vec<Signal> = drawn.cloned().collect();
                if panel.spread {
                    signals.spread.extend(drawn.iter().cloned());
                }
                signals.series.extend(drawn);
                signals.series.extend(panel.reference.clone());
            }
        }
        signals
    }
}

/// A run of a study that has been prepared, so that it can be made for any value of its parameter.
pub(super) struct Preparation<'a> {
    study: &'a Study,
    run: &'a Run,
    /// Signals of the run that the figures draw.
    pub drawn: DrawnSignals,
    /// The experiment, read once so that all members use the same text.
    experiment: Experiment,
    fmu_dirs: &'a [PathBuf],
}

impl<'a> Preparation<'a> {
    /// Collects the signals that are drawn of a run, and reads its experiment.
    ///
    /// # Errors
    /// Returns an error if the experiment cannot be read, or lacks what the run changes in it.
    pub(super) fn new(
        study: &'a Study,
        run: &'a Run,
        fmu_dirs: &'a [PathBuf],
    ) -> Result<Self, Error> {
        let drawn = DrawnSignals::collect(study, run);
        let experiment = study
            .experiment(run)
            .map_err(|source| Error::Run { run: run.id.get_ref().clone(), source })?;
        Ok(Self { study, run, drawn, experiment, fmu_dirs })
    }

    /// Checks the experiment for the member with this number, with all names resolved.
    ///
    /// # Errors
    /// Returns an error if anything is wrong with the experiment, the FMUs, or the parameter that
    /// is varied.
    pub(super) fn system(&self, member: u32, opened: &mut Opened) -> Result<System, Single> {
        let mut experiment = self.experiment.clone();
        if let Some(vary) = &self.run.vary {
            let value = Value::Integer(i64::from(vary.first) + i64::from(member));
            for parameter in vary.parameter.names() {
                experiment.set(parameter, value.clone()).map_err(|message| self.fault(&message))?;
            }
        }
        check(experiment, self.fmu_dirs, opened)
    }

    fn fault(&self, message: &str) -> Single {
        let id = &self.run.id;
        self.study.source.error(&id.span(), format!("[[run]] {}: {message}", id.get_ref()))
    }

    fn resolve(&self, signal: &Signal, system: &mut System) -> Result<Resolved, Single> {
        system.resolve(signal).map_err(|message| self.fault(&message))
    }

    /// Checks that everything exists that the study asks of this run.
    ///
    /// # Errors
    /// Returns an error that names the missing item.
    pub(super) fn check(&self, opened: &mut Opened) -> Result<(), Error> {
        let mut system = self.system(0, opened).map_err(|source| self.failed(source))?;
        let bounded = self.study.bounds_of(self.run).flat_map(|(_, signals)| signals);
        let measured = self.study.measures_of(self.run).flat_map(|(_, signals)| signals);
        let mut signals = self.drawn.series.iter().chain(bounded).chain(measured);
        signals.try_for_each(|signal| self.resolve(signal, &mut system).map(drop))?;
        Meters::new(&mut system).map(drop).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: Single) -> Error {
        Error::Run { run: self.run.id.get_ref().clone(), source }
    }

    /// Runs the members with these numbers.
    ///
    /// # Errors
    /// Returns an error if an FMU fails, or if the run was asked to end.
    pub(super) fn execute(
        &self,
        range: Range<u32>,
        opened: &mut Opened,
        interrupt: &Interrupt,
    ) -> Result<Outcome, Single> {
        let mut outcome = Outcome::default();
        for number in range {
            let mut result = self.fly(number, opened, interrupt)?;
            // Computing times are only meaningful if the run has the machine for itself, and what
            // interrupts a run can only lengthen them.
            for _ in 1..if self.is_timed(number) { REPETITIONS } else { 1 } {
                let again = self.fly(number, opened, interrupt)?;
                result.keep_least_times(&again, &self.experiment.observe);
            }
            for (signal, values) in &result.series.signals {
                if self.drawn.spread.contains(signal) {
                    widen(&mut outcome.spread, signal, values);
                }
            }
            outcome.members.push(result.member);
            if number == 0 {
                outcome.parameters = result.parameters;
                outcome.series = Some(result.series);
            }
        }
        Ok(outcome)
    }

    fn is_timed(&self, number: u32) -> bool {
        self.run.timed && number == 0
    }

    /// Runs one member.
    fn fly(
        &self,
        number: u32,
        opened: &mut Opened,
        interrupt: &Interrupt,
    ) -> Result<MemberResult, Single> {
        let mut system = self.system(number, opened)?;
        let mut series = Watch::new(&self.drawn.series, self, &mut system)?;
        let mut bounds = Vec::new();
        for (within, signals) in self.study.bounds_of(self.run) {
            let signals = signals.iter().map(|signal| self.resolve(signal, &mut system));
            let signals = signals.collect::<Result<_, _>>()?;
            let bound = self.study.number(&within.bound)?;
            bounds.push(Bounded { id: &within.id, signals, bound, inside: Compared::default() });
        }
        let mut gauges = Vec::new();
        for (measure, signals) in self.study.measures_of(self.run) {
            let gauge = Gauge::new(measure, signals, &mut system);
            gauges.push((measure.id.clone(), gauge.map_err(|message| self.fault(&message))?));
        }
        let mut meters = Meters::new(&mut system)?;
        let mut master = system.start(interrupt)?;
        let parameters =
            if number == 0 { system.parameters(&mut master)? } else { Parameters::default() };
        if self.is_timed(number) {
            master.measure_time();
        }
        let mut observers: Vec<&mut dyn Observer> = vec![&mut meters, &mut series];
        observers.extend(bounds.iter_mut().map(|bound| bound as &mut dyn Observer));
        observers.extend(gauges.iter_mut().map(|(_, gauge)| gauge as &mut dyn Observer));
        master.run(&mut observers)?;

        let value = self.run.vary.as_ref().map(|vary| vary.first + number.cast_signed());
        let step_us =
            master.step_seconds().map(|(name, seconds)| (name.into(), seconds * 1e6)).collect();
        let metrics = Metrics { step_us, ..meters.metrics() };
        let within = bounds.into_iter().map(|bound| (bound.id.to_string(), bound.inside)).collect();
        let measures = gauges.into_iter().map(|(id, gauge)| (id, gauge.value())).collect();
        let units = series.resolved.iter().map(|(s, r)| (s.clone(), r.unit.clone())).collect();
        let series =
            Series { time: series.time, signals: series.signals, units, samples: meters.samples() };
        Ok(MemberResult { member: Member { value, metrics, within, measures }, series, parameters })
    }
}

fn widen(spread: &mut BTreeMap<Signal, Spread>, signal: &Signal, values: &[f64]) {
    let band = spread
        .entry(signal.clone())
        .or_insert_with(|| Spread { low: values.to_vec(), high: values.to_vec() });
    band.widen(values, values);
}

impl Compared {
    fn see(&mut self, magnitude: f64, bound: f64) {
        self.samples += 1;
        self.inside += u64::from(magnitude <= bound * (1.0 + ROUNDING));
        self.largest = larger(self.largest, magnitude);
        self.ratio = self.largest / bound;
    }
}

/// A comparison of signals with a bound during the run.
struct Bounded<'a> {
    id: &'a str,
    signals: Vec<Resolved>,
    bound: f64,
    inside: Compared,
}

impl Observer for Bounded<'_> {
    fn observe(&mut self, sample: &Sample) -> Result<(), Single> {
        if sample.last && self.signals.iter().any(|signal| signal.responds) {
            return Ok(());
        }
        let magnitudes = self.signals.iter().map(|signal| signal.value(sample.values).abs());
        let largest = magnitudes.fold(0.0, larger);
        self.inside.see(largest, self.bound);
        Ok(())
    }
}

/// Approximate largest number of points of a time series.
const POINTS: u64 = 4000;

/// An observer that records signals at every n-th communication point.
struct Watch {
    stride: u64,
    resolved: Vec<(Signal, Resolved)>,
    time: Vec<f64>,
    signals: BTreeMap<Signal, Vec<f64>>,
}

impl Watch {
    fn new(
        signals: &BTreeSet<Signal>,
        preparation: &Preparation,
        system: &mut System,
    ) -> Result<Self, Single> {
        let resolved = signals
            .iter()
            .map(|signal| Ok((signal.clone(), preparation.resolve(signal, system)?)))
            .collect::<Result<Vec<_>, Single>>()?;
        let stride = system.clock.ticks().div_ceil(POINTS).max(1);
        let room = (system.clock.ticks() / stride) as usize + 2;
        let signals =
            signals.iter().map(|signal| (signal.clone(), Vec::with_capacity(room))).collect();
        Ok(Self { stride, resolved, time: Vec::with_capacity(room), signals })
    }
}

impl Observer for Watch {
    fn observe(&mut self, sample: &Sample) -> Result<(), Single> {
        if !sample.tick.is_multiple_of(self.stride) && !sample.last {
            return Ok(());
        }
        self.time.push(sample.time);
        for ((_, resolved), values) in self.resolved.iter().zip(self.signals.values_mut()) {
            // At the stop time, a signal with responses keeps its value of the step before.
            let last = values.last().copied().filter(|_| sample.last && resolved.responds);
            values.push(last.unwrap_or_else(|| resolved.value(sample.values)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
