//! Reads an SSP archive as an experiment.

use super::structure::{Structure, SystemComponent};
use super::{OPEN_MODELICA, RUN_SETTINGS, STRUCTURE, flow};
use crate::document::Source;
use crate::error::Error;
use crate::experiment::{
    Component, Coupling, Experiment, Given, Observe, OnInvalid, Overrides, Protection, Record,
    Simulation,
};
use crate::system::Opened;
use crate::wiring::wires;
use fmi_master::delay;
use fmi_master::wiring::{self, Part};
use fmu_import::archive;
use fmu_import::error::Error as Import;
use fmu_import::fmu::Fmu;
use fmu_import::folder::TemporaryFolder;
use fmu_import::xml::{self, Element};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use toml::{Spanned, Value};

/// An experiment that was read from an archive.
pub struct Loaded {
    /// Experiment that the archive describes. Components of subsystems are called
    /// `subsystem/component`.
    pub experiment: Experiment,
    /// The opened FMUs of the archive.
    pub opened: Opened,
    /// The unpacked entries of the archive.
    pub entries: Entries,
}

/// Entries of an archive, which stay unpacked as long as this value lives.
pub struct Entries {
    path: PathBuf,
    folder: TemporaryFolder,
}

impl Entries {
    /// Rewrites an error of one of the FMUs so that it names the archive and the entry.
    pub fn named(&self, error: Error) -> Error {
        of_entry(error, &self.path, self.folder.path())
    }
}

/// Rewrites an error of an FMU so that it names the archive and the entry, and not the temporary
/// folder.
fn of_entry(error: Error, archive: &Path, folder: &Path) -> Error {
    match error {
        Error::Import(Import::Fmu { path, message }) => {
            let (path, message) = match path.strip_prefix(folder) {
                Ok(entry) => (archive.to_path_buf(), format!("{}: {message}", entry.display())),
                Err(_) => (path, message),
            };
            Import::Fmu { path, message }.into()
        }
        error => error,
    }
}

/// Run settings that this program stored in the archive.
struct RunSettings {
    title: String,
    description: String,
    step: f64,
    coupling: Coupling,
    ends_with: Option<String>,
    /// Names of the components with their periods, in the order in which their inputs are set.
    order: Vec<(String, u32)>,
    /// Tolerances of the components that have one.
    tolerances: Vec<(String, f64)>,
    recorded: Vec<String>,
    record_every: u32,
    observe: Observe,
}

impl RunSettings {
    fn read(element: &Element) -> Result<Self, String> {
        let count = |element: &Element, name: &str| {
            let text = element.required(name)?;
            text.parse::<u32>().map_err(|_| format!("{name}=\"{text}\" is not a whole number"))
        };
        let coupling = match element.required("coupling")? {
            "sequential" | "gauss-seidel" => Coupling::Sequential,
            "jacobi" => Coupling::Jacobi,
            other => return Err(format!("the coupling \"{other}\" is not known")),
        };
        let those =
            |name: &'static str| element.children.iter().filter(move |child| child.name == name);
        let observe = match element.child("Observe") {
            Some(stated) => toml::from_str(stated.required("toml")?)
                .map_err(|error| error.message().to_string())?,
            None => Observe::default(),
        };
        Ok(Self {
            title: element.required("title")?.to_string(),
            description: element.attribute("description").unwrap_or_default().to_string(),
            step: element.number("step")?.ok_or("the annotation of the run has no step")?,
            coupling,
            ends_with: element.attribute("endsWith").map(String::from),
            order: those("Component")
                .map(|child| Ok((child.required("name")?.to_string(), count(child, "every")?)))
                .collect::<Result<_, String>>()?,
            tolerances: those("Component")
                .filter_map(|child| {
                    let tolerance = child.number("tolerance").transpose()?;
                    Some(tolerance.and_then(|t| Ok((child.required("name")?.to_string(), t))))
                })
                .collect::<Result<_, String>>()?,
            recorded: those("Record")
                .map(|child| child.required("variable").map(String::from))
                .collect::<Result<_, String>>()?,
            record_every: count(element, "recordEvery")?,
            observe,
        })
    }

    fn apply(self, experiment: &mut Experiment) -> Result<(), String> {
        (experiment.title, experiment.description) = (self.title, self.description);
        experiment.simulation.coupling = self.coupling;
        experiment.simulation.ends_with = self.ends_with;
        for (name, every) in &self.order {
            let component = experiment.components.get_mut(name);
            component
                .ok_or_else(|| {
                    format!("the annotation of the run: there is no component \"{name}\"")
                })?
                .every = *every;
        }
        for (name, tolerance) in self.tolerances {
            if let Some(component) = experiment.components.get_mut(&name) {
                component.tolerance = Some(tolerance);
            }
        }
        experiment.simulation.order = self.order.into_iter().map(|(name, _)| name).collect();
        let texts = self.recorded.into_iter().map(|name| Spanned::new(0..0, name));
        experiment.record = Record { variables: texts.collect(), every: self.record_every };
        experiment.observe = self.observe;
        Ok(())
    }
}

