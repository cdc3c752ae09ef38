//! Numbers that are computed from a run's signals during the run.

mod spectrum;

use cosim::error::Error;
use cosim::experiment::{Measure, MeasureKind, Observe};
use cosim::master::{Observer, Sample};
use cosim::signal::{Resolved, Signal, common_unit};
use cosim::system::System;

/// Returns the larger value. Unlike `f64::max` it does not hide a value that is not a number.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// Tolerance with which a bound counts as met, because of rounding.
const ROUNDING: f64 = 1e-9;

/// A measure of a run whose value is still being computed.
pub(crate) struct Gauge {
    measure: Measure,
    signals: Vec<Resolved>,
    /// Index of the variable that counts events, and its last value.
    each: Option<(usize, f64)>,
    /// Values of each signal: the present one, the one before, and the first one.
    now: Vec<f64>,
    before: Vec<f64>,
    first: Vec<f64>,
    sum: f64,
    integral: f64,
    count: u64,
    largest: f64,
    pulses: u64,
    /// Values of the first signal, which are kept only for a percentile.
    samples: Vec<f64>,
    /// Values of all signals, sample by sample, which are kept only for their spectrum, and the
    /// time of the first one.
    spectrum_samples: Vec<f64>,
    began: f64,
    variation: f64,
    rises: u64,
    /// Number of samples with all signals within the bound.
    inside: u64,
    /// Time of the first sample after which all signals have stayed within the band.
    settled: Option<f64>,
    /// Time of the last sample.
    last: f64,
    /// Time of the first sample at which a signal exceeds the bound.
    left: Option<f64>,
}

impl Gauge {
    /// Creates a gauge that has measured nothing yet.
    ///
    /// # Errors
    /// Returns an error if a variable does not exist, or if the measure is faulty.
    pub(crate) fn new(
        measure: &Measure,
        signals: &[Signal],
        system: &mut System,
    ) -> Result<Self, String> {
        if let Some(fault) = measure.fault() {
            return Err(fault);
        }
        let signals: Vec<Resolved> =
            signals.iter().map(|signal| system.resolve(signal)).collect::<Result<_, _>>()?;
        common_unit(&signals)?;
        // At the stop time, responses to inputs are those of the step before; only an integral
        // needs them there.
        let responds = signals.iter().any(|signal| signal.responds);
        let steps = measure.steps || responds && measure.kind != MeasureKind::Integral;
        let each = measure.each.as_ref().map(|path| system.probe(path)).transpose()?;
        let mut gauge = Self::empty(&Measure { steps, ..measure.clone() }, signals);
        gauge.each = each.map(|probed| (probed.place, 0.0));
        if measure.kind == MeasureKind::P99 {
            // This is enough room for a usual run; a longer run allocates more.
            gauge.samples.reserve(system.clock.ticks().min(1 << 16) as usize + 1);
        }
        Ok(gauge)
    }

    pub(crate) fn empty(measure: &Measure, signals: Vec<Resolved>) -> Self {
        Self {
            measure: measure.clone(),
            signals,
            each: None,
            now: Vec::new(),
            before: Vec::new(),
            first: Vec::new(),
            sum: 0.0,
            integral: 0.0,
            count: 0,
            largest: 0.0,
            pulses: 0,
            samples: Vec::new(),
            spectrum_samples: Vec::new(),
            began: 0.0,
            variation: 0.0,
            rises: 0,
            inside: 0,
            settled: None,
            last: 0.0,
            left: None,
        }
    }

    /// Forgets all samples, so that another run can be measured.
    pub(crate) fn reset(&mut self) {
        let signals = std::mem::take(&mut self.signals);
        let each = self.each.map(|(place, _)| (place, 0.0));
        *self = Self { each, ..Self::empty(&self.measure, signals) };
    }

