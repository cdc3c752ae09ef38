//! One part of the work of a study: some cases of a run, from its experiment to stored results.

use crate::curves::{Curves, Series, bands, widen};
use crate::definition::Study;
use crate::results::FAILED;
use crate::runs::{Run, Within};
use crate::table::table;
use cosim::error::Error as Single;
use cosim::experiment::{Experiment, Measure, MeasureKind, Observe, Overrides};
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::run::Observer;
use cosim::signal::Signal;
use cosim::system::Opened;
use cosim_metrics::metrics::{Meters, Metrics, Value};
use linear::curves::ResponseCurves;
use serde_json::json;
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::PathBuf;
use sweep::cases::Sweep;
use sweep::error::Error;
use sweep::flight::{Flight, Flown, can_reset};
use sweep::parts::PartResult;
use sweep::runner::Part;
use sweep::track::Track;
use toml::Spanned;

/// Approximate largest number of points of a time series.
const POINTS: u64 = 4000;
/// Number of times that a timed case is run; the least of each computing time counts.
const REPETITIONS: u32 = 5;
/// Number of cases from which on it is worth trying whether instances can be reset.
const WORTH_A_RESET: u64 = 10;

/// Signals that the figures of a study need from a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct DrawnSignals {
    /// Signals that are drawn as lines.
    pub series: BTreeSet<Signal>,
    /// Signals that are drawn as bands.
    pub spread: BTreeSet<Signal>,
    /// Whether frequency responses are drawn.
    pub response: bool,
}

impl DrawnSignals {
    /// Collects the signals of a run that the study's figures draw.
    fn collect(study: &Study, run: &Run) -> Self {
        let mut drawn = Self::default();
        for panel in study.panels_of(run) {
            let named = panel.signals.iter().map(|curve| &curve.signal);
            let signals = panel.signal.iter().chain(named);
            drawn.response |= panel.response.is_some();
            if panel.spread {
                drawn.spread.extend(signals.clone().cloned());
            }
            drawn.series.extend(signals.chain(&panel.reference).cloned());
        }
        drawn
    }
}

/// A run of a study that has been prepared, so that any of its cases can be flown.
pub(crate) struct Preparation<'a> {
    study: &'a Study,
    run: &'a Run,
    /// Signals of the run that the figures draw.
    drawn: DrawnSignals,
    /// Cases of the run.
    pub sweep: Sweep,
}

impl<'a> Preparation<'a> {
    /// Reads the experiment of a run, and looks up all names that the study uses of it.
    ///
    /// # Errors
    /// Returns an error if anything is wrong with the experiment, the FMUs, or what varies.
    pub(crate) fn new(
        study: &'a Study,
        run: &'a Run,
        fmu_dirs: &[PathBuf],
        overrides: &Overrides,
        opened: &mut Opened,
    ) -> Result<Self, Error> {
        let failed = |source| run.failed(source);
        let mut experiment = study.experiment(run).map_err(failed)?;
        experiment.apply(overrides).map_err(failed)?;
        let drawn = DrawnSignals::collect(study, run);
        measure(study, run, &mut experiment)?;
        let mut sweep = Sweep::new(experiment, &run.variation(), &study.source, fmu_dirs, opened)
            .map_err(failed)?;
        let mut system = sweep.system(opened).map_err(failed)?;
        let bounded = study.bounds_of(run).flat_map(|(_, signals)| signals);
        let measured = study.measures_of(run).filter(|(measure, _)| !measure.optional);
        let measured = measured.flat_map(|(_, signals)| signals);
        for signal in drawn.series.iter().chain(bounded).chain(measured) {
            system.resolve(signal).map_err(|message| study.run_fault(run, &message))?;
        }
        Meters::new(&mut system).map_err(failed)?;
        sweep.keys.insert("study".into(), key(run, &drawn, &sweep.experiment().observe));
        Ok(Self { study, run, drawn, sweep })
    }

