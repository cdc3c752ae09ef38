//! The closed loop, stepped as the orchestrator steps it with `coupling = "sequential"`: at each
//! communication point the controller first, which responds to the vehicle's state there, and then
//! the vehicle.

use crate::error::Error;
use crate::request::{GUARANTEE, Prepared};
use crate::signals::{COLUMNS, Row};
use crate::summary::{Limits, Summary};
use fmi2_export::Failure;
use fmi2_export::linked::Linked;
use vehicle::axes::{REPEATS, nearest};

/// Number of angles and rates.
const STATES: usize = 6;

/// Value references that a loop needs.
struct Wires {
    state: Vec<u32>,
    measured: Vec<u32>,
    reference: Vec<u32>,
    moment: Vec<u32>,
    applied: Vec<u32>,
    guarantee: Vec<u32>,
    limits: Vec<u32>,
}

/// Returns the value references of variables that every FMU of its kind has.
fn references(instance: &Linked, names: &[&str]) -> Result<Vec<u32>, Error> {
    let find = |name: &&str| {
        let found = instance.find(name).map(|(reference, _)| reference);
        let missing = || Failure::Error(format!("there is no variable {name}"));
        Ok(found.ok_or_else(missing)?)
    };
    names.iter().map(find).collect()
}

impl Wires {
    fn new(controller: &Linked, plant: &Linked) -> Result<Self, Error> {
        let of = |prefix: &str, from: usize, to: usize| {
            COLUMNS[from..to].iter().map(|name| name.trim_start_matches(prefix)).collect::<Vec<_>>()
        };
        let (state, moment) = (of("plant.", 1, 7), of("controller.", 10, 13));
        Ok(Self {
            state: references(plant, &state)?,
            measured: references(controller, &state)?,
            reference: references(controller, &of("controller.", 7, 10))?,
            moment: references(controller, &moment)?,
            applied: references(plant, &moment)?,
            guarantee: GUARANTEE.iter().filter_map(|name| Some(controller.find(name)?.0)).collect(),
            limits: references(controller, &["limit.rate", "limit.moment"])?,
        })
    }
}

/// Flies the loop. `signals` gets a row of [`COLUMNS`] for each communication point, in SI units;
/// the last one repeats the responses of the step before.
///
/// # Errors
/// Says which parameter the FMUs refuse. If a step fails or the attitude is lost, the flight ends
/// there, and the summary says why.
pub fn fly(prepared: Prepared, signals: &mut Vec<f64>) -> Result<Summary, Error> {
    let Prepared { mut controller, mut plant, step, steps, stop, lost_beyond, .. } = prepared;
    let wires = Wires::new(&controller, &plant)?;
    controller.initialize(0.0, stop)?;
    plant.initialize(0.0, stop)?;
    let mut limits = [0.0; 2];
    controller.reals(&wires.limits, &mut limits)?;
    let mut summary =
        Summary::new(Limits { rate: limits[0], moment: limits[1] }, step, &controller);
    signals.clear();
    signals.reserve((steps + 1) * COLUMNS.len());
    let mut row: Row = [0.0; COLUMNS.len()];
    for tick in 0..=steps {
        let end = tick == steps;
        row[0] = if end { stop } else { tick as f64 * step };
        let done = point(&mut controller, &mut plant, &wires, &mut row, (!end).then_some(step));
        if let Err(failure) = done {
            summary.end(row[0], failure.to_string());
            break;
        }
        for text in controller.take_warnings().into_iter().chain(plant.take_warnings()) {
            summary.warn(row[0], text);
        }
        let error = summary.take(&row, end).to_degrees();
        signals.extend_from_slice(&row);
        // An error that is not a number counts as lost, too.
        if error.is_nan() || error > lost_beyond {
            summary.lose(row[0], lost_beyond);
            break;
        }
    }
    Ok(summary)
}

/// Reads the loop at a communication point, and makes the step of length `step` (s) from there.
fn point(
    controller: &mut Linked,
    plant: &mut Linked,
    wires: &Wires,
    row: &mut Row,
    step: Option<f64>,
) -> Result<(), Failure> {
    plant.reals(&wires.state, &mut row[1..=STATES])?;
    controller.reals(&wires.reference, &mut row[7..10])?;
    for i in (0..3).filter(|i| REPEATS[*i]) {
        row[7 + i] = nearest(row[7 + i], row[1 + i]);
    }
    let Some(step) = step else { return Ok(()) };
    controller.set_reals(&wires.measured, &row[1..=STATES])?;
    controller.step(row[0], step)?;
    controller.reals(&wires.moment, &mut row[10..13])?;
    for (value, reference) in row[13..].iter_mut().zip(&wires.guarantee) {
        *value = f64::from(controller.integer(*reference)?);
    }
    plant.set_reals(&wires.applied, &row[10..13])?;
    plant.step(row[0], step)
}
