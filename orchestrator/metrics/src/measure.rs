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

/// Tolerance with which a bound counts as met, because of rounding.
const ROUNDING: f64 = 1e-9;

/// A measure of a run whose value is still being computed.
pub(crate) struct Gauge {
    measure: Measure,
    quantity: Quantity,
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
        let quantity = measure.quantity()?;
        let signals: Vec<Resolved> =
            signals.iter().map(|signal| system.resolve(signal)).collect::<Result<_, _>>()?;
        common_unit(&signals)?;
        // At the stop time, responses to inputs are those of the step before; only an integral
        // needs them there.
        let responds = signals.iter().any(|signal| signal.responds);
        let steps = measure.steps || responds && quantity != Quantity::Integral;
        let each = measure.each.as_ref().map(|path| system.probe(path)).transpose()?;
        let mut gauge = Self::empty(&Measure { steps, ..measure.clone() }, quantity, signals);
        gauge.each = each.map(|probed| (probed.place, 0.0));
        if quantity == Quantity::P99 {
            // This is enough room for a usual run; a longer run allocates more.
            gauge.samples.reserve(system.clock.ticks().min(1 << 16) as usize + 1);
        }
        Ok(gauge)
    }

    pub(crate) fn empty(measure: &Measure, quantity: Quantity, signals: Vec<Resolved>) -> Self {
        Self {
            measure: measure.clone(),
            quantity,
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
        *self = Self { each, ..Self::empty(&self.measure, self.quantity, signals) };
    }

    /// Returns the value of the measure; `None` if it has none.
    pub(crate) fn value(&self) -> Option<f64> {
        let factor = self.measure.unit.as_ref().map_or(1.0, |unit| unit.factor);
        (self.count > 0).then_some(())?;
        let count = self.count as f64;
        match self.quantity {
            Quantity::Rms => Some(factor * (self.sum / count).sqrt()),
            Quantity::Mean => Some(factor * (self.sum / count)),
            Quantity::Integral => Some(factor * self.integral),
            Quantity::P99 => {
                let mut samples = self.samples.clone();
                samples.sort_by(f64::total_cmp);
                let rank = (samples.len() * 99).div_ceil(100).checked_sub(1)?;
                samples.get(rank).map(|sample| factor * sample)
            }
            Quantity::Largest => Some(factor * self.largest),
            Quantity::Last => self.before.first().map(|value| factor * value),
            Quantity::Settling { hold, .. } => {
                self.settled.filter(|settled| self.last - settled >= hold)
            }
            Quantity::Pulses => Some(self.pulses as f64),
            Quantity::Leaving { .. } => self.left,
            Quantity::Rises { .. } => Some(self.rises as f64),
            Quantity::Variation => Some(factor * self.variation),
            Quantity::Share { .. } => Some(self.inside as f64 / count),
            Quantity::RmsAbove { frequency } => {
                let step = (self.last - self.began) / (count - 1.0);
                let signals = self.first.len();
                spectrum::rms_above(&self.spectrum_samples, signals, step, frequency)
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
            if let Quantity::Rises { least } = self.quantity {
                self.rises += u64::from(rise.is_some_and(|rise| rise > least));
            }
        }
        if matches!(self.quantity, Quantity::RmsAbove { .. }) {
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
        self.sum += match self.quantity {
            Quantity::Mean => values.first().copied().unwrap_or(f64::NAN),
            _ => values.iter().map(|value| value * value).sum(),
        };
        if self.quantity == Quantity::P99 {
            self.samples.extend(values.first());
        }
        self.largest = values.iter().map(|value| value.abs()).fold(self.largest, larger);
        match self.quantity {
            Quantity::Settling { within, .. } => {
                let band = |first: &f64| match within {
                    Band::Absolute(bound) => bound,
                    Band::Relative(share) => share * first.abs(),
                };
                let inside =
                    values.iter().zip(&self.first).all(|(value, first)| value.abs() <= band(first));
                self.settled = if inside { self.settled.or(Some(time)) } else { None };
            }
            Quantity::Leaving { bound } if values.iter().any(|value| value.abs() > bound) => {
                self.left = self.left.or(Some(time));
            }
            Quantity::Share { bound } => {
                let bound = bound * (1.0 + ROUNDING);
                self.inside += u64::from(values.iter().all(|value| value.abs() <= bound));
            }
            _ => {}
        }
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
mod tests;
