//! When a loop is linearised, and where it is opened.

use crate::model::Signal;
use cosim::error::Error;
use cosim::system::System;
use fmi_master::clock::Clock;
use fmi_master::description::Carrier;
use fmi_master::wiring::{Port, Wire};
use std::collections::BTreeSet;

/// Input that receives an opened signal.
pub(crate) struct Receiver {
    pub(crate) port: Port,
    /// Index of the signal, and factor from its unit to that of the input.
    pub(crate) signal: usize,
    pub(crate) factor: f64,
}

/// The instant, and the signals at which the loop is opened.
pub(crate) struct Opening {
    /// Communication point of the instant.
    pub(crate) first: u64,
    /// Communication steps in one step of the fastest receiver.
    pub(crate) held: u64,
    pub(crate) signals: Vec<Signal>,
    pub(crate) receivers: Vec<Receiver>,
    /// Receiver of each signal at which it is seen what arrives: the fastest one.
    pub(crate) seen: Vec<usize>,
    /// Number of components.
    pub(crate) components: usize,
    /// Connected outputs: component, and place among the probed values.
    pub(crate) outputs: Vec<(usize, usize)>,
    /// Connections: place of the output among the probed values, and component of the input.
    pub(crate) wires: Vec<(usize, usize)>,
}

impl Opening {
    /// Finds the instant at a time (s), and the connected inputs and outputs with these names.
    pub(crate) fn new(system: &mut System, time: f64, patterns: &[String]) -> Result<Self, Error> {
        let ports = ports(system, patterns)?;
        let signal = |port: &Port| Signal {
            name: system.name(*port),
            size: system.variable_at(*port).nominal(),
            unit: system.variable_at(*port).kind.unit().unwrap_or_default().into(),
        };
        let wires = system.wires();
        let mut receivers = Vec::new();
        for (signal, port) in ports.iter().enumerate() {
            for (wire, _) in &wires {
                if wire.to == *port {
                    receivers.push(Receiver { port: *port, signal, factor: 1.0 });
                } else if wire.from == *port {
                    let Wire { to, scaling, .. } = *wire;
                    receivers.push(Receiver { port: to, signal, factor: scaling.factor });
                }
            }
        }
        let every = |place: &usize| {
            let receiver: &Receiver = &receivers[*place];
            system.components[receiver.port.component].every
        };
        let fastest = |signal: usize| {
            let receive = (0..receivers.len()).filter(|place| receivers[*place].signal == signal);
            receive.min_by_key(every)
        };
        let seen: Vec<usize> = (0..ports.len()).filter_map(fastest).collect();
        let held = u64::from(seen.iter().map(every).min().unwrap_or(1));
        let first = tick_at(&system.clock, time)?.next_multiple_of(held);
        let signals = ports.iter().map(signal).collect();
        let (mut outputs, mut ends) = (Vec::new(), Vec::new());
        for (wire, _) in &wires {
            let name = system.name(wire.from);
            let place = system.probe(&name).map_err(Error::experiment)?.place;
            outputs.push((wire.from.component, place));
            ends.push((place, wire.to.component));
        }
        let components = system.components.len();
        Ok(Self { first, held, signals, receivers, seen, components, outputs, wires: ends })
    }
}

/// Finds the communication point at a time (s).
fn tick_at(clock: &Clock, time: f64) -> Result<u64, Error> {
    let exact = (time - clock.start()) / clock.step();
    let tick = exact.round();
    if !time.is_finite() || tick < 0.0 || (exact - tick).abs() > 1e-6 {
        return Err(Error::experiment(format!(
            "--at {time}: must be a communication point, {} s and then every {} s",
            clock.start(),
            clock.step()
        )));
    }
    Ok(tick as u64)
}

/// Finds the connected inputs and outputs with these names.
fn ports(system: &System, patterns: &[String]) -> Result<Vec<Port>, Error> {
    let wires = system.wires();
    let is_wired =
        |port: &Port| wires.iter().any(|(wire, _)| wire.from == *port || wire.to == *port);
    let mut ports: Vec<Port> = Vec::new();
    for pattern in patterns {
        let meant = system.ports(pattern).into_iter();
        let found: Vec<Port> =
            meant.filter(|port| port.carrier == Carrier::Real && is_wired(port)).collect();
        if found.is_empty() {
            let mut groups = BTreeSet::new();
            for port in wires.iter().flat_map(|(wire, _)| [wire.to, wire.from]) {
                let name = system.name(port);
                let group = name.rsplit_once('.').map(|(group, _)| format!("{group}.*"));
                groups.insert(group.unwrap_or(name));
            }
            let hint = fmi_master::names::hint(pattern, groups.iter().map(String::as_str));
            return Err(Error::experiment(format!(
                "--open {pattern}: there is no such connected input or output{hint}"
            )));
        }
        ports.extend(found.into_iter().filter(|port| !ports.contains(port)).collect::<Vec<_>>());
    }
    Ok(ports)
}
