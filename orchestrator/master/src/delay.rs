//! Effective delay of each feedback loop, derived from the connections, the coupling and the
//! dependencies that the FMUs declare for their outputs.
//!
//! An output that depends on its component's inputs at the same instant is *direct*. It can be read
//! only after the step for which these inputs are set. If a reader is stepped before that (always
//! with Jacobi coupling; with sequential coupling if the component comes later in the order), it
//! gets the response to the inputs of the previous communication point, which delays it by one of
//! its steps. An output that depends on states alone is never delayed. A loop in which every output
//! is direct is algebraic: no order of calls solves it.

use crate::description::VariableKind;
use crate::quantity::rounded;
use crate::settings::{Setting, SettingValue};
use crate::wiring::{Coupling, Part, Port, Wire};
use std::collections::BTreeSet;

/// Time at which an output is read for a round of steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reading {
    /// The output is that of the communication point, before the inputs are set.
    #[default]
    BeforeStep,
    /// The output responds to the inputs, and can only be read after the step for which they are
    /// set: FMI 2.0.5, section 4.2.1, forbids reading between setting and stepping.
    AfterStep,
}

/// A feedback loop through components, with its delay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeedbackLoop {
    /// Indices of the components. Each feeds the next one, and the last feeds the first.
    pub components: Vec<usize>,
    /// Delay in addition to those within the components, in ticks.
    pub ticks: u64,
    /// Components of the loop that do not declare their outputs' dependencies, so that the worst
    /// case was assumed.
    pub undeclared: Vec<usize>,
    /// Components of the loop that respond to it through states only, so that the returning value
    /// is never part of the same instant's output.
    pub stateful: Vec<usize>,
}

/// Way in which an output depends on an input of its component.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Passage {
    /// The output depends on the input through states only.
    Delayed,
    /// The FMU does not declare the dependency.
    Undeclared,
    /// The output depends on the input at the same instant.
    Direct,
}

fn passage(parts: &[Part], component: usize, input: usize, output: usize) -> Passage {
    match parts[component].description.dependencies.get(&output) {
        None => Passage::Undeclared,
        Some(inputs) if inputs.contains(&input) => Passage::Direct,
        Some(_) => Passage::Delayed,
    }
}

/// Returns when the source of each connection is read. A direct output, or one that declares no
/// dependencies, is read after the step. With Jacobi coupling every output is read before it.
pub fn readings_of_wires(
    parts: &[Part],
    wires: &[Wire],
    coupling: Coupling,
) -> Vec<(Wire, Reading)> {
    let reading = |wire: &Wire| match (coupling, strongest_passage(parts, wires, wire.from)) {
        (Coupling::Jacobi, _) | (_, None | Some(Passage::Delayed)) => Reading::BeforeStep,
        (Coupling::Sequential, _) => Reading::AfterStep,
    };
    wires.iter().map(|wire| (*wire, reading(wire))).collect()
}

/// Returns when each variable that an observer asks for is read, so that its value belongs to the
/// communication point: an input, and an output that is declared to be direct, is read after the
/// step that begins there.
pub fn readings_of_probes(parts: &[Part], wires: &[Wire], probes: &[Port]) -> Vec<(Port, Reading)> {
    let reading = |port: &Port| {
        let variable = &parts[port.component].description.variables[port.variable];
        match strongest_passage(parts, wires, *port) {
            Some(Passage::Direct) => Reading::AfterStep,
            _ if variable.causality == "input" => Reading::AfterStep,
            _ => Reading::BeforeStep,
        }
    };
    probes.iter().map(|port| (*port, reading(port))).collect()
}

/// Returns how an output depends on its component's inputs. The connected inputs count. If it
/// depends on none of them, the others count as well, provided that the output is discrete and
/// feeds another component. `None` says that it depends on no input.
fn strongest_passage(parts: &[Part], wires: &[Wire], output: Port) -> Option<Passage> {
    let description = parts[output.component].description;
    let connected = wires.iter().filter(|wire| wire.to.component == output.component);
    let strongest = connected
        .map(|wire| passage(parts, output.component, wire.to.variable, output.variable))
        .max();
    let is_sampled = description.variables[output.variable].variability == "discrete";
    let inputs = description.dependencies.get(&output.variable);
    let responds = inputs.is_some_and(|inputs| {
        inputs.iter().any(|&input| description.variables[input].causality == "input")
    });
    let feeds = wires.iter().any(|wire| wire.from == output);
    if is_sampled && responds && feeds { Some(Passage::Direct) } else { strongest }
}

