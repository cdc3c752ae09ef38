//! An instance of a lookup table.

use super::{HOLD, LookupTable};
use crate::warnings;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::quantity::rounded;
use std::sync::Arc;

/// Part of a time by which two times may differ and still be the same.
const TOLERANCE: f64 = 1e-9;

/// A lookup table with the time that it has reached.
pub(crate) struct LookupTableInstance {
    /// Name of the component.
    name: String,
    /// The table as its file has it.
    file: LookupTable,
    /// The table with the values that were set.
    table: LookupTable,
    /// Row before the present time, the row after it, and the part of the way between them.
    present: (usize, usize, f64),
}

impl LookupTableInstance {
    pub(crate) fn new(name: &str, table: LookupTable) -> Self {
        Self { name: name.into(), file: table.clone(), table, present: <_>::default() }
    }

    /// Goes to a time. Before the first row its values hold, and after the last row the values of
    /// that row.
    fn go_to(&mut self, time: f64) {
        let times = self.table.times();
        let is_past = |row: &f64| *row <= time + TOLERANCE * time.abs().max(1.0);
        let next = times.partition_point(is_past);
        let last = next.saturating_sub(1);
        self.present = if next == 0 || next == times.len() {
            (last, last, 0.0)
        } else {
            let part = (time - times[last]) / (times[next] - times[last]);
            (last, next, part.clamp(0.0, 1.0))
        };
    }

    /// Returns the number with this value reference. That of an output is a column at the present
    /// time.
    fn get(&self, reference: u32) -> f64 {
        let (table, place) = (&self.table, reference as usize);
        if place >= table.columns.len() {
            return table.numbers[place];
        }
        let (last, next, part) = self.present;
        // Neither the difference of two values nor a product with zero may overflow.
        if part == 0.0 || table.numbers[table.interpolation()] == f64::from(HOLD) {
            table.value(last, place)
        } else {
            (1.0 - part) * table.value(last, place) + part * table.value(next, place)
        }
    }
}

impl Instance for LookupTableInstance {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        for (value, reference) in values.iter_mut().zip(references) {
            *value = self.get(*reference);
        }
        Ok(())
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        for (value, reference) in values.iter_mut().zip(references) {
            *value = self.get(*reference) as i32;
        }
        Ok(())
    }

    fn get_boolean(&mut self, _references: &[u32], _values: &mut [i32]) -> Outcome {
        Err(CallFailure::new("getBoolean", "a lookup table has no truth values"))
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        for (reference, value) in references.iter().zip(values) {
            if !value.is_finite() {
                return Err(CallFailure::answer("setReal", format!("{value} is not finite")));
            }
            Arc::make_mut(&mut self.table.numbers)[*reference as usize] = *value;
        }
        Ok(())
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let values: Vec<f64> = values.iter().copied().map(f64::from).collect();
        self.set_real(references, &values)
    }

    fn set_boolean(&mut self, _references: &[u32], _values: &[i32]) -> Outcome {
        Err(CallFailure::new("setBoolean", "a lookup table has no truth values"))
    }

    fn set_string(&mut self, reference: u32, _value: &str) -> Outcome {
        Err(CallFailure::new("setString", format!("variable {reference} is not a text")))
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        let times = self.table.times();
        if let Some(row) = times.windows(2).position(|pair| pair[0] > pair[1]) {
            return Err(CallFailure::answer(
                "enterInitializationMode",
                format!(
                    "time[{}] = {} s is earlier than time[{}] = {} s",
                    row + 2,
                    times[row + 1],
                    row + 1,
                    times[row]
                ),
            ));
        }
        self.go_to(start);
        // One row is a constant.
        if let [first, .., last] = *self.table.times() {
            let [first, last] = [first, last].map(rounded);
            if first > stop || last < start {
                let held = if first > stop { "first" } else { "last" };
                warnings::warn(&format!(
                    "{}: its rows are from {first} s to {last} s, outside the run from {} s to {} s, in which it holds its {held} row",
                    self.name,
                    rounded(start),
                    rounded(stop)
                ));
            }
        }
        Ok(())
    }

    fn exit_initialization(&mut self) -> Outcome {
        Ok(())
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        self.go_to(time + step);
        Ok(())
    }

    fn reset(&mut self) -> Outcome {
        *self = Self::new(&self.name, self.file.clone());
        Ok(())
    }

    // Each step goes to its end, whatever came before, so that there is no state to keep.

    fn save(&mut self, _number: usize) -> Outcome {
        Ok(())
    }

    fn restore(&mut self, _number: usize) -> Outcome {
        Ok(())
    }
}
