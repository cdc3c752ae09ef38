//! The master algorithm, which sets the instances' inputs, steps the instances, and reads their
//! outputs.
//!
//! Every instance sees the calls set, doStep and get in this order, as FMI 2.0.5, section 4.2.1,
//! asks: nothing is read between setting and stepping. At tick k, every instance that stands at t_k
//! is set and stepped. With sequential coupling this is done instance by instance, so that outputs
//! which respond to inputs, such as the moment of a controller, are handed on at once: they are
//! read after the step for which the inputs were set. All other outputs are those that were read
//! when the instance came to t_k, even if it has been stepped since. So no value shows an
//! instance's future, and an instance that steps at every n-th tick only is stepped when its
//! interval begins.

mod ending;
mod kept;
mod transfer;

pub use transfer::Member;

use crate::clock::Clock;
use crate::delay::Reading;
use crate::error::Error;
use crate::experiment::Coupling;
use crate::interrupt::Interrupt;
use crate::pacing::Settings;
use crate::pacing::pacer::Pacer;
use crate::pacing::timer::{Monotonic, Timer};
use crate::stopwatch::{Spent, Stopwatch};
use crate::wiring::{Port, Wire};
use fmu_import::instance::{CallFailure, Instance, Outcome};
use fmu_import::warnings;
use std::rc::Rc;
use transfer::{Inputs, Row, Values};

/// The values that an observer sees at a communication point. Those that respond to the inputs set
/// there were read after the step; at the last point, where no step begins, they are those of the
/// step before.
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

/// Index of an instance whose call failed, with the failure.
type Culprit = (usize, CallFailure);

/// The instances with their connections, ready to run.
pub struct Master {
    clock: Clock,
    coupling: Coupling,
    members: Vec<Member>,
    /// Instances that are stepping in a process of their own, while others work.
    stepping: Vec<bool>,
    inputs: Vec<Inputs>,
    values: Values,
    row: Row,
    /// Accumulated computing time of each instance; empty unless it is measured.
    spent: Vec<Rc<Spent>>,
    pacer: Option<Pacer>,
    interrupt: Interrupt,
    /// Instance that may end the run before the stop time.
    ender: Option<usize>,
    /// How it ended the run.
    end: Option<String>,
}

impl Master {
    /// Creates a master for instances in this order; indices in `wires` and `probes` are positions
    /// in `members`.
    pub fn new(
        clock: Clock,
        coupling: Coupling,
        members: Vec<Member>,
        wires: &[(Wire, Reading)],
        probes: &[(Port, Reading)],
    ) -> Self {
        let wired: Vec<Port> = wires.iter().map(|(wire, _)| wire.from).collect();
        let probed: Vec<Port> = probes.iter().map(|(port, _)| *port).collect();
        let values = Values::new(members.len(), &wired, &probed);
        Self {
            clock,
            coupling,
            stepping: vec![false; members.len()],
            inputs: (0..members.len()).map(|target| Inputs::new(&values, wires, target)).collect(),
            row: Row::new(&values, probes),
            members,
            values,
            spent: Vec::new(),
            pacer: None,
            interrupt: Interrupt::default(),
            ender: None,
            end: None,
        }
    }

