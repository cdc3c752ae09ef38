//! An instance whose calls are timed. All calls count, because an instance may do the work of a
//! step only when its outputs are read.

use crate::timer::Timer;
use fmi_master::forward;
use fmi_master::instance::{Instance, Outcome};
use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;

/// Computing time spent in an instance's calls so far.
#[derive(Debug, Default)]
pub struct Spent {
    time: Cell<Duration>,
    steps: Cell<u32>,
    ended: Cell<Duration>,
}

impl Spent {
    /// Returns the total time spent in the instance's calls.
    pub fn time(&self) -> Duration {
        self.time.get()
    }

    /// Adds a call that began and ended at these instants on the timer.
    pub(crate) fn add(&self, begin: Duration, end: Duration) {
        self.time.set(self.time.get() + end.saturating_sub(begin));
        self.ended.set(end);
    }

    /// Returns the instant on the timer at which the last call ended.
    pub fn ended(&self) -> Duration {
        self.ended.get()
    }

    /// Returns the mean time per step, s; `None` before the first step.
    pub fn seconds_per_step(&self) -> Option<f64> {
        let steps = self.steps.get();
        (steps > 0).then(|| self.time.get().as_secs_f64() / f64::from(steps))
    }
}

/// An instance whose calls are timed.
pub(crate) struct Stopwatch {
    instance: Box<dyn Instance>,
    timer: Rc<dyn Timer>,
    spent: Rc<Spent>,
}

impl Stopwatch {
    /// Wraps an instance so that it is timed from now on. Also returns the shared record of the
    /// time.
    pub(crate) fn new(instance: Box<dyn Instance>, timer: Rc<dyn Timer>) -> (Self, Rc<Spent>) {
        let spent = Rc::new(Spent::default());
        (Self { instance, timer, spent: Rc::clone(&spent) }, spent)
    }

    fn inside(&mut self, call: impl FnOnce(&mut dyn Instance) -> Outcome) -> Outcome {
        call(self.instance.as_mut())
    }

    fn time(&mut self, call: impl FnOnce(&mut dyn Instance) -> Outcome) -> Outcome {
        let begin = self.timer.now();
        let outcome = call(self.instance.as_mut());
        self.spent.add(begin, self.timer.now());
        outcome
    }
}

impl Instance for Stopwatch {
    forward! {
        time:
        get_real, get_integer, get_boolean, set_real, set_integer, set_boolean, set_string,
    }

    forward! {
        inside:
        enter_initialization, exit_initialization, terminate, reset, save, restore,
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        self.spent.steps.set(self.spent.steps.get() + 1);
        self.time(|instance| instance.do_step(time, step))
    }
}
