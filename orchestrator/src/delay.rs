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
