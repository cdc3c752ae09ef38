//! Effective delay of each feedback loop, derived from the connections, the coupling and the
//! dependencies that the FMUs declare for their outputs.
//! An output that depends on its unit's inputs at the same instant is *direct*. If such an output
//! is read before its unit's inputs are set (always with Jacobi coupling; with Gauss–Seidel if the
//! unit comes later in the order), the reader gets the value of the previous communication point,
//! which delays it by one of its steps. An output that depends on states alone is never late. A
//! loop in which every output is direct is algebraic: no order of calls solves it.
//! which every output is direct is algebraic: no order of calls solves it.

use crate::experiment::Coupling;
use crate::settings::{Setting, SettingValue};
use crate::wiring::{Part, Wire};
use fmu_import::description::Kind;
use fmu_import::quantity::rounded;
use std::collections::BTreeSet;

/// A feedback loop through components, with its delay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeedbackLoop {
    /// Indices of the components. Each feeds the next one, and the last feeds the first.
    pub components: Vec<usize>,
    /// Delay in addition to the units' own, in ticks.
    pub ticks: u64,
    /// Components of the loop that do not declare their outputs' dependencies, so that the worst
    /// case was assumed.
    pub undeclared: Vec<usize>,
}

/// How an output depends on an input of its unit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Passage {
    /// The output depends on the input through states only.
    Delayed,
    /// The output depends on the input at the same instant.
    Direct,
    /// The FMU does not declare the dependency.
    Undeclared,
}

