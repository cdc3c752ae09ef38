//! Finds what is doubtful about an experiment that can be run: a control law that is designed for
//! another loop delay, and a seed without effect.

use crate::delay;
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::metadata::is_seed;
use crate::settings::{Setting, SettingValue};
use crate::system::System;
use fmu_import::warnings;
use tracing::subscriber::{NoSubscriber, with_default};

/// Finds what is doubtful about a system, one line for each.
///
/// # Errors
/// Returns an error if the run was asked to end.
pub fn doubts(system: &System, interrupt: &Interrupt) -> Result<Vec<String>, Error> {
    let mut doubts =
        delay::warnings(&system.parts(), &system.settings(), &system.loops, system.clock.step());
    for seed in without_effect(system, interrupt)? {
        doubts
            .push(format!("--set {seed}: this seed has no effect, another one gives the same run"));
    }
    Ok(doubts)
}

/// Finds the seeds, as `component.parameter`, that the command line sets and that have no effect,
/// for example the seed of a constant disturbance. Two runs with different seeds are compared tick
/// by tick until they differ, which is soon if the seed has an effect.
///
/// # Errors
/// Returns an error if the comparison was ended from outside.
fn without_effect(system: &System, interrupt: &Interrupt) -> Result<Vec<String>, Error> {
    let mut idle = Vec::new();
    for (component, checked) in system.components.iter().enumerate() {
        for (index, setting) in checked.settings.iter().enumerate() {
            let path = format!("{}.{}", checked.name, setting.name);
            let SettingValue::Integer(seed) = setting.value else { continue };
            if !is_seed(&path) || !system.experiment.assigned.contains(&path) {
                continue;
            }
            let mut other = system.settings();
            other[component][index].value =
                SettingValue::Integer(if seed > 0 { seed - 1 } else { seed + 1 });
            // Messages of the instances are hidden here, because they appear again in the run
            // itself.
            let same = with_default(NoSubscriber::default(), || {
                let _warnings = warnings::collect();
                are_same(system, &other, interrupt)
            });
            match same {
                Ok(true) => idle.push(path),
                Err(error @ Error::Interrupted { .. }) => return Err(error),
                // A run that fails counts as one that differs.
                Ok(false) | Err(_) => {}
            }
        }
    }
    Ok(idle)
}

/// Returns whether all observed values except computing times stay the same if the settings are
/// replaced by `others`.
fn are_same(
    system: &System,
    others: &[Vec<Setting>],
    interrupt: &Interrupt,
) -> Result<bool, Error> {
    let timings = system.timings();
    let bits = |values: &[f64]| {
        let mut bits: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
        for place in &timings {
            bits[*place] = 0;
        }
        bits
    };
    let (mut one, mut other) = (system.start(interrupt)?, system.start_with(others, interrupt)?);
    let mut compared = false;
    for tick in 0..=system.clock.ticks() {
        let (one, other) = (bits(one.advance(tick)?), bits(other.advance(tick)?));
        compared |= !one.is_empty();
        if one != other {
            return Ok(false);
        }
    }
    Ok(compared)
}
