//! A checked experiment that is ready to run: observers request the signals that they want to see,
//! and then the instances are initialized and stepped.

use crate::error::Error;
use crate::experiment::Experiment;
use crate::interrupt::Interrupt;
use crate::recorder::{self, Recorder};
use crate::run::{Observer, Run};
use crate::signal::{Resolved, Signal, Term};
use crate::watch::Watched;
use crate::wiring::Column;
use fmi_master::clock::Clock;
use fmi_master::delay::{self, FeedbackLoop, Reading};
use fmi_master::description::{InterfaceKind, ModelDescription, VariableKind};
use fmi_master::master::{Master, Member};
use fmi_master::names;
use fmi_master::settings::{Setting, SettingValue};
use fmi_master::wiring::{self, Part, Port, Wire};
use fmu_import::fmu::Fmu;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Opened FMUs, by path. Systems that share this map unpack each archive only once.
pub type Opened = BTreeMap<PathBuf, Rc<Fmu>>;

/// Values of all parameters, by component and name.
pub type Parameters = BTreeMap<String, BTreeMap<String, Value>>;

/// The components of an experiment with their connections, as [`crate::check::check`] creates them.
#[derive(Clone)]
pub struct System {
    /// The experiment that the system was made from.
    pub experiment: Experiment,
    /// Start time, stop time and communication step.
    pub clock: Clock,
    /// The components, in the order in which they are stepped.
    pub components: Vec<CheckedComponent>,
    /// Whether the instances run in a closed process.
    pub is_closed: bool,
    /// Feedback loops with their delays, in ticks.
    pub loops: Vec<FeedbackLoop>,
    pub(crate) wires: Vec<Wire>,
    pub(crate) columns: Vec<Column>,
    /// Variables that the observers see, in the order of a sample's values.
    pub(crate) probes: Vec<Port>,
}

/// A component of an experiment whose FMU is opened and whose names are looked up.
#[derive(Clone)]
pub struct CheckedComponent {
    /// Name of the component in the experiment.
    pub name: String,
    /// FMU of the component.
    pub fmu: Rc<Fmu>,
    /// Interface by which the FMU is called.
    pub interface: InterfaceKind,
    /// Period of the component, in communication steps.
    pub every: u32,
    pub(crate) settings: Vec<Setting>,
}

impl CheckedComponent {
    /// Returns whether the FMU declares a capability for the interface by which it is called.
    pub fn has(&self, capability: &str) -> bool {
        let interface = self.fmu.description.interface(self.interface);
        interface.is_some_and(|interface| interface.has(capability))
    }

    /// Returns the unit in which a variable is to be displayed, with the factor to that unit. Units
    /// with an offset stay as they are.
    pub(crate) fn display(&self, variable: usize) -> (f64, String) {
        let description = &self.fmu.description;
        let kind = &description.variables[variable].kind;
        let VariableKind::Real { unit: Some(unit), display_unit, .. } = kind else {
            return (1.0, String::new());
        };
        let units = description.units_of(kind);
        let defined = units.iter().find(|defined| defined.name == *unit);
        let shown = defined.and_then(|defined| {
            let display = display_unit.as_deref()?;
            let (_, factor, _) = defined.displays.iter().find(|d| d.0 == display && d.2 == 0.0)?;
            Some((*factor, display.to_string()))
        });
        shown.unwrap_or((1.0, unit.clone()))
    }
}

/// A variable that is seen at every communication point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Probed {
    /// Full name of the variable, `component.variable`.
    pub name: String,
    /// Index of the variable among a sample's values.
    pub place: usize,
    /// Unit of the variable, or an empty text.
    pub unit: String,
    /// Items of an enumeration with their values.
    pub items: Vec<(String, i32)>,
}

