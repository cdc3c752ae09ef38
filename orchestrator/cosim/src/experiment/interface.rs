//! The interface by which a component is called: co-simulation or model exchange.

use super::{Component, Experiment};
use crate::error::Error;
use fmi_master::description::InterfaceKind;
use fmu_import::fmu::Fmu;
use schemars::JsonSchema;
use serde::Deserialize;

/// The interface by which a component is called.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "camelCase")]
pub enum Interface {
    /// The FMU steps itself.
    CoSimulation,
    /// The orchestrator integrates the continuous states of the FMU.
    ModelExchange,
}

/// Relative tolerance where neither the experiment nor the FMU names one.
const TOLERANCE: f64 = 1e-6;
/// Smallest and largest relative tolerance of an integration.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-13..=0.1;

impl Experiment {
    /// Returns the interface by which a component is called. Without a key `interface` this is
    /// co-simulation if the FMU offers it, otherwise model exchange.
    pub(crate) fn interface(&self, name: &str, fmu: &Fmu) -> Result<InterfaceKind, Error> {
        let Component { interface, tolerance, is_exchanged, .. } = &self.components[name];
        let refuse = |problem: String| {
            Err(self.source.error(&(0..0), format!("[components.{name}] {problem}")))
        };
        let proposed = fmu.description.default_experiment.tolerance;
        let proposed = proposed.filter(|tolerance| TOLERANCES.contains(tolerance));
        let exchange =
            InterfaceKind::ModelExchange { tolerance: tolerance.or(proposed).unwrap_or(TOLERANCE) };
        let [steps, exchanges] = [InterfaceKind::CoSimulation, exchange]
            .map(|kind| fmu.description.interface(kind).is_some());
        let file = fmu.path.file_name().unwrap_or_default().to_string_lossy();
        // An FMU in place of another one may offer the other interface only.
        let asked = interface.filter(|_| !is_exchanged || steps == exchanges);
        let is_exchange =
            asked.map_or(exchanges && !steps, |asked| asked == Interface::ModelExchange);
        let kind = if is_exchange { exchange } else { InterfaceKind::CoSimulation };
        if asked.is_some() && fmu.description.interface(kind).is_none() {
            return refuse(format!("interface: {file} offers no {}", kind.name()));
        }
        match tolerance {
            Some(tolerance) if !TOLERANCES.contains(tolerance) => {
                refuse(format!("tolerance = {tolerance}: it must be from 1e-13 to 0.1"))
            }
            Some(_) if kind == InterfaceKind::CoSimulation && !is_exchanged => refuse(
                "tolerance: it is used with interface = \"modelExchange\" only, in co-simulation \
                 the FMU chooses its accuracy"
                    .into(),
            ),
            _ => Ok(kind),
        }
    }
}
