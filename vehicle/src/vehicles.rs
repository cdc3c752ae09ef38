//! Vehicles as data: one TOML file for each, with a source for every group of numbers.
//!
//! Those of the papers and of Betts are part of the program. A user's own is read by the same
//! reader, and every error points at a line of the file.

mod place;

use crate::aerodynamics::SurfaceTable;
use crate::aerodynamics::{Aerodynamics, ExponentialAir, Forces, Heating, Moments, Reference};
use crate::dynamics::Inertia;
use crate::effectors::{Effectors, GivenJets, GivenSurfaces};
use crate::error::Error;
use crate::given;
use crate::scenario::Scenario;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::LazyLock;

/// Largest file that is read, in bytes: a table of a million values needs less.
const LARGEST: u64 = 16_000_000;

/// A vehicle: its air forces and moments, its inertia, and its surfaces and jets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Vehicle {
    /// Forces and moments of the air, with mass and reference quantities.
    pub aerodynamics: Aerodynamics,
    /// Nominal inertia.
    pub inertia: Inertia,
    /// Surfaces and jets, if the file gives some.
    pub effectors: Option<Effectors>,
    /// Hash of the file by FNV-1a, by which saved states recognise it.
    pub digest: u64,
}

/// A vehicle: mass, air forces and moments, inertia, surfaces and jets. Angles are in degrees, and
/// moments are about the body axes: x forward, y to the right, z down.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "Vehicle"))]
#[serde(deny_unknown_fields)]
struct Given {
    /// Name of the vehicle, and the range in which the data are valid.
    title: String,
    /// Mass, and the quantities to which the coefficients refer.
    reference: Reference,
    /// Inertia about the centre of mass.
    inertia: GivenInertia,
    /// Coefficients of the forces along the flow.
    forces: Forces,
    /// Coefficients of the moments. Those that are left out are zero.
    #[serde(default)]
    moments: Moments,
    /// Heating. Without it the heat flux is zero.
    heating: Option<Heating>,
    /// Exponential air of the source.
    air: Option<ExponentialAir>,
    /// Surfaces.
    #[cfg_attr(test, schemars(with = "Option<GivenSurfaces>"))]
    surfaces: Option<GivenSurfaces>,
    /// Jets.
    #[cfg_attr(test, schemars(with = "Option<GivenJets>"))]
    jets: Option<GivenJets>,
}

/// Moments and products of inertia as a file gives them, kg m².
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(rename = "Inertia"))]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
struct GivenInertia {
    /// Publication or derivation from which the numbers come.
    #[serde(deserialize_with = "given::source")]
    #[expect(dead_code, reason = "it is for those who read the file")]
    source: String,
    /// Moment about the roll axis.
    #[serde(deserialize_with = "given::positive")]
    Ixx: f64,
    /// Moment about the pitch axis.
    #[serde(deserialize_with = "given::positive")]
    Iyy: f64,
    /// Moment about the yaw axis.
    #[serde(deserialize_with = "given::positive")]
    Izz: f64,
    /// Product of the roll and yaw axes; the inertia tensor contains -Ixz.
    #[serde(default, deserialize_with = "given::finite")]
    Ixz: f64,
    /// Product of the roll and pitch axes; the inertia tensor contains -Ixy.
    #[serde(default, deserialize_with = "given::finite")]
    Ixy: f64,
    /// Product of the pitch and yaw axes; the inertia tensor contains -Iyz.
    #[serde(default, deserialize_with = "given::finite")]
    Iyz: f64,
}

impl Vehicle {
    /// Reads a vehicle from a file, or returns the shipped one of [`SHIPPED`] with this name.
    ///
    /// # Errors
    /// Names the file, the line and the key at fault.
    pub fn read(path: &Path) -> Result<Self, Error> {
        if let Some(shipped) = path.to_str().and_then(Self::shipped).filter(|_| !path.exists()) {
            return Ok(shipped);
        }
        let file = path.display().to_string();
        let refuse = |problem: String| Error::Vehicle { file: file.clone(), line: None, problem };
        // A device or a pipe may have no end, or not even open.
        let about = std::fs::metadata(path).map_err(|error| refuse(error.to_string()))?;
        if !about.is_file() {
            return Err(refuse("is not a file".into()));
        }
        let opened = File::open(path).map_err(|error| refuse(error.to_string()))?;
        let mut text = String::new();
        let mut limited = opened.take(LARGEST + 1);
        limited.read_to_string(&mut text).map_err(|error| refuse(error.to_string()))?;
        if text.len() as u64 > LARGEST {
            return Err(refuse(format!("has more than {LARGEST} bytes")));
        }
        Self::from_toml(&file, &text)
    }

