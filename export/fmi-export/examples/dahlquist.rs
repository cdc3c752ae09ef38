//! Dahlquist's test equation x' = −k x as an FMU of FMI 2.0 and 3.0, for co-simulation and model
//! exchange.
use fmi_export::prelude::*;

/// Parameter, state and derivative.
#[derive(Default, Serialize, Deserialize, Declared)]
pub struct Dahlquist {
    /// Rate k at which the state decays.
    #[setting(unit = "1/s", start = 1.0)]
    k: f64,
    /// State x.
    #[setting(output, unit = "rad", start = 1.0)]
    x: f64,
    /// Time derivative of x.
    #[setting(name = "der(x)", output, unit = "rad/s", derivative = "x", depends_on = ["x"])]
    derivative: f64,
}

impl Model for Dahlquist {
    fn description() -> Description<Self> {
        Description::new("Dahlquist", "Test equation of Dahlquist", VariableTable::new(|m| m))
    }
    fn new() -> Self {
        settings::start()
    }
    fn calculate(&mut self, _time: f64, _last: LastEvent) -> Result<(), Failure> {
        self.derivative = -self.k * self.x;
        Ok(())
    }
}

fmi_export::export_fmus!(Dahlquist);
