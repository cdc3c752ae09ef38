//! Numbers that are computed from a run's signals during the run.

mod spectrum;

use cosim::error::Error;
use cosim::experiment::{Band, Measure, Observe, Quantity};
use cosim::run::{Observer, Sample};
use cosim::signal::{Resolved, Signal, common_unit};
use cosim::system::System;

/// Returns the larger value. Unlike `f64::max` it does not hide a value that is not a number.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// Share of the observed time at whose end signals that have settled are seen within their band.
const SETTLED: f64 = 0.1;

/// Tolerance with which a bound counts as met, because of rounding.
const ROUNDING: f64 = 1e-9;

/// A measure of a run whose value is still being computed.
pub(crate) struct Gauge {
    measure: Measure,
    quantity: Quantity,
    signals: Vec<Resolved>,
    /// Index of the variable that counts events, and its last value.
    each: Option<(usize, f64)>,
    /// Present value of each signal.
    now: Vec<f64>,
    seen: Seen,
}

/// What the samples so far have shown.
#[derive(Default)]
struct Seen {
    /// Values of each signal: those before the present ones, and the first ones.
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
        let quantity = measure.quantity()?;
        let signals: Vec<Resolved> =
            signals.iter().map(|signal| system.resolve(signal)).collect::<Result<_, _>>()?;
        common_unit(&signals)?;
        // At the stop time, responses to inputs are those of the step before; only an integral
        // needs them there.
        let responds = signals.iter().any(|signal| signal.responds);
        let steps = measure.steps || responds && quantity != Quantity::Integral;
        let each = measure.each.as_ref().map(|path| system.probe(path)).transpose()?;
        let gauge = Self::empty(&Measure { steps, ..measure.clone() }, quantity, signals);
        Ok(Self { each: each.map(|probed| (probed.place, 0.0)), ..gauge })
    }

    pub(crate) fn empty(measure: &Measure, quantity: Quantity, signals: Vec<Resolved>) -> Self {
        let (measure, each, now, seen) = (measure.clone(), None, Vec::new(), Seen::default());
        Self { measure, quantity, signals, each, now, seen }
    }

    /// Forgets all samples, so that another run can be measured.
    pub(crate) fn reset(&mut self) {
        self.seen = Seen::default();
        self.each = self.each.map(|(place, _)| (place, 0.0));
    }

    /// Returns the value of the measure; `None` if it has none.
    pub(crate) fn value(&self) -> Option<f64> {
        let factor = self.measure.unit.as_ref().map_or(1.0, |unit| unit.factor);
        (self.seen.count > 0).then_some(())?;
        let count = self.seen.count as f64;
        match self.quantity {
            Quantity::Rms => Some(factor * (self.seen.sum / count).sqrt()),
            Quantity::Mean => Some(factor * (self.seen.sum / count)),
            Quantity::Integral => Some(factor * self.seen.integral),
            Quantity::P99 => {
                let mut samples = self.seen.samples.clone();
                samples.sort_by(f64::total_cmp);
                let rank = (samples.len() * 99).div_ceil(100).checked_sub(1)?;
                samples.get(rank).map(|sample| factor * sample)
            }
            Quantity::Largest => Some(factor * self.seen.largest),
            Quantity::Last => self.seen.before.first().map(|value| factor * value),
            Quantity::Settling { .. } => {
                let least = SETTLED * (self.seen.last - self.seen.began);
                self.seen.settled.filter(|settled| self.seen.last - settled >= least)
            }
            Quantity::Pulses => Some(self.seen.pulses as f64),
            Quantity::Leaving { .. } => self.seen.left,
            Quantity::Rises { .. } => Some(self.seen.rises as f64),
            Quantity::Variation => Some(factor * self.seen.variation),
            Quantity::Share { .. } => Some(self.seen.inside as f64 / count),
            Quantity::RmsAbove { frequency } => {
                let step = (self.seen.last - self.seen.began) / (count - 1.0);
                let signals = self.seen.first.len();
                spectrum::rms_above(&self.seen.spectrum_samples, signals, step, frequency)
                    .map(|rms| factor * rms)
            }
        }
    }

    /// Returns the unit of [`Self::value`], or an empty text if it has none.
    pub(crate) fn unit(&self) -> &str {
        match (self.quantity, &self.measure.unit) {
            (Quantity::Settling { .. } | Quantity::Leaving { .. }, _) => "s",
            (Quantity::Share { .. }, _) => "",
            (_, Some(unit)) => &unit.name,
            _ => self.signals.first().map_or("", |signal| &signal.unit),
        }
    }

    /// Returns whether the number is always whole.
    pub(crate) fn counts(&self) -> bool {
        let is_integer = self.signals.first().is_some_and(|signal| signal.is_integer);
        let is_count = matches!(self.quantity, Quantity::Pulses | Quantity::Rises { .. });
        is_count || self.quantity == Quantity::Last && is_integer
    }

    fn see(&mut self, time: f64, values: &[f64]) {
        if self.measure.over.is_some_and(|[from, to]| !(from..=to).contains(&time)) {
            return;
        }
        if self.seen.count == 0 {
            self.seen.first = values.to_vec();
            self.seen.before = vec![0.0; values.len()];
            self.seen.began = time;
        } else {
            let changes =
                values.iter().zip(&self.seen.before).map(|(now, before)| (now - before).abs());
            self.seen.variation += changes.sum::<f64>();
            let rise =
                values.first().zip(self.seen.before.first()).map(|(now, before)| now - before);
            if let Quantity::Rises { least } = self.quantity {
                self.seen.rises += u64::from(rise.is_some_and(|rise| rise > least));
            }
        }
        if matches!(self.quantity, Quantity::RmsAbove { .. }) {
            self.seen.spectrum_samples.extend(values);
        }
        // By the trapezoidal rule. At the first sample, the values before it are zero and no time
        // has passed.
        if let (true, Some(now), Some(before)) =
            (self.seen.count > 0, values.first(), self.seen.before.first())
        {
            self.seen.integral += 0.5 * (now + before) * (time - self.seen.last);
        }
        self.seen.count += 1;
        self.seen.last = time;
        self.seen.sum += match self.quantity {
            Quantity::Mean => values.first().copied().unwrap_or(f64::NAN),
            _ => values.iter().map(|value| value * value).sum(),
        };
        if self.quantity == Quantity::P99 {
            self.seen.samples.extend(values.first());
        }
        self.seen.largest = values.iter().map(|value| value.abs()).fold(self.seen.largest, larger);
        match self.quantity {
            Quantity::Settling { within, .. } => {
                let band = |first: &f64| match within {
                    Band::Absolute(bound) => bound,
                    Band::Relative(share) => share * first.abs(),
                };
                let inside = values
                    .iter()
                    .zip(&self.seen.first)
                    .all(|(value, first)| value.abs() <= band(first));
                self.seen.settled = if inside { self.seen.settled.or(Some(time)) } else { None };
            }
            Quantity::Leaving { bound } if values.iter().any(|value| value.abs() > bound) => {
                self.seen.left = self.seen.left.or(Some(time));
            }
            Quantity::Share { bound } => {
                let bound = bound * (1.0 + ROUNDING);
                self.seen.inside += u64::from(values.iter().all(|value| value.abs() <= bound));
            }
            _ => {}
        }
        let rises = values
            .iter()
            .zip(&self.seen.before)
            .filter(|(value, before)| **value > 0.5 && **before <= 0.5);
        self.seen.pulses += rises.count() as u64;
        self.seen.before.copy_from_slice(values);
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
mod tests;
