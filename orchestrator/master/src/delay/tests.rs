use super::*;
use crate::description::Carrier;
use crate::description::{ModelDescription, Variable};
use crate::quantity::Scaling;
use crate::wiring::Port;

/// Variable 0 is an input; outputs 1, 2, … depend on it directly, not at all, or without a
/// declaration.
fn description(outputs: &[Option<bool>]) -> ModelDescription {
    let variable = |(position, causality): (usize, &'static str)| Variable {
        name: format!("v{position}"),
        reference: position as u32,
        description: String::new(),
        causality: causality.into(),
        variability: "continuous".into(),
        kind: VariableKind::Boolean,
        start: None,
        derivative_of: None,
        is_optional: false,
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

fn ticks(
    descriptions: &[ModelDescription],
    every: &[u32],
    wires: &[Wire],
    coupling: Coupling,
) -> Vec<u64> {
    let parts: Vec<Part> =
        descriptions.iter().map(|description| Part { name: "c", description }).collect();
    feedback_loops(&parts, every, wires, coupling).iter().map(|l| l.ticks).collect()
}

#[test]
fn oracle_controller_and_plant() {
    let (controller, plant) = (description(&[Some(true)]), description(&[Some(false)]));
    let wires = [wire((0, 1), 1), wire((1, 1), 0)];
    let in_order = [controller.clone(), plant.clone()];
    let against = [plant, controller];
    assert_eq!(ticks(&in_order, &[1, 1], &wires, Coupling::Sequential), [0]);
    assert_eq!(ticks(&against, &[1, 1], &wires, Coupling::Sequential), [1]);
    assert_eq!(ticks(&in_order, &[1, 1], &wires, Coupling::Jacobi), [1]);
    assert_eq!(ticks(&against, &[1, 1], &wires, Coupling::Jacobi), [1]);
    // A value that is read too early is read again only at the reader's next communication
    // point.
    assert_eq!(ticks(&against, &[5, 1], &wires, Coupling::Sequential), [5]);
}

#[test]
fn oracle_three_in_a_ring_and_a_loop_within() {
    // The loops are 0 -> 1 -> 2 -> 0 and 1 -> 0; only component 2 has a state.
    let descriptions = [
        description(&[Some(true)]),
        description(&[Some(true), Some(false)]),
        description(&[Some(false)]),
    ];
    let wires = [wire((0, 1), 1), wire((1, 1), 2), wire((2, 1), 0), wire((1, 2), 0)];
    assert_eq!(ticks(&descriptions, &[1; 3], &wires[..3], Coupling::Sequential), [0]);
    assert_eq!(ticks(&descriptions, &[1; 3], &wires[..3], Coupling::Jacobi), [2]);
    assert_eq!(ticks(&descriptions, &[1; 3], &wires, Coupling::Sequential), [0, 0]);
    assert!(ticks(&descriptions, &[1; 3], &wires[..2], Coupling::Jacobi).is_empty());
}

#[test]
fn what_is_not_declared_counts_as_direct_and_is_named() {
    let descriptions = [description(&[None]), description(&[Some(false)])];
    let parts: Vec<Part> =
        descriptions.iter().map(|description| Part { name: "c", description }).collect();
    let wires = [wire((0, 1), 1), wire((1, 1), 0)];
    let loops = feedback_loops(&parts, &[1, 1], &wires, Coupling::Jacobi);
    let expected = FeedbackLoop { components: vec![0, 1], ticks: 1, undeclared: vec![0] };
    assert_eq!(loops, [expected]);
    assert_eq!(algebraic_loop(&parts, &wires), None);
}

#[test]
fn algebraic_loops_are_found_through_any_number_of_components() {
    let direct = description(&[Some(true)]);
    let descriptions = [direct.clone(), direct.clone(), direct];
    let parts: Vec<Part> =
        descriptions.iter().map(|description| Part { name: "c", description }).collect();
    let ring = [wire((0, 1), 1), wire((1, 1), 2), wire((2, 1), 0)];
    assert_eq!(algebraic_loop(&parts, &ring).unwrap().len(), 3);
    assert_eq!(algebraic_loop(&parts, &ring[..2]), None);
    assert_eq!(algebraic_loop(&parts, &[wire((0, 1), 0)]), Some(vec!["c.v0".into()]));
}
