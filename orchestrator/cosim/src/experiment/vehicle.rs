//! The variables by which the page of a run shows a vehicle in motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fs::Metadata;
use std::path::Path;

/// Largest vehicle's file that is read, in bytes, as by the vehicle itself.
const LARGEST: u64 = 16_000_000;

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

/// What a vehicle's file says of its surfaces and jets. Components that read the file check it.
#[derive(Deserialize)]
struct Effectors {
    #[serde(default)]
    surfaces: Surfaces,
    #[serde(default)]
    jets: Jets,
}

#[derive(Default, Deserialize)]
struct Surfaces {
    names: Vec<String>,
}

#[derive(Default, Deserialize)]
struct Jets {
    moment: [Vec<f64>; 3],
}

impl Vehicle {
    /// Shows the surfaces and jets of a vehicle's file, by their names there. The name of a shipped
    /// vehicle, or a file that cannot be read, changes nothing.
    pub(super) fn take_effectors(&mut self, file: &Path) {
        let is_fit = |file: &Metadata| file.is_file() && file.len() <= LARGEST;
        if !std::fs::metadata(file).is_ok_and(|file| is_fit(&file)) {
            return;
        }
        let text = std::fs::read_to_string(file).unwrap_or_default();
        if let Ok(Effectors { surfaces, jets }) = toml::from_str(&text) {
            self.deflections.truncate(surfaces.names.len());
            self.surfaces = surfaces.names;
            self.flaps = None;
            self.jets.truncate(jets.moment[0].len());
        }
    }

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
