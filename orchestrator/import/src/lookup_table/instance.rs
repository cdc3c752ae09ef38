//! An instance of a lookup table.

use super::{Column, Form, HOLD, LookupTable};
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

    /// Returns the time that is added to the times of all rows, s.
    fn shift(&self) -> f64 {
        self.table.numbers[self.table.columns.len() + 1]
    }

    /// Goes to a time. Before the first row its values hold, and after the last row the values of
    /// that row.
    fn go_to(&mut self, time: f64) {
        let (times, time) = (self.table.times(), time - self.shift());
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
        let count = table.columns.len();
        let Some(column) = table.columns.get(place) else { return table.numbers[place] };
        let (last, next, part) = self.present;
        let is_held = table.numbers[count] == HOLD || !column.form.is_real();
        // Neither the difference of two values nor a product with zero may overflow.
        let value = if is_held || part == 0.0 {
            table.value(last, place)
        } else {
            (1.0 - part) * table.value(last, place) + part * table.value(next, place)
        };
        table.numbers[count + 2 + place] * value
    }

    /// Returns the first column of an angle that is interpolated over more than half a turn, with
    /// the row before it.
    fn long_turn(&self) -> Option<(&Column, usize)> {
        let Self { table, .. } = self;
        let columns = table.columns.iter().enumerate();
        let mut turns = columns.filter_map(|(place, column)| {
            let half = match &column.form {
                Form::Real(Some(unit)) if unit == "deg" => 180.0,
                Form::Real(Some(unit)) if unit == "rad" => std::f64::consts::PI,
                _ => return None,
            };
            let turn = |row: usize| table.value(row + 1, place) - table.value(row, place);
            let row = (0..table.rows.saturating_sub(1)).find(|row| turn(*row).abs() > half)?;
            Some((column, row))
        });
        turns.next().filter(|_| table.numbers[table.columns.len()] != HOLD)
    }

    fn set(&mut self, call: &'static str, reference: u32, value: f64) -> Outcome {
        if !value.is_finite() {
            return Err(CallFailure::answer(call, format!("{value} is not finite")));
        }
        Arc::make_mut(&mut self.table.numbers)[reference as usize] = value;
        Ok(())
    }

    fn get_whole(&self, references: &[u32], values: &mut [i32]) {
        for (value, reference) in values.iter_mut().zip(references) {
            // Only values of 32 bits are read as whole numbers.
            *value = self.get(*reference) as i32;
        }
    }

    fn set_whole(&mut self, call: &'static str, references: &[u32], values: &[i32]) -> Outcome {
        let mut pairs = references.iter().zip(values);
        pairs.try_for_each(|(reference, value)| self.set(call, *reference, (*value).into()))
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
        self.get_whole(references, values);
        Ok(())
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.get_whole(references, values);
        Ok(())
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
        if let Some((column, row)) = self.long_turn() {
            let (name, [from, to]) = (&column.name, [row, row + 1].map(|row| row + 1));
            warnings::warn(&format!(
                "{}: {name} is interpolated the long way round between its rows {from} and {to}: add a whole turn to the later ones",
                self.name
            ));
        }
        // One row is a constant.
        if let [first, .., last] = *self.table.times() {
            let [first, last] = [first, last].map(|time| rounded(time + self.shift()));
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
