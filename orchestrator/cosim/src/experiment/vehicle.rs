//! The variables by which the page of a run shows a vehicle in motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The section `[observe.vehicle]`: variables by which the page of a run shows the vehicle. Those
/// that an FMU lacks which the command line put in are left out.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Angle of attack, sideslip angle and bank angle.
    pub attitude: [String; 3],
    /// The angles that they are to follow.
    pub reference: Option<[String; 3]>,
    /// Angular rates about the body axes x, y and z.
    pub rate: Option<[String; 3]>,
    /// Limit of the norm of the angular rates.
    pub rate_limit: Option<String>,
    /// Control moments about the body axes x, y and z.
    pub moment: Option<[String; 3]>,
    /// Limit of the norm of the control moments.
    pub moment_limit: Option<String>,
    /// Deflections of all surfaces.
    #[serde(default)]
    pub deflections: Vec<String>,
    /// Names of the surfaces in this order, in place of those of the variables.
    #[serde(default)]
    pub surfaces: Vec<String>,
    /// Deflections that the flaps of the picture show, left and right, positive downwards.
    pub flaps: Option<[String; 2]>,
    /// Commands of all jets, from 0 (off) to 1 (on).
    #[serde(default)]
    pub jets: Vec<String>,
}

impl Vehicle {
    /// Returns the name of the surface at a place among the deflections.
    pub fn surface(&self, place: usize) -> &str {
        let variable = || self.deflections.get(place)?.rsplit('.').next();
        self.surfaces.get(place).map(String::as_str).or_else(variable).unwrap_or_default()
    }

    /// Returns the names of all variables, each with the key that names it.
    pub fn paths(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let lists: [(&'static str, &[String]); 9] = [
            ("attitude", &self.attitude),
            ("reference", slice(self.reference.as_ref())),
            ("rate", slice(self.rate.as_ref())),
            ("rate_limit", self.rate_limit.as_slice()),
            ("moment", slice(self.moment.as_ref())),
            ("moment_limit", self.moment_limit.as_slice()),
            ("deflections", &self.deflections),
            ("flaps", slice(self.flaps.as_ref())),
            ("jets", &self.jets),
        ];
        lists.into_iter().flat_map(|(key, list)| list.iter().map(move |path| (key, path.as_str())))
    }
}

fn slice<const N: usize>(list: Option<&[String; N]>) -> &[String] {
    list.map_or(&[], |list| list.as_slice())
}
