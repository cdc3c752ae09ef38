//! A controller's guarantee that limits are kept: when it is in force, and whether the limits are
//! kept then.

use cosim::error::Error;
use cosim::experiment::{Guarantee, Late};
use cosim::run::{Observer, Sample};
use cosim::signal::Resolved;
use cosim::system::{Probed, System};
use cosim::variation::{SettingValue, Target};

/// Multiple of the designed time after which an arrival at the reference is late.
const LATE: f64 = 3.0;

/// Variables in which a controller reports whether its guarantee is in force.
#[derive(Clone, Debug, Default)]
pub struct GuaranteeSignals {
    /// Index, among a sample's values, of the variable that tells whether the guarantee is in
    /// force.
    pub in_force: usize,
    /// Variable that tells why the guarantee is or is not in force, of an enumeration type.
    pub status: Option<Probed>,
    /// Names of the limits, with the indices of the variables that hold the unused share of the
    /// limit after the reserve for disturbances.
    pub margins: Vec<(String, usize)>,
    /// Signals as multiples of their limits, which must not exceed 1 while the guarantee is in
    /// force.
    pub keeps: Vec<Resolved>,
    /// Signals, with their texts, that the guarantee assumes not to exceed 1.
    pub assumes: Vec<(String, Resolved)>,
    /// What counts as a late arrival at the reference.
    pub late: Option<LateSignals>,
}

/// Variables that tell a late arrival at the reference.
#[derive(Clone, Debug)]
pub struct LateSignals {
    /// Signals whose norm is small at the reference.
    pub signals: Vec<Resolved>,
    /// Largest norm with which the reference counts as reached, in the unit of the signals.
    pub beyond: f64,
    /// Index of the variable with the designed time.
    pub time: usize,
}

/// The first tick at which the guarantee was no longer in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuaranteeLoss {
    /// Time of that tick, s.
    pub time: f64,
    /// Status of the guarantee at that tick.
    pub status: Option<f64>,
}

/// Record of the guarantee up to a tick.
#[derive(Clone, Debug, Default)]
pub struct GuaranteeRecord {
    /// Variables that the record is computed from.
    pub signals: GuaranteeSignals,
    ticks: u64,
    ticks_in_force: u64,
    status: Option<f64>,
    /// Tick at which the guarantee was first lost, if it was.
    pub lost: Option<GuaranteeLoss>,
    /// Smallest margins seen while the guarantee was in force; `None` if it never was.
    pub margins: Vec<Option<f64>>,
    /// Whether a limit was exceeded at a tick at which the guarantee was in force.
    pub broken: bool,
    /// What is wrong with the delay that the controller is set for, at any time.
    pub wrong_delay: Option<String>,
    /// First time at which an assumption did not hold while the guarantee was in force (s), and which
    /// one.
    pub unfounded: Option<(f64, String)>,
    /// Time since which the guarantee has been in force and the reference not reached, s.
    away: Option<f64>,
    /// First time at which the arrival at the reference was late, s.
    pub late: Option<f64>,
}

/// Returns the smaller value. Unlike `f64::min` it does not hide a value that is not a number.
fn smaller(a: f64, b: f64) -> f64 {
    if b < a || b.is_nan() { b } else { a }
}

