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
        /// Shortest time for which they must have been observed within the band, s.
        hold: f64,
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

const FREQUENCY: &str = "rms-above needs a frequency above 0, and no other kind has one";

impl Measure {
    /// Describes what is wrong with the measure, or returns `None` if nothing is.
    pub fn fault(&self) -> Option<String> {
        self.quantity().err()
    }

    /// Returns the quantity that the measure computes.
    ///
    /// # Errors
    /// Returns an error if a key has no meaning for the kind of the measure, or is missing.
    pub fn quantity(&self) -> Result<Quantity, String> {
        if self.every == 0 {
            return Err("every = 0: it must be at least 1".into());
        }
        if self.over.is_some_and(|[from, to]| from >= to) {
            return Err("over must be [from, to] with from below to".into());
        }
        let quantity = self.quantity_of_kind()?;
        let takes_bound = matches!(
            quantity,
            Quantity::Leaving { .. }
                | Quantity::Settling { .. }
                | Quantity::Rises { .. }
                | Quantity::Share { .. }
        );
        let settles = matches!(quantity, Quantity::Settling { .. });
        let faults = [
            (
                self.bound.is_some() && !takes_bound,
                "bound is for leaving, settling, rises and share only",
            ),
            (
                self.unit.is_some() && (takes_bound || quantity == Quantity::Pulses),
                "settling, pulses, leaving, rises and share have no unit of the signals to replace: leave unit out",
            ),
            (self.band.is_some() && !settles, "band is for settling only"),
            (self.hold != 0.0 && !settles, "hold is for settling only"),
            (
                self.frequency.is_some_and(|frequency| frequency > 0.0)
                    && self.kind != MeasureKind::RmsAbove,
                FREQUENCY,
            ),
        ];
        match faults.iter().find(|(is_there, _)| *is_there) {
            Some((_, fault)) => Err((*fault).into()),
            None => Ok(quantity),
        }
    }

    /// Reads the keys of the kind. Further keys are ignored.
    fn quantity_of_kind(&self) -> Result<Quantity, String> {
        Ok(match self.kind {
            MeasureKind::Rms => Quantity::Rms,
            MeasureKind::Mean => Quantity::Mean,
            MeasureKind::Integral => Quantity::Integral,
            MeasureKind::P99 => Quantity::P99,
            MeasureKind::Largest => Quantity::Largest,
            MeasureKind::Last => Quantity::Last,
            MeasureKind::Pulses => Quantity::Pulses,
            MeasureKind::Variation => Quantity::Variation,
            MeasureKind::Rises => Quantity::Rises { least: self.bound.unwrap_or(0.0) },
            MeasureKind::Leaving => match self.bound {
                Some(bound) if bound > 0.0 => Quantity::Leaving { bound },
                _ => return Err("leaving needs a bound above 0".into()),
            },
            MeasureKind::Share => match self.bound {
                Some(bound) if bound >= 0.0 => Quantity::Share { bound },
                _ => return Err("share needs a bound of at least 0".into()),
            },
            MeasureKind::Settling => {
                let within = match (self.band, self.bound) {
                    (Some(band), None) if band > 0.0 => Some(Band::Relative(band)),
                    (None, Some(bound)) if bound > 0.0 => Some(Band::Absolute(bound)),
                    _ => None,
                };
                let within = within.filter(|_| self.hold >= 0.0).ok_or(
                    "settling needs either a band or a bound above 0, and a hold of at least 0",
                )?;
                Quantity::Settling { within, hold: self.hold }
            }
            MeasureKind::RmsAbove => match self.frequency {
                Some(frequency) if frequency > 0.0 => Quantity::RmsAbove { frequency },
                _ => return Err(FREQUENCY.into()),
            },
        })
    }
}
