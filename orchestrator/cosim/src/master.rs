//! The master algorithm, which transfers values at communication points and steps the units between
//! them.
//!
//! At tick k, every unit that has reached t_k receives its inputs; then the observers see the
//! probed values, and then time advances. A unit that steps at every n-th tick is stepped when its
//! interval *ends*: until then it stays at its last communication point, so that its outputs show
//! nothing of its future. Each unit sees the calls set, get and doStep in this order, as with any
//! master.

mod transfer;

pub use transfer::Member;

use crate::clock::Clock;
use crate::error::Error;
use crate::experiment::Coupling;
use crate::interrupt::Interrupt;
use crate::pacing::Settings;
use crate::pacing::pacer::Pacer;
use crate::pacing::timer::{Monotonic, Timer};
use crate::stopwatch::{Spent, Stopwatch};
use crate::wiring::{Port, Wire};
use fmu_import::unit::{CoSimulationUnit, Outcome, UnitFailure};
use fmu_import::warnings;
use std::rc::Rc;
use transfer::{Inputs, Probe};

/// The values that an observer sees at a communication point, after all inputs were transferred.
pub struct Sample<'a> {
    /// Number of the communication point, counted from 0.
    pub tick: u64,
    /// Simulated time of the communication point, s.
    pub time: f64,
    /// Whether this communication point is the stop time.
    pub last: bool,
    /// The probed values, in the order in which the probes were requested. Integers and booleans
    /// are converted to floats without loss.
    pub values: &'a [f64],
}

/// An observer is called at every communication point, for example to record results, to accumulate
/// the figures of merit, or to show progress.
pub trait Observer {
    /// Processes the values of one communication point.
    ///
    /// # Errors
    /// An error that the observer returns ends the run.
    fn observe(&mut self, sample: &Sample) -> Result<(), Error>;
}

/// The units with their connections, which are ready to run.
pub struct Master {
    clock: Clock,
    coupling: Coupling,
    members: Vec<Member>,
    /// Whether there are units whose steps are begun ahead.
    has_ahead: bool,
    inputs: Vec<Inputs>,
    probe: Probe,
    /// Accumulated computing time of each unit; empty unless it is measured.
    spent: Vec<Rc<Spent>>,
    pacer: Option<Pacer>,
    interrupt: Interrupt,
}

impl Master {
    /// Creates a master for units in this order; indices in `wires` and `probes` are positions in
    /// `members`.
    pub fn new(
        clock: Clock,
        coupling: Coupling,
        members: Vec<Member>,
        wires: &[Wire],
        probes: &[Port],
    ) -> Self {
        let inputs = (0..members.len()).map(|target| Inputs::new(wires, target)).collect();
        Self {
            clock,
            coupling,
            has_ahead: members.iter().any(|member| member.ahead),
            members,
            inputs,
            probe: Probe::new(probes),
            spent: Vec::new(),
            pacer: None,
            interrupt: Interrupt::default(),
        }
    }

    /// Sets the interrupt through which the run can be ended from outside. It must be set before
    /// [`Self::pace`] is called.
    pub fn heed(&mut self, interrupt: &Interrupt) {
        self.interrupt = interrupt.clone();
    }

    /// Paces the run from now on, so that it keeps in step with the timer.
    pub fn pace(&mut self, settings: Settings, timer: Rc<dyn Timer>) -> &Pacer {
        self.measure(&timer);
        let spent = self.members.iter().zip(&self.spent);
        let components =
            spent.map(|(member, spent)| (member.name.clone(), member.every, Rc::clone(spent)));
        let pacer = Pacer::new(settings, self.clock, timer, self.interrupt.clone(), components);
        self.pacer.insert(pacer)
    }

    /// Removes the pacer that kept the run in step and returns it; `None` if the run was not paced.
    pub fn take_pacer(&mut self) -> Option<Pacer> {
        self.pacer.take()
    }

