//! The settings with which CRMPC flies in the experiments, studies and campaigns of a folder.

use campaign::definition::Campaign;
use control::crmpc::{Constraints, Guarantee, InitialState, Settings};
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{Component, Experiment};
use std::path::{Path, PathBuf};
use study::definition::Study;
use sweep::vary::Vary;
use toml::{Table, Value};
use vehicle::dynamics::Inertia;

/// Settings of one CRMPC in one file.
#[derive(Clone, Debug)]
pub struct Shipped {
    /// File that the settings stand in.
    pub file: PathBuf,
    /// Run of the study, if the file is one, and name of the component.
    pub place: String,
    /// The settings.
    pub settings: Settings,
}

/// Result of reading all files of a folder.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    /// Settings of every CRMPC in the files, file by file.
    pub shipped: Vec<Shipped>,
    /// Number of experiments, studies and campaigns that were read.
    pub read: [usize; 3],
    /// Files that are none of these, or have no title because they only serve to be extended, with
    /// the reason.
    pub left_out: Vec<(PathBuf, String)>,
}

/// Name of the archive of the controller.
const ARCHIVE: &str = "CRMPC.fmu";

impl Scan {
    /// Reads every TOML file below `folder`.
    ///
    /// # Errors
    /// Names the file that cannot be read, and what is wrong with it or with a parameter of CRMPC
    /// in it.
    pub fn new(folder: &Path) -> Result<Self, String> {
        let mut scan = Self::default();
        for file in files(folder)? {
            let outcome = scan.read(&file);
            outcome.map_err(|error| format!("{}: {error}", file.display()))?;
        }
        Ok(scan)
    }

    fn read(&mut self, file: &Path) -> Result<(), String> {
        let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
        let kind = text.lines().next().and_then(|line| line.strip_prefix("#:schema "));
        let kind = kind.and_then(|schema| schema.rsplit('/').next()).unwrap_or("no schema");
        let place = match kind {
            "experiment.json" => 0,
            "study.json" => 1,
            "campaign.json" => 2,
            other => {
                self.left_out.push((file.to_path_buf(), other.into()));
                return Ok(());
            }
        };
        let fault = |error: Error| error.to_string();
        let whole: Table = Source::load(file).and_then(|source| source.read()).map_err(fault)?;
        if !whole.contains_key("title") {
            self.left_out.push((file.to_path_buf(), "no title, only for other files".into()));
            return Ok(());
        }
        self.read[place] += 1;
        match place {
            0 => self.experiment(file, "", &Experiment::load(file).map_err(fault)?),
            1 => self.study(file, &Study::load(file).map_err(|error| error.to_string())?),
            _ => self.campaign(file, &Campaign::load(file).map_err(fault)?),
        }
    }

    fn experiment(
        &mut self,
        file: &Path,
        run: &str,
        experiment: &Experiment,
    ) -> Result<(), String> {
        for (name, component) in &experiment.components {
            if component.fmu.get_ref() == ARCHIVE {
                let settings =
                    settings(component).map_err(|error| format!("{run} {name}: {error}"))?;
                let place = format!("{run} {name}").trim().to_owned();
                self.shipped.push(Shipped { file: file.to_path_buf(), place, settings });
            }
        }
        Ok(())
    }

    fn study(&mut self, file: &Path, study: &Study) -> Result<(), String> {
        for run in &study.runs {
            let experiment = study.experiment(run).map_err(|error| error.to_string())?;
            let varied = run.varied();
            refuse_varied(&experiment, varied)?;
            self.experiment(file, run.id.get_ref(), &experiment)?;
        }
        Ok(())
    }

    fn campaign(&mut self, file: &Path, campaign: &Campaign) -> Result<(), String> {
        let path = campaign.source.beside(campaign.experiment.get_ref());
        let mut experiment = Experiment::load(&path).map_err(|error| error.to_string())?;
        for (name, fmu) in &campaign.fmu {
            let component = experiment.components.get_mut(name).ok_or("no such component")?;
            component.fmu = toml::Spanned::new(0..0, fmu.to_string_lossy().into_owned());
        }
        for (target, value) in &campaign.set {
            experiment.set(target, value.get_ref().clone())?;
        }
        let varied = campaign.vary.iter().flat_map(Vary::names);
        refuse_varied(&experiment, varied)?;
        self.experiment(file, "", &experiment)
    }
}

/// Refuses a parameter of CRMPC that takes several values, as all of them would have to be checked.
fn refuse_varied<'a>(
    experiment: &Experiment,
    mut names: impl Iterator<Item = &'a String>,
) -> Result<(), String> {
    let of_crmpc = |name: &&String| {
        let component = name.split_once('.').and_then(|(name, _)| experiment.components.get(name));
        component.is_some_and(|component| component.fmu.get_ref() == ARCHIVE)
    };
    names.find(of_crmpc).map_or(Ok(()), |name| Err(format!("{name} of CRMPC varies")))
}

