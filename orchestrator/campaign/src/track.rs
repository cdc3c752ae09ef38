//! The values of signals over a flight, for figures.

use cosim::error::Error;
use cosim::run::{Observer, Sample};
use cosim::signal::Resolved;

/// An observer that records signals at every n-th communication point.
pub(crate) struct Track {
    /// Signals, each with the factor to the unit in which it is shown.
    signals: Vec<(f64, Resolved)>,
    stride: u64,
    /// Times of the recorded communication points, s.
    pub time: Vec<f64>,
    /// Values of each signal at these times.
    pub values: Vec<Vec<f64>>,
}

impl Track {
    pub(crate) fn new(signals: Vec<(f64, Resolved)>, stride: u64) -> Self {
        let values = vec![Vec::new(); signals.len()];
        Self { signals, stride, time: Vec::new(), values }
    }
}

impl Observer for Track {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if sample.tick.is_multiple_of(self.stride) {
            self.time.push(sample.time);
            for ((factor, signal), values) in self.signals.iter().zip(&mut self.values) {
                values.push(factor * signal.value(sample.values));
            }
        }
        Ok(())
    }
}
