//! The master algorithm, which transfers values at communication points and steps the units between
//! them.
//!
//! At tick k, every unit that has reached t_k receives its inputs; then the observers see the
//! probed values, and then time advances. A unit that steps at every n-th tick is stepped when its
//! interval *ends*: until then it stays at its last communication point, so that its outputs show
//! nothing of its future. Each unit sees the calls set, get and doStep in this order, as with any
//! master.

use crate::clock::Clock;
use crate::error::Error;
use crate::experiment::Coupling;
use crate::interrupt::Interrupt;
use crate::pacing::Settings;
use crate::pacing::pacer::Pacer;
use crate::pacing::timer::{Monotonic, Timer};
use crate::stopwatch::{Spent, Stopwatch};
use crate::wiring::{Port, Wire};
use fmu_import::description::Carrier;
use fmu_import::quantity::Scaling;
use fmu_import::unit::UnitFailure;
use fmu_import::unit::{CoSimulationUnit, Outcome};
use fmu_import::warnings;
use std::ops::Range;
use std::rc::Rc;

/// A unit together with what the master must know to step it. Members are kept in the order in
/// which their inputs are set.
pub struct Member {
    /// Name of the component in the experiment.
    pub name: String,
    /// Period of the unit: it steps at every n-th tick.
    pub every: u32,
    /// The unit itself, instantiated and with its parameters set.
    pub unit: Box<dyn CoSimulationUnit>,
}

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

/// The units with their connections, ready to run.
pub struct Master {
    clock: Clock,
    coupling: Coupling,
    members: Vec<Member>,
    inputs: Vec<Inputs>,
    probe: Probe,
    /// Accumulated computing time of each unit; empty unless it is measured.
    spent: Vec<Rc<Spent>>,
    pacer: Option<Pacer>,
    interrupt: Interrupt,
}

/// All values of one type that one unit receives: they are read with one get call per source and
/// written with one set call.
struct Bundle<T> {
    references: Vec<u32>,
    values: Vec<T>,
    sources: Vec<(usize, Vec<u32>, Range<usize>)>,
}

impl<T: Copy + Default> Bundle<T> {
    fn new(wires: &[Wire], target: usize, carrier: Carrier) -> Self {
        let mut wires: Vec<&Wire> =
            wires.iter().filter(|w| w.to.component == target && w.to.carrier == carrier).collect();
        wires.sort_by_key(|wire| wire.from.component);
        let mut sources: Vec<(usize, Vec<u32>, Range<usize>)> = Vec::new();
        for (place, wire) in wires.iter().enumerate() {
            match sources.last_mut() {
                Some((source, references, range)) if *source == wire.from.component => {
                    references.push(wire.from.reference);
                    range.end = place + 1;
                }
                _ => sources.push((wire.from.component, vec![wire.from.reference], place..place + 1)),
            }
        }
        Self {
            references: wires.iter().map(|wire| wire.to.reference).collect(),
            values: vec![T::default(); wires.len()],
            sources,
        }
    }
}

/// All values that one unit receives, grouped by type.
struct Inputs {
    real: Bundle<f64>,
    integer: Bundle<i32>,
    boolean: Bundle<i32>,
    /// Indices of the real inputs whose values are converted on the way, with their scaling.
    scaled: Vec<(usize, Scaling)>,
}

impl Inputs {
    fn new(wires: &[Wire], target: usize) -> Self {
        let real: Bundle<f64> = Bundle::new(wires, target, Carrier::Real);
        let scaling = |reference: u32| {
            let is_it = |w: &&Wire| w.to.component == target && w.to.reference == reference;
            wires.iter().filter(|w| w.to.carrier == Carrier::Real).find(is_it).map(|wire| wire.scaling)
        };
        let scaled = real.references.iter().enumerate();
        let scaled = scaled.filter_map(|(place, &reference)| Some((place, scaling(reference)?)));
        Self {
            scaled: scaled.filter(|(_, scaling)| *scaling != Scaling::default()).collect(),
            real,
            integer: Bundle::new(wires, target, Carrier::Integer),
            boolean: Bundle::new(wires, target, Carrier::Boolean),
        }
    }