/// All TOML files below a folder, in order of their names.
fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let fault = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        if path.is_dir() {
            paths.extend(files(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// Converts a value to SI units.
fn quantity(value: &Value) -> Result<f64, String> {
    let refused = || format!("{value} is not a number, or a number with a known unit");
    match value {
        Value::Float(number) => Ok(*number),
        Value::Integer(number) => i32::try_from(*number).map(f64::from).map_err(|_| refused()),
        Value::String(text) => {
            let (number, unit) = text.split_once(' ').ok_or_else(refused)?;
            let number: f64 = number.parse().map_err(|_| refused())?;
            match unit {
                "s" => Ok(number),
                "deg" | "deg/s" | "deg/s2" => Ok(number.to_radians()),
                _ => Err(refused()),
            }
        }
        _ => Err(refused()),
    }
}

/// Settings of a component, from the defaults of the FMU and the parameters that the file sets.
fn settings(component: &Component) -> Result<Settings, String> {
    let mut s = Settings::new(Constraints::Robust);
    let mut inertia = Inertia {
        Ixx: s.body.inertia[(0, 0)],
        Iyy: s.body.inertia[(1, 1)],
        Izz: s.body.inertia[(2, 2)],
        Ixz: -s.body.inertia[(0, 2)],
    };
    for (name, value) in &component.parameters {
        set(&mut s, &mut inertia, name, value.get_ref())
            .map_err(|error| format!("{name}: {error}"))?;
    }
    s.body = inertia.body(1.0).map_err(|error| error.to_string())?;
    s.resolved().map_err(|error| error.to_string())
}

fn set(s: &mut Settings, inertia: &mut Inertia, name: &str, value: &Value) -> Result<(), String> {
    let place: &mut f64 = match name {
        "feedback.k1" => &mut s.feedback.k1,
        "feedback.k2" => &mut s.feedback.k2,
        "terminal.k1" => &mut s.terminal.k1,
        "terminal.k2" => &mut s.terminal.k2,
        "disturbance.bound" => &mut s.disturbance_bound,
        "estimation.angleError" => &mut s.angle_error,
        "estimation.rateError" => &mut s.rate_error,
        "estimation.slowAngleError" => &mut s.slow_angle_error,
        "estimation.slowAngleRate" => &mut s.slow_angle_rate,
        "inertia.error" => &mut s.inertia_error,
        "inertia.tensorError" => &mut s.tensor_error,
        "inertia.Ixx" => &mut inertia.Ixx,
        "inertia.Iyy" => &mut inertia.Iyy,
        "inertia.Izz" => &mut inertia.Izz,
        "inertia.Ixz" => &mut inertia.Ixz,
        "limit.rate" => &mut s.limit_rate,
        "limit.moment" => &mut s.limit_moment,
        "knownMoment.bound" => &mut s.known_bound,
        "knownMoment.change" => &mut s.known_change,
        "scheduled.limitMomentFall" => &mut s.limit_fall,
        "trajectory.turnChange" => &mut s.turn_change,
        "guarantee.sideslip" => &mut s.sideslip_domain,
        "period.feedback" => &mut s.period_feedback,
        "period.optimisation" => &mut s.period_optimisation,
        "delay" | "measurement.age" => {
            // Both are parts of the time from a measurement to its moment.
            s.delay += quantity(value)?;
            return Ok(());
        }
        _ => return set_other(s, name, value),
    };
    *place = quantity(value)?;
    Ok(())
}

fn set_other(s: &mut Settings, name: &str, value: &Value) -> Result<(), String> {
    match (name, value.as_str()) {
        ("constraints", Some("robust")) => s.constraints = Constraints::Robust,
        ("constraints", Some("paper")) => s.constraints = Constraints::Paper,
        ("initialState", Some("measured")) => s.initial_state = InitialState::Measured,
        ("initialState", Some("nominal")) => s.initial_state = InitialState::Nominal,
        ("initialState", Some("tube")) => s.initial_state = InitialState::Tube,
        ("guarantee.policy", Some("required")) => s.guarantee = Guarantee::Required,
        ("guarantee.policy", Some("bestEffort")) => s.guarantee = Guarantee::BestEffort,
        ("horizon" | "scheduled.disturbanceParts", _) => {
            let number = value.as_integer().and_then(|number| usize::try_from(number).ok());
            let number = number.ok_or("is no whole number")?;
            *(if name == "horizon" { &mut s.horizon } else { &mut s.disturbance_parts }) = number;
        }
        _ => {
            // No bound depends on these.
            let free = ["reference.", "weight.", "tube.", "bound.", "observer.", "solver", "plan."];
            let others = ["saturation", "achievedMoment.used", "trajectory.earthRate"];
            if !(free.iter().any(|prefix| name.starts_with(prefix)) || others.contains(&name)) {
                return Err(format!("{value} is not understood here"));
            }
        }
    }
    Ok(())
}
