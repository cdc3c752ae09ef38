//! The vehicle that a file gives in place of the built-in one.

use fmi_export::{Context, Failure};
use serde::{Deserialize, Serialize};
use settings::Declared;
use vehicle::Vehicle;

/// The file of a vehicle, and the vehicle that was read from it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct OwnVehicle {
    /// Path of a TOML file with the vehicle, or name of a file in the resources of the FMU, or a
    /// shipped vehicle: chai2022 (also if empty), wu2015, jia, shuttle.
    #[setting(name = "vehicle.file")]
    pub file: String,
    #[setting(skip)]
    vehicle: Option<Box<Vehicle>>,
}

impl OwnVehicle {
    /// Reads the file, if the parameter names one.
    ///
    /// # Errors
    /// Names file, line and key at fault.
    pub fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.vehicle = None;
        if !self.file.is_empty() {
            let vehicle = Vehicle::read(&context.file(&self.file))
                .map_err(|error| Failure::Error(format!("vehicle.file: {error}")))?;
            self.vehicle = Some(Box::new(vehicle));
        }
        Ok(())
    }

    /// Returns the vehicle of the file, or the built-in one.
    pub fn vehicle(&self) -> &Vehicle {
        self.read().unwrap_or_else(|| Vehicle::papers())
    }

    /// Returns the vehicle of the file.
    pub fn read(&self) -> Option<&Vehicle> {
        self.vehicle.as_deref()
    }

    /// Returns the fault of a restored vehicle that is not the one of the parameter, or not the one
    /// that is loaded. The file is not read again.
    pub fn problem(&self, before: &Self) -> Option<&'static str> {
        match (&self.vehicle, &before.vehicle) {
            (Some(saved), Some(loaded)) if saved != loaded => {
                Some("its vehicle.file had another content than the one that is loaded")
            }
            (Some(saved), _) if !saved.fits() => Some("its vehicle cannot be flown"),
            (saved, _) if saved.is_none() != self.file.is_empty() => {
                Some("its vehicle does not belong to its vehicle.file")
            }
            _ => None,
        }
    }
}
