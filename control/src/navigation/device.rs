//! The navigation as it is built from its settings.

use super::settings::{Errors, Settings};
use crate::error::DesignError;
use vehicle::aerodynamics::Aerodynamics;

/// Navigation.
#[derive(Clone, Debug)]
pub struct Navigation {
    pub(super) settings: Settings,
    /// Errors of gyroscope and accelerometer.
    pub(super) errors: [Errors; 2],
    pub(super) aerodynamics: Aerodynamics,
}

impl Navigation {
    /// Makes a navigation.
    ///
    /// # Errors
    /// Names the setting that is out of range.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        Self::of(settings, Aerodynamics::papers())
    }

    /// Makes the navigation of a vehicle.
    ///
    /// # Errors
    /// Names the setting that is out of range.
    pub fn of(settings: Settings, aerodynamics: Aerodynamics) -> Result<Self, DesignError> {
        ::settings::check(&settings)?;
        Ok(Self { errors: settings.errors(), aerodynamics, settings })
    }

    /// Returns the air forces of the vehicle.
    pub fn aerodynamics(&self) -> &Aerodynamics {
        &self.aerodynamics
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}
