//! When a loop is linearised, and where it is opened.

use crate::model::Signal;
use cosim::error::Error;
use cosim::system::System;
use fmi_master::clock::Clock;
use fmi_master::description::Carrier;
use fmi_master::wiring::Port;

/// Finds the communication point at a time (s).
pub(crate) fn tick_at(clock: &Clock, time: f64) -> Result<u64, Error> {
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

/// Finds the signals at which the loop is opened, and their ports.
pub(crate) fn opened(
    system: &System,
    patterns: &[String],
) -> Result<(Vec<Signal>, Vec<Port>), Error> {
    let wires = system.wires();
    let is_wired =
        |port: &Port| wires.iter().any(|(wire, _)| wire.from == *port || wire.to == *port);
    let mut ports: Vec<Port> = Vec::new();
    for pattern in patterns {
        let meant = system.ports(pattern).into_iter();
        let found: Vec<Port> =
            meant.filter(|port| port.carrier == Carrier::Real && is_wired(port)).collect();
        if found.is_empty() {
            let mut names: Vec<String> = Vec::new();
            for port in wires.iter().flat_map(|(wire, _)| [wire.to, wire.from]) {
                names.push(system.name(port));
            }
            let hint = fmi_master::names::hint(pattern, names.iter().map(String::as_str));
            return Err(Error::experiment(format!(
                "--open {pattern}: there is no such connected input or output{hint}"
            )));
        }
        ports.extend(found.into_iter().filter(|port| !ports.contains(port)).collect::<Vec<_>>());
    }
    let signal = |port: &Port| Signal {
        name: system.name(*port),
        size: system.variable_at(*port).nominal(),
        unit: system.variable_at(*port).kind.unit().unwrap_or_default().into(),
    };
    Ok((ports.iter().map(signal).collect(), ports))
}
