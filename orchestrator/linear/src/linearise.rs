//! From an experiment to the linear model of its loop at an instant.

use crate::Matrix;
use crate::components::Component;
use crate::identification::{Builder, Found};
use crate::model::{OpenLoop, Signal};
use crate::opening::{opened, tick_at};
use crate::pair::{Joined, Pair};
use crate::propagation::{Link, Net};
use crate::replay::Recorded;
use crate::spectrum::spectral_radius;
use crate::windows::needed_steps;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::run::Run;
use cosim::system::System;
use fmi_master::clock::Clock;
use fmi_master::delay::Reading;
use fmi_master::description::Carrier;
use fmi_master::instance::CallFailure;
use fmi_master::quantity::rounded;
use fmi_master::wiring::{Port, Wire};
use fmu_import::warnings;
use std::ops::Range;

/// Growth of a closed loop with a pair that is not distinguished from none, and growth of the open
/// loop that a vehicle does not have, 1/s.
const SLOWEST_GROWTH: f64 = 0.1;
const OWN_GROWTH: f64 = 1.0;

/// The loop of an experiment at an instant.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// Time of the instant, s.
    pub time: f64,
    /// The loop with its components.
    pub net: Net,
    /// The loop for increases and for decreases of every input, if a component has no derivative.
    pub sides: Option<[Net; 2]>,
    /// The open loop of `net`.
    pub open: OpenLoop,
    /// How each component's model was found.
    pub notes: Vec<String>,
}

/// A component that responds to others, with what is connected to it.
struct Wired {
    component: usize,
    /// Number of communication steps in one of its steps.
    every: u64,
    /// Its inputs, of which nothing is recorded yet.
    recorded: Recorded,
    /// Places of the recorded inputs among a sample's values.
    places: Vec<usize>,
    first: u64,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
}

/// Linearises runs of a system at one instant.
pub struct Lineariser {
    system: System,
    time: f64,
    /// Communication points at which components keep their states and their inputs are recorded.
    ticks: Range<u64>,
    wired: Vec<Wired>,
    signals: Vec<Signal>,
    /// The opened variables, in the order of the signals.
    opened: Vec<Port>,
}

/// Linearises an experiment at `time` (s), with the loop opened at signals that are named as
/// `component.variable` or `component.prefix.*`: connected inputs, or outputs with all their
/// connections.
///
/// # Errors
/// Returns the errors of [`Lineariser::new`] and [`Lineariser::linearise`].
pub fn linearise(
    system: System,
    time: f64,
    open: &[String],
    interrupt: &Interrupt,
) -> Result<Linearised, Error> {
    let lineariser = Lineariser::new(system, time, open)?;
    let collection = warnings::collect();
    let mut run = lineariser.system.start(interrupt)?;
    let found = lineariser.linearise(&mut run, interrupt);
    drop(collection);
    found
}

impl Lineariser {
    /// Prepares a system to be linearised at `time` (s), with the loop opened at these signals.
    ///
    /// # Errors
    /// Returns an error if the time is not a communication point, or if a signal is not connected.
    pub fn new(mut system: System, time: f64, open: &[String]) -> Result<Self, Error> {
        let first = tick_at(&system.clock, time)?;
        let time = system.clock.time(first);
        let (signals, opened) = opened(&system, open)?;
        let wired = wired(&mut system, first)?;
        let responds = |component: usize| wired.iter().any(|one| one.component == component);
        for (port, signal) in opened.iter().zip(&signals) {
            let carries = |wire: &Wire| wire.from == *port || wire.to == *port;
            let mut sources = system.wires().into_iter().map(|(wire, _)| wire).filter(carries);
            if !sources.any(|wire| responds(wire.from.component)) {
                let problem =
                    format!("--open {}: no component that responds gives this signal", signal.name);
                return Err(Error::experiment(problem));
            }
        }
        let needed =
            |one: &Wired| one.first + one.every * (needed_steps(one.recorded.length) as u64 + 1);
        let last = wired.iter().map(needed).max().unwrap_or(first + 1);
        let (start, step) = (system.clock.start(), system.clock.step());
        // No step that is repeated reaches the stop time, so that all of them are whole.
        let longest = system.components.iter().map(|component| component.every).max();
        let stop = start + (last + u64::from(longest.unwrap_or(1))) as f64 * step;
        system.clock = Clock::new(start, stop, step).map_err(Error::experiment)?;
        Ok(Self { system, time, ticks: first..last, wired, signals, opened })
    }

    /// Returns the system, from which runs are started.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Returns the communication point at which runs are linearised.
    pub fn first(&self) -> u64 {
        self.ticks.start
    }

