//! The guarantee that a controller gives on rate and moment: at which ticks it is in force, and whether it is kept.

use crate::error::Error;
use crate::master::{Observer, Sample};
use crate::metrics::{Limits, Places, norm_squared};

/// Places of the variables in which a controller says whether its guarantee is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signals {
    /// Whether rate and moment are guaranteed to keep their limits.
    pub in_force: usize,
    /// Why it is in force or not, as an item of an enumeration.
    pub status: Option<usize>,
    /// Smallest shares of the limits of rate and moment that the plan leaves beyond what is reserved.
    pub margins: [Option<usize>; 2],
}

/// The first tick at which the guarantee was no longer in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Time of that tick, s.
    pub time: f64,
    /// Status of the guarantee at that tick.
    pub status: Option<f64>,
}

/// Course of the guarantee up to a tick.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    signals: Signals,
    places: Places,
    limits: Limits,
    ticks: u64,
    ticks_in_force: u64,
    status: Option<f64>,
    /// Tick at which the guarantee was first lost, if it was.
    pub lost: Option<Loss>,
    /// Smallest margins of rate and moment while it was in force.
    pub margins: [Option<f64>; 2],
    /// Whether a limit was exceeded at a tick at which it was in force.
    pub broken: bool,
}

/// Tolerance with which limits count as met, because of rounding.
const ROUNDING: f64 = 1e-9;

/// Whether a vector is longer than its limit. One that is not a number is.
fn exceeds(values: &[f64], places: Option<[usize; 3]>, limit: Option<f64>) -> bool {
    let (Some(places), Some(limit)) = (places, limit) else { return false };
    let norm = norm_squared(values, places).sqrt();
    norm.is_nan() || norm > limit * (1.0 + ROUNDING)
}

/// The smaller value. Unlike `f64::min` it does not hide a value that is not a number.
fn smaller(a: f64, b: f64) -> f64 {
    if b < a || b.is_nan() { b } else { a }
}

impl Course {
    /// Creates a course without samples; `None` if no component reports on a guarantee.
    pub fn new(places: Places, limits: Limits) -> Option<Self> {
        Some(Self {
            signals: places.guarantee?,
            places,
            limits,
            ticks: 0,
            ticks_in_force: 0,
            status: None,
            lost: None,
            margins: [None; 2],
            broken: false,
        })
    }

    /// Share of the ticks at which it was in force; `None` before the first.
    pub fn share(&self) -> Option<f64> {
        (self.ticks > 0).then(|| self.ticks_in_force as f64 / self.ticks as f64)
    }

    /// Whether these values say that the guarantee is in force.
    pub fn is_in_force(&self, values: &[f64]) -> bool {
        values[self.signals.in_force] != 0.0
    }

    /// Margins of rate and moment by these values.
    pub fn margins_at(&self, values: &[f64]) -> [Option<f64>; 2] {
        self.signals.margins.map(|place| place.map(|place| values[place]))
    }

    /// Status of the guarantee at the last tick seen.
    pub fn status_now(&self) -> Option<f64> {
        self.status
    }

    /// Status when it was first lost; if it never was, the present one.
    pub fn status(&self) -> Option<f64> {
        self.lost.map_or(self.status, |loss| loss.status)
    }

    /// Whether there are limits with which the guarantee can be checked.
    pub fn is_checked(&self) -> bool {
        let Places { rate, moment, .. } = self.places;
        rate.and(self.limits.rate).or(moment.and(self.limits.moment)).is_some()
    }
}

impl Observer for Course {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        let values = sample.values;
        self.ticks += 1;
        self.status = self.signals.status.map(|place| values[place]);
        if self.is_in_force(values) {
            self.ticks_in_force += 1;
            let margins = self.margins_at(values);
            for (smallest, now) in self.margins.iter_mut().zip(margins) {
                *smallest = smallest.iter().copied().chain(now).reduce(smaller);
            }
            self.broken |= exceeds(values, self.places.rate, self.limits.rate)
                || exceeds(values, self.places.moment, self.limits.moment);
        } else if self.ticks_in_force > 0 && self.lost.is_none() {
            self.lost = Some(Loss { time: sample.time, status: self.status });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values: in force, status, margins of rate and moment, rate, moment, a zero.
    fn course(rows: &[[f64; 6]]) -> Course {
        let places = Places {
            rate: Some([4, 6, 6]),
            moment: Some([5, 6, 6]),
            guarantee: Some(Signals { in_force: 0, status: Some(1), margins: [Some(2), Some(3)] }),
            ..Places::default()
        };
        let mut course = Course::new(places, Limits { rate: Some(0.1), moment: Some(10.0) }).unwrap();
        for (tick, row) in rows.iter().enumerate() {
            let values: Vec<f64> = row.iter().copied().chain([0.0]).collect();
            let time = 0.5 * tick as f64;
            let last = tick + 1 == rows.len();
            course.observe(&Sample { tick: tick as u64, time, last, values: &values }).unwrap();
        }
        course
    }

    #[test]
    fn oracle_share_loss_and_margins_by_hand() {
        let course = course(&[
            // Not in force yet: no loss, and its margins and limits do not count.
            [0.0, 2.0, -1.0, -1.0, 9.0, 99.0],
            [1.0, 1.0, 0.3, 0.1, 0.05, 5.0],
            [1.0, 1.0, 0.2, 0.4, 0.1, 10.0],
            [0.0, 5.0, -1.0, -1.0, 0.2, 5.0],
            // A second loss is not the first.
            [1.0, 1.0, 0.5, 0.5, 0.0, 0.0],
            [0.0, 4.0, 0.0, 0.0, 0.0, 0.0],
        ]);
        assert_eq!(course.share(), Some(0.5));
        assert_eq!(course.lost, Some(Loss { time: 1.5, status: Some(5.0) }));
        assert_eq!(course.status(), Some(5.0));
        assert_eq!(course.margins, [Some(0.2), Some(0.1)]);
        assert!(course.is_checked() && !course.broken);
    }

    #[test]
    fn a_limit_that_is_exceeded_in_force_is_a_defect() {
        assert!(!course(&[[1.0, 1.0, 0.0, 0.0, 0.1 * (1.0 + 1e-12), 10.0]]).broken);
        assert!(course(&[[1.0, 1.0, 0.0, 0.0, 0.1001, 0.0]]).broken);
        assert!(course(&[[1.0, 1.0, 0.0, 0.0, 0.0, 10.01]]).broken);
        assert!(course(&[[1.0, 1.0, 0.0, 0.0, f64::NAN, 0.0]]).broken);
        assert!(!course(&[[0.0, 3.0, 0.0, 0.0, 0.2, 20.0]]).broken);
    }

    #[test]
    fn what_was_never_in_force_was_not_lost_and_has_no_margins() {
        let course = course(&[[0.0, 2.0, 0.1, 0.1, 0.0, 0.0], [0.0, 3.0, 0.1, 0.1, 0.0, 0.0]]);
        assert_eq!((course.share(), course.lost, course.status()), (Some(0.0), None, Some(3.0)));
        assert_eq!(course.margins, [None; 2]);
    }

    #[test]
    fn a_margin_that_is_not_a_number_is_not_hidden() {
        let course = course(&[[1.0, 1.0, 0.1, f64::NAN, 0.0, 0.0], [1.0, 1.0, 0.1, 0.1, 0.0, 0.0]]);
        assert!(course.margins[1].is_some_and(f64::is_nan));
    }

    #[test]
    fn a_controller_without_guarantee_has_no_course() {
        assert!(Course::new(Places::default(), Limits::default()).is_none());
    }
}
