//! Which component keeps a loop from having a linear model.

use crate::flights::{Flights, Pulse};
use crate::opening::Opening;
use cosim::error::Error;

/// Difference of a response from a linear one, relative to the largest, that counts.
const BENDS: f64 = 0.02;

/// Finds the component whose outputs do not respond to its inputs as those of a linear one do, from
/// a `small` change, `half` of one and a `whole` one, which stay for `count` samples. Returns its
/// index, and how it responds.
///
/// # Errors
/// Returns an error if an instance fails, or if the run was asked to end.
pub(crate) fn culprit(
    opening: &Opening,
    flights: &mut Flights,
    [small, half, whole]: &[Vec<f64>; 3],
    count: usize,
) -> Result<Option<(usize, &'static str)>, Error> {
    let mut flown = |change: &[f64]| {
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let stays = Pulse { sample: 0, part: 0, parts: 0 };
        flights.fly_seen(stays, change, count, |values| rows.push(values.to_vec()))?;
        Ok::<_, Error>(rows)
    };
    let without = flown(&vec![0.0; whole.len()])?;
    let mut response = |change: &[f64]| {
        let with = flown(change)?;
        let by = |output: usize| -> Vec<f64> {
            with.iter()
                .zip(&without)
                .map(|(with, without)| with[output] - without[output])
                .collect()
        };
        Ok::<_, Error>((0..without[0].len()).map(by).collect::<Vec<_>>())
    };
    let (small, half, whole) = (response(small)?, response(half)?, response(whole)?);
    let moves = |response: &[Vec<f64>], output: usize| response[output].iter().any(|by| *by != 0.0);
    // Number of the communication point at which an output leaves the line.
    let bends = |output: usize| {
        let largest = whole[output].iter().fold(0.0, |most: f64, by| most.max(by.abs()));
        let mut both = half[output].iter().zip(&whole[output]);
        both.position(|(half, whole)| (whole - 2.0 * half).abs() > BENDS * largest)
    };
    let of = |component: usize| {
        let outputs = opening.outputs.iter().filter(move |(of, _)| *of == component);
        outputs.map(|(_, place)| *place)
    };
    let into = |component: usize| {
        let wires = opening.wires.iter().filter(move |(_, to)| *to == component);
        wires.map(|(from, _)| *from)
    };
    let is_moved = |component: usize, response: &[Vec<f64>]| {
        let is_given = opening.receivers.iter().any(|to| to.port.component == component);
        is_given || into(component).any(|output| moves(response, output))
    };
    let mut first: Option<(usize, usize)> = None;
    for component in 0..opening.components {
        let rounds = |output| !moves(&small, output) && moves(&whole, output);
        if is_moved(component, &small) && of(component).any(rounds) {
            return Ok(Some((
                component,
                "it rounds its outputs, so that small changes do not show",
            )));
        }
        let at = of(component).filter_map(bends).min();
        let is_first = |at: &usize| into(component).filter_map(bends).all(|before| before > *at);
        if let Some(at) = at.filter(is_first)
            && first.is_none_or(|(_, other)| at < other)
        {
            first = Some((component, at));
        }
    }
    if let Some((component, _)) = first {
        let how = "it is not linear here: it does not respond to half a change by half as much";
        return Ok(Some((component, how)));
    }
    let is_still = |component: &usize| {
        is_moved(*component, &whole) && !of(*component).any(|output| moves(&whole, output))
    };
    let silent = (0..opening.components).find(is_still);
    Ok(silent
        .map(|component| (component, "it delays its response for longer, or holds its outputs")))
}
