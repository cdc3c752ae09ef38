//! What a study says about its tables and claims.

use super::values::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

fn paper() -> String {
    "Paper".into()
}

fn ours() -> String {
    "Ours".into()
}

/// Paper against ours.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// One line.
    pub title: String,
    /// What there is to know.
    #[serde(default)]
    pub note: String,
    /// Heading of what is compared with.
    #[serde(default = "paper")]
    pub against: String,
    /// Heading of ours.
    #[serde(default = "ours")]
    pub ours: String,
    /// Heading of a further column of ours; none if it is empty.
    #[serde(default)]
    pub beside: String,
    /// The rows.
    #[serde(rename = "row")]
    pub rows: Vec<Row>,
}

/// One quantity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// What it is, with unit.
    pub label: String,
    /// The value to compare with.
    pub paper: Option<Quantity>,
    /// `run.metric`.
    pub ours: String,
    /// `run.metric` of the further column.
    pub beside: Option<String>,
    /// Beside the numbers.
    #[serde(default)]
    pub note: String,
}

/// Runs against metrics.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Overview {
    /// One line.
    pub title: String,
    /// What there is to know.
    #[serde(default)]
    pub note: String,
    /// The rows.
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// The columns.
    pub metrics: Vec<Column>,
}

/// A column of an overview.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// The metric.
    pub of: String,
    /// Its heading, with unit.
    pub label: String,
    /// The heading's unit for a value of 1: parameters are in the units of the FMU's variables.
    #[serde(default = "super::values::unscaled")]
    pub factor: f64,
}

/// A claim of the paper with the checks that decide on it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// What the paper claims, in our words.
    pub says: String,
    /// Where it does.
    pub source: String,
    /// Why it comes out as it does.
    #[serde(default)]
    pub remark: String,
    /// What decides.
    #[serde(rename = "check")]
    pub checks: Vec<Check>,
}

/// A comparison of two numbers, for each value of `vary`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// Under which circumstances.
    pub label: String,
    /// `run.metric`.
    pub left: String,
    /// How the left stands to the right.
    #[serde(default)]
    pub relation: Relation,
    /// `run.metric`, a value, or a number.
    pub right: Quantity,
    /// By at least this fraction of the right.
    pub by: Option<Quantity>,
}

/// How the left of a check stands to its right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// Not above it.
    #[default]
    Below,
    /// Not below it.
    Above,
}