    /// Reads the sources of the inputs. An error carries the index of the member whose call failed.
    fn gather(&mut self, members: &mut [Member]) -> Result<(), (usize, UnitFailure)> {
        for (source, references, range) in &self.real.sources {
            let values = &mut self.real.values[range.clone()];
            members[*source].unit.get_real(references, values).map_err(|failure| (*source, failure))?;
        }
        for (place, scaling) in &self.scaled {
            self.real.values[*place] = scaling.of(self.real.values[*place]);
        }
        for (source, references, range) in &self.integer.sources {
            let values = &mut self.integer.values[range.clone()];
            members[*source].unit.get_integer(references, values).map_err(|failure| (*source, failure))?;
        }
        for (source, references, range) in &self.boolean.sources {
            let values = &mut self.boolean.values[range.clone()];
            members[*source].unit.get_boolean(references, values).map_err(|failure| (*source, failure))?;
        }
        Ok(())
    }

    fn scatter(&self, unit: &mut dyn CoSimulationUnit) -> Outcome {
        if !self.real.references.is_empty() {
            unit.set_real(&self.real.references, &self.real.values)?;
        }
        if !self.integer.references.is_empty() {
            unit.set_integer(&self.integer.references, &self.integer.values)?;
        }
        if !self.boolean.references.is_empty() {
            unit.set_boolean(&self.boolean.references, &self.boolean.values)?;
        }
        Ok(())
    }
}

/// Reads the probed variables for the observers, with one call per unit and type.
struct Probe {
    reads: Vec<Read>,
    values: Vec<f64>,
}

struct Read {
    component: usize,
    carrier: Carrier,
    references: Vec<u32>,
    /// Index of each value among the probed values.
    places: Vec<usize>,
    reals: Vec<f64>,
    integers: Vec<i32>,
}

impl Probe {
    fn new(ports: &[Port]) -> Self {
        let mut reads: Vec<Read> = Vec::new();
        for (place, port) in ports.iter().enumerate() {
            let known = reads.iter_mut().find(|r| r.component == port.component && r.carrier == port.carrier);
            if let Some(read) = known {
                read.references.push(port.reference);
                read.places.push(place);
            } else {
                reads.push(Read {
                    component: port.component,
                    carrier: port.carrier,
                    references: vec![port.reference],
                    places: vec![place],
                    reals: Vec::new(),
                    integers: Vec::new(),
                });
            }
        }
        for read in &mut reads {
            match read.carrier {
                Carrier::Real => read.reals = vec![0.0; read.places.len()],
                Carrier::Integer | Carrier::Boolean => read.integers = vec![0; read.places.len()],
            }
        }
        Self { reads, values: vec![0.0; ports.len()] }
    }

