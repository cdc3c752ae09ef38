//! The part of a study that describes its tables, its overviews and its claims.

use crate::values::{Quantity, ShownMetric};
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

/// A table that compares numbers of the paper with ours.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComparisonTable {
    /// Title of the table, in one line.
    pub title: String,
    /// Note that is shown with the table.
    #[serde(default)]
    pub note: String,
    /// Rows of the table, each with one quantity.
    #[serde(rename = "row")]
    pub rows: Vec<ComparisonRow>,
}

/// A row of a table, which compares one quantity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComparisonRow {
    /// Name of the quantity, with its unit.
    pub label: String,
    /// Value of the paper, or another value to compare with.
    pub paper: Option<Quantity>,
    /// Our number, as `run.metric`.
    pub ours: String,
    /// Note that is shown beside the numbers.
    #[serde(default)]
    pub note: String,
}

/// A table that shows metrics of several runs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Overview {
    /// Title of the table, in one line.
    pub title: String,
    /// Note that is shown with the table.
    #[serde(default)]
    pub note: String,
    /// Ids of the runs, one for each row.
    #[schemars(with = "Vec<String>")]
    pub runs: Vec<Spanned<String>>,
    /// Columns of the table, each with one metric.
    pub metrics: Vec<OverviewColumn>,
}

/// A column of an overview.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OverviewColumn {
    /// Metric that is shown for each run, in the unit of the heading.
    pub of: ShownMetric,
    /// Heading of the column, with the unit.
    pub label: String,
    /// Limit in the unit of the heading; larger values are marked.
    pub limit: Option<f64>,
}

/// A claim of the paper with the checks that decide on it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Claim of the paper, in our words.
    pub says: String,
    /// Place in the paper where the claim is made.
    pub source: String,
    /// Explanation of why the claim holds or does not hold.
    #[serde(default)]
    pub remark: String,
    /// Checks that decide whether the claim holds.
    #[serde(rename = "check")]
    pub checks: Vec<Check>,
}

/// A comparison of two numbers, which is made for each value of `vary`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// Description of the circumstances under which the numbers are compared.
    pub label: String,
    /// Number on the left side of the relation, as `run.metric`.
    pub left: String,
    /// Relation in which the left number must stand to the right one.
    #[serde(default)]
    pub relation: Relation,
    /// Number on the right side of the relation: `run.metric`, the id of a value, or a number.
    pub right: Quantity,
    /// Margin by which the numbers must differ at least, as a fraction of the right one.
    pub by: Option<Quantity>,
}

/// Relation in which the left number of a check must stand to the right one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// The left number is below the right one.
    #[default]
    Below,
    /// The left number is above the right one.
    Above,
    /// The left number is below the right one, or equal to it.
    AtMost,
    /// The left number is above the right one, or equal to it.
    AtLeast,
}
