//! The pacer keeps a run in step with a timer and checks the deadlines.

use super::distribution::Distribution;
use super::report::{ComponentTiming, Lag, Late, RealTime};
use super::timer::Timer;
use super::{OnMiss, Settings};
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::stopwatch::Spent;
use fmi_master::clock::Clock;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

/// Longest uninterrupted part of a wait. After each part the pacer checks whether the run is to
/// end.
const PIECE: Duration = Duration::from_millis(100);

/// A deadline that a component missed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    /// Index of the component whose values were late.
    pub component: usize,
    /// Simulated time of the communication point that the values belong to, s.
    pub time: f64,
    /// Time from the deadline until the values were ready.
    pub late: Duration,
    /// Delay with which the communication point began, because of the wake-up or of earlier work.
    pub lag: Duration,
    /// Longest step since the run last waited: the likely cause of the miss, if it is not the
    /// component itself.
    pub longest: Step,
}

/// One step of a component, with its duration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Index of the component that was stepped.
    pub component: usize,
    /// Simulated time of the communication point at its end, s.
    pub time: f64,
    /// Computing time spent in the instance.
    pub duration: Duration,
}

/// A component with its timing, as the pacer needs it.
struct Task {
    name: String,
    every: u32,
    spent: Rc<Spent>,
    /// Computing time of this component that earlier communication points have already counted.
    counted: Duration,
    steps: Distribution,
    responses: Distribution,
    wake_ups: Distribution,
    misses: u64,
}

/// Keeps a run in step with a timer, and records how well it did.
pub struct Pacer {
    settings: Settings,
    clock: Clock,
    timer: Rc<dyn Timer>,
    interrupt: Interrupt,
    tasks: Vec<Task>,
    /// Instant of the simulation's start on the timer.
    began: Duration,
    elapsed: Duration,
    /// Instant at which the work of the current tick began. `tick_spent` is the computing time of
    /// all instances up to then.
    tick_began: Duration,
    tick_spent: Duration,
    /// Wake-up jitter of the current tick, if there was a wait.
    woken: Option<Duration>,
    longest: Step,
    first: Option<Miss>,
    worst: Option<Miss>,
    late_starts: u64,
    largest_lag: Duration,
    /// Number of deadlines checked so far.
    deadlines: u64,
    /// Number of deadlines missed so far.
    misses: u64,
    /// Delay with which the current communication point began.
    lag: Duration,
    /// Time that the orchestrator itself takes at a communication point.
    overhead: Distribution,
    wake_ups: Distribution,
}

impl Pacer {
    /// Creates a pacer for components, each given by its name, its period in ticks, and its
    /// accumulated computing time.
    pub fn new(
        settings: Settings,
        clock: Clock,
        timer: Rc<dyn Timer>,
        interrupt: Interrupt,
        components: impl Iterator<Item = (String, u32, Rc<Spent>)>,
    ) -> Self {
        let tasks = components.map(|(name, every, spent)| Task {
            name,
            every,
            counted: spent.time(),
            spent,
            steps: Distribution::default(),
            responses: Distribution::default(),
            wake_ups: Distribution::default(),
            misses: 0,
        });
        Self {
            tasks: tasks.collect(),
            settings,
            clock,
            timer,
            interrupt,
            began: Duration::ZERO,
            elapsed: Duration::ZERO,
            tick_began: Duration::ZERO,
            tick_spent: Duration::ZERO,
            woken: None,
            longest: Step::default(),
            first: None,
            worst: None,
            late_starts: 0,
            largest_lag: Duration::ZERO,
            deadlines: 0,
            misses: 0,
            lag: Duration::ZERO,
            overhead: Distribution::default(),
            wake_ups: Distribution::default(),
        }
    }

    /// Waits for a communication point, unless it has passed. Returns early if the run is to end.
    pub fn wait(&mut self, tick: u64) {
        let now = self.timer.now();
        if tick == 0 {
            self.began = now;
        } else {
            self.count_overhead(now);
        }
        let release = self.release(tick);
        if now < release {
            self.sleep_until(release);
            self.longest = Step::default();
            self.woken = Some(self.timer.now().saturating_sub(release));
        } else {
            self.woken = None;
            self.late_starts += u64::from(now > release);
        }
        self.tick_began = self.timer.now();
        self.tick_spent = self.spent();
        self.lag = self.tick_began.saturating_sub(release);
        self.largest_lag = self.largest_lag.max(self.lag);
    }

    fn sleep_until(&self, release: Duration) {
        while self.interrupt.asked().is_none() {
            let piece = self.timer.now() + PIECE;
            if piece >= release {
                self.timer.sleep_until(release);
                return;
            }
            self.timer.sleep_until(piece);
        }
    }

