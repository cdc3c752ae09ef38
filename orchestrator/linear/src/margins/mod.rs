//! How far a loop is from instability at the signals where it was opened. The loop is analysed as
//! it is sampled.

mod classical;
pub(crate) mod disk;
pub(crate) mod structured;

pub(crate) use classical::rate;
pub use classical::{Classical, Crossing};
pub use disk::{Disk, Peak};

use disk::Responses;

use crate::model::OpenLoop;
use crate::spectrum::spectral_radius;
use serde::Serialize;

/// Margins of one signal while the loops of all others stay closed.
#[derive(Clone, Debug, Serialize)]
pub struct LoopMargins {
    /// Name of the signal.
    pub signal: String,
    /// Gains, phase and delay that make the loop unstable.
    pub classical: Classical,
    /// Disk margin.
    pub disk: Disk,
    /// Largest magnitude of the sensitivity function.
    pub sensitivity: Peak,
}

/// Margins of a loop.
#[derive(Clone, Debug, Serialize)]
pub struct Margins {
    /// Whether the loop is stable as it is. If it is not, it has no margins.
    pub stable: bool,
    /// Largest magnitude of an eigenvalue of the closed loop over one period.
    pub spectral_radius: f64,
    /// Margins of each signal.
    pub loops: Vec<LoopMargins>,
    /// Margins for all signals at a time.
    pub together: Option<LoopMargins>,
}

/// Computes the margins of a loop.
pub fn margins(open: &OpenLoop) -> Margins {
    let radius =
        open.closed(&vec![1.0; open.channels()]).map_or(f64::INFINITY, |a| spectral_radius(&a));
    let stable = radius < 1.0;
    if !stable {
        return Margins { stable, spectral_radius: radius, loops: Vec::new(), together: None };
    }
    let responses = Responses::of(open);
    let of = |signal: String, channels: &[usize]| LoopMargins {
        signal,
        classical: classical::classical(open, channels),
        disk: responses.disk(channels),
        sensitivity: responses.sensitivity(channels),
    };
    let loops = (0..open.channels())
        .map(|channel| of(open.signals[channel].name.clone(), &[channel]))
        .collect();
    let all: Vec<usize> = (0..open.channels()).collect();
    let together = (all.len() > 1).then(|| of("all together".into(), &all));
    Margins { stable, spectral_radius: radius, loops, together }
}

#[cfg(test)]
mod tests;
