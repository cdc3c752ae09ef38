//! The reference that a controller follows: a paper's profile, a constant, a lookup table, or
//! the external inputs.

use control::controller::{Forecast, Preview};
use fmi_export::{Context, Failure};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::Scenario;
use vehicle::axes;
use vehicle::profile::Profile;
use vehicle::reference::Reference;
use vehicle::table::LookupTable;

/// Source of the reference attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, settings::Choice)]
#[setting(name = "ReferenceProfile")]
pub enum Choice {
    /// Profile of Chai 2022, section 5.1, with its jump at 25 s.
    #[default]
    Crmpc2022,
    /// Profile of Wu 2015, section 6.
    Tvsmc2015,
    /// Step of Jia, Zhou and Zhou, section V.
    TwoLoop,
    /// Constant angles reference.angle.
    Constant,
    /// Values interpolated from the file reference.file.
    Table,
    /// Inputs reference.external; reference.preview says what predictions assume of their future.
    External,
}

/// Future of an external reference in predictions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, settings::Choice)]
#[setting(name = "ReferencePreview")]
pub enum Ahead {
    /// Angles stay constant.
    Hold,
    /// Angles go on at their rates and brake with reference.previewAcceleration.
    #[default]
    Brake,
}

/// Parameters of the reference.
#[derive(Clone, Debug, Serialize, Deserialize, Declared)]
pub struct Parameters {
    #[allow(missing_docs)] // Its type says what it is.
    pub profile: Choice,
    /// Path of a CSV file with time and angles, or name of a file in the resources of the FMU.
    #[setting(used_with = "reference.profile = table")]
    pub file: String,
    /// Constant reference.
    #[setting(each = axes::ANGLES, unit = "rad", nominal = 0.1)]
    #[setting(used_with = "reference.profile = constant")]
    pub angle: Vector3<f64>,
    #[allow(missing_docs)] // Its type says what it is.
    #[setting(used_with = "reference.profile = external")]
    pub preview: Ahead,
    /// Deceleration of the external reference in predictions.
    #[setting(each = axes::ANGLES, unit = "rad/s2", above = 0.0, nominal = 0.01)]
    #[setting(used_with = "reference.profile = external and reference.preview = brake")]
    #[setting(file)]
    pub preview_acceleration: Vector3<f64>,
}

impl Default for Parameters {
    fn default() -> Self {
        let angle = Scenario::crmpc2022().reference.at(0.0).angles;
        Self {
            profile: Choice::default(),
            file: String::new(),
            angle,
            preview: Ahead::default(),
            // Half of what the entry guidance's bank angle brakes with, since it does not always
            // brake at once: with this the tracking error in an entry is a third less.
            preview_acceleration: Vector3::new(0.1, 0.1, 0.4).map(f64::to_radians),
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
        let Parameters { file, angle, .. } = parameters;
        Ok(match parameters.profile {
            Choice::Crmpc2022 => Self::Profile(Scenario::crmpc2022().reference),
            Choice::Tvsmc2015 => Self::Profile(Scenario::tvsmc2015().reference),
            Choice::TwoLoop => Self::Profile(Scenario::two_loop().reference),
            Choice::Constant => Self::Profile(Profile::constant(*angle)),
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

    /// Returns the preview of the reference at a tick at `now` (s), whose moment acts at `acts_at`
    /// (s).
    pub(crate) fn preview(
        &self,
        parameters: &Parameters,
        [now, acts_at]: [f64; 2],
        external: &Reference,
    ) -> Preview<'_> {
        let braking = match parameters.preview {
            Ahead::Hold => None,
            Ahead::Brake => Some(parameters.preview_acceleration),
        };
        match self {
            Self::Profile(profile) => Preview::Profile(profile),
            Self::External => {
                Preview::External(Forecast { given: *external, from: now, until: acts_at, braking })
            }
        }
    }
}

/// Reads the lookup table from the file name as given, or from the resources of the FMU.
fn table(file: &str, context: &Context) -> Result<LookupTable, Failure> {
    if file.is_empty() {
        let text = "reference.profile = table, but reference.file is empty; set it to the path of a CSV file";
        return Err(Failure::Error(text.into()));
    }
    LookupTable::from_csv_file(&context.file(file))
        .map_err(|error| Failure::Error(format!("reference.file: {error}")))
}
