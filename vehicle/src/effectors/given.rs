//! Surfaces and jets as a file gives them, with the units of the papers named in the keys.

use super::{Effectors, JETS, SURFACES, Surfaces};
use crate::aerodynamics::GivenTable;
use crate::given;
use nalgebra::{SMatrix, Vector3};
use serde::Deserialize;
use toml::Spanned;

/// Surfaces of the vehicle: up to eight, in one order in all lists.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "Surfaces"))]
#[serde(deny_unknown_fields)]
pub(crate) struct GivenSurfaces {
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    #[expect(dead_code, reason = "it is for those who read the file")]
    source: String,
    /// Names of the surfaces. The FMUs know them by their number in this list.
    names: Vec<String>,
    /// Lower limits of the deflections, trailing edge down positive.
    min_deg: Vec<f64>,
    /// Upper limits of the deflections.
    max_deg: Vec<f64>,
    /// Largest deflection rates in either direction.
    rate_deg_s: Vec<f64>,
    /// Whether control may use each surface; by default it may use all.
    allowed: Option<Vec<bool>>,
    /// Dynamic pressure in Pa for which `effectiveness_deg` holds.
    reference_pressure: Option<f64>,
    /// Roll, pitch and yaw moments in N m for a degree of each surface, proportional to the dynamic
    /// pressure.
    effectiveness_deg: Option<[Vec<f64>; 3]>,
    /// Moments that depend on angle of attack, Mach number and deflection. They add to those of
    /// `effectiveness_deg`.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<GivenTable>"))]
    pub table: Vec<Spanned<GivenTable>>,
}

/// Jets of the vehicle: up to ten.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "Jets"))]
#[serde(deny_unknown_fields)]
pub(crate) struct GivenJets {
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    #[expect(dead_code, reason = "it is for those who read the file")]
    source: String,
    /// Thrust of one jet in N.
    #[serde(deserialize_with = "given::positive")]
    force: f64,
    /// Roll, pitch and yaw moments of each jet at full thrust in N m.
    moment: [Vec<f64>; 3],
    /// Moment of the fourth jet in place of that of `moment` with `jets.symmetric`; by default the
    /// same.
    symmetric_jet_4: Option<[f64; 3]>,
}

/// Refuses a list without one entry for each of `count` things.
fn full<T>(key: &str, list: &[T], count: usize, what: &str) -> Result<(), String> {
    if list.len() == count {
        return Ok(());
    }
    let found = list.len();
    Err(format!("{key} has {found} values; it needs one for each of the {count} {what}"))
}

/// Returns the rows of a matrix, with zeros in the columns that are left.
fn matrix<const N: usize>(rows: &[Vec<f64>; 3]) -> SMatrix<f64, 3, N> {
    SMatrix::from_fn(|i, j| rows[i].get(j).copied().unwrap_or(0.0))
}

impl GivenSurfaces {
    /// Puts the surfaces in the place of those of `effectors`. The tables are left to the caller,
    /// who knows the reference quantities.
    pub(crate) fn put(&self, effectors: &mut Effectors) -> Result<(), String> {
        let count = self.names.len();
        if count > SURFACES {
            return Err(format!("surfaces.names has {count} names; there are {SURFACES} at most"));
        }
        let what = "names of surfaces";
        for (key, list) in [
            ("surfaces.min_deg", &self.min_deg),
            ("surfaces.max_deg", &self.max_deg),
            ("surfaces.rate_deg_s", &self.rate_deg_s),
        ] {
            full(key, list, count, what)?;
        }
        if let Some(twice) =
            self.names.iter().enumerate().find(|(i, name)| self.names[..*i].contains(name))
        {
            return Err(format!("surfaces.names holds '{}' twice", twice.1));
        }
        if let Some(allowed) = &self.allowed {
            full("surfaces.allowed", allowed, count, what)?;
        }
        match (&self.effectiveness_deg, self.reference_pressure) {
            (Some(rows), Some(pressure)) => {
                for row in rows {
                    full("surfaces.effectiveness_deg: a row", row, count, what)?;
                }
                effectors.effectiveness = matrix(rows) * 1f64.to_degrees();
                effectors.reference_pressure = pressure;
            }
            (None, None) => {}
            _ => {
                return Err(
                    "surfaces.reference_pressure and effectiveness_deg need each other".into()
                );
            }
        }
        let entry = |list: &[f64], i: usize, rest: f64| list.get(i).copied().unwrap_or(rest);
        for i in 0..SURFACES {
            effectors.min[i] = entry(&self.min_deg, i, 0.0).to_radians();
            effectors.max[i] = entry(&self.max_deg, i, 0.0).to_radians();
            effectors.rate[i] = entry(&self.rate_deg_s, i, 1.0).to_radians();
            effectors.names[i] = self.names.get(i).cloned().unwrap_or_else(|| "none".into());
            let allowed = self.allowed.as_ref().map(|list| list.get(i).copied().unwrap_or(false));
            effectors.allowed[i] = allowed.unwrap_or(i < count);
        }
        Ok(())
    }

    /// Returns the index of the surface with this name.
    pub(crate) fn index(&self, name: &str) -> Result<usize, String> {
        self.names.iter().position(|other| other == name).ok_or_else(|| {
            let names = self.names.join(", ");
            format!("surface: there is no '{name}' in surfaces.names: {names}")
        })
    }
}

impl GivenJets {
    /// Puts the jets in the place of those of `effectors`.
    pub(crate) fn put(&self, effectors: &mut Effectors) -> Result<(), String> {
        let count = self.moment[0].len();
        if count > JETS {
            return Err(format!("jets.moment has {count} jets; there are {JETS} at most"));
        }
        for row in &self.moment {
            full("jets.moment: a row", row, count, "jets")?;
        }
        effectors.jet_force = self.force;
        effectors.jet_moments = matrix(&self.moment);
        effectors.symmetric_jet_4 = self
            .symmetric_jet_4
            .map_or_else(|| effectors.jet_moments.column(3).into_owned(), Vector3::from);
        Ok(())
    }
}

impl Effectors {
    /// Returns a vehicle without surfaces and jets: all are fixed, and give no moment.
    pub(crate) fn none() -> Self {
        Self {
            reference_pressure: 1.0,
            rate: Surfaces::repeat(1.0),
            names: std::array::from_fn(|_| "none".into()),
            jet_force: 1.0,
            ..Self::default()
        }
    }
}