/// Reads an archive. The stop time and the step come from `overrides`, or otherwise from the
/// archive; without a step there, the smallest one that an FMU proposes is taken. The components
/// are ordered so that there is no delay, if this is possible.
///
/// # Errors
/// Returns an error if the archive is faulty, or needs what this program does not support:
/// components other than FMUs, signal dictionaries, or mappings of values between
/// FMUs.
pub fn load(path: &Path, overrides: &Overrides) -> Result<Loaded, Error> {
    let folder = archive::unpack_with_backslashes(path)?;
    let refuse = |message: String| Error::from(Import::Fmu { path: path.to_path_buf(), message });
    let bytes = std::fs::read(folder.path().join(STRUCTURE)).map_err(|error| {
        refuse(format!("is not an SSP archive, because {STRUCTURE} cannot be read: {error}"))
    })?;
    let in_structure = |message: String| refuse(format!("{STRUCTURE}: {message}"));
    let text = xml::decode(&bytes).map_err(in_structure)?;
    let root = Element::parse(&text).map_err(in_structure)?;
    let structure = Structure::read(&root, folder.path()).map_err(in_structure)?;

    let mut opened = Opened::default();
    for component in &structure.components {
        let fmu = folder.path().join(&component.source);
        if !opened.contains_key(&fmu) {
            let archive =
                Fmu::open(&fmu).map_err(|error| of_entry(error.into(), path, folder.path()))?;
            opened.insert(fmu.clone(), Rc::new(archive));
        }
    }
    let parts = parts(&structure.components, &opened, folder.path());
    let flow::Resolved { connections, parameters } =
        flow::resolve(&structure, &parts, path).map_err(in_structure)?;

    let stored = annotations(&root, RUN_SETTINGS).find_map(|tool| tool.child("Experiment"));
    let stored = stored.map(RunSettings::read).transpose().map_err(in_structure)?;
    let common = common_step(&root).map_err(in_structure)?;

    let experiment = root.child("DefaultExperiment");
    let time = |name| experiment.map_or(Ok(None), |e| e.number(name)).map_err(in_structure);
    let stop = overrides.stop.map_or_else(|| time("stopTime"), |stop| Ok(Some(stop)))?;
    let proposed = parts.iter().filter_map(|part| part.description.default_experiment.step);
    let stated = stored.as_ref().map(|settings| settings.step).or(common);
    let step = overrides.step.or(stated).or(proposed.reduce(f64::min));
    let simulation = Simulation {
        on_invalid: OnInvalid::default(),
        ends_with: None,
        start: time("startTime")?.unwrap_or(0.0),
        stop: stop.ok_or_else(|| refuse("has no stop time: give --stop".into()))?,
        step: step.ok_or_else(|| refuse("none of its FMUs proposes a step: give --step".into()))?,
        coupling: Coupling::Sequential,
        order: structure.components.iter().map(|component| component.name.clone()).collect(),
    };
    let text_of = |text: String| Spanned::new(0..0, text);
    let recorded = parts.iter().flat_map(|part| {
        let seen = |causality| {
            part.description.names(causality).map(|name| format!("{}.{name}", part.name))
        };
        seen("input").chain(seen("output")).collect::<Vec<_>>()
    });
    // Texts can be neither recorded nor shown.
    let is_no_text = |name: &String| wiring::find(name, &parts).is_some();
    let mut experiment = Experiment {
        title: root.attribute("name").unwrap_or("system").to_string(),
        description: root.attribute("description").unwrap_or_default().to_string(),
        simulation,
        components: structure
            .components
            .iter()
            .zip(parameters)
            .map(|(c, values)| (c.name.clone(), component(c, folder.path(), values)))
            .collect(),
        connections,
        record: Record { variables: recorded.filter(is_no_text).map(text_of).collect(), every: 1 },
        observe: Observe::default(),
        isolation: Protection::default(),
        leaves_inputs_open: true,
        assigned: BTreeSet::new(),
        law: None,
        unplaced: Vec::new(),
        given: Given::default(),
        source: Source::plain(path, text),
    };
    let wires = wires(&experiment, &parts)?;
    experiment.simulation.order = delay::order(&parts, &wires)
        .into_iter()
        .map(|index| parts[index].name.to_string())
        .collect();
    if let Some(settings) = stored {
        settings.apply(&mut experiment).map_err(in_structure)?;
    }
    experiment.apply(overrides)?;
    Ok(Loaded { experiment, opened, entries: Entries { path: path.to_path_buf(), folder } })
}

/// Returns the content of the system's annotations of this type.
fn annotations<'a>(root: &'a Element, kind: &'a str) -> impl Iterator<Item = &'a Element> {
    let system = root.child("System").into_iter();
    system
        .flat_map(|system| system.list("Annotations", "Annotation"))
        .filter(move |annotation| annotation.attribute("type") == Some(kind))
}

/// Returns the step that OMSimulator's annotation states, as versions before 3 write it or as later
/// ones do.
fn common_step(root: &Element) -> Result<Option<f64>, String> {
    let solvers = annotations(root, OPEN_MODELICA)
        .flat_map(|annotation| annotation.list("Annotations", "SimulationInformation"));
    for information in solvers {
        let master = information.child("FixedStepMaster");
        let step = master.map_or(Ok(None), |master| master.number("stepSize"))?;
        let step = step.map_or_else(|| information.number("fixedStepSize"), |step| Ok(Some(step)));
        if let Some(step) = step? {
            return Ok(Some(step));
        }
    }
    Ok(None)
}

/// Returns a component of the experiment for an FMU with these values.
fn component(
    component: &SystemComponent,
    folder: &Path,
    values: BTreeMap<String, Value>,
) -> Component {
    let text = |text| Spanned::new(0..0, text);
    Component {
        fmu: text(folder.join(&component.source).to_string_lossy().into_owned()),
        every: 1,
        unconnected: Vec::new(),
        parameters: values.into_iter().map(|(n, value)| (n, Spanned::new(0..0, value))).collect(),
        interface: component.interface,
        tolerance: None,
        isolate: None,
        is_exchanged: false,
    }
}

fn parts<'a>(
    components: &'a [SystemComponent],
    opened: &'a Opened,
    folder: &Path,
) -> Vec<Part<'a>> {
    let part = |component: &'a SystemComponent| Part {
        name: &component.name,
        description: &opened[&folder.join(&component.source)].description,
    };
    components.iter().map(part).collect()
}