    fn read(&mut self, members: &mut [Member]) -> Result<(), (usize, UnitFailure)> {
        for read in &mut self.reads {
            let unit = &mut members[read.component].unit;
            match read.carrier {
                Carrier::Real => unit.get_real(&read.references, &mut read.reals),
                Carrier::Integer => unit.get_integer(&read.references, &mut read.integers),
                Carrier::Boolean => unit.get_boolean(&read.references, &mut read.integers),
            }
            .map_err(|failure| (read.component, failure))?;
            for (value, place) in read.reals.iter().zip(&read.places) {
                self.values[*place] = *value;
            }
            for (value, place) in read.integers.iter().zip(&read.places) {
                self.values[*place] = f64::from(*value);
            }
        }
        Ok(())
    }
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
        let (probe, interrupt) = (Probe::new(probes), Interrupt::default());
        Self { clock, coupling, members, inputs, probe, spent: Vec::new(), pacer: None, interrupt }
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
        let components = spent.map(|(member, spent)| (member.name.clone(), member.every, Rc::clone(spent)));
        let pacer = Pacer::new(settings, self.clock, timer, self.interrupt.clone(), components);
        self.pacer.insert(pacer)
    }

    /// Takes out the pacer that kept the run in step; `None` if the run was not paced.
    pub fn take_pacer(&mut self) -> Option<Pacer> {
        self.pacer.take()
    }

    /// Measures the computing time of each unit from now on.
    pub fn measure_time(&mut self) {
        let timer: Rc<dyn Timer> = Rc::new(Monotonic);
        self.measure(&timer);
    }

    fn measure(&mut self, timer: &Rc<dyn Timer>) {
        let members = std::mem::take(&mut self.members).into_iter();
        (self.members, self.spent) = members
            .map(|Member { name, every, unit }| {
                let (unit, spent) = Stopwatch::new(unit, Rc::clone(timer));
                (Member { name, every, unit: Box::new(unit) }, spent)
            })
            .unzip();
    }

    /// Mean wall-clock time (s) that each unit took per step, by name; empty if it is not measured.
    pub fn step_seconds(&self) -> impl Iterator<Item = (&str, f64)> {
        let spent = self.members.iter().zip(&self.spent);
        spent.filter_map(|(member, spent)| Some((member.name.as_str(), spent.seconds_per_step()?)))
    }

    /// Initializes all units; their inputs are transferred in initialization mode, in the members'
    /// order.
    ///
    /// # Errors
    /// If a call of a unit fails.
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

    /// Reads variables of a unit once, for example parameters after initialization.
    ///
    /// # Errors
    /// If a call of the unit fails.
    pub fn read(&mut self, ports: &[Port]) -> Result<Vec<f64>, Error> {
        let mut probe = Probe::new(ports);
        probe.read(&mut self.members).map_err(|culprit| self.error(self.clock.start(), culprit))?;
        Ok(probe.values)
    }

    /// Runs from the start time to the stop time.
    ///
    /// # Errors
    /// If a unit or an observer fails, if a missed deadline is to end the run, or if the run was
    /// asked to end. The observers have seen all communication points up to then.
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
            let sample = Sample { tick, time, last: tick == self.clock.ticks(), values: &self.probe.values };
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
    /// If a unit fails, or if the run was ended from outside.
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

    /// Steps the units whose interval ends at this tick.
    fn step_to(&mut self, tick: u64) -> Result<(), Error> {
        for index in 0..self.members.len() {
            let member = &mut self.members[index];
            let every = u64::from(member.every);
            if tick.is_multiple_of(every) {
                let from = self.clock.time(tick - every);
                let outcome = member.unit.do_step(from, every as f64 * self.clock.step());
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
                for (index, (member, inputs)) in self.members.iter_mut().zip(&self.inputs).enumerate() {
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
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::rc::Rc;

    type Journal = Rc<RefCell<Vec<String>>>;

    /// Variable 0 is the input and variable 1 the output. A `gain` has direct feedthrough: output =
    /// 2 · input. The output of an `integrator` is its state, which grows by h · input at each
    /// step.
    struct Mock {
        name: &'static str,
        direct: bool,
        input: f64,
        state: f64,
        fails_after: f64,
        journal: Journal,
    }

    impl Mock {
        fn note(&self, what: &str) {
            self.journal.borrow_mut().push(format!("{} {what}", self.name));
        }
    }

    impl CoSimulationUnit for Mock {
        fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
            for (reference, value) in references.iter().zip(values.iter_mut()) {
                *value = match (reference, self.direct) {
                    (0, _) => self.input,
                    (_, true) => 2.0 * self.input,
                    (_, false) => self.state,
                };
            }
            Ok(())
        }
        fn get_integer(&mut self, _: &[u32], _: &mut [i32]) -> Outcome {
            unreachable!("no such variables")
        }
        fn get_boolean(&mut self, _: &[u32], _: &mut [i32]) -> Outcome {
            unreachable!("no such variables")
        }
        fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
            assert_eq!(references, [0]);
            self.input = values[0];
            self.note(&format!("set {}", self.input));
            Ok(())
        }
        fn set_integer(&mut self, _: &[u32], _: &[i32]) -> Outcome {
            unreachable!("no such variables")
        }
        fn set_boolean(&mut self, _: &[u32], _: &[i32]) -> Outcome {
            unreachable!("no such variables")
        }
        fn set_string(&mut self, _: u32, _: &str) -> Outcome {
            unreachable!("no such variables")
        }
        fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
            self.note(&format!("enter {start}..{stop}"));
            Ok(())
        }
        fn exit_initialization(&mut self) -> Outcome {
            self.note("exit");
            Ok(())
        }
        fn do_step(&mut self, time: f64, step: f64) -> Outcome {
            if time >= self.fails_after {
                return Err(UnitFailure::new("doStep", "out of propellant"));
            }
            self.state += step * self.input;
            self.note(&format!("step {time}+{step}"));
            Ok(())
        }
        fn terminate(&mut self) -> Outcome {
            self.note("terminate");
            Ok(())
        }
    }

    fn port(component: usize, reference: u32) -> Port {
        Port { component, variable: reference as usize, reference, carrier: Carrier::Real }
    }

    fn wire(from: usize, to: usize) -> Wire {
        Wire { from: port(from, 1), to: port(to, 0), scaling: Scaling::default() }
    }

    #[derive(Default)]
    struct Rows(Vec<Vec<f64>>);

    impl Observer for Rows {
        fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
            self.0.push([&[sample.time], sample.values].concat());
            Ok(())
        }
    }

    /// Returns the outcome of the run, rows of time, the gain's output and the integrator's input
    /// and output, and the journal of calls.
    fn run(
        coupling: Coupling,
        order: [&'static str; 2],
        every: [u32; 2],
        [step, stop]: [f64; 2],
        fails_after: f64,
    ) -> (Result<(), Error>, Vec<Vec<f64>>, Vec<String>) {
        let journal = Journal::default();
        let members = order
            .iter()
            .zip(every)
            .map(|(&name, every)| {
                let direct = name == "gain";
                let state = if direct { 0.0 } else { 1.0 };
                let mock =
                    Mock { name, direct, input: 0.0, state, fails_after, journal: Rc::clone(&journal) };
                Member { name: name.into(), every, unit: Box::new(mock) }
            })
            .collect();
        let gain = order.iter().position(|name| *name == "gain").unwrap();
        let integrator = 1 - gain;
        let wires = [wire(integrator, gain), wire(gain, integrator)];
        let probes = [port(gain, 1), port(integrator, 0), port(integrator, 1)];
        let clock = Clock::new(0.0, stop, step).unwrap();
        let mut master = Master::new(clock, coupling, members, &wires, &probes);
        let mut rows = Rows::default();
        let outcome = master.initialize().and_then(|()| master.run(&mut [&mut rows]));
        let journal = journal.borrow().clone();
        (outcome, rows.0, journal)
    }

    #[test]
    fn oracle_gauss_seidel_in_the_order_of_the_loop_has_no_delay() {
        let (outcome, rows, _) = run(Coupling::GaussSeidel, ["gain", "integrator"], [1, 1], [1.0, 3.0], 1e9);
        outcome.unwrap();
        // The state follows x⁺ = x + 2x, and the moment recorded in each row belongs to the state
        // of that row.
        let expected =
            [[0.0, 2.0, 2.0, 1.0], [1.0, 6.0, 6.0, 3.0], [2.0, 18.0, 18.0, 9.0], [3.0, 54.0, 54.0, 27.0]];
        assert_eq!(rows, expected);
    }

    #[test]
    fn oracle_the_other_order_delays_by_one_step() {
        let (outcome, rows, _) = run(Coupling::GaussSeidel, ["integrator", "gain"], [1, 1], [1.0, 3.0], 1e9);
        outcome.unwrap();
        // The integrator receives 2·x of the tick before. In initialization mode it received the
        // gain's 0, at tick 0 its 2·x₀.
        let expected =
            [[0.0, 2.0, 2.0, 1.0], [1.0, 6.0, 2.0, 3.0], [2.0, 10.0, 6.0, 5.0], [3.0, 22.0, 10.0, 11.0]];
        assert_eq!(rows, expected);
    }

    #[test]
    fn oracle_jacobi_delays_by_one_step_in_either_order() {
        for order in [["gain", "integrator"], ["integrator", "gain"]] {
            let (outcome, rows, _) = run(Coupling::Jacobi, order, [1, 1], [1.0, 3.0], 1e9);
            outcome.unwrap();
            // After initialization the gain's output is 2·x₀ in either order.
            let expected =
                [[0.0, 2.0, 2.0, 1.0], [1.0, 6.0, 2.0, 3.0], [2.0, 10.0, 6.0, 5.0], [3.0, 22.0, 10.0, 11.0]];
            assert_eq!(rows, expected, "{order:?}");
        }
    }

    #[test]
    fn units_are_set_before_they_are_stepped() {
        let (_, _, journal) = run(Coupling::GaussSeidel, ["gain", "integrator"], [1, 1], [1.0, 1.0], 1e9);
        let expected = [
            "gain enter 0..1",
            "integrator enter 0..1",
            "gain set 1",
            "integrator set 2",
            "gain exit",
            "integrator exit",
            "gain set 1",
            "integrator set 2",
            "gain step 0+1",
            "integrator step 0+1",
            "gain set 3",
            "integrator set 6",
            "gain terminate",
            "integrator terminate",
        ];
        assert_eq!(journal, expected);
    }

    #[test]
    fn oracle_a_slow_unit_holds_its_outputs_and_shows_nothing_early() {
        let (outcome, rows, journal) =
            run(Coupling::GaussSeidel, ["gain", "integrator"], [1, 2], [1.0, 5.0], 1e9);
        outcome.unwrap();
        // The integrator has communication points at 0, 2 and 4 only, where x⁺ = x + 2·2x.
        let states: Vec<f64> = rows.iter().map(|row| row[3]).collect();
        assert_eq!(states, [1.0, 1.0, 5.0, 5.0, 25.0, 25.0]);
        let steps: Vec<&String> = journal.iter().filter(|line| line.starts_with("integrator step")).collect();
        assert_eq!(steps, ["integrator step 0+2", "integrator step 2+2"]);

        let (outcome, rows, _) = run(Coupling::GaussSeidel, ["gain", "integrator"], [2, 1], [1.0, 4.0], 1e9);
        outcome.unwrap();
        // The gain is sampled at 0, 2 and 4, and its output is held between.
        let held: Vec<f64> = rows.iter().map(|row| row[1]).collect();
        assert_eq!(held, [2.0, 2.0, 10.0, 10.0, 50.0]);
    }

    #[test]
    fn a_failing_unit_is_named_with_time_and_words_and_the_rows_stay() {
        let (outcome, rows, _) = run(Coupling::GaussSeidel, ["gain", "integrator"], [1, 1], [1.0, 5.0], 2.0);
        let error = outcome.unwrap_err();
        assert_eq!(error.to_string(), "gain failed at t = 2 s in doStep: out of propellant");
        assert_eq!(error.exit_code(), 1);
        assert_eq!(rows.len(), 3);
    }

    proptest::proptest! {
        /// Units that all step at every n-th tick give the same results as at every tick of a clock
        /// n times slower.
        #[test]
        fn oracle_equal_periods_are_a_slower_clock(n in 1u32..6, periods in 1u32..6, jacobi: bool, swap: bool) {
            let coupling = if jacobi { Coupling::Jacobi } else { Coupling::GaussSeidel };
            let order = if swap { ["integrator", "gain"] } else { ["gain", "integrator"] };
            let stop = f64::from(n * periods) * 0.25;
            let (_, fine, _) = run(coupling, order, [n, n], [0.25, stop], 1e9);
            let (_, coarse, _) = run(coupling, order, [1, 1], [0.25 * f64::from(n), stop], 1e9);
            let sampled: Vec<Vec<f64>> = fine.into_iter().step_by(n as usize).collect();
            proptest::prop_assert_eq!(sampled, coarse);
        }
    }
}
