//! Description of a recorded variable.

use fmi_master::description::Carrier;

/// A variable that is recorded, with its type and unit.
#[derive(Clone, Debug)]
pub struct Column {
    /// Full name of the variable, `component.variable`.
    pub name: String,
    /// Index of the variable among a sample's values.
    pub place: usize,
    /// Type in which the values are transferred.
    pub carrier: Carrier,
    /// Unit of the variable, if it has one.
    pub unit: Option<String>,
    /// Items of an enumeration; empty for other types.
    pub items: Vec<(String, i32)>,
}