    /// Returns the value of the measure; `None` if it has none.
    pub(crate) fn value(&self) -> Option<f64> {
        let factor = self.measure.unit.as_ref().map_or(1.0, |unit| unit.factor);
        (self.count > 0).then_some(())?;
        let count = self.count as f64;
        match self.measure.kind {
            MeasureKind::Rms => Some(factor * (self.sum / count).sqrt()),
            MeasureKind::Mean => Some(factor * (self.sum / count)),
            MeasureKind::Integral => Some(factor * self.integral),
            MeasureKind::P99 => {
                let mut samples = self.samples.clone();
                samples.sort_by(f64::total_cmp);
                let rank = (samples.len() * 99).div_ceil(100).checked_sub(1)?;
                samples.get(rank).map(|sample| factor * sample)
            }
            MeasureKind::Largest => Some(factor * self.largest),
            MeasureKind::Last => self.before.first().map(|value| factor * value),
            MeasureKind::Settling => {
                self.settled.filter(|settled| self.last - settled >= self.measure.hold)
            }
            MeasureKind::Pulses => Some(self.pulses as f64),
            MeasureKind::Leaving => self.left,
            MeasureKind::Rises => Some(self.rises as f64),
            MeasureKind::Variation => Some(factor * self.variation),
            MeasureKind::Share => Some(self.inside as f64 / count),
            MeasureKind::RmsAbove => {
                let step = (self.last - self.began) / (count - 1.0);
                let frequency = self.measure.frequency.unwrap_or(0.0);
                let signals = self.first.len();
                spectrum::rms_above(&self.spectrum_samples, signals, step, frequency)
                    .map(|rms| factor * rms)
            }
        }
    }

    /// Returns the unit of [`Self::value`], or an empty text if it has none.
    pub(crate) fn unit(&self) -> &str {
        match (self.measure.kind, &self.measure.unit) {
            (MeasureKind::Settling | MeasureKind::Leaving, _) => "s",
            (MeasureKind::Share, _) => "",
            (_, Some(unit)) => &unit.name,
            _ => self.signals.first().map_or("", |signal| &signal.unit),
        }
    }

    /// Returns whether the number is always whole.
    pub(crate) fn counts(&self) -> bool {
        let is_integer = self.signals.first().is_some_and(|signal| signal.is_integer);
        let is_count = matches!(self.measure.kind, MeasureKind::Pulses | MeasureKind::Rises);
        is_count || self.measure.kind == MeasureKind::Last && is_integer
    }

    /// Returns the single values of a percentile, in the order of time.
    pub(crate) fn samples(&self) -> Vec<f64> {
        let factor = self.measure.unit.as_ref().map_or(1.0, |unit| unit.factor);
        self.samples.iter().map(|sample| factor * sample).collect()
    }

    fn see(&mut self, time: f64, values: &[f64]) {
        if self.measure.over.is_some_and(|[from, to]| !(from..=to).contains(&time)) {
            return;
        }
        if self.count == 0 {
            self.first = values.to_vec();
            self.before = vec![0.0; values.len()];
            self.began = time;
        } else {
            let changes = values.iter().zip(&self.before).map(|(now, before)| (now - before).abs());
            self.variation += changes.sum::<f64>();
            let rise = values.first().zip(self.before.first()).map(|(now, before)| now - before);
            let least = self.measure.bound.unwrap_or(0.0);
            self.rises += u64::from(rise.is_some_and(|rise| rise > least));
        }
        if self.measure.kind == MeasureKind::RmsAbove {
            self.spectrum_samples.extend(values);
        }
        // By the trapezoidal rule. At the first sample, the values before it are zero and no time
        // has passed.
        if let (true, Some(now), Some(before)) =
            (self.count > 0, values.first(), self.before.first())
        {
            self.integral += 0.5 * (now + before) * (time - self.last);
        }
        self.count += 1;
        self.last = time;
        self.sum += match self.measure.kind {
            MeasureKind::Mean => values.first().copied().unwrap_or(f64::NAN),
            _ => values.iter().map(|value| value * value).sum(),
        };
        if self.measure.kind == MeasureKind::P99 {
            self.samples.extend(values.first());
        }
        self.largest = values.iter().map(|value| value.abs()).fold(self.largest, larger);
        let band = |first: &f64| match (self.measure.bound, self.measure.band) {
            (Some(bound), _) => bound,
            (None, band) => band.unwrap_or(0.0) * first.abs(),
        };
        let inside =
            values.iter().zip(&self.first).all(|(value, first)| value.abs() <= band(first));
        self.settled = if inside { self.settled.or(Some(time)) } else { None };
        if self.measure.bound.is_some_and(|bound| values.iter().any(|value| value.abs() > bound)) {
            self.left = self.left.or(Some(time));
        }
        let within = self.measure.bound.map(|bound| bound * (1.0 + ROUNDING));
        let is_inside = within.is_some_and(|bound| values.iter().all(|value| value.abs() <= bound));
        self.inside += u64::from(is_inside);
        let rises = values
            .iter()
            .zip(&self.before)
            .filter(|(value, before)| **value > 0.5 && **before <= 0.5);
        self.pulses += rises.count() as u64;
        self.before.copy_from_slice(values);
    }