    /// Measures the computing time of each unit from now on.
    pub fn measure_time(&mut self) {
        let timer: Rc<dyn Timer> = Rc::new(Monotonic);
        self.measure(&timer);
    }

    fn measure(&mut self, timer: &Rc<dyn Timer>) {
        self.has_ahead = false;
        let members = std::mem::take(&mut self.members).into_iter();
        (self.members, self.spent) = members
            .map(|Member { name, every, unit, .. }| {
                let (unit, spent) = Stopwatch::new(unit, Rc::clone(timer));
                // What two units compute at the same time could not be told apart.
                (Member { name, every, ahead: false, unit: Box::new(unit) }, spent)
            })
            .unzip();
    }

    /// Returns the mean wall-clock time that each unit took per step, s, by name. There are no
    /// entries if it was not measured.
    pub fn step_seconds(&self) -> impl Iterator<Item = (&str, f64)> {
        let spent = self.members.iter().zip(&self.spent);
        spent.filter_map(|(member, spent)| Some((member.name.as_str(), spent.seconds_per_step()?)))
    }

    /// Initializes all units; their inputs are transferred in initialization mode, in the members'
    /// order.
    ///
    /// # Errors
    /// Returns an error if a call of a unit fails.
    pub fn initialize(&mut self) -> Result<(), Error> {
        let start = self.clock.start();
        for index in 0..self.members.len() {
            let outcome = self.members[index].unit.enter_initialization(start, self.clock.stop());
            outcome.map_err(|failure| self.error(start, (index, failure)))?;
        }
        // Whatever the coupling, inputs are transferred one after the other here, so that the
        // simulation starts from consistent values.
        for index in 0..self.members.len() {
            self.pass_on(index).map_err(|culprit| self.error(start, culprit))?;
        }
        for index in 0..self.members.len() {
            let outcome = self.members[index].unit.exit_initialization();
            outcome.map_err(|failure| self.error(start, (index, failure)))?;
        }
        Ok(())
    }

    /// Sets all units back to their start values, after which [`Self::initialize`] begins another
    /// run. `prepare` is called with the index of each unit to set its parameters.
    ///
    /// # Errors
    /// Returns an error if a call of a unit fails.
    pub fn reset(
        &mut self,
        mut prepare: impl FnMut(usize, &mut dyn CoSimulationUnit) -> Outcome,
    ) -> Result<(), Error> {
        let start = self.clock.start();
        for index in 0..self.members.len() {
            let unit = self.members[index].unit.as_mut();
            let outcome = unit.reset().and_then(|()| prepare(index, unit));
            outcome.map_err(|failure| self.error(start, (index, failure)))?;
        }
        Ok(())
    }

    /// Reads variables of a unit once, for example parameters after initialization.
    ///
    /// # Errors
    /// Returns an error if a call of the unit fails.
    pub fn read(&mut self, ports: &[Port]) -> Result<Vec<f64>, Error> {
        let mut probe = Probe::new(ports);
        probe.read(&mut self.members).map_err(|culprit| self.error(self.clock.start(), culprit))?;
        Ok(probe.values)
    }

    /// Runs from the start time to the stop time.
    ///
    /// # Errors
    /// Returns an error if a unit or an observer fails, if a missed deadline is to end the run, or
    /// if the run was asked to end. The observers have seen all communication points up to then.
    pub fn run(&mut self, observers: &mut [&mut dyn Observer]) -> Result<(), Error> {
        let outcome = self.pass_through(observers);
        if let Some(pacer) = &mut self.pacer {
            pacer.finish();
        }
        outcome
    }

