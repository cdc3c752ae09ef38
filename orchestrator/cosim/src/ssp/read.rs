//! Reads an SSP archive as an experiment.

use super::structure::{Structure, SystemComponent};
use super::{STRUCTURE, flow};
use crate::document::Source;
use crate::error::Error;
use crate::experiment::{Component, Experiment, Overrides, Record, Simulation};
use crate::system::Opened;
use crate::wiring::wires;
use fmi_master::delay;
use fmi_master::wiring::{self, Part};
use fmu_import::archive;
use fmu_import::error::Error as Import;
use fmu_import::fmu::Fmu;
use fmu_import::folder::TemporaryFolder;
use fmu_import::xml::{self, Element};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
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

/// Reads an archive. The stop time and the step come from `overrides`, or otherwise the stop time
/// from the archive, and as the step the smallest one that an FMU proposes. The components are
/// ordered so that there is no delay, if this is possible.
///
/// # Errors
/// Returns an error if the archive is faulty, or needs what this program does not support:
/// components other than FMUs, signal dictionaries, or mappings of values between
/// FMUs.
pub fn load(path: &Path, overrides: &Overrides) -> Result<Loaded, Error> {
    let folder = archive::unpack_with_backslashes(path)?;
    let refuse = |message: String| Error::from(Import::Fmu { path: path.to_path_buf(), message });
    let in_structure = |message: String| refuse(format!("{STRUCTURE}: {message}"));
    let bytes = std::fs::read(folder.path().join(STRUCTURE)).map_err(|error| {
        refuse(format!("is not an SSP archive, because {STRUCTURE} cannot be read: {error}"))
    })?;
    let text = xml::decode(&bytes).map_err(in_structure)?;
    let root = Element::parse(&text).map_err(in_structure)?;
    let structure = Structure::read(&root, folder.path()).map_err(in_structure)?;

    let opened = open(&structure, path, folder.path())?;
    let parts = parts(&structure.components, &opened, folder.path());
    let flow::Resolved { connections, parameters } =
        flow::resolve(&structure, &parts, path).map_err(in_structure)?;

    let components = structure.components.iter().zip(parameters);
    let mut experiment = Experiment {
        title: root.attribute("name").unwrap_or("system").to_string(),
        description: root.attribute("description").unwrap_or_default().to_string(),
        simulation: simulation(&root, &parts, overrides, &refuse)?,
        components: components
            .map(|(each, values)| (each.name.clone(), component(each, folder.path(), values)))
            .collect(),
        connections,
        record: Record { variables: recorded(&parts), every: 1 },
        leaves_inputs_open: true,
        source: Source::plain(path, text),
        ..Experiment::default()
    };
    let wires = wires(&experiment, &parts)?;
    experiment.simulation.order = delay::order(&parts, &wires)
        .into_iter()
        .map(|index| parts[index].name.to_string())
        .collect();
    experiment.apply(overrides)?;
    Ok(Loaded { experiment, opened, entries: Entries { path: path.to_path_buf(), folder } })
}

/// Opens the FMUs of the archive `path`, which is unpacked in a folder.
fn open(structure: &Structure, path: &Path, folder: &Path) -> Result<Opened, Error> {
    let mut opened = Opened::default();
    for component in &structure.components {
        if let Entry::Vacant(place) = opened.entry(folder.join(&component.source)) {
            let fmu = Fmu::open(place.key());
            let fmu = fmu.map_err(|error| of_entry(error.into(), path, folder))?;
            place.insert(Rc::new(fmu));
        }
    }
    Ok(opened)
}

/// Returns start, stop and step of the simulation.
fn simulation(
    root: &Element,
    parts: &[Part],
    overrides: &Overrides,
    refuse: &impl Fn(String) -> Error,
) -> Result<Simulation, Error> {
    let experiment = root.child("DefaultExperiment");
    let time = |name| {
        let time = experiment.map_or(Ok(None), |experiment| experiment.number(name));
        time.map_err(|message| refuse(format!("{STRUCTURE}: {message}")))
    };
    let stop = overrides.stop.map_or_else(|| time("stopTime"), |stop| Ok(Some(stop)))?;
    let proposed = parts.iter().filter_map(|part| part.description.default_experiment.step);
    let step = overrides.step.or(proposed.reduce(f64::min));
    Ok(Simulation {
        start: time("startTime")?.unwrap_or(0.0),
        stop: stop.ok_or_else(|| refuse("has no stop time: give --stop".into()))?,
        step: step.ok_or_else(|| refuse("none of its FMUs proposes a step: give --step".into()))?,
        order: parts.iter().map(|part| part.name.to_string()).collect(),
        ..Simulation::default()
    })
}

/// Lists the inputs and outputs, but for texts, which cannot be recorded.
fn recorded(parts: &[Part]) -> Vec<Spanned<String>> {
    let names = parts.iter().flat_map(|part| {
        let names = |causality| part.description.names(causality);
        names("input").chain(names("output")).map(|name| format!("{}.{name}", part.name))
    });
    let is_no_text = |name: &String| wiring::find(name, parts).is_some();
    names.filter(is_no_text).map(|name| Spanned::new(0..0, name)).collect()
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
