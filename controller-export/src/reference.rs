//! The reference that a controller follows: a paper's profile, a constant, a sine, a lookup table,
//! or the external inputs.

use control::controller::Preview;
use fmi2_export::fields::by_variable;
use fmi2_export::{Context, Enumeration, Failure};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use vehicle::Scenario;
use vehicle::profile::Profile;
use vehicle::reference::Reference;
use vehicle::table::LookupTable;

/// Choice of the source of the reference attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)] // Each item is described in [`PROFILES`].
pub enum Choice {
    #[default]
    Crmpc2022,
    Tvsmc2015,
    TwoLoop,
    Constant,
    Sine,
    Table,
    External,
}

/// The choices of the parameter `reference.profile`.
pub static PROFILES: Enumeration<Choice> = Enumeration {
    name: "ReferenceProfile",
    description: "Source of the reference attitude",
    items: &[
        (
            Choice::Crmpc2022,
            "crmpc2022",
            "profile of Chai 2022, section 5.1, with its jump at 25 s",
        ),
        (Choice::Tvsmc2015, "tvsmc2015", "profile of Wu 2015, section 6"),
        (Choice::TwoLoop, "twoLoop", "step of Jia, Zhou and Zhou, section V"),
        (Choice::Constant, "constant", "constant angles reference.angle"),
        (
            Choice::Sine,
            "sine",
            "reference.angle plus a sine with reference.amplitude, reference.frequency and reference.phase",
        ),
        (Choice::Table, "table", "values interpolated from the file reference.file"),
        (
            Choice::External,
            "external",
            "inputs reference.external; predictions hold their angles constant",
        ),
    ],
};

/// Parameters of the reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Parameters {
    /// Choice of the source.
    pub profile: Choice,
    /// Path of the CSV file of the table.
    pub file: String,
    /// Constant part of the angles, rad.
    pub angle: Vector3<f64>,
    /// Amplitude of the sine, rad.
    pub amplitude: Vector3<f64>,
    /// Angular frequency of the sine, rad/s.
    pub frequency: f64,
    /// Phase of the sine at t = 0, rad.
    pub phase: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        let angle = Scenario::crmpc2022().reference.at(0.0).angles;
        Self {
            profile: Choice::default(),
            file: String::new(),
            angle,
            amplitude: Vector3::zeros(),
            frequency: 1.0,
            phase: 0.0,
        }
    }
}

/// Source of the reference with its data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Source {
    Profile(Profile),
    External,
}

impl Source {
    pub(crate) fn new(parameters: &Parameters, context: &Context) -> Result<Self, Failure> {
        let Parameters { file, angle, amplitude, frequency, phase, .. } = parameters;
        Ok(match parameters.profile {
            Choice::Crmpc2022 => Self::Profile(Scenario::crmpc2022().reference),
            Choice::Tvsmc2015 => Self::Profile(Scenario::tvsmc2015().reference),
            Choice::TwoLoop => Self::Profile(Scenario::two_loop().reference),
            Choice::Constant => Self::Profile(Profile::constant(*angle)),
            Choice::Sine => Self::Profile(Profile::sine(*angle, *amplitude, *frequency, *phase)),
            Choice::Table => Self::Profile(Profile::Table(table(file, context)?)),
            Choice::External => Self::External,
        })
    }

    /// Returns whether these parameters lead to this source. The file of a table is not read again.
    pub(crate) fn fits(&self, parameters: &Parameters) -> bool {
        let wants_table = parameters.profile == Choice::Table;
        match self {
            Self::Profile(Profile::Table(table)) => wants_table && table.check().is_ok(),
            _ if wants_table => false,
            _ => {
                let context = Context { start_time: 0.0, stop_time: None, resources: None };
                Self::new(parameters, &context).is_ok_and(|source| source == *self)
            }
        }
    }

    /// Returns the preview of the reference. An external reference is valid until `valid_until`
    /// (s).
    pub(crate) fn preview(&self, valid_until: f64, external: &Reference) -> Preview<'_> {
        match self {
            Self::Profile(profile) => Preview::Profile(profile),
            Self::External => Preview::External(*external, valid_until),
        }
    }
}

/// Reads the lookup table from the file name as given, or from the resources of the FMU.
fn table(file: &str, context: &Context) -> Result<LookupTable, Failure> {
    if file.is_empty() {
        let text = "reference.profile = table, but reference.file is empty; set it to the path of a CSV file";
        return Err(Failure::Error(text.into()));
    }
    let path = Path::new(file);
    let inside =
        context.resources.map(|folder| folder.join(path)).filter(|inside| inside.is_file());
    let path = if path.is_file() { path.into() } else { inside.unwrap_or_else(|| path.into()) };
    let problem = |error| format!("reference.file: {}", by_variable(&error, &[]));
    LookupTable::from_csv_file(&path).map_err(|error| Failure::Error(problem(error)))
}