    /// Returns whether a sample is one of those that the measure uses.
    fn takes(&mut self, sample: &Sample) -> bool {
        let grown = self.each.as_mut().is_none_or(|(place, last)| {
            let now = sample.values[*place];
            let grown = now > *last;
            *last = now;
            grown
        });
        grown
            && sample.tick.is_multiple_of(u64::from(self.measure.every))
            && !(self.measure.steps && sample.last)
    }
}

impl Observer for Gauge {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if self.takes(sample) {
            let mut now = std::mem::take(&mut self.now);
            now.clear();
            now.extend(self.signals.iter().map(|signal| signal.value(sample.values)));
            self.see(sample.time, &now);
            self.now = now;
        }
        Ok(())
    }
}

/// Creates the gauge that an experiment asks for; `None` if the measure is optional and the FMUs
/// lack what it needs.
///
/// # Errors
/// Returns an error if a list or a variable does not exist.
pub(crate) fn gauge_for(
    measure: &Measure,
    observe: &Observe,
    system: &mut System,
) -> Result<Option<Gauge>, String> {
    let signals = observe.list(measure.signals.get_ref())?;
    let paths = || signals.iter().flat_map(Signal::paths).chain(measure.each.as_deref());
    let is_missing = paths().any(|path| !system.has(path));
    if is_missing && measure.optional || system.lost_by_exchange(paths()) {
        return Ok(None);
    }
    Gauge::new(measure, signals, system).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use toml::Spanned;

    fn measured(
        kind: MeasureKind,
        over: Option<[f64; 2]>,
        size: Option<f64>,
        rows: &[[f64; 2]],
    ) -> Option<f64> {
        held(kind, over, size, 0.0, rows)
    }

    /// Parses a measure from its TOML text.
    fn measure(text: &str) -> Measure {
        toml::from_str(&format!("signals = \"x\"\n{text}")).unwrap()
    }

    fn held(
        kind: MeasureKind,
        over: Option<[f64; 2]>,
        size: Option<f64>,
        hold: f64,
        rows: &[[f64; 2]],
    ) -> Option<f64> {
        let signals = Spanned::new(0..0, "x".to_string());
        let (band, bound) = if kind == MeasureKind::Leaving { (None, size) } else { (size, None) };
        let measure =
            Measure { kind, signals, over, band, hold, bound, ..measure("kind = \"rms\"") };
        let mut gauge = Gauge::empty(&measure, Vec::new());
        for (time, row) in rows.iter().enumerate() {
            gauge.see(time as f64, row);
        }
        gauge.value()
    }

    #[test]
    fn oracle_each_kind_by_hand() {
        let rows = [[10.0, -1.0], [3.0, 0.0], [0.1, 0.6], [0.4, 0.015], [-0.15, 0.0], [0.0, 0.01]];
        assert_eq!(measured(MeasureKind::Largest, None, None, &rows), Some(10.0));
        assert_eq!(measured(MeasureKind::Largest, Some([1.0, 2.0]), None, &rows), Some(3.0));
        assert_eq!(measured(MeasureKind::Rms, Some([1.0, 1.0]), None, &rows), Some(3.0));
        assert_eq!(measured(MeasureKind::Pulses, None, None, &rows), Some(2.0));
        // 6.5 + 1.55 + 0.25 + 0.125 - 0.075
        let integral = measured(MeasureKind::Integral, None, None, &rows).unwrap();
        assert!((integral - 8.35).abs() < 1e-12);
        // The first signal is within 0.2 from 4 s on, the second within 0.02 from 3 s on.
        assert_eq!(measured(MeasureKind::Settling, None, Some(0.02), &rows), Some(4.0));
        assert_eq!(measured(MeasureKind::Settling, None, Some(0.001), &rows), None);
        // The signals are seen within the band for 1 s, until 5 s.
        assert_eq!(held(MeasureKind::Settling, None, Some(0.02), 1.0, &rows), Some(4.0));
        assert_eq!(held(MeasureKind::Settling, None, Some(0.02), 1.1, &rows), None);
        assert_eq!(measured(MeasureKind::Rms, Some([7.0, 8.0]), None, &rows), None);
        assert_eq!(measured(MeasureKind::Rises, None, None, &rows), Some(2.0));
        // 7 + 2.9 + 0.3 + 0.55 + 0.15, and 1 + 0.6 + 0.585 + 0.015 + 0.01
        let variation = measured(MeasureKind::Variation, None, None, &rows).unwrap();
        assert!((variation - 13.11).abs() < 1e-12, "{variation}");
        assert_eq!(measured(MeasureKind::Leaving, Some([1.0, 5.0]), Some(0.5), &rows), Some(1.0));
        assert_eq!(measured(MeasureKind::Leaving, Some([2.0, 5.0]), Some(0.7), &rows), None);
    }

    #[test]
    fn a_measure_that_cannot_be_meant_is_refused() {
        let fault = |text: &str| measure(text).fault();
        assert!(fault("kind = \"rms\"\nover = [2.0, 1.0]").unwrap().contains("over"));
        assert!(fault("kind = \"settling\"").unwrap().contains("band"));
        assert!(fault("kind = \"rms\"\nband = 0.1").unwrap().contains("band"));
        assert!(fault("kind = \"rms\"\nevery = 0").unwrap().contains("every"));
        assert_eq!(fault("kind = \"settling\"\nband = 0.1"), None);
        assert!(fault("kind = \"leaving\"").unwrap().contains("bound"));
        assert!(fault("kind = \"largest\"\nbound = 1.0").unwrap().contains("bound"));
        assert_eq!(fault("kind = \"leaving\"\nbound = 1.0"), None);
        assert!(fault("kind = \"share\"").unwrap().contains("bound"));
        assert_eq!(fault("kind = \"share\"\nbound = 0.0"), None);
        assert_eq!(fault("kind = \"settling\"\nbound = 0.1"), None);
        assert!(fault("kind = \"settling\"\nbound = 0.1\nband = 0.1").unwrap().contains("either"));
        assert!(fault("kind = \"rms-above\"").unwrap().contains("frequency"));
        assert!(fault("kind = \"rms\"\nfrequency = 5.0").unwrap().contains("frequency"));
        assert_eq!(fault("kind = \"rms-above\"\nfrequency = 5.0"), None);
    }

    /// Computes a measure of the first of two variables from rows of both.
    fn taken(text: &str, rows: &[[f64; 2]]) -> Option<f64> {
        let measure = measure(text);
        let mut gauge = Gauge::empty(&measure, vec![Resolved::variable(0)]);
        gauge.each = measure.each.as_ref().map(|_| (1, 0.0));
        for (tick, row) in rows.iter().enumerate() {
            let (time, last) = (tick as f64, tick + 1 == rows.len());
            gauge.observe(&Sample { tick: tick as u64, time, last, values: row }).unwrap();
        }
        gauge.value()
    }

    #[test]
    fn oracle_which_points_are_taken_by_hand() {
        let rows = [[3.0, 1.0], [100.0, 1.0], [4.0, 2.0], [50.0, 2.0]];
        assert_eq!(taken("kind = \"settling\"\nbound = 60.0", &rows), Some(2.0));
        assert_eq!(taken("kind = \"rises\"\nbound = 50.0", &rows), Some(1.0));
        assert_eq!(taken("kind = \"rms\"\nevery = 2", &rows), Some(12.5_f64.sqrt()));
        assert_eq!(taken("kind = \"mean\"\nsteps = true", &rows), Some(107.0 / 3.0));
        // A sample at which the count has not grown is not used.
        let each = "each = \"a.count\"";
        assert_eq!(taken(&format!("kind = \"mean\"\n{each}"), &rows), Some(3.5));
        let unit = "unit = { name = \"ms\", factor = 1e3 }";
        assert_eq!(taken(&format!("kind = \"p99\"\n{each}\n{unit}"), &rows), Some(4000.0));
        assert_eq!(taken("kind = \"last\"", &rows), Some(50.0));
        assert_eq!(taken("kind = \"largest\"", &rows), Some(100.0));
        assert_eq!(taken("kind = \"p99\"", &[[0.0, 0.0]; 0]), None);
    }

    #[test]
    fn oracle_shares_by_hand() {
        let rows = [[0.5, 0.0], [-2.0, 0.0], [3.0, 0.0], [f64::NAN, 0.0]];
        assert_eq!(taken("kind = \"share\"\nbound = 2.0", &rows), Some(0.5));
    }

    #[test]
    fn oracle_the_99th_percentile_is_the_nearest_rank() {
        let rows: Vec<[f64; 2]> = (1..=200).rev().map(|k| [f64::from(k), 0.0]).collect();
        assert_eq!(taken("kind = \"p99\"", &rows), Some(198.0));
    }

    #[test]
    fn a_value_that_is_not_a_number_is_not_hidden() {
        let rows = [[1.0, 0.0], [f64::NAN, 0.0], [2.0, 0.0]];
        assert!(taken("kind = \"largest\"", &rows).unwrap().is_nan());
    }
}
