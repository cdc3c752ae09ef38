//! Numbers of a run that a study defines itself, over all communication points or a part of them.

use super::signal::Resolved;
use crate::error::Error;
use crate::master::{Observer, Sample};
use crate::metrics::larger;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A number as it is asked for.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measure {
    /// By which it is referred to: `run.measure.ID`.
    pub id: String,
    /// What is done with the signals.
    pub kind: Kind,
    /// A list of signals.
    #[schemars(with = "String")]
    pub signals: Spanned<String>,
    /// From and to, s; the whole run if it is left out.
    pub over: Option<[f64; 2]>,
    /// For `settling`: fraction of a signal's first magnitude.
    pub band: Option<f64>,
    /// For `settling`: for how long (s) the signals must have been seen within the band; 0 if it is left out.
    #[serde(default)]
    pub hold: f64,
    /// For `leaving`: a magnitude.
    pub bound: Option<f64>,
}

/// What is done with the signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// √(mean of the sum of squares).
    Rms,
    /// Largest magnitude of any signal.
    Largest,
    /// Time, s, from which on every signal stays within `band` times its first magnitude; nothing if one never does.
    Settling,
    /// How often any signal rises above one half.
    Pulses,
    /// Time, s, at which any signal first exceeds `bound`; nothing if none ever does.
    Leaving,
}

impl Measure {
    /// What is wrong with it, if anything is.
    pub fn fault(&self) -> Option<String> {
        let name = format!("[[measure]] id = \"{}\"", self.id);
        if self.over.is_some_and(|[from, to]| from >= to) {
            return Some(format!("{name}: over must be [from, to] with from below to"));
        }
        match (self.kind, self.bound) {
            (Kind::Leaving, Some(bound)) if bound > 0.0 => {}
            (Kind::Leaving, _) => return Some(format!("{name}: leaving wants a bound above 0")),
            (_, Some(_)) => return Some(format!("{name}: bound is for leaving only")),
            _ => {}
        }
        match (self.kind, self.band) {
            (Kind::Settling, Some(band)) if band > 0.0 && self.hold >= 0.0 => None,
            (Kind::Settling, _) => {
                Some(format!("{name}: settling wants a band above 0, and a hold not below"))
            }
            (_, Some(_)) => Some(format!("{name}: band is for settling only")),
            (_, None) if self.hold != 0.0 => Some(format!("{name}: hold is for settling only")),
            _ => None,
        }
    }
}

/// A number in the making.
pub struct Gauge<'a> {
    /// What is measured.
    pub measure: &'a Measure,
    signals: Vec<Resolved>,
    /// Of each signal: the value now, the one before, and the first one.
    now: Vec<f64>,
    before: Vec<f64>,
    first: Vec<f64>,
    sum: f64,
    count: u64,
    largest: f64,
    pulses: u64,
    /// Time of the first sample after which all signals have stayed within the band.
    settled: Option<f64>,
    /// Time of the last sample.
    last: f64,
    /// Time of the first sample at which a signal exceeds the bound.
    left: Option<f64>,
}

impl<'a> Gauge<'a> {
    /// Nothing measured yet.
    pub fn new(measure: &'a Measure, signals: Vec<Resolved>) -> Self {
        let (now, before, first) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            measure,
            signals,
            now,
            before,
            first,
            sum: 0.0,
            count: 0,
            largest: 0.0,
            pulses: 0,
            settled: None,
            last: 0.0,
            left: None,
        }
    }

    /// The number, if there is one.
    pub fn value(&self) -> Option<f64> {
        (self.count > 0).then_some(())?;
        match self.measure.kind {
            Kind::Rms => Some((self.sum / self.count as f64).sqrt()),
            Kind::Largest => Some(self.largest),
            Kind::Settling => self.settled.filter(|settled| self.last - settled >= self.measure.hold),
            Kind::Pulses => Some(self.pulses as f64),
            Kind::Leaving => self.left,
        }
    }

    fn see(&mut self, time: f64, values: &[f64]) {
        if self.measure.over.is_some_and(|[from, to]| !(from..=to).contains(&time)) {
            return;
        }
        if self.count == 0 {
            self.first = values.to_vec();
            self.before = vec![0.0; values.len()];
        }
        self.count += 1;
        self.last = time;
        self.sum += values.iter().map(|value| value * value).sum::<f64>();
        self.largest = values.iter().map(|value| value.abs()).fold(self.largest, larger);
        let band = self.measure.band.unwrap_or(0.0);
        let inside = values.iter().zip(&self.first).all(|(value, first)| value.abs() <= band * first.abs());
        self.settled = if inside { self.settled.or(Some(time)) } else { None };
        if self.measure.bound.is_some_and(|bound| values.iter().any(|value| value.abs() > bound)) {
            self.left = self.left.or(Some(time));
        }
        let rises =
            values.iter().zip(&self.before).filter(|(value, before)| **value > 0.5 && **before <= 0.5);
        self.pulses += rises.count() as u64;
        self.before.copy_from_slice(values);
    }
}

