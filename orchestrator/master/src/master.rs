//! The master algorithm, which sets the instances' inputs, steps the instances, and reads their
//! outputs.
//!
//! Every instance sees the calls set, doStep and get in this order, as FMI 2.0.5, section 4.2.1,
//! asks: nothing is read between setting and stepping. At tick k, every instance that stands at t_k
//! is set and stepped. With sequential coupling this is done instance by instance, so that outputs
//! which respond to inputs, such as the moment of a controller, are passed on at once: they are
//! read after the step for which the inputs were set. All other outputs are those that were read
//! when the instance came to t_k, even if it has been stepped since. So no value shows an
//! instance's future, and an instance that steps at every n-th tick only is stepped when its
//! interval begins.

mod ending;
mod kept;
mod transfer;

pub use transfer::{Member, OpenedInput};

use crate::clock::Clock;
use crate::delay::Reading;
use crate::instance::{CallFailure, Outcome};
use crate::settings::{self, Setting};
use crate::wiring::{Coupling, Port, Wire};
use transfer::{Inputs, Readings, Row, Values};

/// The values at a communication point. Those that respond to the inputs set there were read after
/// the step; at the last point, where no step begins, they are those of the step before.
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

/// Watcher of a run: it may hold each tick until it is due, and sees its values.
pub trait Watcher {
    /// Error by which it ends the run.
    type Error: From<Failed>;

    /// Called before the steps of a tick, whose time (s) is given.
    ///
    /// # Errors
    /// An error ends the run before this tick.
    fn before(&mut self, _tick: u64, _time: f64) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Called with the values of a communication point. If an instance has failed there, they are
    /// what could be read, and the failure comes with them.
    ///
    /// # Errors
    /// An error ends the run. The failure is to be passed on.
    fn after(&mut self, sample: &Sample, outcome: Result<(), Failed>) -> Result<(), Self::Error>;
}

/// A call that an instance did not carry out, or by which it ended the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Failed {
    /// Name of the component.
    pub component: String,
    /// Simulated time of the communication point, s.
    pub time: f64,
    /// The call, with the instance's own message.
    pub failure: CallFailure,
}

/// Index of an instance whose call failed, with the failure.
type Culprit = (usize, CallFailure);

