//! Runs that keep in step with the wall clock.
//!
//! Communication point t is due at t₀ + (t − start) / factor on the monotonic clock: these instants
//! are absolute, so that errors do not accumulate. The master waits for each instant ([`crate::timer`]),
//! then steps the instances and transfers values. The values that a component computes at one of
//! its communication points must be ready before its next one; if they are not, a *deadline is
//! missed*. The run then continues at once, without waiting, until it is back in step.

use crate::interrupt::Interrupt;
use crate::stopwatch::Spent;
use crate::timer::Timer;
use fmi_master::clock::Clock;
use fmi_master::quantity::rounded;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;
use std::str::FromStr;
use std::time::Duration;

/// Longest uninterrupted part of a wait. After each part the pacer checks whether the run is to
/// end.
const PIECE: Duration = Duration::from_millis(100);

/// A real-time factor, which is finite and positive: simulated time divided by elapsed time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Factor(f64);

impl FromStr for Factor {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let factor: f64 = text.parse().map_err(|_| {
            "not a number; write the experiment before --real-time, or --real-time=1".to_string()
        })?;
        if factor > 0.0 && factor.is_finite() {
            Ok(Self(factor))
        } else {
            Err("the factor must be finite and above 0: 1 is real time, 20 is twenty times as fast"
                .into())
        }
    }
}

/// How well a run kept in step; `metrics.json` holds it under `real_time`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RealTime {
    /// Simulated time divided by elapsed time, as requested.
    pub factor: Factor,
    /// Number of deadlines that were checked.
    pub deadlines: u64,
    /// Number of deadlines that each component missed, by its name.
    pub misses: BTreeMap<String, u64>,
    /// The missed deadline with the longest delay.
    pub worst_miss: Option<Miss>,
}

/// A missed deadline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Miss {
    /// Name of the component whose values were late.
    pub component: String,
    /// Simulated time of the communication point that the values belong to, s.
    pub time: f64,
    /// Time from the deadline until the values were ready, ms.
    pub late_ms: f64,
}

impl fmt::Display for RealTime {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let missed: u64 = self.misses.values().sum();
        write!(f, "factor {}: {missed} of {} deadlines missed", self.factor.0, self.deadlines)?;
        let Some(Miss { component, time, late_ms }) = &self.worst_miss else { return Ok(()) };
        let time = rounded(*time);
        write!(f, "; at worst {component} at t = {time} s, {late_ms:.3} ms late")
    }
}

/// Keeps a run in step with a timer, and counts missed deadlines.
pub struct Pacer {
    clock: Clock,
    timer: Rc<dyn Timer>,
    interrupt: Interrupt,
    /// Name, period in ticks, and computing time of each component.
    components: Vec<(String, u32, Rc<Spent>)>,
    /// Instant of the simulation's start on the timer.
    began: Duration,
    report: RealTime,
}

impl Pacer {
    /// Creates a pacer for components, each given by its name, its period in ticks, and its
    /// computing time.
    pub fn new(
        factor: Factor,
        clock: Clock,
        timer: Rc<dyn Timer>,
        interrupt: Interrupt,
        components: impl Iterator<Item = (String, u32, Rc<Spent>)>,
    ) -> Self {
        let components: Vec<_> = components.collect();
        let misses = components.iter().map(|(name, ..)| (name.clone(), 0)).collect();
        let report = RealTime { factor, deadlines: 0, misses, worst_miss: None };
        Self { clock, timer, interrupt, components, began: Duration::ZERO, report }
    }

    /// Waits for a communication point, unless it has passed. Returns early if the run is to end.
    pub fn wait(&mut self, tick: u64) {
        if tick == 0 {
            self.began = self.timer.now();
        }
        let release = self.release(tick);
        while self.timer.now() < release && self.interrupt.asked().is_none() {
            self.timer.sleep_until(release.min(self.timer.now() + PIECE));
        }
    }

    /// Checks the deadlines of the values that belong to a communication point.
    pub fn check(&mut self, tick: u64) {
        for (name, every, spent) in &self.components {
            if !self.clock.begins(tick, *every) {
                continue;
            }
            self.report.deadlines += 1;
            let deadline = self.release(tick + u64::from(*every));
            let Some(late) = spent.ended().checked_sub(deadline).filter(|late| !late.is_zero())
            else {
                continue;
            };
            *self.report.misses.entry(name.clone()).or_default() += 1;
            let late_ms = late.as_secs_f64() * 1e3;
            if self.report.worst_miss.as_ref().is_none_or(|worst| late_ms > worst.late_ms) {
                let (component, time) = (name.clone(), self.clock.time(tick));
                self.report.worst_miss = Some(Miss { component, time, late_ms });
            }
        }
    }