    /// Returns whether a part is measured, for which it has the machine for itself.
    fn is_timed(&self, range: &Range<u64>) -> bool {
        self.run.timed && range.start == 0
    }

    /// Returns the instances that fly the cases of a part.
    fn instances(
        &'a self,
        range: &Range<u64>,
        opened: &mut Opened,
        interrupt: &'a Interrupt,
    ) -> Result<Instances<'a>, Single> {
        let is_timed = self.is_timed(range);
        // A fault that shows here shows again where it can be reported.
        let resets = !is_timed
            && self.sweep.cases() >= WORTH_A_RESET
            && can_reset(&self.sweep, opened, interrupt).unwrap_or(false);
        let mut flight = Flight::new(&self.sweep, opened, resets, interrupt)?;
        if is_timed {
            flight.measure_times();
        }
        let resolved = self.drawn.series.iter().map(|signal| {
            let resolved = flight.system().resolve(signal);
            resolved.map_err(|message| self.study.run_fault(self.run, &message))
        });
        let resolved = resolved.collect::<Result<Vec<_>, Single>>()?;
        let stride = flight.system().clock.ticks().div_ceil(POINTS).max(1);
        Ok(Instances { preparation: self, flight, track: Track::new(resolved, stride) })
    }
}

/// Adds the measures and bounds of a run to the metrics of its experiment, under the names by which
/// the study refers to them.
fn measure(study: &Study, run: &Run, experiment: &mut Experiment) -> Result<(), Error> {
    let Observe { signals: lists, metrics, .. } = &mut experiment.observe;
    let mut add = |name: String, measure: &Measure, signals: &[Signal]| {
        let list = format!("signals of {name}");
        lists.insert(list.clone(), signals.to_vec());
        let signals = Spanned::new(0..0, list);
        metrics
            .insert(name, Measure { id: String::new(), limit: None, signals, ..measure.clone() });
    };
    for (measure, signals) in study.measures_of(run) {
        add(format!("measure.{}", measure.id), measure, signals);
    }
    for (within, signals) in study.bounds_of(run) {
        let bound = Some(study.number(&within.bound)?);
        let share = Measure { bound, ..Measure::new(MeasureKind::Share) };
        add(format!("within.{}.share", within.id), &share, signals);
        let largest = Measure::new(MeasureKind::Largest);
        add(format!("within.{}.largest", within.id), &largest, signals);
    }
    Ok(())
}

/// Hashes the parts of the study on which the results of a run depend. Experiment and FMUs have
/// their own hashes.
fn key(run: &Run, drawn: &DrawnSignals, observe: &Observe) -> String {
    let inputs = json!([
        run.set,
        run.unset,
        run.vary,
        run.timed,
        observe,
        drawn.series,
        drawn.spread,
        drawn.response,
    ]);
    files::digest(inputs.to_string())
}

/// Instances of a run's FMUs in one thread.
pub(crate) struct Instances<'a> {
    preparation: &'a Preparation<'a>,
    flight: Flight<'a>,
    /// Signals that are drawn, in the order of [`DrawnSignals::series`].
    track: Track,
}

/// State that a thread keeps from one part to the next: opened archives, and the instances of the
/// run that it works on.
#[derive(Default)]
pub(crate) struct Bench<'a> {
    opened: Opened,
    instances: Option<(usize, Instances<'a>)>,
}

impl<'a> Bench<'a> {
    /// Flies the cases of a part.
    ///
    /// # Errors
    /// Returns an error if an FMU fails, or if the run was asked to end.
    pub(crate) fn fly(
        &mut self,
        part: &Part,
        preparation: &'a Preparation<'a>,
        interrupt: &'a Interrupt,
    ) -> Result<PartResult, Single> {
        // A timed part is flown by instances of its own.
        let kept = self.instances.take();
        let kept = kept.filter(|(run, _)| *run == part.sweep && part.cases.start > 0);
        let mut instances = match kept {
            Some((_, instances)) => instances,
            None => preparation.instances(&part.cases, &mut self.opened, interrupt)?,
        };
        let result = instances.fly(&part.cases)?;
        if !preparation.is_timed(&part.cases) {
            self.instances = Some((part.sweep, instances));
        }
        Ok(result)
    }
}