/// Finds all feedback loops, each once. `parts` are in the experiment's order, `every` are their
/// periods in ticks.
pub fn feedback_loops(
    parts: &[Part],
    every: &[u32],
    wires: &[Wire],
    coupling: Coupling,
) -> Vec<FeedbackLoop> {
    let mut loops = Vec::new();
    for first in 0..parts.len() {
        let mut path = vec![first];
        // Each loop is found only from its component with the smallest index.
        extend(&mut path, wires, &mut |components| {
            loops.push(measure(components, parts, every, wires, coupling));
        });
    }
    loops
}

fn extend(path: &mut Vec<usize>, wires: &[Wire], report: &mut impl FnMut(&[usize])) {
    let (first, last) = (path[0], path[path.len() - 1]);
    let next: BTreeSet<usize> =
        wires.iter().filter(|w| w.from.component == last).map(|w| w.to.component).collect();
    for component in next {
        if component == first {
            report(path);
        } else if component > first && !path.contains(&component) {
            path.push(component);
            extend(path, wires, report);
            path.pop();
        }
    }
}

fn measure(
    components: &[usize],
    parts: &[Part],
    every: &[u32],
    wires: &[Wire],
    coupling: Coupling,
) -> FeedbackLoop {
    let n = components.len();
    let mut ticks = 0;
    let (mut undeclared, mut stateful) = (Vec::new(), Vec::new());
    for (place, &component) in components.iter().enumerate() {
        let (before, after) = (components[(place + n - 1) % n], components[(place + 1) % n]);
        let entering =
            wires.iter().filter(|w| w.from.component == before && w.to.component == component);
        let leaving =
            wires.iter().filter(|w| w.from.component == component && w.to.component == after);
        let passages: Vec<Passage> = entering
            .flat_map(|i| {
                leaving
                    .clone()
                    .map(move |o| passage(parts, component, i.to.variable, o.from.variable))
            })
            .collect();
        let read_too_early = match coupling {
            Coupling::Jacobi => true,
            Coupling::Sequential => component >= after,
        };
        if passages.iter().any(|p| *p != Passage::Delayed) && read_too_early {
            ticks += u64::from(every[after]);
        }
        if passages.contains(&Passage::Undeclared) {
            undeclared.push(component);
        }
        if passages.iter().all(|passage| *passage == Passage::Delayed) {
            stateful.push(component);
        }
    }
    FeedbackLoop { components: components.to_vec(), ticks, undeclared, stateful }
}

/// Finds an order of the components in which sequential coupling has no delay, if there is one: a
/// component whose outputs depend on its inputs at the same instant comes before those that read
/// them. Otherwise the order of `parts` is kept.
pub fn order(parts: &[Part], wires: &[Wire]) -> Vec<usize> {
    let is_direct = |wire: &Wire| {
        let component = wire.from.component;
        let inputs = wires.iter().filter(|w| w.to.component == component);
        inputs.into_iter().any(|w| {
            passage(parts, component, w.to.variable, wire.from.variable) != Passage::Delayed
        })
    };
    let direct: Vec<&Wire> = wires.iter().filter(|wire| is_direct(wire)).collect();
    let mut left: Vec<usize> = (0..parts.len()).collect();
    let mut order = Vec::new();
    while !left.is_empty() {
        let waits = |index: usize| {
            direct.iter().any(|w| {
                w.to.component == index
                    && w.from.component != index
                    && left.contains(&w.from.component)
            })
        };
        let place = left.iter().position(|&index| !waits(index)).unwrap_or(0);
        order.push(left.remove(place));
    }
    order
}

/// Finds an algebraic loop, in which every output is declared to depend on the one before at the
/// same instant. Returns the names of the loop's inputs.
pub fn algebraic_loop(parts: &[Part], wires: &[Wire]) -> Option<Vec<String>> {
    // The nodes of this graph are wires. One wire leads to another if it ends at an input on which
    // the other's output depends.
    let leads_to = |a: &Wire, b: &Wire| {
        a.to.component == b.from.component
            && passage(parts, a.to.component, a.to.variable, b.from.variable) == Passage::Direct
    };
    let name = |wire: &Wire| {
        let part = parts[wire.to.component];
        format!("{}.{}", part.name, part.description.variables[wire.to.variable].name)
    };
    // What no wire leads to is on no loop, and neither is what only such wires lead to.
    let mut left: Vec<&Wire> = wires.iter().collect();
    loop {
        let before = left.clone();
        left.retain(|wire| before.iter().any(|other| leads_to(other, wire)));
        if left.len() == before.len() {
            break;
        }
    }
    let mut path = vec![*left.first()?];
    loop {
        let last = path[path.len() - 1];
        let other = left.iter().find(|other| leads_to(other, last))?;
        if let Some(place) = path.iter().position(|wire| std::ptr::eq(*wire, *other)) {
            return Some(path[place..].iter().copied().map(name).collect());
        }
        path.push(other);
    }
}