    /// Returns the instant of a communication point on the timer. Ticks continue beyond the stop
    /// time, because deadlines may lie there.
    fn release(&self, tick: u64) -> Duration {
        let simulated = if tick <= self.clock.ticks() {
            self.clock.time(tick) - self.clock.start()
        } else {
            tick as f64 * self.clock.step()
        };
        let after =
            Duration::try_from_secs_f64(simulated / self.report.factor.0).unwrap_or(Duration::MAX);
        self.began.saturating_add(after)
    }

    /// Returns how well the run kept in step.
    pub fn report(self) -> RealTime {
        self.report
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timer::fake::Fake;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_factor_is_finite_and_positive() {
        assert_eq!("20".parse::<Factor>().unwrap().0, 20.0);
        for text in ["0", "-1", "nan", "inf", "-inf", "-0"] {
            let message = text.parse::<Factor>().unwrap_err();
            assert!(message.contains("finite and above 0"), "{text}: {message}");
        }
        assert!("fast".parse::<Factor>().unwrap_err().contains("not a number"));
    }

    /// Paces components with these periods (ticks) through 10 ticks of 1 s at factor 100, that is,
    /// of 10 ms. `work` gives the time (ms) that a component computes at a tick. Returns the report
    /// and the instant at which each tick began, ms.
    fn paced(
        every: &[u32],
        jitter: Duration,
        work: impl Fn(usize, u64) -> u32,
    ) -> (RealTime, Vec<u128>) {
        let timer = Rc::new(Fake { jitter, ..Fake::default() });
        // The origin of the timer differs from the start of the run.
        timer.pass(12345 * MS);
        let clock = Clock::new(5.0, 15.0, 1.0).unwrap();
        let spent: Vec<Rc<Spent>> = every.iter().map(|_| Rc::default()).collect();
        let components = ["controller", "plant"].into_iter().zip(every).zip(&spent);
        let components =
            components.map(|((name, every), spent)| (name.to_string(), *every, Rc::clone(spent)));
        let (factor, interrupt) = ("100".parse().unwrap(), Interrupt::default());
        let mut pacer = Pacer::new(factor, clock, timer.clone(), interrupt, components);
        let mut begins = Vec::new();
        for tick in 0..=clock.ticks() {
            pacer.wait(tick);
            begins.push(timer.now().as_millis() - 12345);
            for (index, (&every, spent)) in every.iter().zip(&spent).enumerate() {
                let every = u64::from(every);
                if tick.is_multiple_of(every) && tick + every <= clock.ticks() {
                    let begin = timer.now();
                    timer.pass(work(index, tick) * MS);
                    spent.add(begin, timer.now());
                }
            }
            pacer.check(tick);
            // The observers take this time.
            timer.pass(MS);
        }
        (pacer.report(), begins)
    }

    #[test]
    fn oracle_a_run_that_keeps_up_begins_every_tick_in_time() {
        let (report, begins) = paced(&[1, 1], Duration::ZERO, |_, _| 4);
        assert_eq!(begins, (0..=10).map(|tick| tick * 10).collect::<Vec<_>>());
        assert_eq!((report.deadlines, &report.worst_miss), (20, &None));
        assert_eq!(report.to_string(), "factor 100: 0 of 20 deadlines missed");
    }

    #[test]
    fn oracle_wake_up_jitter_adds_up_to_nothing() {
        let (_, begins) = paced(&[1, 5], 2 * MS, |_, _| 1);
        assert_eq!(begins[10], 102);
    }

    #[test]
    fn oracle_a_run_that_is_late_catches_up_to_the_original_time_base() {
        // A component computes for 25 ms at tick 3 and for 1 ms otherwise.
        let work = |_: usize, tick: u64| if tick == 3 { 25 } else { 1 };
        let (report, begins) = paced(&[1], Duration::ZERO, work);
        assert_eq!(begins[3..8], [30, 56, 58, 60, 70]);
        // The values of tick 4, due at 50, came at 57.
        assert_eq!((report.deadlines, report.misses["controller"]), (10, 2));
        let text =
            "factor 100: 2 of 10 deadlines missed; at worst controller at t = 8 s, 15.000 ms late";
        assert_eq!(report.to_string(), text);
    }

    #[test]
    fn oracle_a_slow_component_has_the_time_to_its_own_next_tick() {
        // The plant steps every 5 ticks of 10 ms and takes 25 ms, which is in time. The controller
        // steps at every tick, before it.
        let work = |index: usize, tick: u64| if index == 1 && tick == 5 { 25 } else { 1 };
        let (report, begins) = paced(&[1, 5], Duration::ZERO, work);
        assert_eq!(begins[5..9], [50, 77, 79, 81]);
        assert_eq!((report.misses["plant"], report.misses["controller"]), (0, 1));
        assert_eq!(report.deadlines, 12);
        // The controller's values of tick 6, due at 70, came at 78.
        let miss = report.worst_miss.unwrap();
        assert_eq!((miss.component.as_str(), miss.time), ("controller", 11.0));
        assert!((miss.late_ms - 8.0).abs() < 1e-9);
    }
}
