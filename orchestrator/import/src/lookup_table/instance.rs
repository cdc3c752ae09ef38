//! An instance of a lookup table.

use super::description::{HOLD, LINEAR, Place};
use super::{Form, LONGEST, LookupTable};
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
    places: Vec<Place>,
    interpolation: i32,
    shift: f64,
    /// Factor of each column.
    scales: Vec<f64>,
    present: Present,
    is_running: bool,
}

/// Place of the present time among the rows.
#[derive(Clone, Copy, Default)]
struct Present {
    last: usize,
    next: usize,
    /// Part of the way from the last row to the next.
    part: f64,
}

impl LookupTableInstance {
    pub(crate) fn new(name: &str, table: LookupTable) -> Self {
        Self {
            name: name.into(),
            places: table.places(),
            interpolation: HOLD,
            shift: 0.0,
            scales: vec![1.0; table.columns.len()],
            present: Present::default(),
            is_running: false,
            file: table.clone(),
            table,
        }
    }

    fn place(&self, call: &'static str, reference: u32) -> Result<Place, CallFailure> {
        let place = self.places.get(reference as usize).copied();
        place.ok_or_else(|| CallFailure::new(call, format!("there is no variable {reference}")))
    }

    /// Goes to a time. Before the first row its values hold, and after the last row the values of
    /// that row.
    fn go_to(&mut self, time: f64) {
        let (times, time) = (&self.table.times, time - self.shift);
        let is_past = |row: &f64| *row <= time + TOLERANCE * time.abs().max(1.0);
        let next = times.partition_point(is_past);
        let last = next.saturating_sub(1);
        self.present = if next == 0 || next == times.len() {
            Present { last, next: last, part: 0.0 }
        } else {
            let part = (time - times[last]) / (times[next] - times[last]);
            Present { last, next, part: part.clamp(0.0, 1.0) }
        };
    }

    /// Returns the value of a column at the present time.
    fn at_present(&self, column: usize) -> f64 {
        let LookupTable { columns, values, .. } = &self.table;
        let value_in = |row: usize| values[row * columns.len() + column];
        let Present { last, next, part } = self.present;
        let is_held = self.interpolation == HOLD || !matches!(columns[column].form, Form::Real(_));
        // Neither the difference of two values nor a product with zero may overflow.
        let value = if is_held || part == 0.0 {
            value_in(last)
        } else {
            (1.0 - part) * value_in(last) + part * value_in(next)
        };
        self.scales[column] * value
    }

    fn get(&self, call: &'static str, reference: u32) -> Result<f64, CallFailure> {
        Ok(match self.place(call, reference)? {
            Place::Output(column) => self.at_present(column),
            Place::Interpolation => self.interpolation.into(),
            Place::Shift => self.shift,
            Place::Scale(column) => self.scales[column],
            Place::Time(row) => self.table.times[row],
            Place::Value(index) => self.table.values[index],
        })
    }

    fn set(&mut self, call: &'static str, reference: u32, value: f64) -> Outcome {
        let refuse = |problem: String| Err(CallFailure::answer(call, problem));
        if self.is_running {
            return refuse("a lookup table can be set only before the run begins".into());
        }
        if !value.is_finite() {
            return refuse(format!("{value} is not finite"));
        }
        match self.place(call, reference)? {
            Place::Output(_) => return refuse("an output cannot be set".into()),
            Place::Interpolation if value == f64::from(HOLD) || value == f64::from(LINEAR) => {
                self.interpolation = value as i32;
            }
            Place::Interpolation => {
                return refuse(format!(
                    "interpolation = {value} is neither {HOLD} (hold) nor {LINEAR} (linear)"
                ));
            }
            Place::Shift | Place::Time(_) if value.abs() > LONGEST => {
                return refuse(format!("{value} s is not within {LONGEST:e} s of zero"));
            }
            Place::Shift => self.shift = value,
            Place::Scale(column) => self.scales[column] = value,
            Place::Time(row) => Arc::make_mut(&mut self.table.times)[row] = value,
            Place::Value(index) => Arc::make_mut(&mut self.table.values)[index] = value,
        }
        Ok(())
    }

    fn get_whole(&self, call: &'static str, references: &[u32], values: &mut [i32]) -> Outcome {
        for (value, reference) in values.iter_mut().zip(references) {
            // Only values of 32 bits are read as whole numbers.
            *value = self.get(call, *reference)? as i32;
        }
        Ok(())
    }

    fn set_whole(&mut self, call: &'static str, references: &[u32], values: &[i32]) -> Outcome {
        let mut pairs = references.iter().zip(values);
        pairs.try_for_each(|(reference, value)| self.set(call, *reference, (*value).into()))
    }
}

impl Instance for LookupTableInstance {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        for (value, reference) in values.iter_mut().zip(references) {
            *value = self.get("getReal", *reference)?;
        }
        Ok(())
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.get_whole("getInteger", references, values)
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.get_whole("getBoolean", references, values)
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        let mut pairs = references.iter().zip(values);
        pairs.try_for_each(|(reference, value)| self.set("setReal", *reference, *value))
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.set_whole("setInteger", references, values)
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.set_whole("setBoolean", references, values)
    }

    fn set_string(&mut self, reference: u32, _value: &str) -> Outcome {
        Err(CallFailure::new("setString", format!("variable {reference} is not a text")))
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        let times = &self.table.times;
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
        self.is_running = true;
        self.go_to(start);
        // One row is a constant.
        if let [first, .., last] = self.table.times[..] {
            let [first, last] = [first, last].map(|time| rounded(time + self.shift));
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
}
