//! Effective delay of each feedback loop, from the wiring, the coupling and what the FMUs declare of their outputs.
//!
//! An output that depends on its unit's inputs at the same instant is *direct*. Where such an output is read before its
//! unit's inputs are set (always with Jacobi; with Gauss–Seidel if the unit comes later in the order), the reader gets the
//! value of the point before: one of its steps of delay. An output that depends on states alone is never late. A loop in
//! which every output is direct is algebraic: no order of calls solves it.

use crate::experiment::Coupling;
use crate::wiring::{Part, Wire};
use std::collections::BTreeSet;

/// A feedback loop through components.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeedbackLoop {
    /// Indices of the components, each feeding the next, the last the first.
    pub components: Vec<usize>,
    /// Delay beyond what the units themselves have, in ticks.
    pub ticks: u64,
    /// Components on the way that do not declare what their outputs depend on, so that the worst was assumed.
    pub undeclared: Vec<usize>,
}

/// How an output depends on an input of its unit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Passage {
    /// Through states only.
    Delayed,
    /// At the same instant.
    Direct,
    /// The FMU does not say.
    Undeclared,
}

fn passage(parts: &[Part], component: usize, input: usize, output: usize) -> Passage {
    match parts[component].description.dependencies.get(&output) {
        None => Passage::Undeclared,
        Some(known) if known.contains(&input) => Passage::Direct,
        Some(_) => Passage::Delayed,
    }
}

/// All feedback loops, each once. `parts` are in the experiment's order, `every` their periods in ticks.
pub fn feedback_loops(
    parts: &[Part],
    every: &[u32],
    wires: &[Wire],
    coupling: Coupling,
) -> Vec<FeedbackLoop> {
    let mut loops = Vec::new();
    for first in 0..parts.len() {
        let mut path = vec![first];
        // A loop is found from its smallest index only.
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

/// An order of the components in which Gauss–Seidel coupling has no delay, as far as there is one: a component whose outputs
/// depend on its inputs at the same instant comes before those that read them. Else they stay in the order of `parts`.
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

/// A loop of outputs that all are declared to depend on each other at the same instant, by the names of its inputs.
pub fn algebraic_loop(parts: &[Part], wires: &[Wire]) -> Option<Vec<String>> {
    // Nodes are wires; one wire leads to another if it ends at an input on which the other's output depends.
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

/// Depth-first search for a cycle; a wire once left is on none.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Kind, ModelDescription, Variable};
    use crate::experiment::Scaling;
    use crate::wiring::{Carrier, Port};

    /// Variable 0 is an input; outputs 1, 2, … depend on it directly, not at all, or by no declaration.
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
        // What is read too early is read again only at the reader's next point.
        assert_eq!(ticks(&against, &[5, 1], &wires, Coupling::GaussSeidel), [5]);
    }

    #[test]
    fn oracle_three_in_a_ring_and_a_loop_within() {
        // 0 -> 1 -> 2 -> 0, and 1 -> 0; only 2 has a state.
        let units = [unit(&[Some(true)]), unit(&[Some(true), Some(false)]), unit(&[Some(false)])];
        let wires = [wire((0, 1), 1), wire((1, 1), 2), wire((2, 1), 0), wire((1, 2), 0)];
        assert_eq!(ticks(&units, &[1; 3], &wires[..3], Coupling::GaussSeidel), [0]);
        assert_eq!(ticks(&units, &[1; 3], &wires[..3], Coupling::Jacobi), [2]);
        assert_eq!(ticks(&units, &[1; 3], &wires, Coupling::GaussSeidel), [0, 0]);
        assert!(ticks(&units, &[1; 3], &wires[..2], Coupling::Jacobi).is_empty());
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
