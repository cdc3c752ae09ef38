//! Signals of a run that the figures of a study draw.

use cosim::run::{Observer, Sample};
use cosim::signal::{Resolved, Signal};
use cosim::system::Parameters;
use linear::curves::ResponseCurves;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Results of a part besides its numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Curves {
    /// Signals of the run's first case, if it belongs to the part.
    pub series: Option<Series>,
    /// Parameters of all components in the first case, if it belongs to the part.
    pub parameters: Parameters,
    /// Smallest and largest value of each signal over the cases, at each communication point.
    pub spread: BTreeMap<Signal, Spread>,
}

/// Time series of signals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Simulated times of the communication points, s.
    pub time: Vec<f64>,
    /// Values at these times, in the unit in which they are shown.
    pub signals: BTreeMap<Signal, Vec<f64>>,
    /// Unit in which each signal is shown.
    pub units: BTreeMap<Signal, String>,
    /// Single values of the metrics that keep them, by name.
    pub samples: BTreeMap<String, Vec<f64>>,
    /// Frequency responses of the loop, if a figure draws them.
    pub response: Option<ResponseCurves>,
}

/// Smallest and largest value at each communication point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest value at each communication point.
    pub low: Vec<f64>,
    /// Largest value at each communication point.
    pub high: Vec<f64>,
}

/// Extends the bands of signals so that they also cover others.
pub(crate) fn widen(
    bands: &mut BTreeMap<Signal, Spread>,
    others: impl IntoIterator<Item = (Signal, Spread)>,
) {
    for (signal, other) in others {
        let Some(band) = bands.get_mut(&signal) else {
            bands.insert(signal, other);
            continue;
        };
        band.low.iter_mut().zip(other.low).for_each(|(least, low)| *least = least.min(low));
        band.high.iter_mut().zip(other.high).for_each(|(most, high)| *most = most.max(high));
    }
}

/// Approximate largest number of points of a time series.
const POINTS: u64 = 4000;

/// An observer that records signals at every n-th communication point.
pub(crate) struct Watch {
    stride: u64,
    resolved: Vec<(Signal, Resolved)>,
    time: Vec<f64>,
    values: Vec<Vec<f64>>,
}

impl Watch {
    /// Creates a watch for runs of so many communication points.
    pub(crate) fn new(resolved: Vec<(Signal, Resolved)>, ticks: u64) -> Self {
        let values = vec![Vec::new(); resolved.len()];
        Self { stride: ticks.div_ceil(POINTS).max(1), resolved, time: Vec::new(), values }
    }

    /// Forgets the last run.
    pub(crate) fn clear(&mut self) {
        self.time.clear();
        self.values.iter_mut().for_each(Vec::clear);
    }

    fn signals(&self) -> impl Iterator<Item = (&Signal, &Vec<f64>)> {
        self.resolved.iter().map(|(signal, _)| signal).zip(&self.values)
    }

    /// Returns the time series, to which the single values of metrics are added.
    pub(crate) fn series(&self, samples: BTreeMap<String, Vec<f64>>) -> Series {
        let units = self.resolved.iter().map(|(s, resolved)| (s.clone(), resolved.unit.clone()));
        Series {
            time: self.time.clone(),
            signals: self.signals().map(|(s, values)| (s.clone(), values.clone())).collect(),
            units: units.collect(),
            samples,
            response: None,
        }
    }

    /// Returns the bands of one run, which have no width.
    pub(crate) fn bands(&self, drawn: &BTreeSet<Signal>) -> Vec<(Signal, Spread)> {
        let signals = self.signals().filter(|(signal, _)| drawn.contains(signal));
        let bands = signals.map(|(signal, values)| {
            (signal.clone(), Spread { low: values.clone(), high: values.clone() })
        });
        bands.collect()
    }
}

impl Observer for Watch {
    fn observe(&mut self, sample: &Sample) -> Result<(), cosim::error::Error> {
        if !sample.tick.is_multiple_of(self.stride) && !sample.last {
            return Ok(());
        }
        self.time.push(sample.time);
        for ((_, resolved), values) in self.resolved.iter().zip(&mut self.values) {
            // At the stop time, a signal with responses keeps its value of the step before.
            let last = values.last().copied().filter(|_| sample.last && resolved.responds);
            values.push(last.unwrap_or_else(|| resolved.value(sample.values)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_holds_all_values() {
        let mut bands = BTreeMap::new();
        let signal = Signal::try_from("a.b".to_string()).unwrap();
        for values in [vec![1.0, 5.0], vec![2.0, 3.0]] {
            let spread = Spread { low: values.clone(), high: values };
            widen(&mut bands, [(signal.clone(), spread)]);
        }
        assert_eq!(bands[&signal], Spread { low: vec![1.0, 3.0], high: vec![2.0, 5.0] });
    }
}
