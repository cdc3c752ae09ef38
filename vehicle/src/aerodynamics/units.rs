//! Units in which the sources of the data print their numbers.

use crate::given;
use serde::{Deserialize, Serialize};

/// Foot, m.
pub const FOOT: f64 = 0.3048;
/// Slug, the mass that a pound-force accelerates by 1 ft/s², kg.
pub(super) const SLUG: f64 = 0.453_592_37 * 9.806_65 / FOOT;
/// British thermal unit (of the international table) per square foot, J/m².
pub(super) const BTU_PER_SQUARE_FOOT: f64 = 1_055.055_852_62 / (FOOT * FOOT);

/// Mass of a vehicle as its source gives it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum Mass {
    /// Mass in kg.
    Kilograms(#[serde(deserialize_with = "given::positive")] f64),
    /// Weight, and the acceleration of gravity by which the mass follows from it.
    Weight {
        /// Weight in lbf.
        #[serde(deserialize_with = "given::positive")]
        pounds: f64,
        /// Acceleration of gravity in ft/s².
        #[serde(deserialize_with = "given::positive")]
        gravity_ft_s2: f64,
    },
}

impl Mass {
    pub(super) fn kilograms(self) -> f64 {
        match self {
            Self::Kilograms(mass) => mass,
            Self::Weight { pounds, gravity_ft_s2 } => pounds / gravity_ft_s2 * SLUG,
        }
    }
}

/// Area as its source gives it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum Area {
    /// Area in m².
    SquareMetres(#[serde(deserialize_with = "given::positive")] f64),
    /// Area in ft².
    SquareFeet(#[serde(deserialize_with = "given::positive")] f64),
}

impl Area {
    pub(super) fn square_metres(self) -> f64 {
        match self {
            Self::SquareMetres(area) => area,
            Self::SquareFeet(area) => area * FOOT * FOOT,
        }
    }
}

/// Length as its source gives it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum Length {
    /// Length in m.
    Metres(#[serde(deserialize_with = "given::positive")] f64),
    /// Length in ft.
    Feet(#[serde(deserialize_with = "given::positive")] f64),
}

impl Length {
    pub(super) fn metres(self) -> f64 {
        match self {
            Self::Metres(length) => length,
            Self::Feet(length) => length * FOOT,
        }
    }
}
