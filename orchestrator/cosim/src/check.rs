//! Checks an experiment in one pass: every name in it is looked up, and an experiment that cannot
//! be run is refused. After that only the instances themselves can fail.

use crate::error::Error;
use crate::experiment::{Coupling, Experiment};
use crate::search;
use crate::settings;
use crate::system::{CheckedComponent, Opened, System, parts};
use crate::wiring;
use fmi_master::clock::Clock;
use fmi_master::delay;
use fmi_master::description::{Variable, VariableKind};
use fmi_master::names;
use fmi_master::settings::SettingValue;
use fmi_master::wiring::Part;
use fmu_import::faults;
use fmu_import::fmu::Fmu;
use fmu_import::folder::from_start;
use fmu_import::isolation;
use fmu_import::lookup_table::is_lookup_table;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Checks an experiment against the model descriptions of its FMUs. Archives that are already in
/// `opened` are not opened again.
///
/// # Errors
/// Returns an error if anything is wrong with the experiment or with the archive of an FMU.
pub fn check(
    experiment: Experiment,
    fmu_dirs: &[PathBuf],
    opened: &mut Opened,
) -> Result<System, Error> {
    let simulation = &experiment.simulation;
    let clock = Clock::new(simulation.start, simulation.stop, simulation.step)
        .map_err(|problem| experiment.time_error(&problem))?;

    let (mut components, mut foreign) = (Vec::new(), None);
    for name in order(&experiment)? {
        let path = find_fmu(&experiment, &name, fmu_dirs)?;
        let fmu = match opened.get(&path) {
            Some(fmu) => Rc::clone(fmu),
            None => Rc::new(open(&path)?),
        };
        opened.insert(path, Rc::clone(&fmu));
        let fmu =
            if experiment.is_flown_by_law(&name) { Rc::new(fmu.flown_by_law()?) } else { fmu };
        let component = &experiment.components[&name];
        // The declaration alone proves nothing, but others do not write to these folders.
        let is_trusted = fmu.is_lookup_table()
            || fmu.is_made_by_fmu_pack() && search::is_installed(&fmu.path, fmu_dirs);
        if !is_trusted {
            foreign.get_or_insert(fmu.path.clone());
        }
        let interface = experiment.interface(&name, &fmu)?;
        let (every, settings) = (component.every, Vec::new());
        components.push(CheckedComponent { name, fmu, interface, every, settings });
    }
    let parts = parts(&components);
    if let Some(target) = experiment.unplaced.first() {
        return Err(Error::experiment(format!("--set {target}: {}", whereabouts(target, &parts))));
    }
    let fault =
        |problem: String| experiment.source.error(&(0..0), format!("[isolation] {problem}"));
    experiment.isolation.check().map_err(fault)?;
    let is_closed = is_closed(&experiment, foreign.as_deref());
    warn_of_idle_keys(&experiment, is_closed);
    experiment.warn_of_idle(experiment.assigned.iter().map(String::as_str));
    check_single_instances(&experiment, &components)?;
    if let Some(name) = &experiment.simulation.ends_with
        && !experiment.components.contains_key(name)
    {
        let hint = names::hint(name, experiment.components.keys().map(String::as_str));
        let problem = format!("[simulation] ends_with: there is no component \"{name}\"{hint}");
        return Err(experiment.source.error(&(0..0), problem));
    }

    let wires = wiring::wires(&experiment, &parts)?;
    let settings = (0..parts.len())
        .map(|index| settings::resolve(&experiment, &parts, index, &wires))
        .collect::<Result<Vec<_>, _>>()?;
    let columns = wiring::columns(&experiment, &parts)?;
    if clock.ticks() > MOST_STEPS {
        let message = format!(
            "{} steps of {} s are too many, at most {MOST_STEPS} are possible: choose a longer step or an earlier stop",
            clock.ticks(),
            clock.step()
        );
        return Err(experiment.time_error(&message));
    }
    if let Some(names) = delay::algebraic_loop(&parts, &wires) {
        let message = format!(
            "algebraic loop: each of these inputs depends on the next at the same instant: {}. \
             Put an FMU with a state or a delay into the loop",
            names.join(" <- ")
        );
        return Err(experiment.source.error(&(0..0), message));
    }
    let every: Vec<u32> = components.iter().map(|component| component.every).collect();
    let loops = delay::feedback_loops(&parts, &every, &wires, simulation.coupling);
    let probes = columns.iter().map(|column| column.port).collect();
    for (component, settings) in components.iter_mut().zip(settings) {
        component.settings = settings;
    }
    warn_of_different_vehicles(&components);
    Ok(System { experiment, clock, components, is_closed, loops, wires, columns, probes })
}