impl GuaranteeSignals {
    /// Finds the variables of a guarantee; `None` if they may be missing and the FMUs lack one
    /// that is needed.
    ///
    /// # Errors
    /// Returns an error if a required variable does not exist.
    pub fn find(guarantee: &Guarantee, system: &mut System) -> Result<Option<Self>, String> {
        let is_left_out = |path: &str, system: &System| {
            guarantee.optional && !system.has(path) || system.lost_by_exchange([path])
        };
        if is_left_out(&guarantee.in_force, system) {
            return Ok(None);
        }
        let in_force = system.probe(&guarantee.in_force)?.place;
        let mut signals = Self { in_force, ..Self::default() };
        if let Some(path) = guarantee.status.as_ref().filter(|path| !is_left_out(path, system)) {
            signals.status = Some(system.probe(path)?);
        }
        for (name, path) in &guarantee.margins {
            if !is_left_out(path, system) {
                signals.margins.push((name.clone(), system.probe(path)?.place));
            }
        }
        let observe = system.experiment.observe.clone();
        for signal in guarantee.assumes.as_ref().map_or(Ok(&[][..]), |name| observe.list(name))? {
            if !signal.paths().iter().any(|path| is_left_out(path, system)) {
                signals.assumes.push((format!("{signal} > 1"), system.resolve(signal)?));
            }
        }
        let mut of_list = |name: &Option<String>| {
            let mut found = Vec::new();
            for signal in name.as_ref().map_or(Ok(&[][..]), |name| observe.list(name))? {
                if !system.lost_by_exchange(signal.paths()) {
                    found.push(system.resolve(signal)?);
                }
            }
            Ok::<_, String>(found)
        };
        signals.keeps = of_list(&guarantee.keeps)?;
        let way = of_list(&guarantee.late.as_ref().map(|late| late.signals.clone()))?;
        if let Some(Late { beyond, time, .. }) = &guarantee.late
            && !is_left_out(time, system)
        {
            let time = system.probe(time)?.place;
            signals.late = Some(LateSignals { signals: way, beyond: *beyond, time });
        }
        Ok(Some(signals))
    }
}

/// Returns what is wrong with the delay that the controller is set for, if the guarantee of an
/// experiment with these changes has assumptions.
pub(crate) fn wrong_delay(
    guarantee: &Guarantee,
    system: &System,
    changes: &[(Target, SettingValue)],
) -> Option<String> {
    guarantee.assumes.as_ref()?;
    let (component, _) = guarantee.in_force.split_once('.')?;
    let mut doubts = system.doubts(changes).into_iter().filter(|doubt| doubt.certain);
    Some(doubts.find(|doubt| system.names()[doubt.component] == component)?.text)
}

impl GuaranteeRecord {
    /// Creates a record that has seen no samples.
    pub fn new(signals: GuaranteeSignals) -> Self {
        let margins = vec![None; signals.margins.len()];
        Self { signals, margins, ..Self::default() }
    }

    /// Forgets all samples.
    pub fn reset(&mut self) {
        let margins = vec![None; self.signals.margins.len()];
        let signals = std::mem::take(&mut self.signals);
        *self = Self { signals, margins, ..Self::default() };
    }

    /// Notes the first time at which the reference has not been reached for too long.
    fn observe_way(&mut self, Sample { time, values, .. }: &Sample) {
        let Some(LateSignals { signals, beyond, time: designed }) = &self.signals.late else {
            return;
        };
        let squares = signals.iter().map(|signal| signal.value(values).powi(2));
        if squares.sum::<f64>().sqrt() <= *beyond || !self.is_in_force(values) {
            self.away = None;
            return;
        }
        let since = *self.away.get_or_insert(*time);
        if time - since > LATE * values[*designed] {
            self.late.get_or_insert(*time);
        }
    }

    /// Returns the share of the ticks at which the guarantee was in force; `None` before the first
    /// tick.
    pub fn share(&self) -> Option<f64> {
        (self.ticks > 0).then(|| self.ticks_in_force as f64 / self.ticks as f64)
    }

    /// Returns whether these values say that the guarantee is in force.
    pub fn is_in_force(&self, values: &[f64]) -> bool {
        values[self.signals.in_force] != 0.0
    }

    /// Returns the status at which the guarantee was first lost, or the present status if it never
    /// was.
    pub fn status(&self) -> Option<f64> {
        self.lost.map_or(self.status, |loss| loss.status)
    }

    /// Returns the name of the enumeration item of a status.
    pub fn name_of(&self, status: f64) -> String {
        let mut items = self.signals.status.iter().flat_map(|status| &status.items);
        let item = items.find(|(_, item)| f64::from(*item) == status);
        item.map_or_else(|| status.to_string(), |(name, _)| name.clone())
    }
}