    /// Returns the opened variables, in the order of the signals.
    pub fn opened(&self) -> &[Port] {
        &self.opened
    }

    /// Linearises a run of the system after its initialisation.
    ///
    /// # Errors
    /// Returns an error if an instance fails or keeps no states, if the loop does not respond to
    /// changes of the opened signals, or if the run was asked to end.
    pub fn linearise(&self, run: &mut Run, interrupt: &Interrupt) -> Result<Linearised, Error> {
        let Self { system, time, ticks, wired, signals, opened } = self;
        let recorded = record(system, wired, ticks.clone(), run).map_err(|error| match error {
            Error::EndedByInstance { component, time, message } => {
                let end = rounded(system.clock.time(ticks.end));
                let message =
                    format!("{message}, but a linear model needs its motion until t = {end} s");
                Error::Call { component, time, failure: CallFailure::answer("linearise", message) }
            }
            error => error,
        })?;
        let _silence = warnings::silence();
        let mut found: Vec<Found> = Vec::new();
        let (mut next, mut has_pair) = (0, false);
        while next < wired.len() {
            if let Some(request) = interrupt.asked() {
                return Err(Error::Interrupted { time: *time, request });
            }
            if let Some(pair) = self.pair(next, &recorded, run)? {
                found.push(pair);
                (next, has_pair) = (next + 2, true);
            } else {
                found.push(self.alone(next, &recorded[next], run)?);
                next += 1;
            }
        }
        let models: Vec<&Component> = found.iter().map(|found| &found.model).collect();
        let links = links(system, &models, opened);
        let net = |of: &dyn Fn(&Found) -> Component| Net {
            components: found.iter().map(of).collect(),
            links: links.clone(),
            coupling: system.experiment.simulation.coupling,
            first: ticks.start,
            length: system.clock.step(),
            signals: signals.clone(),
        };
        let side = |side: usize| {
            net(&|found| found.sides.as_ref().map_or(&found.model, |sides| &sides[side]).clone())
        };
        let has_edge = found.iter().any(|found| found.sides.is_some());
        let sides = has_edge.then(|| [side(0), side(1)]);
        let net = net(&|found| found.model.clone());
        let open = net.open();
        if open.step.b.amax().max(open.step.d.amax()) == 0.0 || open.step.c.amax() == 0.0 {
            let silent: Vec<&str> =
                found.iter().filter(|found| found.is_silent).map(|found| &*found.note).collect();
            let message = format!(
                "the loop does not respond to a change of {}. {}",
                open.signals[0].name,
                silent.join("; ")
            );
            let component = system.components[opened[0].component].name.clone();
            let failure = CallFailure::new("linearise", message);
            return Err(Error::Call { component, time: *time, failure });
        }
        if has_pair && let Some(growth) = noise(&open) {
            let names: Vec<&str> = models.iter().map(|model| model.name.as_str()).collect();
            return Err(Error::Call {
                component: names.join(" with "),
                time: *time,
                failure: CallFailure::answer(
                    "linearise",
                    format!(
                        "the stability of the loop is undecided, because the allocator's noise hides a growth of {growth:.1e}/s"
                    ),
                ),
            });
        }
        let notes = found.into_iter().map(|found| found.note).collect();
        Ok(Linearised { time: *time, net, sides, open, notes })
    }
}

impl Lineariser {
    /// Finds the model of a component by itself.
    fn alone(&self, place: usize, recorded: &Recorded, run: &mut Run) -> Result<Found, Error> {
        let one = &self.wired[place];
        let builder = self.builder(one, recorded);
        Ok(run.master.call(one.component, self.time, |instance| builder.find(instance))?)
    }

    fn builder<'a>(&'a self, one: &'a Wired, recorded: &'a Recorded) -> Builder<'a> {
        Builder {
            system: &self.system,
            components: std::slice::from_ref(&one.component),
            first: one.first,
            recorded,
            inputs: one.inputs.clone(),
            outputs: one.outputs.clone(),
        }
    }

    /// Finds the model of a component together with the next one, if it has an edge by itself and
    /// none together with what it acts on.
    fn pair(
        &self,
        place: usize,
        recorded: &[Recorded],
        run: &mut Run,
    ) -> Result<Option<Found>, Error> {
        let [first, second] = match self.wired.get(place..place + 2) {
            Some([first, second]) if first.every == second.every => [first, second],
            _ => return Ok(None),
        };
        let components = [first.component, second.component];
        let joined = Joined::new(
            &self.system,
            components,
            [&recorded[place], &recorded[place + 1]],
            [&first.outputs, &second.outputs],
            &self.opened,
        );
        let Some(joined) = joined else { return Ok(None) };
        let builder = self.builder(first, &recorded[place]);
        if !run.master.call(first.component, self.time, |instance| builder.has_edge(instance))? {
            return Ok(None);
        }
        let builder = Builder {
            system: &self.system,
            components: &components,
            first: first.first,
            recorded: &joined.recorded,
            inputs: joined.inputs.clone(),
            outputs: joined.outputs.clone(),
        };
        let found = run.master.call_both(components, self.time, |instances| {
            let mut pair = Pair::new(&joined, instances);
            builder.find(&mut pair).map_err(|failure| (pair.last, failure))
        })?;
        Ok(Some(found).filter(|found| found.sides.is_none()))
    }
}

