//! Margins as metrics of a run.

use crate::linearise::{Linearised, linearise};
use crate::margins::{self, Crossing, LoopMargins, Margins};
use cosim::error::Error;
use cosim::experiment;
use cosim::interrupt::Interrupt;
use cosim::system::System;
use cosim_metrics::metrics::Value;
use std::collections::BTreeMap;

/// Metrics by name, as an experiment's `[observe.margins]` asks for them.
pub type Measured = BTreeMap<String, Option<Value>>;

/// Returns the metrics without values, for a run that could not be linearised.
pub fn none() -> Measured {
    experiment::Margins::NAMES.iter().map(|(name, _)| ((*name).to_string(), None)).collect()
}

/// Computes the margins that a system's experiment asks for; nothing if it asks for none.
///
/// # Errors
/// The errors are those of [`linearise`].
pub fn asked(system: &System, interrupt: &Interrupt) -> Result<Measured, Error> {
    let Some(experiment::Margins { at, open }) = &system.experiment.observe.margins else {
        return Ok(Measured::new());
    };
    Ok(measure(&linearise(system.clone(), *at, open, interrupt)?))
}

/// Computes the margins of a loop: the smallest of all opened signals by themselves and together,
/// and of both sides of an edge. An unstable loop has none left. A margin without a limit has no
/// value.
pub fn measure(found: &Linearised) -> Measured {
    let sides = found.sides.iter().flatten();
    let all: Vec<Margins> =
        std::iter::once(&found.open).chain(sides).map(margins::margins).collect();
    let rows: Vec<&LoopMargins> =
        all.iter().flat_map(|margins| margins.loops.iter().chain(&margins.together)).collect();
    let is_stable = all.iter().all(|margins| margins.stable);
    let extreme = |of: &dyn Fn(&LoopMargins) -> Option<f64>, pick: fn(f64, f64) -> f64| {
        rows.iter().filter_map(|row| of(row)).reduce(pick)
    };
    let crossing = |of: fn(&LoopMargins) -> Option<Crossing>, pick: fn(f64, f64) -> f64| {
        extreme(&|row| of(row).map(|crossing| crossing.value), pick)
    };
    let numbers = if is_stable {
        [
            crossing(|row| row.classical.gain_above, f64::min),
            crossing(|row| row.classical.gain_below, f64::max),
            crossing(|row| row.classical.phase, f64::min),
            crossing(|row| row.classical.delay, f64::min),
            extreme(&|row| Some(row.disk.alpha), f64::min),
            extreme(&|row| Some(row.sensitivity.value), f64::max),
        ]
    } else {
        [Some(1.0), Some(1.0), Some(0.0), Some(0.0), Some(0.0), None]
    };
    let mut measured = none();
    let names = experiment::Margins::NAMES.map(|(name, _)| name.to_string());
    measured.insert(names[0].clone(), Some(Value::Flag(is_stable)));
    for (name, number) in names.into_iter().skip(1).zip(numbers) {
        measured.insert(name, number.map(Value::Number));
    }
    measured
}