/// Warns if components read different vehicles.
fn warn_of_different_vehicles(components: &[CheckedComponent]) {
    let mut read: Vec<(&str, &str)> = Vec::new();
    for CheckedComponent { name, fmu, settings, .. } in components {
        let is_vehicle =
            |it: &&Variable| it.kind == VariableKind::String && it.name == settings::VEHICLE;
        let Some(variable) = fmu.description.variables.iter().find(is_vehicle) else { continue };
        let given = settings.iter().find(|setting| setting.name == variable.name);
        let file = match given.map(|setting| &setting.value) {
            Some(SettingValue::Text(file)) => file,
            _ => variable.start.as_deref().unwrap_or_default(),
        };
        read.push((name, file));
    }
    if read.iter().any(|(_, file)| *file != read[0].1) {
        let read = read.iter().map(|(component, file)| match *file {
            "" => format!("\"{component}\" reads none"),
            file => format!("\"{component}\" reads {file}"),
        });
        let read = read.collect::<Vec<_>>().join(", ");
        tracing::warn!("{} differs from component to component: {read}", settings::VEHICLE);
    }
}

/// Returns whether the instances run in a closed process, if an FMU is `foreign` or none is.
fn is_closed(experiment: &Experiment, foreign: Option<&Path>) -> bool {
    match (experiment.isolation.isolate, foreign) {
        (None, Some(path)) if !isolation::can_close() => {
            let path = path.display();
            tracing::warn!("{path} runs with your rights: no process can be closed here");
            false
        }
        (isolate, _) => isolate.unwrap_or(foreign.is_some()),
    }
}

/// Warns of keys that have no effect beside the others.
fn warn_of_idle_keys(experiment: &Experiment, is_closed: bool) {
    let Experiment { isolation, simulation, source, .. } = experiment;
    let warn = |keys: &str, why: &str| {
        tracing::warn!("{}: {keys} has no effect {why}", source.path.display());
    };
    for key in isolation.limits().filter(|_| !is_closed) {
        let why = "where the process is not closed: it is used with isolate = true";
        warn(&format!("[isolation] {key}"), why);
    }
    if simulation.coupling == Coupling::Jacobi
        && !simulation.order.is_empty()
        && experiment.given.coupling.is_none()
    {
        warn("[simulation] order", "with coupling = \"jacobi\"");
    }
}

/// Opens an archive, and warns if its description has a fault.
fn open(path: &Path) -> Result<Fmu, Error> {
    let fmu = Fmu::open(path)?;
    let faults = faults::faults(&fmu.description);
    if let Some(first) = faults.first() {
        let more = match faults.len() {
            1 => String::new(),
            count => format!(" ({} more, which orchestrator inspect --check lists)", count - 1),
        };
        tracing::warn!("{}: {first}{more}", path.display());
    }
    Ok(fmu)
}

/// Suggests the component if a parameter is given without one, or with a wrong one.
fn whereabouts(target: &str, parts: &[Part]) -> String {
    let settable = |part: &Part| {
        let names = part.description.names("parameter").chain(part.description.names("input"));
        names.map(|name| format!("{}.{name}", part.name)).collect::<Vec<_>>()
    };
    let paths: Vec<String> = parts.iter().flat_map(settable).collect();
    let meant: Vec<&str> = paths
        .iter()
        .filter(|name| names::split(name).is_some_and(|(_, rest)| rest == target))
        .map(String::as_str)
        .collect();
    if !meant.is_empty() {
        return format!("the component is missing: write {}", meant.join(" or "));
    }
    let component = names::split(target).map_or(target, |(component, _)| component);
    let hint = match names::nearest(target, paths.iter().map(String::as_str)) {
        Some(name) => format!("; did you mean \"{name}\"?"),
        None => names::hint(component, parts.iter().map(|part| part.name)),
    };
    format!("there is no component \"{component}\"{hint}")
}