impl Instances<'_> {
    fn fly(&mut self, range: &Range<u64>) -> Result<PartResult, Single> {
        let Preparation { study, sweep, drawn, .. } = self.preparation;
        let mut curves = Curves::default();
        let mut cases = Vec::new();
        for case in range.clone() {
            let mut flown = self.one(case)?;
            if self.preparation.is_timed(range) {
                // Computing times are only meaningful if the run has the machine for itself, and
                // interruptions can only lengthen them.
                for _ in 1..REPETITIONS {
                    let again = self.one(case)?.metrics;
                    keep_least_times(&mut flown.metrics, &again, &sweep.experiment().observe);
                }
            }
            let signals = drawn.series.iter().zip(&self.track.values);
            let spread = signals.filter(|(signal, _)| drawn.spread.contains(*signal));
            widen(&mut curves.spread, bands(spread));
            if case == 0 {
                curves.parameters = self.flight.parameters()?;
                let response = self.flight.linearised().filter(|_| drawn.response);
                let response = response.and_then(ResponseCurves::of);
                curves.series = Some(self.series(response));
            }
            cases.push(flown);
        }
        let curves = serde_json::to_string(&curves);
        let curves = curves.map_err(|error| study.fault(error.to_string()))?;
        Ok(PartResult { rows: table(sweep, &cases), curves })
    }

    /// Returns the time series of the last case, to which its frequency responses are added.
    fn series(&self, response: Option<ResponseCurves>) -> Series {
        let signals = self.preparation.drawn.series.iter().cloned();
        Series {
            time: self.track.time.clone(),
            signals: signals.zip(self.track.values.iter().cloned()).collect(),
            response,
        }
    }

    /// Flies one case, which the track sees if any of its signals is drawn.
    fn one(&mut self, case: u64) -> Result<Flown, Single> {
        self.track.clear();
        let is_drawn = case == 0 || !self.preparation.drawn.spread.is_empty();
        let mut track: [&mut dyn Observer; 1] = [&mut self.track];
        let seen = if is_drawn { &mut track[..] } else { &mut [] };
        let mut flown = self.flight.fly(case, seen)?;
        match std::mem::replace(&mut flown.outcome, Ok(())) {
            // An instance refuses the case, which has no numbers. The others are flown.
            Err(error @ Single::Call { .. }) => {
                let asked = &mut flown.metrics.asked;
                *asked = asked.keys().map(|name| (name.clone(), None)).collect();
                asked.insert(FAILED.into(), Some(Value::Text(error.to_string())));
            }
            outcome => outcome?,
        }
        let Preparation { study, run, .. } = self.preparation;
        for (Within { id, bound, .. }, _) in study.bounds_of(run) {
            let bound = study.number(bound)?;
            let ratio = flown.metrics.number(&format!("within.{id}.largest"));
            let ratio = ratio.map(|largest| Value::Number(largest / bound));
            flown.metrics.asked.insert(format!("within.{id}.ratio"), ratio);
        }
        Ok(flown)
    }
}

/// Replaces each computing time by the smaller one of two runs that are otherwise the same.
fn keep_least_times(metrics: &mut Metrics, others: &Metrics, observe: &Observe) {
    for (name, value) in &mut metrics.asked {
        let is_timing = observe.metrics.get(name).is_some_and(|measure| measure.timing);
        if let (true, Some(Value::Number(time)), Some(Some(Value::Number(other)))) =
            (is_timing, value, others.asked.get(name))
        {
            *time = time.min(*other);
        }
    }
    for (name, time) in &mut metrics.step_us {
        *time = others.step_us.get(name).map_or(*time, |other| time.min(*other));
    }
}