/// The instances with their connections, ready to run.
pub struct Master {
    /// The instances, which may be wrapped but must stay in this order.
    pub members: Vec<Member>,
    clock: Clock,
    coupling: Coupling,
    inputs: Vec<Inputs>,
    values: Values,
    row: Row,
    /// Values that belong to the kept states of the instances.
    kept: Vec<Readings>,
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
            inputs: (0..members.len()).map(|target| Inputs::new(&values, wires, target)).collect(),
            row: Row::new(&values, probes),
            members,
            values,
            kept: Vec::new(),
            ender: None,
            end: None,
        }
    }

    /// Returns the clock of the run.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Initializes all instances; their inputs are transferred in initialization mode, in the
    /// members' order.
    ///
    /// # Errors
    /// Returns an error if a call of an instance fails.
    pub fn initialize(&mut self) -> Result<(), Failed> {
        let clock = self.clock;
        let (start, all) = (clock.start(), 0..self.members.len());
        self.each(start, |_, Member { every, varies, instance, .. }| {
            let stop = if *varies { clock.stop() } else { clock.end(*every) };
            instance.enter_initialization(start, stop)
        })?;
        // Whatever the coupling, inputs are transferred one after the other here, so that the
        // simulation starts from consistent values. Reading after setting is allowed in this mode.
        let passed = all.clone().try_for_each(|index| self.pass_on(index));
        passed.map_err(|culprit| self.failed(start, culprit))?;
        self.each(start, |_, member| member.instance.exit_initialization())?;
        let read = all.clone().try_for_each(|index| self.read_instance(index, true));
        read.map_err(|culprit| self.failed(start, culprit))
    }

    /// Makes calls of each instance, in their order.
    fn each(
        &mut self,
        time: f64,
        mut calls: impl FnMut(usize, &mut Member) -> Outcome,
    ) -> Result<(), Failed> {
        for (index, member) in self.members.iter_mut().enumerate() {
            let outcome = calls(index, member);
            let component = &member.name;
            outcome.map_err(|failure| Failed { component: component.clone(), time, failure })?;
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

    /// Sets the parameters of each instance, before its initialization.
    ///
    /// # Errors
    /// Returns an error if a call of an instance fails.
    pub fn set_parameters(&mut self, settings: &[Vec<Setting>]) -> Result<(), Failed> {
        self.each(self.clock.start(), |index, member| {
            settings::apply(&settings[index], member.instance.as_mut())
        })
    }

    /// Sets all instances back to their start values, after which [`Self::set_parameters`] and
    /// [`Self::initialize`] begin another run.
    ///
    /// # Errors
    /// Returns an error if a call of an instance fails.
    pub fn reset(&mut self) -> Result<(), Failed> {
        self.end = None;
        self.each(self.clock.start(), |_, member| member.instance.reset())
    }

    /// Reads variables of an instance once, for example parameters after initialization.
    ///
    /// # Errors
    /// Returns an error if a call of the instance fails.
    pub fn read(&mut self, ports: &[Port]) -> Result<Vec<f64>, Failed> {
        let mut values = Values::new(self.members.len(), &[], ports);
        self.each(self.clock.start(), |index, member| {
            values.read(index, member.instance.as_mut(), true)
        })?;
        let latest: Vec<_> = ports.iter().map(|port| (*port, Reading::AfterStep)).collect();
        let mut row = Row::new(&values, &latest);
        row.fill(&values);
        Ok(row.values)
    }

    /// Runs from the start time to the stop time.
    ///
    /// # Errors
    /// Returns an error if an instance fails, or if the watcher ends the run. It has seen all
    /// communication points up to then.
    pub fn run<W: Watcher>(&mut self, watcher: &mut W) -> Result<(), W::Error> {
        for tick in 0..=self.clock.ticks() {
            let time = self.clock.time(tick);
            watcher.before(tick, time)?;
            let (outcome, end) = match self.round(tick) {
                Err((index, failure)) if failure.ends.is_some() && self.ender == Some(index) => {
                    (Ok(()), Some((index, failure)))
                }
                outcome => (outcome.map_err(|culprit| self.failed(time, culprit)), None),
            };
            let last = tick == self.clock.ticks();
            let sample = Sample { tick, time, last, values: &self.row.values };
            watcher.after(&sample, outcome)?;
            if let Some(end) = end {
                self.show_end(tick, &end, watcher)?;
                break;
            }
        }
        Ok(self.each(self.clock.stop(), |_, member| member.instance.terminate())?)
    }

    /// Does the steps of this tick, which must follow the last one; tick 0 follows initialization.
    /// Returns the probed values at this tick, in the order in which the probes were requested.
    ///
    /// # Errors
    /// Returns an error if an instance fails.
    pub fn advance(&mut self, tick: u64) -> Result<&[f64], Failed> {
        let outcome = self.round(tick);
        outcome.map_err(|culprit| self.failed(self.clock.time(tick), culprit))?;
        Ok(&self.row.values)
    }

    /// Sets and steps the instances whose communication point is this tick, and fills the row. If
    /// one fails, the row shows what could be read.
    fn round(&mut self, tick: u64) -> Result<(), Culprit> {
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
                self.set(index)?;
                self.step(index, tick)?;
            }
        }
        Ok(())
    }

    fn step_all_at_once(&mut self, tick: u64) -> Result<(), Culprit> {
        for index in 0..self.members.len() {
            if self.begins(index, tick) {
                self.set(index)?;
            }
        }
        for index in 0..self.members.len() {
            if self.begins(index, tick) {
                self.step(index, tick)?;
            }
        }
        Ok(())
    }

    fn begins(&self, index: usize, tick: u64) -> bool {
        self.clock.begins(tick, self.members[index].every)
    }

    fn set(&mut self, index: usize) -> Result<(), Culprit> {
        let inputs = &mut self.inputs[index];
        inputs.gather(&self.values);
        inputs.scatter(self.members[index].instance.as_mut()).map_err(|failure| (index, failure))
    }

    /// Steps an instance at this tick, and reads it.
    fn step(&mut self, index: usize, tick: u64) -> Result<(), Culprit> {
        let Member { every, varies, instance, .. } = &mut self.members[index];
        let clock = self.clock;
        let length = if *varies { clock.length(tick, *every) } else { clock.whole(*every) };
        instance.do_step(clock.time(tick), length).map_err(|failure| (index, failure))?;
        self.read_instance(index, true)
    }

    fn read_instance(&mut self, index: usize, probed: bool) -> Result<(), Culprit> {
        let instance = self.members[index].instance.as_mut();
        self.values.read(index, instance, probed).map_err(|failure| (index, failure))
    }

    #[cold]
    fn failed(&self, time: f64, (index, failure): Culprit) -> Failed {
        Failed { component: self.members[index].name.clone(), time, failure }
    }
}

#[cfg(test)]
mod tests;
