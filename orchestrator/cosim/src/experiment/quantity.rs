//! Quantity that a measure computes: its kind, with the keys of this kind.

use super::{Measure, MeasureKind};

/// Quantity that a measure computes, with the keys of its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// Square root of the mean of the sum of the signals' squares.
    Rms,
    /// Arithmetic mean of the first signal.
    Mean,
    /// Integral of the first signal.
    Integral,
    /// 99th percentile of the first signal.
    P99,
    /// Largest magnitude of any signal.
    Largest,
    /// Last value of the first signal.
    Last,
    /// Time from which on every signal stays within a band.
    Settling {
        /// Band of the signals.
        within: Band,
    },
    /// Number of times that any signal rises above one half.
    Pulses,
    /// Time at which any signal first exceeds a magnitude.
    Leaving {
        /// The magnitude, which is positive.
        bound: f64,
    },
    /// Number of rises of the first signal.
    Rises {
        /// Rise that does not count yet.
        least: f64,
    },
    /// Total variation of all signals.
    Variation,
    /// Root mean square of the signals' content above a frequency.
    RmsAbove {
        /// The frequency, Hz.
        frequency: f64,
    },
    /// Share of the communication points at which all signals are within a magnitude.
    Share {
        /// The magnitude.
        bound: f64,
    },
}

/// Band in which signals settle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Band {
    /// A magnitude.
    Absolute(f64),
    /// A fraction of each signal's first magnitude.
    Relative(f64),
}

impl Measure {
    /// Describes what is wrong with the measure, or returns `None` if nothing is.
    pub fn fault(&self) -> Option<String> {
        self.quantity().err()
    }

    /// Returns what is measured.
    ///
    /// # Errors
    /// Returns a fault of the measure: a key that its kind does not have, or a number out of range.
    pub fn quantity(&self) -> Result<Quantity, String> {
        if self.every == 0 {
            return Err("every = 0: it must be at least 1".into());
        }
        if self.over.is_some_and(|[from, to]| from >= to) {
            return Err("over must be [from, to] with from below to".into());
        }
        let takes: &[&str] = match self.kind {
            MeasureKind::Pulses => &[],
            MeasureKind::Rises | MeasureKind::Leaving | MeasureKind::Share => &["bound"],
            MeasureKind::Settling => &["bound", "band"],
            MeasureKind::RmsAbove => &["unit", "frequency"],
            _ => &["unit"],
        };
        let given = [
            ("bound", self.bound.is_some()),
            ("band", self.band.is_some()),
            ("frequency", self.frequency.is_some_and(|frequency| frequency > 0.0)),
            ("unit", self.unit.is_some()),
        ];
        if let Some((key, _)) = given.iter().find(|(key, is)| *is && !takes.contains(key)) {
            return Err(format!("{key} does nothing for this kind: leave {key} out"));
        }
        Ok(match (self.kind, self.bound) {
            (MeasureKind::Rms, _) => Quantity::Rms,
            (MeasureKind::Mean, _) => Quantity::Mean,
            (MeasureKind::Integral, _) => Quantity::Integral,
            (MeasureKind::P99, _) => Quantity::P99,
            (MeasureKind::Largest, _) => Quantity::Largest,
            (MeasureKind::Last, _) => Quantity::Last,
            (MeasureKind::Pulses, _) => Quantity::Pulses,
            (MeasureKind::Variation, _) => Quantity::Variation,
            (MeasureKind::Rises, least) => Quantity::Rises { least: least.unwrap_or(0.0) },
            (MeasureKind::Leaving, Some(bound)) if bound > 0.0 => Quantity::Leaving { bound },
            (MeasureKind::Leaving, _) => return Err("leaving needs a bound above 0".into()),
            (MeasureKind::Share, Some(bound)) if bound >= 0.0 => Quantity::Share { bound },
            (MeasureKind::Share, _) => return Err("share needs a bound of at least 0".into()),
            (MeasureKind::Settling, bound) => {
                let within = match (self.band, bound) {
                    (Some(band), None) if band > 0.0 => Some(Band::Relative(band)),
                    (None, Some(bound)) if bound > 0.0 => Some(Band::Absolute(bound)),
                    _ => None,
                };
                let within = within.ok_or("settling needs either a band or a bound above 0")?;
                Quantity::Settling { within }
            }
            (MeasureKind::RmsAbove, _) => match self.frequency {
                Some(frequency) if frequency > 0.0 => Quantity::RmsAbove { frequency },
                _ => return Err("rms-above needs a frequency above 0".into()),
            },
        })
    }
}
