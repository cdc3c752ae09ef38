//! The panels of an experiment whose signals have been found.

use cosim::error::Error;
use cosim::experiment;
use cosim::signal::{Resolved, Signal, common_unit};
use cosim::system::System;

/// A panel whose signals have been found.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Short name of the panel.
    pub name: String,
    /// Label of the vertical axis without the unit.
    pub label: String,
    /// Unit of all values in the panel.
    pub unit: String,
    /// Factor from the unit of the signals to the unit of the panel.
    pub factor: f64,
    /// Curves of the panel, with their names and signals.
    pub curves: Vec<Curve>,
    /// Limit of the norm of all curves.
    pub limit: Option<Resolved>,
}

/// A curve of a panel.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name of the curve in the legend.
    pub name: String,
    /// Signal that is drawn as the curve.
    pub signal: Resolved,
    /// Signal that the curve is to follow, if any.
    pub reference: Option<Resolved>,
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
        let units = system.experiment.observe.units.clone();
        let mut resolve = |signal: &Signal| {
            if system.lost_by_exchange(signal.paths()) {
                return Ok(None);
            }
            system.resolve(signal).map(Some)
        };
        let mut curves = Vec::new();
        for experiment::Curve { name, of, reference } in &requested.curves {
            let reference = reference.as_ref().map(&mut resolve).transpose()?.flatten();
            let signal = resolve(of)?;
            curves.extend(signal.map(|signal| Curve { name: name.clone(), signal, reference }));
        }
        let limit = requested.limit.as_ref().map(&mut resolve).transpose()?.flatten();
        let followed = curves.iter().filter_map(|curve| curve.reference.as_ref());
        let drawn = curves.iter().map(|curve| &curve.signal).chain(followed).chain(&limit);
        let signal_unit = common_unit(drawn)?.to_string();
        let shown = requested.unit.as_ref().or_else(|| units.get(&signal_unit));
        let (unit, factor) =
            shown.map_or((signal_unit, 1.0), |unit| (unit.name.clone(), unit.factor));
        let label = if requested.label.is_empty() { &requested.name } else { &requested.label };
        Ok(Self { name: requested.name.clone(), label: label.clone(), unit, factor, curves, limit })
    }
}