    /// Sets the interrupt through which the run can be ended from outside. It must be set before
    /// [`Self::pace`] is called.
    pub fn set_interrupt(&mut self, interrupt: &Interrupt) {
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

    /// Measures the computing time of each instance from now on.
    pub fn measure_time(&mut self) {
        let timer: Rc<dyn Timer> = Rc::new(Monotonic);
        self.measure(&timer);
    }

    fn measure(&mut self, timer: &Rc<dyn Timer>) {
        let members = std::mem::take(&mut self.members).into_iter();
        (self.members, self.spent) = members
            .map(|member| {
                let (instance, spent) = Stopwatch::new(member.instance, Rc::clone(timer));
                // Computing times of two instances that work at the same time could not be told
                // apart.
                (Member { ahead: false, instance: Box::new(instance), ..member }, spent)
            })
            .unzip();
    }

    /// Returns the mean wall-clock time that each instance took per step, s, by name. There are no
    /// entries if it was not measured.
    pub fn step_seconds(&self) -> impl Iterator<Item = (&str, f64)> {
        let spent = self.members.iter().zip(&self.spent);
        spent.filter_map(|(member, spent)| Some((member.name.as_str(), spent.seconds_per_step()?)))
    }

    /// Initializes all instances; their inputs are transferred in initialization mode, in the
    /// members' order.
    ///
    /// # Errors
    /// Returns an error if a call of an instance fails.
    pub fn initialize(&mut self) -> Result<(), Error> {
        let start = self.clock.start();
        for index in 0..self.members.len() {
            let Member { every, varies, instance, .. } = &mut self.members[index];
            let stop = if *varies { self.clock.stop() } else { self.clock.end(*every) };
            let outcome = instance.enter_initialization(start, stop);
            outcome.map_err(|failure| self.error(start, (index, failure)))?;
        }
        // Whatever the coupling, inputs are transferred one after the other here, so that the
        // simulation starts from consistent values. Reading after setting is allowed in this mode.
        for index in 0..self.members.len() {
            self.pass_on(index).map_err(|culprit| self.error(start, culprit))?;
        }
        for index in 0..self.members.len() {
            let outcome = self.members[index].instance.exit_initialization();
            outcome.map_err(|failure| self.error(start, (index, failure)))?;
        }
        for index in 0..self.members.len() {
            self.read_instance(index, true).map_err(|culprit| self.error(start, culprit))?;
        }
        Ok(())
    }

    fn pass_on(&mut self, index: usize) -> Result<(), Culprit> {
        for place in 0..self.inputs[index].sources.len() {
            let source = self.inputs[index].sources[place];
            self.read_instance(source, false)?;
            self.values.arrive(source);
        }
        self.set(index)
    }

    /// Sets all instances back to their start values, after which [`Self::initialize`] begins
    /// another run. `prepare` is called with the index of each instance to set its parameters.
    ///
    /// # Errors
    /// Returns an error if a call of an instance fails.
    pub fn reset(
        &mut self,
        mut prepare: impl FnMut(usize, &mut dyn Instance) -> Outcome,
    ) -> Result<(), Error> {
        let start = self.clock.start();
        self.end = None;
        for index in 0..self.members.len() {
            let instance = self.members[index].instance.as_mut();
            let outcome = instance.reset().and_then(|()| prepare(index, instance));
            outcome.map_err(|failure| self.error(start, (index, failure)))?;
        }
        Ok(())
    }

    /// Reads variables of an instance once, for example parameters after initialization.
    ///
    /// # Errors
    /// Returns an error if a call of the instance fails.
    pub fn read(&mut self, ports: &[Port]) -> Result<Vec<f64>, Error> {
        let mut values = Values::new(self.members.len(), &[], ports);
        for index in 0..self.members.len() {
            let outcome = values.read(index, self.members[index].instance.as_mut(), true);
            outcome.map_err(|failure| self.error(self.clock.start(), (index, failure)))?;
        }
        let latest: Vec<_> = ports.iter().map(|port| (*port, Reading::AfterStep)).collect();
        let mut row = Row::new(&values, &latest);
        row.fill(&values);
        Ok(row.values)
    }

    /// Runs from the start time to the stop time.
    ///
    /// # Errors
    /// Returns an error if an instance or an observer fails, if a missed deadline is to end the
    /// run, or if the run was asked to end. The observers have seen all communication points up to
    /// then.
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
            let time = self.clock.time(tick);
            if let Some(request) = self.interrupt.asked() {
                return Err(Error::Interrupted { time, request });
            }
            let (outcome, end) = match self.round(tick) {
                Err((index, failure)) if failure.ends.is_some() && self.ender == Some(index) => {
                    (Ok(()), Some((index, failure)))
                }
                outcome => (outcome.map_err(|culprit| self.error(time, culprit)), None),
            };
            let deadlines = self.pacer.as_mut().map_or(Ok(()), |pacer| pacer.check(tick));
            let last = tick == self.clock.ticks();
            let sample = Sample { tick, time, last, values: &self.row.values };
            for observer in observers.iter_mut() {
                observer.observe(&sample)?;
            }
            outcome.and(deadlines)?;
            if let Some(end) = end {
                self.observe_end(tick, &end, observers)?;
                break;
            }
        }
        for index in 0..self.members.len() {
            let outcome = self.members[index].instance.terminate();
            outcome.map_err(|failure| self.error(self.clock.stop(), (index, failure)))?;
        }
        Ok(())
    }

    /// Does the steps of this tick, which must follow the last one; tick 0 follows initialization.
    /// Returns the probed values at this tick, in the order in which the probes were requested.
    ///
    /// # Errors
    /// Returns an error if an instance fails, or if the run was ended from outside.
    pub fn advance(&mut self, tick: u64) -> Result<&[f64], Error> {
        if let Some(request) = self.interrupt.asked() {
            return Err(Error::Interrupted { time: self.clock.time(tick), request });
        }
        let outcome = self.round(tick);
        outcome.map_err(|culprit| self.error(self.clock.time(tick), culprit))?;
        Ok(&self.row.values)
    }

    /// Sets and steps the instances whose communication point is this tick, and fills the row. If
    /// one fails, the row shows what could be read.
    fn round(&mut self, tick: u64) -> Result<(), Culprit> {
        let time = self.clock.time(tick);
        warnings::at(time);
        for index in 0..self.members.len() {
            if tick.is_multiple_of(u64::from(self.members[index].every)) {
                self.values.arrive(index);
            }
        }
        let outcome = match self.coupling {
            Coupling::Sequential => self.step_one_by_one(tick),
            Coupling::Jacobi => self.step_all_at_once(tick),
        };
        self.row.fill(&self.values);
        outcome
    }

    fn step_one_by_one(&mut self, tick: u64) -> Result<(), Culprit> {
        for index in 0..self.members.len() {
            if self.begins(index, tick) {
                for place in 0..self.inputs[index].awaited.len() {
                    self.finish(self.inputs[index].awaited[place], tick)?;
                }
                self.set(index)?;
                self.begin(index, tick)?;
            }
        }
        self.finish_all(tick)
    }

    fn step_all_at_once(&mut self, tick: u64) -> Result<(), Culprit> {
        for index in 0..self.members.len() {
            if self.begins(index, tick) {
                self.set(index)?;
            }
        }
        // Instances in processes of their own compute while the others are stepped.
        for ahead in [true, false] {
            for index in 0..self.members.len() {
                if self.begins(index, tick) && self.members[index].ahead == ahead {
                    self.begin(index, tick)?;
                }
            }
        }
        self.finish_all(tick)
    }

    fn begins(&self, index: usize, tick: u64) -> bool {
        self.clock.begins(tick, self.members[index].every)
    }

    fn set(&mut self, index: usize) -> Result<(), Culprit> {
        let inputs = &mut self.inputs[index];
        inputs.gather(&self.values);
        inputs.scatter(self.members[index].instance.as_mut()).map_err(|failure| (index, failure))
    }

    /// Begins the step of an instance at this tick. Only an instance in a process of its own still
    /// computes when this returns.
    fn begin(&mut self, index: usize, tick: u64) -> Result<(), Culprit> {
        self.stepping[index] = true;
        if !self.members[index].ahead {
            return self.finish(index, tick);
        }
        self.step(index, tick, Instance::begin_step)
    }

    fn finish(&mut self, index: usize, tick: u64) -> Result<(), Culprit> {
        if !std::mem::take(&mut self.stepping[index]) {
            return Ok(());
        }
        self.step(index, tick, Instance::do_step)?;
        self.read_instance(index, true)
    }

    fn finish_all(&mut self, tick: u64) -> Result<(), Culprit> {
        (0..self.members.len()).try_for_each(|index| self.finish(index, tick))
    }

    fn step(
        &mut self,
        index: usize,
        tick: u64,
        call: impl Fn(&mut (dyn Instance + 'static), f64, f64) -> Outcome,
    ) -> Result<(), Culprit> {
        let Member { every, varies, instance, .. } = &mut self.members[index];
        let clock = self.clock;
        let length = if *varies { clock.length(tick, *every) } else { clock.whole(*every) };
        call(instance.as_mut(), clock.time(tick), length).map_err(|failure| (index, failure))
    }

    fn read_instance(&mut self, index: usize, probed: bool) -> Result<(), Culprit> {
        let instance = self.members[index].instance.as_mut();
        self.values.read(index, instance, probed).map_err(|failure| (index, failure))
    }

    #[cold]
    fn error(&self, time: f64, (index, failure): Culprit) -> Error {
        let component = self.members[index].name.clone();
        if failure.ends.is_some() {
            Error::EndedByInstance { component, time, message: failure.message }
        } else {
            Error::Call { component, time, failure }
        }
    }
}

#[cfg(test)]
mod tests;