    /// Records the components' computing times at a communication point, and checks their
    /// deadlines.
    ///
    /// # Errors
    /// Returns an error if a deadline was missed and the settings say that this ends the run.
    pub fn check(&mut self, tick: u64) -> Result<(), Error> {
        let time = self.clock.time(tick);
        if let Some(woken) = self.woken {
            self.wake_ups.record(woken);
        }
        let release = self.release(tick);
        for (component, task) in self.tasks.iter_mut().enumerate() {
            if !self.clock.begins(tick, task.every) {
                continue;
            }
            let duration = task.spent.time().saturating_sub(task.counted);
            task.counted += duration;
            task.steps.record(duration);
            task.responses.record(task.spent.ended().saturating_sub(release));
            if let Some(woken) = self.woken {
                task.wake_ups.record(woken);
            }
            if duration > self.longest.duration {
                self.longest = Step { component, time, duration };
            }
        }
        let mut outcome = Ok(());
        for component in 0..self.tasks.len() {
            let task = &self.tasks[component];
            if !self.clock.begins(tick, task.every) {
                continue;
            }
            let late =
                task.spent.ended().saturating_sub(self.release(tick + u64::from(task.every)));
            self.deadlines += 1;
            if !late.is_zero() {
                let miss = Miss { component, time, late, lag: self.lag, longest: self.longest };
                self.note(miss);
                if self.settings.on_miss == OnMiss::Stop && outcome.is_ok() {
                    let Late { component, time, late_ms, .. } = self.late(miss);
                    outcome = Err(Error::Deadline { component, time, late_ms });
                }
            }
        }
        outcome
    }

    fn note(&mut self, miss: Miss) {
        self.misses += 1;
        self.tasks[miss.component].misses += 1;
        self.first = self.first.or(Some(miss));
        if self.worst.is_none_or(|worst| miss.late > worst.late) {
            self.worst = Some(miss);
        }
    }

    /// Records the end of the run.
    pub fn finish(&mut self) {
        let now = self.timer.now();
        self.count_overhead(now);
        self.elapsed = now.saturating_sub(self.began);
    }

    /// Returns the instant of a communication point on the timer. Ticks continue beyond the stop
    /// time, because deadlines may lie there.
    fn release(&self, tick: u64) -> Duration {
        let simulated = if tick <= self.clock.ticks() {
            self.clock.time(tick) - self.clock.start()
        } else {
            tick as f64 * self.clock.step()
        };
        let after = Duration::try_from_secs_f64(simulated / self.settings.factor.get())
            .unwrap_or(Duration::MAX);
        self.began.saturating_add(after)
    }

    fn spent(&self) -> Duration {
        self.tasks.iter().map(|task| task.spent.time()).sum()
    }

    fn count_overhead(&mut self, now: Duration) {
        let in_instances = self.spent().saturating_sub(self.tick_spent);
        self.overhead.record(now.saturating_sub(self.tick_began).saturating_sub(in_instances));
    }

    fn late(&self, miss: Miss) -> Late {
        let milliseconds = |duration: Duration| duration.as_secs_f64() * 1e3;
        Late {
            component: self.tasks[miss.component].name.clone(),
            time: shown(miss.time),
            late_ms: milliseconds(miss.late),
            lag_ms: milliseconds(miss.lag),
            longest: self.tasks[miss.longest.component].name.clone(),
            longest_time: shown(miss.longest.time),
            longest_ms: milliseconds(miss.longest.duration),
        }
    }

    /// Returns the timing report of the run.
    pub fn report(self) -> RealTime {
        let (first_miss, worst_miss) =
            (self.first.map(|m| self.late(m)), self.worst.map(|m| self.late(m)));
        let milliseconds = |duration: Duration| duration.as_secs_f64() * 1e3;
        let period = self.clock.step() / self.settings.factor.get() * 1e3;
        let mut components = BTreeMap::new();
        for task in self.tasks {
            let component = ComponentTiming {
                period_ms: period * f64::from(task.every),
                misses: task.misses,
                step_ms: task.steps.summary(),
                response_ms: task.responses.summary(),
                wake_up_ms: task.wake_ups.summary(),
            };
            components.insert(task.name, component);
        }
        RealTime {
            factor: self.settings.factor,
            on_miss: self.settings.on_miss,
            elapsed_s: self.elapsed.as_secs_f64(),
            deadlines: self.deadlines,
            misses: self.misses,
            first_miss,
            worst_miss,
            lag: Lag {
                late_starts: self.late_starts,
                largest_ms: milliseconds(self.largest_lag),
                at_end_ms: milliseconds(self.lag),
            },
            components,
            wake_up_ms: self.wake_ups.summary(),
            orchestrator_ms: self.overhead.summary(),
        }
    }
}

/// Rounds a time, to remove digits that come from the multiplication of tick and step.
fn shown(time: f64) -> f64 {
    (time * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests;