    /// Reads a vehicle from a text; `file` names it in messages.
    ///
    /// # Errors
    /// Names the file, the line and the key at fault.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Error> {
        let refuse = |offset: Option<usize>, message: &str| {
            let (line, problem) = place::located(text, offset, message);
            Error::Vehicle { file: file.into(), line, problem }
        };
        let given: Given = toml::from_str(text)
            .map_err(|error| refuse(error.span().map(|span| span.start), error.message()))?;
        let Given { title, reference, inertia, forces, moments, heating, air, surfaces, jets } =
            given;
        for (name, coefficient) in [
            ("forces.lift", &forces.lift),
            ("forces.drag", &forces.drag),
            ("moments.roll", &moments.roll),
            ("moments.pitch", &moments.pitch),
            ("moments.yaw", &moments.yaw),
        ] {
            if coefficient.is_per_degree() {
                let text = format!("{name}.per_degree is for derivatives, and this is none");
                return Err(refuse(None, &text));
            }
        }
        if let Some((key, drag)) = forces.drag.negative() {
            let text = format!("forces.drag.{key} gives {drag}, which would be thrust");
            return Err(refuse(None, &text));
        }
        let has_moments = moments != Moments::default();
        let aerodynamics = Aerodynamics { title, reference, forces, moments, heating, air };
        let lengths = aerodynamics.lengths();
        if lengths.is_none() && has_moments {
            return Err(refuse(
                None,
                "reference.span and chord are missing, to which moments refer",
            ));
        }
        let GivenInertia { Ixx, Iyy, Izz, Ixz, Ixy, Iyz, .. } = inertia;
        let inertia = Inertia { Ixx, Iyy, Izz, Ixz, Ixy, Iyz };
        inertia.body(1.0).map_err(|error| refuse(None, &error.to_string()))?;
        let mut effectors = Effectors::none();
        let has_effectors = surfaces.is_some() || jets.is_some();
        if let Some(jets) = jets {
            jets.put(&mut effectors).map_err(|problem| refuse(None, &problem))?;
        }
        if let Some(mut surfaces) = surfaces {
            surfaces.put(&mut effectors).map_err(|problem| refuse(None, &problem))?;
            for table in std::mem::take(&mut surfaces.table) {
                let (offset, table) = (Some(table.span().start), table.into_inner());
                let made = surfaces.index(&table.surface).and_then(|index| {
                    let lengths =
                        lengths.ok_or("surface: its moments need reference.span and chord")?;
                    let volume = aerodynamics.area() * lengths[table.axis as usize];
                    SurfaceTable::new(table, index, volume)
                });
                effectors.tables.push(made.map_err(|problem| refuse(offset, &problem))?);
            }
        }
        effectors.check().map_err(|problem| refuse(None, &problem))?;
        let effectors = has_effectors.then_some(effectors);
        Ok(Self { aerodynamics, inertia, effectors, digest: digest(text.as_bytes()) })
    }

    /// Returns whether a restored vehicle can be flown: its data may be corrupt.
    pub fn fits(&self) -> bool {
        self.effectors.as_ref().is_none_or(|effectors| effectors.check().is_ok())
            && self.inertia.body(1.0).is_ok()
    }
}

/// Returns the FNV-1a hash of some bytes.
fn digest(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Vehicle of the papers: air and effectors are in one file each, which are two halves of one.
const PAPERS: &str =
    concat!(include_str!("../data/papers.toml"), include_str!("../data/effectors.toml"));

/// Reads a text that is part of the program. A test reads each, so that this cannot fail.
fn embedded(file: &str, text: &str) -> Vehicle {
    Vehicle::from_toml(file, text).unwrap_or_else(|error| panic!("{error}"))
}

/// Names of the shipped vehicles. That of Chai 2022 is the default. Those of the other papers differ
/// from it by their inertia.
pub const SHIPPED: [&str; 4] = ["chai2022", "wu2015", "jia", "shuttle"];

impl Vehicle {
    /// Returns the shipped vehicle with a name of [`SHIPPED`].
    pub fn shipped(name: &str) -> Option<Self> {
        let with =
            |scenario: Scenario| Self { inertia: scenario.inertia, ..Self::papers().clone() };
        match name {
            "chai2022" => Some(Self::papers().clone()),
            "wu2015" => Some(with(Scenario::tvsmc2015())),
            "jia" => Some(with(Scenario::two_loop())),
            "shuttle" => Some(embedded("shuttle.toml", include_str!("../data/shuttle.toml"))),
            _ => None,
        }
    }

    /// Returns the vehicle of Chai 2022: the Shuttle's forces at the same wing loading,
    /// representative moments, and the surfaces and jets of Wu 2015, section 6, as printed, with a
    /// representative effectiveness of the surfaces.
    pub fn papers() -> &'static Self {
        static READ: LazyLock<Vehicle> = LazyLock::new(|| embedded("papers.toml", PAPERS));
        &READ
    }
}

impl Aerodynamics {
    /// Returns the Space Shuttle of J. T. Betts, "Practical Methods for Optimal Control and
    /// Estimation Using Nonlinear Programming", chapter 6: forces and heating, no moments.
    pub fn shuttle() -> Self {
        embedded("shuttle.toml", include_str!("../data/shuttle.toml")).aerodynamics
    }

    /// Returns the air forces and moments of the papers' vehicle.
    pub fn papers() -> Self {
        Vehicle::papers().aerodynamics.clone()
    }
}

impl Effectors {
    /// Returns the surfaces and jets of the papers' vehicle.
    pub fn published() -> Self {
        Vehicle::papers().effectors.clone().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests;
