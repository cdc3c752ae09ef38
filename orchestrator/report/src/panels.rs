//! The panels of an experiment whose signals have been found.

use cosim::error::Error;
use cosim::experiment;
use cosim::signal::{Resolved, Signal, common_unit};
use cosim::system::System;

/// A panel whose signals have been found.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Label of the vertical axis without the unit.
    pub label: String,
    /// Unit of all values in the panel.
    pub unit: String,
    /// Factor from the unit of the signals to the unit of the panel.
    pub factor: f64,
    /// Names and signals of the curves.
    pub curves: Vec<(String, Resolved)>,
}

impl Panel {
    /// Finds the signals of all panels of an experiment. Signals that are missing because the
    /// command line replaced their FMU are left out.
    ///
    /// # Errors
    /// Returns an error if a variable does not exist.
    pub fn resolve_all(system: &mut System) -> Result<Vec<Self>, Error> {
        let panels = system.experiment.observe.panels.clone();
        let resolved = panels.iter().map(|panel| {
            let fault = |problem| {
                Error::experiment(format!("[[observe.panels]] \"{}\": {problem}", panel.name))
            };
            Self::resolve(panel, system).map_err(fault)
        });
        let resolved = resolved.collect::<Result<Vec<_>, _>>()?;
        Ok(resolved.into_iter().filter(|panel| !panel.curves.is_empty()).collect())
    }

    fn resolve(requested: &experiment::Panel, system: &mut System) -> Result<Self, String> {
        if requested.optional && requested.paths().any(|path| !system.has(path)) {
            return Ok(Self::default());
        }
        let units = system.experiment.observe.units.clone();
        let mut resolve = |signal: &Signal| {
            if system.lost_by_exchange(signal.paths()) {
                return Ok(None);
            }
            system.resolve(signal).map(Some)
        };
        let (mut curves, mut others) = (Vec::new(), Vec::new());
        for experiment::Curve { name, of, reference } in &requested.curves {
            curves.extend(resolve(of)?.map(|signal| (name.clone(), signal)));
            others.extend(reference.as_ref().map(&mut resolve).transpose()?.flatten());
        }
        others.extend(requested.limit.as_ref().map(&mut resolve).transpose()?.flatten());
        let drawn = curves.iter().map(|(_, signal)| signal).chain(&others);
        let signal_unit = common_unit(drawn)?.to_string();
        let shown = requested.unit.as_ref().or_else(|| units.get(&signal_unit));
        let (unit, factor) =
            shown.map_or((signal_unit, 1.0), |unit| (unit.name.clone(), unit.factor));
        let label = if requested.label.is_empty() { &requested.name } else { &requested.label };
        Ok(Self { label: label.clone(), unit, factor, curves })
    }
}
