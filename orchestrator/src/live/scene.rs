//! Content of the live view: the panels and readings that the experiment names.

use crate::failure::Failure;
use cosim::error::Error;
use cosim::pacing::pacer::Tally;
use cosim::system::{Probed, System};
use cosim_metrics::guarantee::{GuaranteeRecord, GuaranteeSignals};
use cosim_report::panels::Panel;

/// Everything in the view that stays the same during the run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scene {
    /// Title of the experiment.
    pub(crate) title: String,
    /// Start and stop time of the run, s.
    pub(crate) span: [f64; 2],
    /// Requested real-time factor, if the run is paced.
    pub(crate) factor: Option<f64>,
    /// Names of the components, in the order in which their inputs are set.
    pub(crate) components: Vec<String>,
    /// Panels of the experiment; the first two are drawn as charts.
    pub(crate) panels: Vec<Panel>,
    /// Further lines of variables, each with its heading.
    pub(crate) readings: Vec<(String, Vec<Probed>)>,
    /// Variables of the guarantee, if an FMU gives one.
    pub(crate) guarantee: Option<GuaranteeSignals>,
    /// Recorded variables, which are shown if the experiment names no panels.
    pub(crate) recorded: Vec<Probed>,
}

/// Values that the master copies for the view at a communication point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    /// Simulated time of the communication point, s; `None` before the first one.
    pub(crate) time: Option<f64>,
    /// Probed values at this communication point.
    pub(crate) values: Vec<f64>,
    /// State of the pacing, if the run is paced.
    pub(crate) tally: Option<Tally>,
    /// Record of the controller's guarantee, if it gives one.
    pub(crate) guarantee: Option<GuaranteeRecord>,
}

/// Formats a variable's value with its unit, or as the name of its enumeration item.
pub(crate) fn text(variable: &Probed, values: &[f64]) -> String {
    let value = values.get(variable.place).copied().unwrap_or(f64::NAN);
    let unit = &variable.unit;
    match variable.items.iter().find(|(_, item)| f64::from(*item) == value) {
        Some((name, _)) => name.clone(),
        None if value == value.trunc() && value.abs() < 1e6 => format!("{value} {unit}"),
        None if (1e-3..1e6).contains(&value.abs()) => format!("{value:.4} {unit}"),
        None => format!("{value:.4e} {unit}"),
    }
}

impl Scene {
    /// Finds everything that the view shows, and requests that these variables are probed at every
    /// communication point.
    pub(crate) fn new(
        system: &mut System,
        panels: Vec<Panel>,
        factor: Option<f64>,
    ) -> Result<Self, Failure> {
        let observe = system.experiment.observe.clone();
        let mut probe = |path: &String| system.has(path).then(|| system.probe(path).ok()).flatten();
        // A reading that the FMUs lack is left out, like an optional metric.
        let readings = observe.readings.iter().map(|(heading, paths)| {
            (heading.clone(), paths.iter().filter_map(&mut probe).collect::<Vec<_>>())
        });
        let readings = readings.filter(|(_, variables)| !variables.is_empty()).collect();
        let guarantee =
            observe.guarantee.as_ref().map(|asked| GuaranteeSignals::find(asked, system));
        let recorded = system.recorded();
        Ok(Self {
            title: system.experiment.title.clone(),
            span: [system.clock.start(), system.clock.stop()],
            factor,
            components: system.names().into_iter().map(String::from).collect(),
            panels,
            readings,
            guarantee: guarantee.transpose().map_err(Error::experiment)?.flatten(),
            recorded: recorded.iter().filter_map(|path| system.probe(path).ok()).collect(),
        })
    }
}