    fn pass_through(&mut self, observers: &mut [&mut dyn Observer]) -> Result<(), Error> {
        for tick in 0..=self.clock.ticks() {
            if let Some(pacer) = &mut self.pacer {
                pacer.wait(tick);
            }
            self.advance(tick)?;
            let time = self.clock.time(tick);
            let deadlines = self.pacer.as_mut().map_or(Ok(()), |pacer| pacer.check(tick));
            let sample =
                Sample { tick, time, last: tick == self.clock.ticks(), values: &self.probe.values };
            for observer in observers.iter_mut() {
                observer.observe(&sample)?;
            }
            deadlines?;
        }
        for index in 0..self.members.len() {
            let outcome = self.members[index].unit.terminate();
            outcome.map_err(|failure| self.error(self.clock.stop(), (index, failure)))?;
        }
        Ok(())
    }

    /// Advances to this tick, which must follow the last one; tick 0 follows initialization.
    /// Returns the probed values at this tick, in the order in which the probes were requested.
    ///
    /// # Errors
    /// Returns an error if a unit fails, or if the run was ended from outside.
    pub fn advance(&mut self, tick: u64) -> Result<&[f64], Error> {
        let time = self.clock.time(tick);
        warnings::at(time);
        if let Some(request) = self.interrupt.asked() {
            return Err(Error::Interrupted { time, request });
        }
        if tick > 0 {
            self.step_to(tick)?;
        }
        self.propagate(tick).map_err(|culprit| self.error(time, culprit))?;
        self.probe.read(&mut self.members).map_err(|culprit| self.error(time, culprit))?;
        Ok(&self.probe.values)
    }

    /// Steps the units whose interval ends at this tick: those in processes of their own at the
    /// same time.
    fn step_to(&mut self, tick: u64) -> Result<(), Error> {
        if self.has_ahead {
            self.each_due(tick, |member| member.ahead, CoSimulationUnit::begin_step)?;
        }
        self.each_due(tick, |_| true, CoSimulationUnit::do_step)
    }

    /// Calls those units whose interval ends at this tick with its begin and length.
    fn each_due(
        &mut self,
        tick: u64,
        wanted: impl Fn(&Member) -> bool,
        call: impl Fn(&mut (dyn CoSimulationUnit + 'static), f64, f64) -> Outcome,
    ) -> Result<(), Error> {
        for index in 0..self.members.len() {
            let member = &mut self.members[index];
            let every = u64::from(member.every);
            if tick.is_multiple_of(every) && wanted(member) {
                let from = self.clock.time(tick - every);
                let outcome = call(member.unit.as_mut(), from, every as f64 * self.clock.step());
                outcome.map_err(|failure| self.error(from, (index, failure)))?;
            }
        }
        Ok(())
    }

    /// Transfers values to the units whose communication point is this tick.
    fn propagate(&mut self, tick: u64) -> Result<(), (usize, UnitFailure)> {
        let due = |member: &Member| tick.is_multiple_of(u64::from(member.every));
        match self.coupling {
            Coupling::GaussSeidel => {
                for index in 0..self.members.len() {
                    if due(&self.members[index]) {
                        self.pass_on(index)?;
                    }
                }
            }
            Coupling::Jacobi => {
                for index in 0..self.members.len() {
                    if due(&self.members[index]) {
                        self.inputs[index].gather(&mut self.members)?;
                    }
                }
                for (index, (member, inputs)) in
                    self.members.iter_mut().zip(&self.inputs).enumerate()
                {
                    if due(member) {
                        inputs.scatter(member.unit.as_mut()).map_err(|failure| (index, failure))?;
                    }
                }
            }
        }
        Ok(())
    }

    fn pass_on(&mut self, index: usize) -> Result<(), (usize, UnitFailure)> {
        let inputs = &mut self.inputs[index];
        inputs.gather(&mut self.members)?;
        inputs.scatter(self.members[index].unit.as_mut()).map_err(|failure| (index, failure))
    }

    #[cold]
    fn error(&self, time: f64, (index, failure): (usize, UnitFailure)) -> Error {
        let component = self.members[index].name.clone();
        if failure.ends {
            Error::EndedByUnit { component, time, message: failure.message }
        } else {
            Error::Unit { component, time, failure }
        }
    }
}

#[cfg(test)]
mod tests;