impl System {
    /// Returns the names and model descriptions of the components.
    pub(crate) fn parts(&self) -> Vec<Part<'_>> {
        parts(&self.components)
    }

    fn find(&self, path: &str) -> Option<Port> {
        wiring::find(path, &self.parts())
    }

    fn place(&mut self, port: Port) -> usize {
        self.probes.iter().position(|probe| *probe == port).unwrap_or_else(|| {
            self.probes.push(port);
            self.probes.len() - 1
        })
    }

    /// Returns the largest delay of a feedback loop, in addition to delays within the components,
    /// s; `None` if there is no loop.
    pub fn loop_delay(&self) -> Option<f64> {
        let ticks = self.loops.iter().map(|feedback| feedback.ticks).max()?;
        Some(ticks as f64 * self.clock.step())
    }

    /// Returns the names of the components, in the order in which they are stepped.
    pub fn names(&self) -> Vec<&str> {
        self.components.iter().map(|component| component.name.as_str()).collect()
    }

    /// Returns the settings of the components, in the order in which they are stepped.
    pub(crate) fn settings(&self) -> Vec<Vec<Setting>> {
        self.components.iter().map(|component| component.settings.clone()).collect()
    }

    /// Returns the full names of the recorded variables.
    pub fn recorded(&self) -> Vec<String> {
        self.columns.iter().map(|column| column.name.clone()).collect()
    }

    /// Returns whether there is a variable `component.variable` that is not a text.
    pub fn has(&self, path: &str) -> bool {
        self.find(path).is_some()
    }

    /// Returns whether some of the variables are missing, and all missing ones because the command
    /// line replaced their FMUs.
    pub fn lost_by_exchange<'a>(&self, paths: impl IntoIterator<Item = &'a str>) -> bool {
        let is_exchanged = |path: &str| {
            names::split(path)
                .and_then(|(name, _)| self.experiment.components.get(name))
                .is_some_and(|component| component.is_exchanged)
        };
        let mut missing = paths.into_iter().filter(|path| !self.has(path)).peekable();
        missing.peek().is_some() && missing.all(is_exchanged)
    }

    /// Requests that a variable is seen at every communication point.
    ///
    /// # Errors
    /// Returns an error if there is no such variable, or if it is a text.
    pub fn probe(&mut self, path: &str) -> Result<Probed, String> {
        let port = self.find(path).ok_or_else(|| {
            let parts = self.parts();
            let paths_of = |part: &Part| {
                let names =
                    part.description.variables.iter().map(|v| format!("{}.{}", part.name, v.name));
                names.collect::<Vec<_>>()
            };
            let paths: Vec<String> = parts.iter().flat_map(paths_of).collect();
            let hint = names::hint(path, paths.iter().map(String::as_str));
            format!("there is no variable \"{path}\"{hint}")
        })?;
        let place = self.place(port);
        let kind = &self.variable_at(port).kind;
        let unit = kind.unit().unwrap_or_default().into();
        Ok(Probed { name: path.into(), place, unit, items: kind.items().to_vec() })
    }

    /// Requests that the variables of a signal are seen at every communication point.
    ///
    /// # Errors
    /// Returns an error if a variable does not exist, or if variables that are combined are not all
    /// in the same unit.
    pub fn resolve(&mut self, signal: &Signal) -> Result<Resolved, String> {
        let resolved = signal.resolve(|path| {
            let place = self.probe(path)?.place;
            let (factor, unit) = self.display(self.probes[place]);
            Ok((place, factor, unit))
        })?;
        let terms = &resolved.terms;
        let is_integer = matches!(terms[..], [Term { value, with: None }]
            if !matches!(self.variable_at(self.probes[value]).kind, VariableKind::Real { .. }));
        let responds = terms.iter().flat_map(Term::variables).any(|place| self.is_response(*place));
        Ok(Resolved { is_integer, responds, ..resolved })
    }

    fn is_response(&self, place: usize) -> bool {
        let readings =
            delay::readings_of_probes(&self.parts(), &self.wires, &self.probes[place..=place]);
        readings.iter().any(|(_, reading)| *reading == Reading::AfterStep)
    }

    /// Returns the full names of the probed variables, in the order of a sample's values, and
    /// whether each responds to the inputs of the communication point.
    pub fn probed(&self) -> Vec<(String, bool)> {
        let named = self.probes.iter().enumerate();
        named.map(|(place, port)| (self.name(*port), self.is_response(place))).collect()
    }

    /// Returns the full names of the connected outputs and inputs.
    pub fn connections(&self) -> Vec<(String, String)> {
        self.wires.iter().map(|wire| (self.name(wire.from), self.name(wire.to))).collect()
    }

    fn display(&self, port: Port) -> (f64, String) {
        self.components[port.component].display(port.variable)
    }

    /// Runs the experiment from its start to its stop time.
    ///
    /// # Errors
    /// Returns an error if an instance or an observer fails, or if the run was asked to end. The
    /// observers have seen all communication points up to then.
    pub fn run(
        &self,
        observers: &mut [&mut dyn Observer],
        interrupt: &Interrupt,
    ) -> Result<(), Error> {
        self.start(interrupt)?.run(observers)
    }

    /// Creates the instances, sets their parameters, and initializes them.
    ///
    /// # Errors
    /// Returns an error if an instance cannot be made or initialized.
    pub fn start(&self, interrupt: &Interrupt) -> Result<Run, Error> {
        self.start_with(&self.settings(), interrupt)
    }

    /// Creates and initializes the instances with `settings` in place of the system's own.
    pub(crate) fn start_with(
        &self,
        settings: &[Vec<Setting>],
        interrupt: &Interrupt,
    ) -> Result<Run, Error> {
        interrupt.watch();
        let mut members = Vec::new();
        for component in &self.components {
            let CheckedComponent { name, fmu, interface, every, .. } = component;
            let instance = fmu.instantiate(name, *interface)?;
            let on_invalid = self.experiment.simulation.on_invalid;
            let instance = Watched::around(instance, name, fmu, on_invalid);
            let (name, every) = (name.clone(), *every);
            let varies = fmu.fits_last_step(*interface);
            members.push(Member { name, every, varies, instance });
        }
        let coupling = self.experiment.simulation.coupling;
        let parts = self.parts();
        let wires = delay::readings_of_wires(&parts, &self.wires, coupling);
        let probes = delay::readings_of_probes(&parts, &self.wires, &self.probes);
        let mut master = Master::new(self.clock, coupling, members, &wires, &probes);
        let ender = self.experiment.simulation.ends_with.as_ref();
        master.set_ender(ender.and_then(|ender| self.names().iter().position(|n| n == ender)));
        master.set_parameters(settings)?;
        master.initialize()?;
        Ok(Run::new(master, interrupt))
    }

    /// Reads the values of all parameters after initialization. Of those of type String, which name
    /// files, it takes those that are set.
    ///
    /// # Errors
    /// Returns an error if an instance cannot be read.
    pub fn parameters(&self, run: &mut Run) -> Result<Parameters, Error> {
        let mut parameters = Parameters::new();
        for (component, part) in self.parts().iter().enumerate() {
            let variables = part.description.variables.iter().enumerate();
            let ports: Vec<Port> = variables
                .filter(|(_, variable)| variable.causality == "parameter")
                .filter_map(|(position, variable)| wiring::port(component, position, variable))
                .collect();
            let values = run.master.read(&ports)?;
            let named = ports.iter().zip(values).map(|(port, value)| {
                let name = part.description.variables[port.variable].name.clone();
                (name, plain_value(part.description, *port, value))
            });
            let texts = self.components[component].settings.iter();
            let texts = texts.filter(|setting| matches!(setting.value, SettingValue::Text(_)));
            let texts = texts.map(|setting| (setting.name.clone(), setting.value.to_json()));
            parameters.insert(part.name.to_string(), named.chain(texts).collect());
        }
        Ok(parameters)
    }

    /// Creates the recorder, which writes the file of the recorded variables into a folder.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn recorder(&self, folder: &Path) -> Result<Recorder, Error> {
        let places: HashMap<Port, usize> =
            self.probes.iter().enumerate().rev().map(|(place, port)| (*port, place)).collect();
        let column = |column: &Column| {
            let port = column.port;
            let (name, carrier) = (column.name.clone(), port.carrier);
            Some(recorder::Column { name, place: *places.get(&port)?, carrier })
        };
        let columns: Vec<_> = self.columns.iter().filter_map(column).collect();
        let path = folder.join(recorder::FILE);
        Recorder::create(&path, columns, self.experiment.record.every)
    }
}

pub(crate) fn parts(components: &[CheckedComponent]) -> Vec<Part<'_>> {
    let components = components.iter();
    components.map(|c| Part { name: &c.name, description: &c.fmu.description }).collect()
}

fn plain_value(description: &ModelDescription, port: Port, value: f64) -> Value {
    match &description.variables[port.variable].kind {
        VariableKind::Boolean => (value != 0.0).into(),
        VariableKind::Integer { .. } => (value as i64).into(),
        VariableKind::Enumeration { items } => items
            .iter()
            .find(|(_, item)| f64::from(*item) == value)
            .map_or_else(|| (value as i64).into(), |(name, _)| name.as_str().into()),
        _ => value.into(),
    }
}
