//! Parameters of an entry flight.

use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use vehicle::air::Air;
use vehicle::entry::{Config, Deviations, End, Following, Start, Trim};
use vehicle::translation::Planet;

/// Motion of the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub(crate) enum Translation {
    /// The flight condition is fixed by flight.altitude and flight.mach; the inputs trajectory.*
    /// give the turn of the trajectory.
    #[default]
    Given,
    /// An entry flight from the initial motion: the FMU computes the trajectory and the air.
    Entry,
}

/// File of the vehicle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct VehicleFile {
    /// Path of a TOML file with the vehicle, or name of a file in the resources of the FMU, or a
    /// shipped vehicle: chai2022 (also if empty), wu2015, jia, shuttle.
    #[setting(name = "vehicle.file")]
    pub(crate) file: String,
}

/// Parameters of an entry flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct EntryParameters {
    pub(crate) translation: Translation,
    #[setting(name = "initial", used_with = "translation = entry")]
    pub(crate) start: Start,
    #[setting(used_with = "translation = entry")]
    pub(crate) planet: Planet,
    #[setting(name = "aerodynamics.trim", used_with = "translation = entry")]
    pub(crate) trim: Trim,
    #[setting(name = "aerodynamics", used_with = "translation = entry")]
    pub(crate) deviations: Deviations,
    #[setting(name = "", used_with = "translation = entry")]
    pub(crate) air: Air,
    #[setting(used_with = "translation = entry")]
    pub(crate) prescribed: Following,
    #[setting(used_with = "translation = entry")]
    pub(crate) end: End,
}

impl Default for EntryParameters {
    /// Returns the start of the guided flight from 120 km in docs/entry.md.
    fn default() -> Self {
        Self {
            translation: Translation::default(),
            start: Start::default(),
            planet: Planet::EARTH,
            trim: Trim::default(),
            deviations: Deviations::default(),
            air: Air::default(),
            prescribed: Following { active: false, frequency: 1.0 },
            // The terminal area of the Space Shuttle begins at 80,000 ft.
            end: End { altitude: 24_384.0, speed: 0.0 },
        }
    }
}

impl EntryParameters {
    /// Whether the FMU computes an entry flight.
    pub(crate) fn is_entry(&self) -> bool {
        self.translation == Translation::Entry
    }

    /// Returns the configuration of the entry flight of a vehicle, with a factor on the density of
    /// the air, or `None` without one.
    pub(crate) fn config(&self, density_scale: f64, vehicle: &vehicle::Vehicle) -> Option<Config> {
        self.is_entry().then(|| Config {
            planet: self.planet,
            aerodynamics: vehicle.aerodynamics.clone(),
            deviations: self.deviations,
            air: Air { scale: density_scale, ..self.air },
            trim: self.trim,
            following: self.prescribed,
            end: self.end,
        })
    }
}