impl Observer for Gauge<'_> {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        let mut now = std::mem::take(&mut self.now);
        now.clear();
        now.extend(self.signals.iter().map(|signal| signal.value(sample.values)));
        self.see(sample.time, &now);
        self.now = now;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(kind: Kind, over: Option<[f64; 2]>, size: Option<f64>, rows: &[[f64; 2]]) -> Option<f64> {
        held(kind, over, size, 0.0, rows)
    }

    fn held(
        kind: Kind,
        over: Option<[f64; 2]>,
        size: Option<f64>,
        hold: f64,
        rows: &[[f64; 2]],
    ) -> Option<f64> {
        let signals = Spanned::new(0..0, "x".to_string());
        let (band, bound) = if kind == Kind::Leaving { (None, size) } else { (size, None) };
        let measure = Measure { id: "m".into(), kind, signals, over, band, hold, bound };
        let mut gauge = Gauge::new(&measure, Vec::new());
        for (time, row) in rows.iter().enumerate() {
            gauge.see(time as f64, row);
        }
        gauge.value()
    }

    #[test]
    fn oracle_each_kind_by_hand() {
        let rows = [[10.0, -1.0], [3.0, 0.0], [0.1, 0.6], [0.4, 0.015], [-0.15, 0.0], [0.0, 0.01]];
        assert_eq!(measured(Kind::Largest, None, None, &rows), Some(10.0));
        assert_eq!(measured(Kind::Largest, Some([1.0, 2.0]), None, &rows), Some(3.0));
        assert_eq!(measured(Kind::Rms, Some([1.0, 1.0]), None, &rows), Some(3.0));
        assert_eq!(measured(Kind::Pulses, None, None, &rows), Some(2.0));
        // The first signal is within 0.2 from 4 s on, the second within 0.02 from 3 s on.
        assert_eq!(measured(Kind::Settling, None, Some(0.02), &rows), Some(4.0));
        assert_eq!(measured(Kind::Settling, None, Some(0.001), &rows), None);
        // Seen for 1 s, until 5 s.
        assert_eq!(held(Kind::Settling, None, Some(0.02), 1.0, &rows), Some(4.0));
        assert_eq!(held(Kind::Settling, None, Some(0.02), 1.1, &rows), None);
        assert_eq!(measured(Kind::Rms, Some([7.0, 8.0]), None, &rows), None);
        assert_eq!(measured(Kind::Leaving, Some([1.0, 5.0]), Some(0.5), &rows), Some(1.0));
        assert_eq!(measured(Kind::Leaving, Some([2.0, 5.0]), Some(0.7), &rows), None);
    }

    #[test]
    fn a_measure_that_cannot_be_meant_is_refused() {
        let measure = |kind, over, band| Measure {
            id: "m".into(),
            kind,
            signals: Spanned::new(0..0, String::new()),
            over,
            band,
            hold: 0.0,
            bound: None,
        };
        assert!(measure(Kind::Rms, Some([2.0, 1.0]), None).fault().unwrap().contains("over"));
        assert!(measure(Kind::Settling, None, None).fault().unwrap().contains("band"));
        assert!(measure(Kind::Rms, None, Some(0.1)).fault().unwrap().contains("band"));
        assert_eq!(measure(Kind::Settling, None, Some(0.1)).fault(), None);
        assert!(measure(Kind::Leaving, None, None).fault().unwrap().contains("bound"));
        let bounded = |kind| Measure { bound: Some(1.0), ..measure(kind, None, None) };
        assert!(bounded(Kind::Largest).fault().unwrap().contains("bound"));
        assert_eq!(bounded(Kind::Leaving).fault(), None);
    }
}