/// Returns the growth, 1/s, of a closed loop with a pair if noise alone may make it unstable: a
/// model of a pair may have motions that grow by themselves, and cannot distinguish a very slow
/// growth from none.
fn noise(open: &OpenLoop) -> Option<f64> {
    let growth = |a: &Matrix| spectral_radius(a).ln() / open.period;
    let closed = open.closed(&vec![1.0; open.channels()]).map(|a| growth(&a))?;
    let is_own = || growth(&open.step.a) > OWN_GROWTH;
    (closed >= 0.0 && (closed < SLOWEST_GROWTH || is_own())).then_some(closed)
}

/// Finds the components that respond to others. The inputs of each are seen at every communication
/// point from now on.
fn wired(system: &mut System, first: u64) -> Result<Vec<Wired>, Error> {
    let wires = system.wires();
    let is_real = |port: &Port| port.carrier == Carrier::Real;
    let mut wired = Vec::new();
    for component in 0..system.components.len() {
        let into = wires.iter().filter(|(wire, _)| wire.to.component == component);
        let ports: Vec<Port> = into.map(|(wire, _)| wire.to).collect();
        let mut outputs: Vec<Port> = Vec::new();
        for (wire, _) in wires.iter().filter(|(wire, _)| wire.from.component == component) {
            if is_real(&wire.from) && !outputs.contains(&wire.from) {
                outputs.push(wire.from);
            }
        }
        // A signal that responds to nothing does not change.
        if ports.is_empty() || outputs.is_empty() {
            continue;
        }
        let places = ports
            .iter()
            .map(|port| Ok(system.probe(&system.name(*port))?.place))
            .collect::<Result<Vec<_>, String>>()
            .map_err(Error::experiment)?;
        let every = u64::from(system.components[component].every);
        let length = every as f64 * system.clock.step();
        wired.push(Wired {
            component,
            every,
            recorded: Recorded { ports: ports.clone(), length, ..Recorded::default() },
            places,
            first: first.div_ceil(every) * every,
            inputs: ports.into_iter().filter(is_real).collect(),
            outputs,
        });
    }
    Ok(wired)
}

/// Runs to the end of some communication points, at whose beginning every component keeps its
/// state. Returns the components' inputs at them.
fn record(
    system: &System,
    wired: &[Wired],
    ticks: Range<u64>,
    run: &mut Run,
) -> Result<Vec<Recorded>, Error> {
    for tick in 0..ticks.start {
        run.advance(tick)?;
    }
    let time = system.clock.time(ticks.start);
    for one in wired {
        run.master.call(one.component, time, |instance| instance.save(0))?;
    }
    let mut all: Vec<Recorded> = wired.iter().map(|one| one.recorded.clone()).collect();
    for tick in ticks {
        let values = run.advance(tick)?;
        for (one, recorded) in wired.iter().zip(&mut all) {
            if tick.is_multiple_of(one.every) {
                recorded.rows.push(one.places.iter().map(|place| values[*place]).collect());
                recorded.times.push(system.clock.time(tick));
            }
        }
    }
    Ok(all)
}

/// Finds the connections between the components.
fn links(system: &System, models: &[&Component], opened: &[Port]) -> Vec<Link> {
    // A pair counts its references anew.
    let is_same = |a: &Port, b: &Port| a.component == b.component && a.variable == b.variable;
    let place = |port: &Port, of: fn(&Component) -> &Vec<Port>| {
        models.iter().enumerate().find_map(|(one, model)| {
            Some((one, of(model).iter().position(|other| is_same(port, other))?))
        })
    };
    let link = |(wire, reading): (Wire, Reading)| {
        Some(Link {
            from: place(&wire.from, |one| &one.outputs)?,
            to: place(&wire.to, |one| &one.inputs)?,
            factor: wire.scaling.apply(1.0) - wire.scaling.apply(0.0),
            reading,
            opened: opened.iter().position(|port| *port == wire.to || *port == wire.from),
        })
    };
    system.wires().into_iter().filter_map(link).collect()
}
