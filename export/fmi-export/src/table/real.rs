//! Declaration of a real variable.

use super::Common;
use model_description::unit::Unit;

/// Declaration of a real variable.
#[derive(Clone, Debug)]
pub struct Real {
    pub(super) common: Common,
    pub(super) unit: Option<Unit>,
    pub(super) min: Option<f64>,
    pub(super) max: Option<f64>,
    pub(super) nominal: Option<f64>,
    pub(super) derivative_of: Option<String>,
}

impl Real {
    /// Declares the unit of measure of the variable by its name, as [`Unit::new`] has it.
    #[must_use]
    #[inline(never)]
    pub fn unit(mut self, name: &str) -> Self {
        self.unit = (!name.is_empty()).then(|| Unit::new(name));
        self
    }
    /// Declares the smallest allowed value.
    #[must_use]
    #[inline(never)]
    pub fn min(mut self, min: f64) -> Self {
        self.min = Some(min);
        self
    }
    /// Declares the largest allowed value.
    #[must_use]
    #[inline(never)]
    pub fn max(mut self, max: f64) -> Self {
        self.max = Some(max);
        self
    }
    /// Declares the typical magnitude of the variable.
    #[must_use]
    #[inline(never)]
    pub fn nominal(mut self, nominal: f64) -> Self {
        self.nominal = Some(nominal);
        self
    }
    /// Declares the variable as the time derivative of the (state) variable `name`.
    #[must_use]
    pub fn derivative_of(mut self, name: &str) -> Self {
        self.derivative_of = Some(name.into());
        self
    }
}