fn passage(parts: &[Part], component: usize, input: usize, output: usize) -> Passage {
    match parts[component].description.dependencies.get(&output) {
        None => Passage::Undeclared,
        Some(known) if known.contains(&input) => Passage::Direct,
        Some(_) => Passage::Delayed,
    }
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

fn extend(path: &mut Vec<usize>, wires: &[Wire], found: &mut impl FnMut(&[usize])) {
    let (first, last) = (path[0], path[path.len() - 1]);
    let next: BTreeSet<usize> =
        wires.iter().filter(|w| w.from.component == last).map(|w| w.to.component).collect();
    for component in next {
        if component == first {
            found(path);
        } else if component > first && !path.contains(&component) {
            path.push(component);
            extend(path, wires, found);
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
    let mut undeclared = Vec::new();
    for (place, &component) in components.iter().enumerate() {
        let (before, after) = (components[(place + n - 1) % n], components[(place + 1) % n]);
        let entering = wires.iter().filter(|w| w.from.component == before && w.to.component == component);
        let leaving = wires.iter().filter(|w| w.from.component == component && w.to.component == after);
        let passages: Vec<Passage> = entering
            .flat_map(|i| {
                leaving.clone().map(move |o| passage(parts, component, i.to.variable, o.from.variable))
            })
            .collect();
        let read_too_early = match coupling {
            Coupling::Jacobi => true,
            Coupling::GaussSeidel => component >= after,
        };
        if passages.iter().any(|p| *p != Passage::Delayed) && read_too_early {
            ticks += u64::from(every[after]);
        }
        if passages.contains(&Passage::Undeclared) {
            undeclared.push(component);
        }
    }
    FeedbackLoop { components: components.to_vec(), ticks, undeclared }
}

/// An order of the components in which Gauss–Seidel coupling has no delay, as far as there is one:
/// a component whose outputs depend on its inputs at the same instant comes before those that read
/// them. Otherwise the order of `parts` is kept.
pub fn order(parts: &[Part], wires: &[Wire]) -> Vec<usize> {
    let is_direct = |wire: &Wire| {
        let component = wire.from.component;
        let inputs = wires.iter().filter(|w| w.to.component == component);
        inputs
            .into_iter()
            .any(|w| passage(parts, component, w.to.variable, wire.from.variable) != Passage::Delayed)
    };
    let direct: Vec<&Wire> = wires.iter().filter(|wire| is_direct(wire)).collect();
    let mut left: Vec<usize> = (0..parts.len()).collect();
    let mut order = Vec::new();
    while !left.is_empty() {
        let waits = |index: usize| {
            direct.iter().any(|w| {
                w.to.component == index && w.from.component != index && left.contains(&w.from.component)
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
    let mut done = vec![false; wires.len()];
    for start in 0..wires.len() {
        let mut path = vec![start];
        if let Some(cycle) = follow(&mut path, &mut done, wires, &leads_to) {
            return Some(cycle.iter().map(|&wire| name(&wires[wire])).collect());
        }
    }
    None
}

/// Searches for a cycle depth first; a wire that the search has left is on no cycle.
fn follow(
    path: &mut Vec<usize>,
    done: &mut [bool],
    wires: &[Wire],
    leads_to: &impl Fn(&Wire, &Wire) -> bool,
) -> Option<Vec<usize>> {
    let last = path[path.len() - 1];
    if done[last] {
        return None;
    }
    for next in 0..wires.len() {
        if leads_to(&wires[last], &wires[next]) {
            if let Some(place) = path.iter().position(|&wire| wire == next) {
                return Some(path[place..].to_vec());
            }
            path.push(next);
            if let Some(cycle) = follow(path, done, wires, leads_to) {
                return Some(cycle);
            }
            path.pop();
        }
    }
    done[last] = true;
    None
}

/// Parameter by which a component states the loop delay that its law is designed for, s.
const COUNTED_ON: &str = "delay";
/// Parameter by which a component states how much later than commanded its actuators act, s.
const TRANSPORT: &str = "actuation.delay";

/// Returns one warning for each component whose law is designed for another delay than its feedback
/// loop has. The loop's delay is its ticks times `step` (s), plus the transport delays of the other
/// components on it. If there are several loops, the one with the longest delay counts.
pub fn warnings(parts: &[Part], settings: &[Vec<Setting>], loops: &[FeedbackLoop], step: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    for (component, part) in parts.iter().enumerate() {
        let Some(counted_on) = duration(COUNTED_ON, parts[component], &settings[component]) else { continue };
        let own = loops.iter().filter(|feedback| feedback.components.contains(&component));
        let delays = own.map(|feedback| {
            let others = feedback.components.iter().filter(|other| **other != component);
            let transport: f64 =
                others.filter_map(|&other| duration(TRANSPORT, parts[other], &settings[other])).sum();
            (feedback.ticks as f64 * step + transport, feedback)
        });
        let Some((delay, longest)) = delays.max_by(|(a, _), (b, _)| a.total_cmp(b)) else { continue };
        if (delay - counted_on).abs() <= 1e-9 * delay.abs().max(counted_on.abs()) {
            continue;
        }
        let names: Vec<&str> = longest
            .components
            .iter()
            .chain(longest.components.first())
            .map(|&index| parts[index].name)
            .collect();
        let (name, delay) = (part.name, rounded(delay));
        warnings.push(format!(
            "{name}.{COUNTED_ON} = {counted_on} s, but the loop {} has a delay of {delay} s: set {name}.{COUNTED_ON} = {delay}",
            names.join(" -> ")
        ));
    }
    warnings
}

/// Value of a real parameter in s, from the experiment or otherwise its start value; `None` if
/// there is no such parameter.
fn duration(name: &str, part: Part, settings: &[Setting]) -> Option<f64> {
    let (_, variable) = part.description.find(name)?;
    let is_duration = matches!(&variable.kind, Kind::Real { unit: Some(unit), .. } if unit == "s");
    if !is_duration || variable.causality != "parameter" {
        return None;
    }
    match settings.iter().find(|setting| setting.name == name).map(|setting| &setting.value) {
        Some(SettingValue::Real(value)) => Some(*value),
        _ => variable.start.as_ref()?.trim().parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wiring::Port;
    use fmu_import::description::Carrier;
    use fmu_import::description::{ModelDescription, Variable};
    use fmu_import::quantity::Scaling;

    /// Variable 0 is an input; outputs 1, 2, … depend on it directly, not at all, or without a
    /// declaration.
    fn unit(outputs: &[Option<bool>]) -> ModelDescription {
        let variable = |(position, causality): (usize, &str)| Variable {
            name: format!("v{position}"),
            reference: position as u32,
            description: String::new(),
            causality: causality.into(),
            variability: "continuous".into(),
            kind: Kind::Boolean,
            start: None,
        };
        let causalities = std::iter::once("input").chain(outputs.iter().map(|_| "output"));
        let mut description = ModelDescription {
            variables: causalities.enumerate().map(variable).collect(),
            ..ModelDescription::default()
        };
        for (place, direct) in outputs.iter().enumerate() {
            if let Some(direct) = direct {
                description.dependencies.insert(place + 1, if *direct { vec![0] } else { vec![] });
            }
        }
        description
    }

    fn wire((from, output): (usize, usize), to: usize) -> Wire {
        let port = |component, variable: usize| Port {
            component,
            variable,
            reference: variable as u32,
            carrier: Carrier::Real,
        };
        Wire { from: port(from, output), to: port(to, 0), scaling: Scaling::default() }
    }

    fn ticks(units: &[ModelDescription], every: &[u32], wires: &[Wire], coupling: Coupling) -> Vec<u64> {
        let parts: Vec<Part> = units.iter().map(|description| Part { name: "c", description }).collect();
        feedback_loops(&parts, every, wires, coupling).iter().map(|l| l.ticks).collect()
    }

    #[test]
    fn oracle_controller_and_plant() {
        let (controller, plant) = (unit(&[Some(true)]), unit(&[Some(false)]));
        let wires = [wire((0, 1), 1), wire((1, 1), 0)];
        let in_order = [controller.clone(), plant.clone()];
        let against = [plant, controller];
        assert_eq!(ticks(&in_order, &[1, 1], &wires, Coupling::GaussSeidel), [0]);
        assert_eq!(ticks(&against, &[1, 1], &wires, Coupling::GaussSeidel), [1]);
        assert_eq!(ticks(&in_order, &[1, 1], &wires, Coupling::Jacobi), [1]);
        assert_eq!(ticks(&against, &[1, 1], &wires, Coupling::Jacobi), [1]);
        // A value that is read too early is read again only at the reader's next communication
        // point.
        assert_eq!(ticks(&against, &[5, 1], &wires, Coupling::GaussSeidel), [5]);
    }

    #[test]
    fn oracle_three_in_a_ring_and_a_loop_within() {
        // The loops are 0 -> 1 -> 2 -> 0 and 1 -> 0; only component 2 has a state.
        let units = [unit(&[Some(true)]), unit(&[Some(true), Some(false)]), unit(&[Some(false)])];
        let wires = [wire((0, 1), 1), wire((1, 1), 2), wire((2, 1), 0), wire((1, 2), 0)];
        assert_eq!(ticks(&units, &[1; 3], &wires[..3], Coupling::GaussSeidel), [0]);
        assert_eq!(ticks(&units, &[1; 3], &wires[..3], Coupling::Jacobi), [2]);
        assert_eq!(ticks(&units, &[1; 3], &wires, Coupling::GaussSeidel), [0, 0]);
        assert!(ticks(&units, &[1; 3], &wires[..2], Coupling::Jacobi).is_empty());
    }

    /// Adds a real parameter in s to the unit's description.
    fn with_duration(mut unit: ModelDescription, name: &str, unit_name: &str) -> ModelDescription {
        let kind = Kind::Real { unit: Some(unit_name.into()), display_unit: None, min: Some(0.0), max: None };
        let start = Some("0".to_string());
        let causality = "parameter".to_string();
        let variable = Variable { name: name.into(), causality, kind, start, ..unit.variables[0].clone() };
        unit.variables.push(variable);
        unit
    }

    /// Warnings of controller and plant with these values of `delay` and `actuation.delay`, steps of 0.04 s.
    fn warned(counted_on: Option<f64>, transport: Option<f64>, coupling: Coupling) -> Vec<String> {
        let controller = with_duration(unit(&[Some(true)]), "delay", "s");
        let plant = with_duration(unit(&[Some(false)]), "actuation.delay", "s");
        let parts = [
            Part { name: "controller", description: &controller },
            Part { name: "plant", description: &plant },
        ];
        let setting = |name: &str, value: Option<f64>| {
            let real = |value| Setting { name: name.into(), reference: 0, value: SettingValue::Real(value) };
            value.map(real).into_iter().collect::<Vec<_>>()
        };
        let settings = [setting("delay", counted_on), setting("actuation.delay", transport)];
        let loops = feedback_loops(&parts, &[1, 1], &[wire((0, 1), 1), wire((1, 1), 0)], coupling);
        warnings(&parts, &settings, &loops, 0.04)
    }

    #[test]
    fn oracle_a_law_that_counts_on_its_loops_delay_is_not_warned_of() {
        assert!(warned(None, None, Coupling::GaussSeidel).is_empty());
        assert!(warned(Some(0.04), None, Coupling::Jacobi).is_empty());
        assert!(warned(Some(0.02), Some(0.02), Coupling::GaussSeidel).is_empty());
        assert!(warned(Some(0.07), Some(0.03), Coupling::Jacobi).is_empty());
        assert!(warned(Some(0.04 * (1.0 + 1e-12)), None, Coupling::Jacobi).is_empty());
    }

    #[test]
    fn oracle_a_law_that_counts_on_another_delay_is_told_the_right_one() {
        let told = |counted_on, delay| {
            let expected = format!(
                "controller.delay = {counted_on} s, but the loop controller -> plant -> controller has a delay of \
                 {delay} s: set controller.delay = {delay}"
            );
            vec![expected]
        };
        assert_eq!(warned(None, None, Coupling::Jacobi), told("0", "0.04"));
        assert_eq!(warned(Some(0.04), None, Coupling::GaussSeidel), told("0.04", "0"));
        assert_eq!(warned(Some(0.04), Some(0.02), Coupling::Jacobi), told("0.04", "0.06"));
        assert_eq!(warned(Some(0.0400001), None, Coupling::Jacobi), told("0.0400001", "0.04"));
    }

    #[test]
    fn the_longest_loop_counts_and_what_is_on_no_loop_does_not() {
        // The loop 0 -> 1 -> 0 has a delay of one tick, 0 -> 2 -> 0 has none, and 3 is on no loop.
        let law = with_duration(unit(&[Some(true)]), "delay", "s");
        let (direct, state) = (unit(&[Some(true)]), unit(&[Some(false)]));
        let units = [law.clone(), direct, state, law];
        let parts: Vec<Part> = units.iter().map(|description| Part { name: "c", description }).collect();
        let wires = [wire((0, 1), 1), wire((1, 1), 0), wire((0, 1), 2), wire((2, 1), 0), wire((2, 1), 3)];
        let loops = feedback_loops(&parts, &[1; 4], &wires, Coupling::GaussSeidel);
        let none = [const { Vec::new() }; 4];
        let warnings = warnings(&parts, &none, &loops, 0.5);
        assert_eq!(
            warnings,
            ["c.delay = 0 s, but the loop c -> c -> c has a delay of 0.5 s: set c.delay = 0.5"]
        );
    }

    #[test]
    fn a_parameter_that_is_no_duration_means_something_else() {
        let law = with_duration(unit(&[Some(true)]), "delay", "1");
        let parts = ["a", "b"].map(|name| Part { name, description: &law });
        let loops = feedback_loops(&parts, &[1, 1], &[wire((0, 1), 1), wire((1, 1), 0)], Coupling::Jacobi);
        assert_eq!(loops.len(), 1);
        assert!(warnings(&parts, &[Vec::new(), Vec::new()], &loops, 0.04).is_empty());
    }

    #[test]
    fn what_is_not_declared_counts_as_direct_and_is_named() {
        let units = [unit(&[None]), unit(&[Some(false)])];
        let parts: Vec<Part> = units.iter().map(|description| Part { name: "c", description }).collect();
        let wires = [wire((0, 1), 1), wire((1, 1), 0)];
        let loops = feedback_loops(&parts, &[1, 1], &wires, Coupling::Jacobi);
        assert_eq!(loops, [FeedbackLoop { components: vec![0, 1], ticks: 1, undeclared: vec![0] }]);
        assert_eq!(algebraic_loop(&parts, &wires), None);
    }

    #[test]
    fn algebraic_loops_are_found_through_any_number_of_units() {
        let direct = unit(&[Some(true)]);
        let units = [direct.clone(), direct.clone(), direct];
        let parts: Vec<Part> = units.iter().map(|description| Part { name: "c", description }).collect();
        let ring = [wire((0, 1), 1), wire((1, 1), 2), wire((2, 1), 0)];
        assert_eq!(algebraic_loop(&parts, &ring).unwrap().len(), 3);
        assert_eq!(algebraic_loop(&parts, &ring[..2]), None);
        assert_eq!(algebraic_loop(&parts, &[wire((0, 1), 0)]), Some(vec!["c.v0".into()]));
    }
}
