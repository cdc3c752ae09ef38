//! What can go wrong in this crate.

/// Why a vehicle, its data or a simulation cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A scenario file that cannot be read or understood.
    #[error("scenario {file}: {problem}")]
    Scenario {
        /// File or embedded name.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file of surfaces and jets that cannot be read or understood.
    #[error("effectors {file}: {problem}")]
    Effectors {
        /// File or embedded name.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A reference table that cannot be read or understood.
    #[error("reference table {file}{}: {problem}", place(*line, column.as_deref()))]
    Table {
        /// File name.
        file: String,
        /// Line, counted from 1, if the problem has one.
        line: Option<u64>,
        /// Column heading, if the problem has one.
        column: Option<String>,
        /// What is wrong and what is expected.
        problem: String,
    },
    /// A configuration value outside what the equations allow.
    #[error("{name} {problem}")]
    Parameter {
        /// Name of the value, as in the data files and units.
        name: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// The sideslip angle came to ±90°, where the attitude angles are singular.
    #[error("sideslip beta = {beta_deg:.3} deg at t = {time} s: the attitude angles are singular at 90 deg")]
    Singular {
        /// Time, s.
        time: f64,
        /// Sideslip angle, deg.
        beta_deg: f64,
    },
    /// A state or an input is no longer a finite number.
    #[error(
        "{what} is not finite or beyond all bounds at t = {time} s: wrong input, unstable loop, or too long a step"
    )]
    NotFinite {
        /// Time, s.
        time: f64,
        /// The quantity at fault.
        what: &'static str,
    },
}

fn place(line: Option<u64>, column: Option<&str>) -> String {
    let line = line.map(|line| format!(", line {line}")).unwrap_or_default();
    let column = column.map(|column| format!(", column {column}")).unwrap_or_default();
    line + &column
}