/// Parameter by which a component states the loop delay that its law is designed for, s.
const COUNTED_ON: &str = "delay";
/// Parameter by which a component states how much later than commanded its actuators act, s.
const TRANSPORT: &str = "actuation.delay";

/// A component whose control law is designed for another delay than its feedback loop has.
#[derive(Clone, Debug)]
pub struct Doubt {
    /// Index of the component.
    pub component: usize,
    /// Whether none of its loops has the delay that the law is designed for.
    pub certain: bool,
    /// What is set, and what should be.
    pub text: String,
}

/// Returns a doubt for each component whose control law is designed for another delay than its
/// feedback loop has. The loop's delay is its ticks times `step` (s), plus the transport delays of
/// the other components on it. If there are several loops, the one with the longest delay counts;
/// the doubt says so if another one has the delay that the law is designed for. If the component
/// responds to some of its loops at once, those through its states alone do not count: the values
/// that they carry, as the moment that actuators achieved, are a record of earlier ticks and not
/// the measurement that the law acts upon.
pub fn doubts(
    parts: &[Part],
    settings: &[Vec<Setting>],
    loops: &[FeedbackLoop],
    step: f64,
) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for (component, part) in parts.iter().enumerate() {
        let Some(counted_on) = duration(COUNTED_ON, parts[component], &settings[component]) else {
            continue;
        };
        let mut its_loops: Vec<&FeedbackLoop> =
            loops.iter().filter(|feedback| feedback.components.contains(&component)).collect();
        let is_at_once = |feedback: &&FeedbackLoop| !feedback.stateful.contains(&component);
        if its_loops.iter().any(is_at_once) {
            its_loops.retain(is_at_once);
        }
        let fits =
            |delay: f64| (delay - counted_on).abs() <= 1e-9 * delay.abs().max(counted_on.abs());
        let delays = its_loops.into_iter().map(|feedback| {
            let others = feedback.components.iter().filter(|other| **other != component);
            let transport: f64 = others
                .filter_map(|&other| duration(TRANSPORT, parts[other], &settings[other]))
                .sum();
            (feedback.ticks as f64 * step + transport, feedback)
        });
        let delays: Vec<_> = delays.collect();
        let longest = delays.iter().max_by(|(a, _), (b, _)| a.total_cmp(b));
        let Some(&(delay, longest)) = longest.filter(|(delay, _)| !fits(*delay)) else { continue };
        let certain = !delays.iter().any(|(delay, _)| fits(*delay));
        let unless = if certain {
            ""
        } else {
            ", unless its measurements come through another of its loops, which has the delay that is set"
        };
        let names: Vec<&str> = longest
            .components
            .iter()
            .chain(longest.components.first())
            .map(|&index| parts[index].name)
            .collect();
        let (name, delay) = (part.name, rounded(delay));
        let text = format!(
            "{name}.{COUNTED_ON} = {counted_on} s, but the loop {} has a delay of {delay} s: set {name}.{COUNTED_ON} = {delay}{unless}",
            names.join(" -> ")
        );
        doubts.push(Doubt { component, certain, text });
    }
    doubts
}

/// Returns the value of a real parameter in s, from the experiment or otherwise its start value;
/// `None` if there is no such parameter.
pub fn duration(name: &str, part: Part, settings: &[Setting]) -> Option<f64> {
    let (_, variable) = part.description.find(name)?;
    let is_duration =
        matches!(&variable.kind, VariableKind::Real { unit: Some(unit), .. } if unit == "s");
    if !is_duration || variable.causality != "parameter" {
        return None;
    }
    match settings.iter().find(|setting| setting.name == name).map(|setting| &setting.value) {
        Some(SettingValue::Real(value)) => Some(*value),
        _ => variable.start.as_ref()?.trim().parse().ok(),
    }
}

#[cfg(test)]
mod tests;
