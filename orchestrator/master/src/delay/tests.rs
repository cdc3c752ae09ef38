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

fn parts(descriptions: &[ModelDescription]) -> Vec<Part<'_>> {
    descriptions.iter().map(|description| Part { name: "c", description }).collect()
}

fn ticks(
    descriptions: &[ModelDescription],
    every: &[u32],
    wires: &[Wire],
    coupling: Coupling,
) -> Vec<u64> {
    let parts = parts(descriptions);
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

/// Adds a real parameter in s to the description.
fn with_duration(mut description: ModelDescription, name: &str, unit: &str) -> ModelDescription {
    let kind = VariableKind::Real {
        unit: Some(unit.into()),
        display_unit: None,
        is_relative: false,
        min: Some(0.0),
        max: None,
        nominal: None,
    };
    let start = Some("0".to_string());
    let causality = "parameter".into();
    let variable =
        Variable { name: name.into(), causality, kind, start, ..description.variables[0].clone() };
    description.variables.push(variable);
    description
}

fn texts(doubts: Vec<Doubt>) -> Vec<String> {
    doubts.into_iter().map(|doubt| doubt.text).collect()
}

/// Returns the doubts about a controller and a plant with these values of `delay` and
/// `actuation.delay`, at a step of 0.04 s.
fn warned(counted_on: Option<f64>, transport: Option<f64>, coupling: Coupling) -> Vec<String> {
    let controller = with_duration(description(&[Some(true)]), "delay", "s");
    let plant = with_duration(description(&[Some(false)]), "actuation.delay", "s");
    let parts = [
        Part { name: "controller", description: &controller },
        Part { name: "plant", description: &plant },
    ];
    let setting = |name: &str, value: Option<f64>| {
        let real =
            |value| Setting { name: name.into(), reference: 0, value: SettingValue::Real(value) };
        value.map(real).into_iter().collect::<Vec<_>>()
    };
    let settings = [setting("delay", counted_on), setting("actuation.delay", transport)];
    let loops = feedback_loops(&parts, &[1, 1], &[wire((0, 1), 1), wire((1, 1), 0)], coupling);
    texts(doubts(&parts, &settings, &loops, 0.04))
}

#[test]
fn oracle_a_law_that_counts_on_its_loops_delay_is_not_warned_of() {
    assert!(warned(None, None, Coupling::Sequential).is_empty());
    assert!(warned(Some(0.04), None, Coupling::Jacobi).is_empty());
    assert!(warned(Some(0.02), Some(0.02), Coupling::Sequential).is_empty());
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
    assert_eq!(warned(Some(0.04), None, Coupling::Sequential), told("0.04", "0"));
    assert_eq!(warned(Some(0.04), Some(0.02), Coupling::Jacobi), told("0.04", "0.06"));
    assert_eq!(warned(Some(0.0400001), None, Coupling::Jacobi), told("0.0400001", "0.04"));
}

#[test]
fn the_longest_loop_counts_and_what_is_on_no_loop_does_not() {
    // The loop 0 -> 1 -> 0 has a delay of one tick, 0 -> 2 -> 0 has none, and 3 is on no loop.
    let law = with_duration(description(&[Some(true)]), "delay", "s");
    let (direct, state) = (description(&[Some(true)]), description(&[Some(false)]));
    let descriptions = [law.clone(), direct, state, law];
    let parts = parts(&descriptions);
    let wires =
        [wire((0, 1), 1), wire((1, 1), 0), wire((0, 1), 2), wire((2, 1), 0), wire((2, 1), 3)];
    let loops = feedback_loops(&parts, &[1; 4], &wires, Coupling::Sequential);
    let none = [const { Vec::new() }; 4];
    let doubts = doubts(&parts, &none, &loops, 0.5);
    assert!(!doubts[0].certain);
    assert_eq!(
        texts(doubts),
        ["c.delay = 0 s, but the loop c -> c -> c has a delay of 0.5 s: set c.delay = 0.5, \
          unless its measurements come through another of its loops, which has the delay that is set"]
    );
}

#[test]
fn a_loop_through_the_states_of_a_law_does_not_count_beside_one_to_which_it_responds_at_once() {
    // The law responds at once by its first output and through states by the second, which returns
    // a tick later.
    let law = with_duration(description(&[Some(true), Some(false)]), "delay", "s");
    let (direct, state) = (description(&[Some(true)]), description(&[Some(false)]));
    let parts = [
        Part { name: "law", description: &law },
        Part { name: "allocator", description: &direct },
        Part { name: "plant", description: &state },
    ];
    let record = [wire((0, 2), 1), wire((1, 1), 0)];
    let flight = [wire((0, 1), 2), wire((2, 1), 0)];
    let warned = |wires: &[Wire], coupling| {
        let loops = feedback_loops(&parts, &[1; 3], wires, coupling);
        texts(doubts(&parts, &[const { Vec::new() }; 3], &loops, 0.5))
    };
    let both = [record, flight].concat();
    assert!(warned(&both, Coupling::Sequential).is_empty());
    assert!(
        warned(&both, Coupling::Jacobi)[0].contains("law -> plant -> law has a delay of 0.5 s")
    );
    // A law whose only loop is through its states is designed for that one.
    assert!(warned(&record, Coupling::Sequential)[0].contains("law -> allocator -> law"));
}

#[test]
fn a_parameter_that_is_no_duration_means_something_else() {
    let law = with_duration(description(&[Some(true)]), "delay", "1");
    let parts = ["a", "b"].map(|name| Part { name, description: &law });
    let loops =
        feedback_loops(&parts, &[1, 1], &[wire((0, 1), 1), wire((1, 1), 0)], Coupling::Jacobi);
    assert_eq!(loops.len(), 1);
    assert!(doubts(&parts, &[Vec::new(), Vec::new()], &loops, 0.04).is_empty());
}

#[test]
fn what_is_not_declared_counts_as_direct_and_is_named() {
    let descriptions = [description(&[None]), description(&[Some(false)])];
    let parts = parts(&descriptions);
    let wires = [wire((0, 1), 1), wire((1, 1), 0)];
    let loops = feedback_loops(&parts, &[1, 1], &wires, Coupling::Jacobi);
    let expected =
        FeedbackLoop { components: vec![0, 1], ticks: 1, undeclared: vec![0], stateful: vec![1] };
    assert_eq!(loops, [expected]);
    assert_eq!(algebraic_loop(&parts, &wires), None);
}

#[test]
fn algebraic_loops_are_found_through_any_number_of_components() {
    let direct = description(&[Some(true)]);
    let descriptions = [direct.clone(), direct.clone(), direct];
    let parts = parts(&descriptions);
    let ring = [wire((0, 1), 1), wire((1, 1), 2), wire((2, 1), 0)];
    assert_eq!(algebraic_loop(&parts, &ring).unwrap().len(), 3);
    assert_eq!(algebraic_loop(&parts, &ring[..2]), None);
    assert_eq!(algebraic_loop(&parts, &[wire((0, 1), 0)]), Some(vec!["c.v0".into()]));
}
