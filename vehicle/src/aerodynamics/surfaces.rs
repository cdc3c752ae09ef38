//! Moments of single surfaces as tables over angle of attack, Mach number and deflection.

use super::Flow;
use super::coefficient::{TURN, Table, increasing, place};
use crate::given;
use serde::{Deserialize, Serialize};

/// Largest moment coefficient that a table may have at zero deflection, as rounding.
const ZERO: f64 = 1e-9;

/// Axis of a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum Axis {
    /// About x, which points forward.
    Roll,
    /// About y, which points to the right.
    Pitch,
    /// About z, which points down.
    Yaw,
}

/// Change of a moment coefficient with the deflection of one surface, as a file gives it.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "SurfaceTable"))]
#[serde(deny_unknown_fields)]
pub(crate) struct GivenTable {
    /// Name of the surface, as in `surfaces.names`.
    pub surface: String,
    /// Axis of the moment.
    pub axis: Axis,
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    #[expect(dead_code, reason = "it is for those who read the file")]
    source: String,
    /// Angles of attack in degrees, increasing.
    alpha_deg: Vec<f64>,
    /// Mach numbers, increasing.
    mach: Vec<f64>,
    /// Deflections in degrees, increasing, trailing edge down positive.
    deflection_deg: Vec<f64>,
    /// For each deflection one row for each Mach number, with one value for each angle of attack.
    values: Vec<Vec<Vec<f64>>>,
}

/// Moment of one surface about one axis: linear between the points of its table, and constant
/// beyond them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceTable {
    /// Index of the surface, from 0.
    pub surface: usize,
    /// Index of the axis, from 0.
    pub axis: usize,
    /// Reference area times reference length, m³.
    volume: f64,
    deflections: Vec<f64>,
    tables: Vec<Table>,
}

impl SurfaceTable {
    /// Makes the table of the surface with this index; `volume` is the reference area times the
    /// reference length of the axis, m³.
    pub(crate) fn new(given: GivenTable, surface: usize, volume: f64) -> Result<Self, String> {
        let GivenTable { axis, alpha_deg, mach, deflection_deg, values, .. } = given;
        increasing("deflection_deg", &deflection_deg, TURN)?;
        if values.len() != deflection_deg.len() {
            let (found, wanted) = (values.len(), deflection_deg.len());
            return Err(format!(
                "values has {found} parts; it needs one for each of its {wanted} deflections"
            ));
        }
        let tables: Vec<Table> = values
            .into_iter()
            .map(|values| Table { alpha_deg: alpha_deg.clone(), mach: mach.clone(), values })
            .collect();
        tables.iter().try_for_each(Table::check)?;
        let axis = axis as usize;
        let table = Self { surface, axis, volume, deflections: deflection_deg, tables };
        let points = alpha_deg.iter().flat_map(|alpha| mach.iter().map(move |mach| (alpha, mach)));
        for (&alpha, &mach) in points {
            let rest = table.coefficient(alpha, mach, 0.0);
            if rest.abs() > ZERO {
                return Err(format!(
                    "values: {rest} at zero deflection, alpha_deg = {alpha}, mach = {mach}; it must be 0 there, as what acts without deflection belongs to moments.roll, pitch and yaw"
                ));
            }
        }
        Ok(table)
    }

    /// Returns the coefficient at an angle of attack (deg), a Mach number and a deflection (deg).
    fn coefficient(&self, alpha: f64, mach: f64, deflection: f64) -> f64 {
        let (before, share) = place(&self.deflections, deflection);
        let low = self.tables[before].at(alpha, mach);
        match self.tables.get(before + 1) {
            Some(next) if share > 0.0 => low + share * (next.at(alpha, mach) - low),
            _ => low,
        }
    }

    /// Returns the moment in a flow at a deflection (rad), N m.
    pub fn moment(&self, flow: &Flow, deflection: f64) -> f64 {
        let Flow { dynamic_pressure, mach, alpha, .. } = *flow;
        let degrees = f64::to_degrees;
        dynamic_pressure * self.volume * self.coefficient(degrees(alpha), mach, degrees(deflection))
    }

    /// Returns whether a restored table can be evaluated.
    pub(crate) fn fits(&self) -> bool {
        self.tables.iter().all(|table| table.check().is_ok())
            && self.axis < 3
            && self.volume.is_finite()
            && self.tables.len() == self.deflections.len()
            && increasing("", &self.deflections, TURN).is_ok()
    }
}
