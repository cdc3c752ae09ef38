//! The values of signals over a flight, for figures.

use cosim::error::Error;
use cosim::run::{Observer, Sample};
use cosim::signal::Resolved;
use serde::{Deserialize, Serialize};

/// An observer that records signals at every n-th communication point, and at the last.
#[derive(Serialize, Deserialize)]
pub struct Track {
    #[serde(skip)]
    signals: Vec<Resolved>,
    stride: u64,
    /// Times of the recorded communication points, s.
    pub time: Vec<f64>,
    /// Values of each signal at these times.
    pub values: Vec<Vec<f64>>,
}

impl Track {
    /// Creates a track of these signals.
    pub fn new(signals: Vec<Resolved>, stride: u64) -> Self {
        let values = vec![Vec::new(); signals.len()];
        Self { signals, stride, time: Vec::new(), values }
    }

    /// Forgets the last flight.
    pub fn clear(&mut self) {
        self.time.clear();
        self.values.iter_mut().for_each(Vec::clear);
    }
}

impl Observer for Track {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.stride) && !sample.last {
            return Ok(());
        }
        self.time.push(sample.time);
        for (signal, values) in self.signals.iter().zip(&mut self.values) {
            // At the stop time, a signal with responses keeps its value of the step before.
            let last = values.last().copied().filter(|_| sample.last && signal.responds);
            values.push(last.unwrap_or_else(|| signal.value(sample.values)));
        }
        Ok(())
    }
}
