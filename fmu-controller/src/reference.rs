//! The reference a controller follows: a paper's profile, a simple course, a table, or the external inputs.

use fmi2_export::{Context, Failure};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use vehicle::Scenario;
use vehicle::reference::{Profile, Reference};
use vehicle::table::Table;

/// The choices of `reference.profile` in the order of their values 1, 2, ….
pub(crate) const PROFILES: [(&str, &str); 7] = [
    ("crmpc2022", "the profile of Chai 2022, section 5.1, with its jump at 25 s"),
    ("tvsmc2015", "the profile of Wu 2015, section 6"),
    ("twoLoop", "the step of Jia, Zhou and Zhou, section V"),
    ("constant", "reference.angle"),
    ("sine", "reference.angle plus reference.amplitude times a sine"),
    ("table", "interpolated from the file reference.file"),
    ("external", "the inputs reference.external, taken as constant over a preview"),
];

/// The parameters of the reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Parameters {
    /// Number of the item of [`PROFILES`], from 1.
    pub(crate) profile: i32,
    pub(crate) file: String,
    pub(crate) angle: Vector3<f64>,
    pub(crate) amplitude: Vector3<f64>,
    pub(crate) frequency: f64,
    pub(crate) phase: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        let angle = Scenario::crmpc2022().reference.at(0.0).angles;
        Self {
            profile: 1,
            file: String::new(),
            angle,
            amplitude: Vector3::zeros(),
            frequency: 1.0,
            phase: 0.0,
        }
    }
}

/// Where the reference comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Source {
    Profile(Profile),
    External,
}

impl Source {
    pub(crate) fn new(parameters: &Parameters, context: &Context) -> Result<Self, Failure> {
        let Parameters { file, angle, amplitude, frequency, phase, .. } = parameters;
        let item = usize::try_from(parameters.profile - 1).ok().and_then(|i| PROFILES.get(i));
        Ok(match item.map(|item| item.0) {
            Some("tvsmc2015") => Self::Profile(Scenario::tvsmc2015().reference),
            Some("twoLoop") => Self::Profile(Scenario::two_loop().reference),
            Some("constant") => Self::Profile(Profile::constant(*angle)),
            Some("sine") => Self::Profile(Profile::sine(*angle, *amplitude, *frequency, *phase)),
            Some("table") => Self::Profile(Profile::Table(table(file, context)?)),
            Some("external") => Self::External,
            _ => Self::Profile(Scenario::crmpc2022().reference),
        })
    }

    /// Whether it is one that these parameters lead to. The file of a table is not read again.
    pub(crate) fn fits(&self, parameters: &Parameters) -> bool {
        let table = (1..).zip(PROFILES).find(|(_, item)| item.0 == "table").map(|(number, _)| number);
        let wants_table = table == Some(parameters.profile);
        match self {
            Self::Profile(Profile::Table(table)) => wants_table && table.check().is_ok(),
            _ if wants_table => false,
            _ => {
                let context = Context { start_time: 0.0, stop_time: None, resources: None };
                Self::new(parameters, &context).is_ok_and(|source| source == *self)
            }
        }
    }

    /// The reference at `time` (s) as it is known at `now` (s). Of the external one nothing is known beyond now: its angles
    /// are taken to stay.
    pub(crate) fn at(&self, time: f64, now: f64, external: &Reference) -> Reference {
        match self {
            Self::Profile(profile) => profile.at(time),
            Self::External if time <= now => *external,
            Self::External => Reference { angles: external.angles, ..Reference::default() },
        }
    }
}

/// A file name as it stands, or inside the unit's resources.
fn table(file: &str, context: &Context) -> Result<Table, Failure> {
    if file.is_empty() {
        let text =
            "reference.profile is 'table' but reference.file is empty; set it to the path of a CSV file";
        return Err(Failure::Error(text.into()));
    }
    let path = Path::new(file);
    let inside = context.resources.map(|folder| folder.join(path)).filter(|inside| inside.is_file());
    let path = if path.is_file() { path.into() } else { inside.unwrap_or_else(|| path.into()) };
    Table::from_csv_file(&path).map_err(|error| Failure::Error(format!("reference.file: {error}")))
}
