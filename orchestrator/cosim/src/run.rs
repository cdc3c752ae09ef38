//! A run of an experiment's instances: it can be paced by the wall clock and ended from outside,
//! and observers see it.

use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::pacing::{Factor, Pacer};
use crate::stopwatch::{Spent, Stopwatch};
use crate::timer::{Monotonic, Timer};
use fmi_master::master::{Failed, Master, Member, Watcher};
use fmu_import::warnings;
use std::rc::Rc;

pub use fmi_master::master::Sample;

/// An observer is called at every communication point, for example to record results, to accumulate
/// the figures of merit, or to show progress.
pub trait Observer {
    /// Processes the values of one communication point.
    ///
    /// # Errors
    /// An error that the observer returns ends the run.
    fn observe(&mut self, sample: &Sample) -> Result<(), Error>;
}

/// Initialized instances, with the pacer and the interrupt of their run.
pub struct Run {
    /// The instances with their connections.
    pub master: Master,
    /// Accumulated computing time of each instance; empty unless it is measured.
    spent: Vec<Rc<Spent>>,
    pacer: Option<Pacer>,
    interrupt: Interrupt,
}

impl Run {
    /// Creates a run, which can be ended from outside through the interrupt.
    pub(crate) fn new(master: Master, interrupt: &Interrupt) -> Self {
        Self { master, spent: Vec::new(), pacer: None, interrupt: interrupt.clone() }
    }

    /// Paces the run from now on, so that it keeps in step with the timer.
    pub fn pace(&mut self, factor: Factor, timer: Rc<dyn Timer>) {
        self.measure(&timer);
        let spent = self.master.members.iter().zip(&self.spent);
        let components =
            spent.map(|(member, spent)| (member.name.clone(), member.every, Rc::clone(spent)));
        let (clock, interrupt) = (self.master.clock(), self.interrupt.clone());
        self.pacer = Some(Pacer::new(factor, clock, timer, interrupt, components));
    }

    /// Removes the pacer that kept the run in step and returns it; `None` if the run was not paced.
    pub fn take_pacer(&mut self) -> Option<Pacer> {
        self.pacer.take()
    }

    /// Measures the computing time of each instance from now on.
    pub fn measure_time(&mut self) {
        let timer: Rc<dyn Timer> = Rc::new(Monotonic);
        self.measure(&timer);
    }

    fn measure(&mut self, timer: &Rc<dyn Timer>) {
        let members = std::mem::take(&mut self.master.members).into_iter();
        (self.master.members, self.spent) = members
            .map(|member| {
                let (instance, spent) = Stopwatch::new(member.instance, Rc::clone(timer));
                (Member { instance: Box::new(instance), ..member }, spent)
            })
            .unzip();
    }

    /// Returns the mean wall-clock time that each instance took per step, s, by name. There are no
    /// entries if it was not measured.
    pub fn step_seconds(&self) -> impl Iterator<Item = (&str, f64)> {
        let spent = self.master.members.iter().zip(&self.spent);
        spent.filter_map(|(member, spent)| Some((member.name.as_str(), spent.seconds_per_step()?)))
    }

    /// Runs from the start time to the stop time.
    ///
    /// # Errors
    /// Returns an error if an instance or an observer fails, or if the run was asked to end. The
    /// observers have seen all communication points up to then.
    pub fn run(&mut self, observers: &mut [&mut dyn Observer]) -> Result<(), Error> {
        let Self { master, pacer, interrupt, .. } = self;
        let mut watch = Watch { pacer: pacer.as_mut(), interrupt, is_step: false, observers };
        master.run(&mut watch)
    }

    /// Does the steps of this tick, which must follow the last one; tick 0 follows initialization.
    /// Returns the probed values at this tick, in the order in which the probes were requested.
    ///
    /// # Errors
    /// Returns an error if an instance fails, or if the run was ended from outside.
    pub fn advance(&mut self, tick: u64) -> Result<&[f64], Error> {
        begin(self.master.clock().time(tick), &self.interrupt)?;
        self.master.advance(tick).map_err(|failed| Error::from(failed).or(self.interrupt.asked()))
    }
}

/// Begins the tick at this time (s), unless the run was asked to end.
fn begin(time: f64, interrupt: &Interrupt) -> Result<(), Error> {
    if let Some(request) = interrupt.asked() {
        return Err(Error::Interrupted { time, request });
    }
    warnings::at(time);
    Ok(())
}

/// Holds each tick until it is due, and hands its values to the observers.
struct Watch<'a, 'b> {
    pacer: Option<&'a mut Pacer>,
    interrupt: &'a Interrupt,
    /// Whether the next values are those of a tick. The moment at which an instance ended the run
    /// is not a tick, and has no deadline.
    is_step: bool,
    observers: &'a mut [&'b mut dyn Observer],
}

impl Watcher for Watch<'_, '_> {
    type Error = Error;

    fn before(&mut self, tick: u64, time: f64) -> Result<(), Error> {
        if let Some(pacer) = &mut self.pacer {
            pacer.wait(tick);
        }
        self.is_step = true;
        begin(time, self.interrupt)
    }

    fn after(&mut self, sample: &Sample, outcome: Result<(), Failed>) -> Result<(), Error> {
        if let Some(pacer) = &mut self.pacer
            && std::mem::take(&mut self.is_step)
        {
            pacer.check(sample.tick);
        }
        for observer in self.observers.iter_mut() {
            observer.observe(sample)?;
        }
        outcome.map_err(|failed| Error::from(failed).or(self.interrupt.asked()))
    }
}
