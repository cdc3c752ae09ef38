//! The groups of numbers of which a file gives the air's forces and moments.

use super::coefficient::Coefficient;
use super::units::{Area, Length, Mass};
use crate::given;
use serde::{Deserialize, Serialize};

/// Mass of the vehicle, and the quantities to which its coefficients refer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Reference {
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    pub source: String,
    /// Mass of the vehicle.
    pub mass: Mass,
    /// Area S of all coefficients.
    pub area: Area,
    /// Span b of the roll and yaw moments.
    pub span: Option<Length>,
    /// Chord c of the pitch moments.
    pub chord: Option<Length>,
    /// Name of the point about which the moments are given.
    #[serde(default)]
    pub moment_point: String,
    /// Place of that point from the centre of mass: forward, to the right, down. Without it the
    /// moments are about the centre of mass.
    #[serde(default, deserialize_with = "given::point")]
    pub moment_point_metres: Option<[f64; 3]>,
}

/// Coefficients of the forces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Forces {
    /// Lift.
    pub lift: Coefficient,
    /// Drag.
    pub drag: Coefficient,
    /// Side force per radian of sideslip.
    #[serde(default)]
    pub side: Coefficient,
}

/// Coefficients of the moments: those by sideslip and by angle of attack per radian, damping ones
/// per rad of p b/(2 V) and so on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Moments {
    /// Roll without sideslip and with all surfaces at zero.
    pub roll: Coefficient,
    /// Pitch with all surfaces at zero, whatever the angle at which the vehicle is trimmed.
    pub pitch: Coefficient,
    /// Yaw without sideslip and with all surfaces at zero.
    pub yaw: Coefficient,
    /// Roll per radian of sideslip.
    pub roll_by_sideslip: Coefficient,
    /// Yaw per radian of sideslip.
    pub yaw_by_sideslip: Coefficient,
    /// Pitch per radian of α beyond the angle at which the vehicle is trimmed.
    pub pitch_by_alpha: Coefficient,
    /// Roll by the roll rate.
    pub roll_damping: Coefficient,
    /// Pitch by the pitch rate.
    pub pitch_damping: Coefficient,
    /// Yaw by the yaw rate.
    pub yaw_damping: Coefficient,
    /// Factor on the constant effectiveness of the surfaces.
    pub surfaces: Option<Coefficient>,
}

impl Moments {
    /// Returns the coefficients with their names.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&'static str, &Coefficient)> {
        let coefficients = [
            ("roll", &self.roll),
            ("pitch", &self.pitch),
            ("yaw", &self.yaw),
            ("roll by sideslip", &self.roll_by_sideslip),
            ("yaw by sideslip", &self.yaw_by_sideslip),
            ("pitch by angle of attack", &self.pitch_by_alpha),
            ("roll damping", &self.roll_damping),
            ("pitch damping", &self.pitch_damping),
            ("yaw damping", &self.yaw_damping),
        ];
        coefficients.into_iter().chain(self.surfaces.as_ref().map(|factor| ("surfaces", factor)))
    }
}

/// Heating of the leading edge: a polynomial of α times `factor` ρᵃ Vᵇ with the density's power a,
/// `density_exponent`, and the speed's b, `exponent`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Heating {
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    pub source: String,
    /// Units of flux, density and speed.
    #[serde(default)]
    pub units: HeatingUnits,
    /// Factors of 1, α, α², … with the angle of attack α in degrees.
    #[serde(deserialize_with = "given::all_finite")]
    pub polynomial: Vec<f64>,
    /// Factor of the powers of density and speed.
    #[serde(deserialize_with = "given::finite")]
    pub factor: f64,
    /// Power of the density.
    #[serde(default = "half", deserialize_with = "given::positive")]
    pub density_exponent: f64,
    /// Power of the speed.
    #[serde(deserialize_with = "given::finite")]
    pub exponent: f64,
}

/// Units of the heating's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum HeatingUnits {
    /// BTU/(ft² s), slug/ft³ and 10⁴ ft/s.
    #[default]
    Imperial,
    /// W/m², kg/m³ and m/s.
    Si,
}

fn half() -> f64 {
    0.5
}

/// Air whose density falls exponentially with altitude. Only published checks of the data use it:
/// the FMUs fly in the standard atmosphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ExponentialAir {
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    pub source: String,
    /// Density at zero altitude, slug/ft³.
    #[serde(deserialize_with = "given::positive")]
    pub density_slug_ft3: f64,
    /// Height over which the density falls to 1/e, ft.
    #[serde(deserialize_with = "given::positive")]
    pub scale_height_ft: f64,
}
