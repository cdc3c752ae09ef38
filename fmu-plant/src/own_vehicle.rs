//! The vehicle that a file gives in place of the built-in ones.

use crate::parameters::{Actuation, Parameters};
use crate::plant::ReentryPlant;
use fmi_export::{Context, Failure};
use vehicle::Vehicle;

impl Parameters {
    /// Reads the vehicle from the file that the parameters name, if they name one.
    pub(crate) fn load_vehicle(&self, context: &Context) -> Result<Option<Box<Vehicle>>, Failure> {
        if self.vehicle.file.is_empty() {
            return Ok(None);
        }
        let vehicle = Vehicle::read(&context.file(&self.vehicle.file))
            .map_err(|error| Failure::Error(format!("vehicle.file: {error}")))?;
        if self.actuation == Actuation::SurfacesAndJets && vehicle.effectors.is_none() {
            let text = "vehicle.file gives neither surfaces nor jets, which actuation = surfacesAndJets needs";
            return Err(Failure::Error(text.into()));
        }
        Ok(Some(Box::new(vehicle)))
    }
}

impl ReentryPlant {
    /// Refuses a restored vehicle that is not the one of the parameters, or not the one that is
    /// loaded. The file is not read again.
    pub(crate) fn check_vehicle(&self, before: &Self) -> Result<(), Failure> {
        let refuse =
            |problem: &str| Err(Failure::Error(format!("the saved state does not fit: {problem}")));
        match (&self.vehicle, &before.vehicle) {
            (Some(saved), Some(loaded)) if saved != loaded => {
                refuse("its vehicle.file had another content than the one that is loaded")
            }
            (Some(saved), _) if !saved.fits() || self.parameters.vehicle.file.is_empty() => {
                refuse("its vehicle cannot be flown")
            }
            (None, _) if !self.parameters.vehicle.file.is_empty() => {
                refuse("it lacks the vehicle of vehicle.file")
            }
            _ => Ok(()),
        }
    }
}