/// Largest number of steps. Beyond it the times of two steps coincide, because FMUs treat instants
/// as equal if they differ by less than 1e-9 of their size.
const MOST_STEPS: u64 = 1_000_000_000;
/// Checks that an FMU that can be instantiated only once per process is used by one component only.
fn check_single_instances(
    experiment: &Experiment,
    components: &[CheckedComponent],
) -> Result<(), Error> {
    for (index, component) in components.iter().enumerate() {
        let CheckedComponent { name, fmu, .. } = component;
        let only_once = component.has("canBeInstantiatedOnlyOncePerProcess");
        if only_once
            && let Some(other) = components[..index].iter().find(|o| Rc::ptr_eq(&o.fmu, fmu))
        {
            let message = format!(
                "\"{}\" and \"{name}\" both use {}, which can be instantiated only once per process: give one of them a copy of the file",
                other.name,
                fmu.path.display()
            );
            return Err(experiment.source.error(&(0..0), message));
        }
    }
    Ok(())
}

/// Returns the names of the components, in the order in which they are stepped.
fn order(experiment: &Experiment) -> Result<Vec<String>, Error> {
    let refuse = |message: String| Err(experiment.source.error(&(0..0), message));
    let names: Vec<&str> = experiment.components.keys().map(String::as_str).collect();
    if let Some(name) = names.iter().find(|name| name.is_empty() || name.contains('.')) {
        return refuse(format!("the component name \"{name}\" must not be empty or contain a dot"));
    }
    if let Some((name, _)) =
        experiment.components.iter().find(|(_, component)| component.every == 0)
    {
        return refuse(format!("[components.{name}] every = 0: it must be at least 1"));
    }
    if experiment.record.every == 0 {
        return refuse("[record] every = 0: it must be at least 1".into());
    }
    let order = &experiment.simulation.order;
    for name in order {
        if !names.contains(&name.as_str()) {
            let hint = names::hint(name, names.iter().copied());
            return refuse(format!("[simulation] order: there is no component \"{name}\"{hint}"));
        }
        if order.iter().filter(|other| *other == name).count() > 1 {
            return refuse(format!("[simulation] order names \"{name}\" twice"));
        }
    }
    if order.is_empty() && (names.len() == 1 || experiment.simulation.coupling == Coupling::Jacobi)
    {
        return Ok(names.iter().map(ToString::to_string).collect());
    }
    if order.is_empty() {
        return refuse(format!(
            "[simulation] there is no order: list the components in the order in which they are stepped. Those whose \
             outputs respond to their inputs at once come first, for example order = [{}]",
            names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
        ));
    }
    // Components that the order does not name come last, sorted by name.
    let others = names.iter().filter(|name| !order.iter().any(|other| other == *name));
    Ok(order.iter().cloned().chain(others.map(ToString::to_string)).collect())
}

/// Finds the archive of a component: beside the experiment, in the given folders, or where FMUs are
/// found from any folder.
fn find_fmu(experiment: &Experiment, name: &str, fmu_dirs: &[PathBuf]) -> Result<PathBuf, Error> {
    let written = &experiment.components[name].fmu;
    let mut folders: Vec<PathBuf> = experiment.source.folders().map(Path::to_path_buf).collect();
    folders.dedup();
    folders.extend(fmu_dirs.iter().cloned());
    folders.extend(search::fmu_folders());
    if let Some(path) = folders
        .iter()
        .map(|folder| folder.join(written.get_ref()))
        .find(|path| from_start(path).is_file())
    {
        return Ok(path);
    }
    if let Some(path) = folders
        .iter()
        .map(|folder| folder.join(written.get_ref()))
        .find(|path| from_start(path).is_dir())
    {
        let problem = format!("{} is a folder, not an archive", path.display());
        return Err(experiment.fmu_error(name, &problem));
    }
    let files: Vec<String> = folders
        .iter()
        .flat_map(|folder| fs::read_dir(from_start(folder)).into_iter().flatten().flatten())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|file| {
            let path = Path::new(file);
            path.extension().is_some_and(|extension| extension == "fmu") || is_lookup_table(path)
        })
        .collect();
    let hint = names::hint(written.get_ref(), files.iter().map(String::as_str));
    let searched: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
    let message =
        format!("there is no file \"{}\" in {}{hint}", written.get_ref(), searched.join(", "));
    Err(experiment.fmu_error(name, &message))
}