/// Formats margins with their names as part of a sentence.
pub fn margins_text<'a>(margins: impl Iterator<Item = (Option<f64>, &'a str)>) -> String {
    let present = margins.filter_map(|(margin, name)| Some((margin?, name)));
    let texts: Vec<String> =
        present.map(|(margin, name)| format!("{:.1} % ({name})", margin * 100.0)).collect();
    if texts.is_empty() { String::new() } else { format!(", margins {}", texts.join(", ")) }
}

impl Observer for GuaranteeRecord {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        let values = sample.values;
        // At the stop time the status is that of the step before, which covers the state there.
        let begins = u64::from(!sample.last);
        self.ticks += begins;
        self.status = self.signals.status.as_ref().map(|status| values[status.place]);
        self.observe_way(sample);
        if self.is_in_force(values) {
            self.ticks_in_force += begins;
            for (smallest, (_, place)) in self.margins.iter_mut().zip(&self.signals.margins) {
                *smallest = smallest.iter().copied().chain([values[*place]]).reduce(smaller);
            }
            self.broken |= self.signals.keeps.iter().any(|signal| signal.is_beyond_one(values));
            if self.unfounded.is_none() {
                let mut assumes = self.signals.assumes.iter();
                let beyond = assumes.find(|(_, signal)| signal.is_beyond_one(values));
                let found = beyond.map(|(text, _)| text).or(self.wrong_delay.as_ref());
                self.unfounded = found.map(|text| (sample.time, text.clone()));
            }
        } else if self.ticks_in_force > 0 && self.lost.is_none() {
            self.lost = Some(GuaranteeLoss { time: sample.time, status: self.status });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a record from rows of values: in force, status, margins of rate and moment, and rate
    /// and moment, whose limits are 0.1 and 10.
    fn record(rows: &[[f64; 6]]) -> GuaranteeRecord {
        let keeps = |place| Resolved::variable(place);
        let mut record = GuaranteeRecord::new(GuaranteeSignals {
            in_force: 0,
            status: Some(Probed { place: 1, ..Probed::default() }),
            margins: vec![("rate".into(), 2), ("moment".into(), 3)],
            keeps: vec![keeps(4), keeps(5)],
            ..GuaranteeSignals::default()
        });
        for (tick, row) in rows.iter().enumerate() {
            let mut values = *row;
            (values[4], values[5]) = (row[4] / 0.1, row[5] / 10.0);
            let time = 0.5 * tick as f64;
            let last = tick + 1 == rows.len();
            record.observe(&Sample { tick: tick as u64, time, last, values: &values }).unwrap();
        }
        record
    }

    #[test]
    fn oracle_share_loss_and_margins_by_hand() {
        let record = record(&[
            // The guarantee is not in force yet: this is no loss, and margins and limits do not
            // count.
            [0.0, 2.0, -1.0, -1.0, 9.0, 99.0],
            [1.0, 1.0, 0.3, 0.1, 0.05, 5.0],
            [1.0, 1.0, 0.2, 0.4, 0.1, 10.0],
            [0.0, 5.0, -1.0, -1.0, 0.2, 5.0],
            // This second loss does not replace the first.
            [1.0, 1.0, 0.5, 0.5, 0.0, 0.0],
            [0.0, 4.0, 0.0, 0.0, 0.0, 0.0],
        ]);
        // At the last row no step begins.
        assert_eq!(record.share(), Some(0.6));
        assert_eq!(record.lost, Some(GuaranteeLoss { time: 1.5, status: Some(5.0) }));
        assert_eq!(record.status(), Some(5.0));
        assert_eq!(record.margins, [Some(0.2), Some(0.1)]);
        assert!(!record.broken);
    }

    #[test]
    fn a_limit_that_is_exceeded_in_force_is_a_defect() {
        assert!(!record(&[[1.0, 1.0, 0.0, 0.0, 0.1 * (1.0 + 1e-12), 10.0]]).broken);
        assert!(record(&[[1.0, 1.0, 0.0, 0.0, 0.1001, 0.0]]).broken);
        assert!(record(&[[1.0, 1.0, 0.0, 0.0, 0.0, 10.01]]).broken);
        assert!(record(&[[1.0, 1.0, 0.0, 0.0, f64::NAN, 0.0]]).broken);
        assert!(!record(&[[0.0, 3.0, 0.0, 0.0, 0.2, 20.0]]).broken);
    }

    #[test]
    fn an_error_beyond_the_declared_is_told_only_while_in_force() {
        let error = Resolved { over: Some(2), ..Resolved::difference(1, 3) };
        let record = |rows: &[[f64; 4]], wrong_delay: Option<&str>| {
            let assumes =
                vec![("other".into(), Resolved::variable(3)), ("error".into(), error.clone())];
            let signals = GuaranteeSignals { assumes, ..GuaranteeSignals::default() };
            let mut record = GuaranteeRecord::new(signals);
            record.wrong_delay = wrong_delay.map(String::from);
            for (tick, values) in rows.iter().enumerate() {
                let (tick, time) = (tick as u64, tick as f64);
                record.observe(&Sample { tick, time, last: false, values }).unwrap();
            }
            record.unfounded
        };
        let unfounded = |rows: &[[f64; 4]]| record(rows, None);
        let error_at = |time| Some((time, "error".to_string()));
        // In force, measured, declared, true: without an error none need be declared.
        assert_eq!(unfounded(&[[1.0, 0.5, 0.0, 0.5], [1.0, 0.5, 0.1, 0.6]]), None);
        assert_eq!(unfounded(&[[0.0, 0.5, 0.0, 0.6], [1.0, 0.5, 0.2, 0.6]]), None);
        let broken = [[1.0, 0.5, 0.2, 0.6], [1.0, 0.5, 0.0, 0.6], [1.0, 0.5, 0.0, 9.0]];
        assert_eq!(unfounded(&broken), error_at(1.0));
        assert_eq!(unfounded(&[[1.0, f64::NAN, 1.0, 0.0]]), error_at(0.0));
        // What is wrong at any time is told when the guarantee comes into force.
        let comes = [[0.0; 4], [1.0, 0.0, 0.0, 0.0]];
        assert_eq!(record(&comes, Some("delay")), Some((1.0, "delay".into())));
    }

    #[test]
    fn an_arrival_is_late_after_three_times_the_designed_time() {
        let late = |rows: &[[f64; 3]]| {
            let signals = vec![Resolved::variable(1)];
            let late = Some(LateSignals { signals, beyond: 10.0, time: 2 });
            let signals = GuaranteeSignals { late, ..GuaranteeSignals::default() };
            let mut record = GuaranteeRecord::new(signals);
            for (tick, values) in rows.iter().enumerate() {
                let (tick, time) = (tick as u64, 1e9 + 2.0 * tick as f64);
                record.observe(&Sample { tick, time, last: false, values }).unwrap();
            }
            record.late
        };
        // In force, distance, designed time.
        let away = [1.0, 11.0, 1.9];
        assert_eq!(late(&[away; 4]), Some(1e9 + 6.0));
        assert_eq!(late(&[[1.0, 11.0, 2.0]; 4]), None);
        assert_eq!(late(&[away, away, [1.0, 10.0, 1.9], away, away, away]), None);
        assert_eq!(late(&[away, away, [0.0, 11.0, 1.9], away, away, away]), None);
    }

    #[test]
    fn what_was_never_in_force_was_not_lost_and_has_no_margins() {
        let record = record(&[[0.0, 2.0, 0.1, 0.1, 0.0, 0.0], [0.0, 3.0, 0.1, 0.1, 0.0, 0.0]]);
        assert_eq!((record.share(), record.lost, record.status()), (Some(0.0), None, Some(3.0)));
        assert_eq!(record.margins, [None; 2]);
    }

    #[test]
    fn a_margin_that_is_not_a_number_is_not_hidden() {
        let record = record(&[[1.0, 1.0, 0.1, f64::NAN, 0.0, 0.0], [1.0, 1.0, 0.1, 0.1, 0.0, 0.0]]);
        assert!(record.margins[1].is_some_and(f64::is_nan));
    }
}
