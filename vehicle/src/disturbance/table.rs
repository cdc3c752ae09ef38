//! Disturbance as a lookup table: every row has a time and a direction, which holds until the next
//! row.

use crate::axes::ANGLES;
use crate::error::Error;
use crate::time::tolerance;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Shortest period with which a table repeats, s.
const SHORTEST_PERIOD: f64 = 1e-3;

/// Lookup table of a piecewise constant disturbance. A row that holds for no longer than the
/// tolerance of times is passed over.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisturbanceTable {
    /// Time after which the table repeats, with the time before the first row, s. A table with
    /// period 0 does not repeat, and its last row holds.
    #[serde(default)]
    pub period: f64,
    /// Rows in the order of their times.
    #[serde(default, rename = "row")]
    pub rows: Vec<Row>,
}

/// One row of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Time after disturbance.start at which a row takes effect (row {#}).
    #[setting(unit = "s", min = 0.0, nominal = 10.0)]
    pub time: f64,
    /// Factor on disturbance.bound for the {} (row {#}).
    #[setting(name = "", each = ANGLES, min = -1, max = 1, nominal = 1)]
    pub direction: Vector3<f64>,
}

impl DisturbanceTable {
    /// Refuses values that the definitions of the fields do not allow.
    ///
    /// # Errors
    /// Names the value at fault by its path in the configuration of the plant.
    pub(super) fn check(&self) -> Result<(), Error> {
        let name = |i: usize, column: &str| format!("disturbance.table.{column}[{}]", i + 1);
        let repeats = self.period >= SHORTEST_PERIOD && self.period.is_finite();
        if !(repeats || self.period == 0.0) {
            let problem = format!("= {} s must be 0 or at least {SHORTEST_PERIOD} s", self.period);
            return Err(Error::parameter("disturbance.table.period", problem));
        }
        let mut before: Option<f64> = None;
        for (i, Row { time, direction }) in self.rows.iter().enumerate() {
            let refuse = |problem: String| Err(Error::parameter(name(i, "time"), problem));
            if !(*time >= 0.0 && time.is_finite()) {
                return refuse(format!("= {time} s must be finite and not negative"));
            }
            if let Some(before) = before.filter(|before| before >= time) {
                let last = name(i - 1, "time");
                return refuse(format!("= {time} s must come after {last} = {before} s"));
            }
            if repeats && *time >= self.period {
                let period = self.period;
                return refuse(format!(
                    "= {time} s must come before disturbance.table.period = {period} s"
                ));
            }
            for (axis, factor) in ["alpha", "beta", "sigma"].into_iter().zip(direction) {
                if !(-1.0..=1.0).contains(factor) {
                    let problem = format!("= {factor} must lie between -1 and 1");
                    return Err(Error::parameter(name(i, axis), problem));
                }
            }
            before = Some(*time);
        }
        Ok(())
    }

    /// Time (s) at which the repetition with this number begins; `start` is that of the
    /// disturbance (s).
    fn begin(&self, start: f64, repetition: f64) -> f64 {
        start + repetition * self.period
    }

    /// Number of the repetition that contains `time` (s), from 0 at `start` (s).
    fn repetition(&self, start: f64, time: f64) -> f64 {
        if self.period == 0.0 {
            return 0.0;
        }
        let number = ((time - start) / self.period).floor();
        // The quotient is rounded, and begins are what times are compared with.
        if self.begin(start, number) > time {
            number - 1.0
        } else if self.begin(start, number + 1.0) <= time {
            number + 1.0
        } else {
            number
        }
    }

    /// Number of the row in force at `time` (s), from 1, or 0 before the first row. The table
    /// begins at `start` (s).
    pub(super) fn row(&self, start: f64, time: f64) -> usize {
        let latest = time + tolerance(time);
        let begin = self.begin(start, self.repetition(start, latest));
        self.rows.partition_point(|row| begin + row.time <= latest)
    }

    /// First time (s) after `time` (s) at which another row holds, or the table repeats.
    pub(super) fn next_change(&self, start: f64, time: f64) -> Option<f64> {
        let latest = time + tolerance(time);
        let repetition = self.repetition(start, latest);
        let next = match self.rows.get(self.row(start, time)) {
            Some(row) => self.begin(start, repetition) + row.time,
            None if self.rows.is_empty() || self.period == 0.0 => return None,
            None => self.begin(start, repetition + 1.0),
        };
        // Far from its start, rounding makes a table and its next repetition indistinguishable.
        (next > time).then_some(next)
    }

    /// Direction of the row with this number, from 1, and zero for any other number.
    pub(super) fn direction(&self, number: i64) -> Vector3<f64> {
        let row = usize::try_from(number - 1).ok().and_then(|i| self.rows.get(i));
        row.map_or_else(Vector3::zeros, |row| row.direction)
    }
}
