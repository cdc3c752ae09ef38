//! Errors that this crate reports.

use std::borrow::Cow;

/// Reason why a vehicle, its data or a simulation cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The scenario file cannot be read or understood.
    #[error("scenario {file}: {problem}")]
    Scenario {
        /// Path of the file, or the name of an embedded one.
        file: String,
        /// Description of the fault in the file.
        problem: String,
    },
    /// The file of a vehicle cannot be read or understood.
    #[error("{file}{}: {problem}", place(line.map(|line| line as u64), None))]
    Vehicle {
        /// Path of the file, or the name of an embedded one.
        file: String,
        /// Number of the line, counted from 1, if the problem belongs to one.
        line: Option<usize>,
        /// Description of the fault in the file.
        problem: String,
    },
    /// The reference table cannot be read or understood.
    #[error("reference table {file}{}: {problem}", place(*line, column.as_deref()))]
    Table {
        /// Name of the table's file.
        file: String,
        /// Number of the line, counted from 1, if the problem belongs to one.
        line: Option<u64>,
        /// Heading of the column, if the problem belongs to one.
        column: Option<String>,
        /// Description of the fault and of the expected content.
        problem: String,
    },
    /// A configuration value lies outside the range that the equations allow.
    #[error("{name} {problem}")]
    Parameter {
        /// Name of the setting that holds the value, as it is declared.
        name: Cow<'static, str>,
        /// Description of the fault in the value.
        problem: String,
    },
    /// The sideslip angle reached ±90°, where the attitude angles are singular.
    #[error(
        "sideslip beta = {beta_deg:.3} deg at t = {} s: the attitude angles are singular at 90 deg",
        rounded_time(*time)
    )]
    Singular {
        /// Time at which this happened, s.
        time: f64,
        /// Sideslip angle at that time, deg.
        beta_deg: f64,
    },
    /// The flight has no course: it is vertical, over a pole, or stands still.
    #[error(
        "the flight {problem} at t = {} s: its flight path angle and heading have no meaning",
        rounded_time(*time)
    )]
    NoCourse {
        /// Time at which this happened, s.
        time: f64,
        /// Behaviour of the flight.
        problem: &'static str,
    },
    /// A state or an input is no longer a finite number.
    #[error(
        "{what} is not finite or beyond all bounds at t = {} s: wrong input, unstable loop, or too long a step",
        rounded_time(*time)
    )]
    NotFinite {
        /// Time at which this happened, s.
        time: f64,
        /// Name of the quantity at fault.
        what: &'static str,
    },
}

/// Rounds a time (s) for a message, so that its last digits show no rounding errors.
pub fn rounded_time(time: f64) -> f64 {
    (time * 1e9).round() / 1e9
}

impl Error {
    /// Returns the error for a configuration value, with the name of its setting.
    pub(crate) fn parameter(
        name: impl Into<Cow<'static, str>>,
        problem: impl Into<String>,
    ) -> Self {
        Self::Parameter { name: name.into(), problem: problem.into() }
    }
}

/// Refuses a configuration value that is not positive and finite. `unit` follows it in the message.
pub(crate) fn positive(
    name: impl Into<Cow<'static, str>>,
    value: f64,
    unit: &str,
) -> Result<(), Error> {
    let problem = || format!("= {value}{unit} must be positive");
    (value > 0.0 && value.is_finite())
        .then_some(())
        .ok_or_else(|| Error::parameter(name, problem()))
}

/// Refuses a configuration value that is negative or not finite. `unit` follows it in the message.
pub(crate) fn not_negative(
    name: impl Into<Cow<'static, str>>,
    value: f64,
    unit: &str,
) -> Result<(), Error> {
    let problem = || format!("= {value}{unit} must not be negative");
    (value >= 0.0 && value.is_finite())
        .then_some(())
        .ok_or_else(|| Error::parameter(name, problem()))
}

/// Refuses configuration values that are not finite.
pub(crate) fn finite<'a>(
    name: impl Into<Cow<'static, str>>,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), Error> {
    let problem = "holds a value that is not finite";
    let all = values.into_iter().all(|value| value.is_finite());
    all.then_some(()).ok_or_else(|| Error::parameter(name, problem))
}

fn place(line: Option<u64>, column: Option<&str>) -> String {
    let line = line.map(|line| format!(", line {line}")).unwrap_or_default();
    let column = column.map(|column| format!(", column {column}")).unwrap_or_default();
    line + &column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_in_messages_show_no_rounding_errors() {
        let time = 477.0 * 0.04;
        assert_eq!(time.to_string(), "19.080000000000002");
        let messages = [
            Error::Singular { time, beta_deg: 89.0 },
            Error::NoCourse { time, problem: "is vertical" },
            Error::NotFinite { time, what: "moment" },
        ];
        for message in messages.map(|error| error.to_string()) {
            assert!(message.contains("at t = 19.08 s: "), "{message}");
        }
    }
}
