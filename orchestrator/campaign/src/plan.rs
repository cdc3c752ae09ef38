//! A campaign that is ready to be flown: all names are looked up, and every parameter that varies
//! has its distribution.

use crate::definition::{Campaign, Kind, Limit, Vary};
use crate::design::{Design, Place};
use crate::law::Law;
use crate::table::hex;
use cosim::check::check;
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{self, Experiment, Observe, Overrides};
use cosim::search;
use cosim::system::{Opened, System};
use cosim::variation::{SettingValue, Target};
use cosim_report::metrics::{Meters, Metrics};
use fmu_import::description::Kind as Type;
use fmu_import::names;
use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Version of the files of parts, which must be raised when their content changes.
const FORMAT: u32 = 1;
/// Metrics of every run that are those of the machine, not of the case.
const OF_THE_MACHINE: [&str; 2] = ["real_time_factor", "wall_s"];

/// A parameter that varies, or several that always have the same value.
#[derive(Clone, Debug)]
pub struct Varied {
    /// Name of the first parameter, `component.parameter`, which is that of the column.
    pub name: String,
    /// Unit of the values, or an empty text.
    pub unit: String,
    /// Type of the values.
    pub kind: Type,
    /// Distribution of the values.
    pub law: Law,
    targets: Vec<Target>,
    paths: Vec<String>,
}

/// A number that is recorded of each case.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Name of the metric or measure.
    pub name: String,
    /// Unit of the number, or an empty text.
    pub unit: String,
    /// Whether a missing value means that something never happened, as with a settling time.
    pub is_never: bool,
}

/// A campaign that is ready to be flown.
pub struct Plan {
    /// The campaign as its file describes it.
    pub campaign: Campaign,
    /// What varies, in the order of the design's dimensions.
    pub varied: Vec<Varied>,
    /// Numbers that are recorded of each case.
    pub recorded: Vec<Recorded>,
    /// Places of the cases.
    pub design: Design,
    /// Hashes of all that the cases depend on, by what it is.
    pub keys: BTreeMap<String, String>,
    /// Display of the campaign's time, s: from start to stop.
    pub span: [f64; 2],
    experiment: Experiment,
    fmu_dirs: Vec<PathBuf>,
    correlation: Option<Correlated>,
}

/// Parameters that are correlated: their dimensions, and the Cholesky factor of the correlation of
/// their normal scores, row by row.
struct Correlated {
    dimensions: Vec<usize>,
    factor: Vec<Vec<f64>>,
}

impl Plan {
    /// Prepares a campaign.
    ///
    /// # Errors
    /// Returns an error that names the key at fault, with its line and the nearest right name.
    pub fn new(campaign: Campaign, fmu_dirs: &[PathBuf]) -> Result<Self, Error> {
        let mut experiment = experiment(&campaign)?;
        experiment.observe = observe(&campaign, &experiment.observe)?;
        let fmu_dirs = fmu_dirs.to_vec();
        let mut opened = Opened::default();
        let mut system = check(experiment.clone(), &fmu_dirs, &mut opened)?;
        let mut varied = Vec::new();
        for vary in &campaign.vary {
            varied.extend(laws(vary, &campaign.source, &system)?);
        }
        for (i, own) in varied.iter().enumerate() {
            let twice = own.paths.iter().find(|path| {
                varied[..i].iter().any(|other: &Varied| other.paths.contains(path))
                    || own.paths.iter().filter(|other| other == path).count() > 1
            });
            if let Some(path) = twice {
                let message = format!("[[vary]] \"{path}\" varies twice");
                return Err(campaign.source.error(&(0..0), message));
            }
        }
        let correlation = correlation(&campaign, &varied)?;
        let levels = varied.iter().map(|own| {
            let fault = |problem| {
                campaign.source.error(&(0..0), format!("[[vary]] \"{}\": {problem}", own.name))
            };
            match campaign.design {
                Kind::Factorial => own.law.levels().map_err(fault),
                Kind::Corners => own.law.check_ends().map(|()| 0).map_err(fault),
                Kind::Sensitivity if !own.law.is_ordered() && !own.law.is_counted() => Ok(0),
                _ => Ok(0),
            }
        });
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        let design = Design::new(campaign.design, campaign.seed, campaign.cases, levels)
            .map_err(|problem| campaign.source.error(&(0..0), problem))?;
        let meters = Meters::new(&mut system)?;
        let recorded = recorded(&campaign, &system.experiment.observe, &meters);
        let keys = keys(&campaign, &system)?;
        let span = [system.clock.start(), system.clock.stop()];
        let plan = Self {
            campaign,
            varied,
            recorded,
            design,
            keys,
            span,
            experiment,
            fmu_dirs,
            correlation,
        };
        plan.check_limits()?;
        Ok(plan)
    }

    /// Returns the number of cases.
    pub fn cases(&self) -> u64 {
        self.design.cases()
    }

    /// Returns the experiment of all cases, in which nothing varies.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Makes a system of the experiment. Archives that are already in `opened` are not opened again.
    ///
    /// # Errors
    /// Returns an error if the experiment or an archive is faulty.
    pub fn system(&self, opened: &mut Opened) -> Result<System, Error> {
        check(self.experiment.clone(), &self.fmu_dirs, opened)
    }

    /// Returns the values of a case, one for each entry of [`Self::varied`].
    ///
    /// # Errors
    /// Returns an error if a value cannot be that of its parameter.
    pub fn values(&self, case: u64) -> Result<Vec<SettingValue>, Error> {
        self.values_at(&self.design.place(case), case)
    }

    /// Returns the values at a place for the case with this number.
    ///
    /// # Errors
    /// Returns an error if a value cannot be that of its parameter.
    pub fn values_at(&self, places: &[Place], case: u64) -> Result<Vec<SettingValue>, Error> {
        let mut places = places.to_vec();
        if let Some(correlated) = &self.correlation {
            correlated.apply(&mut places);
        }
        let values = self.varied.iter().zip(places).map(|(own, place)| {
            own.law.value(place, case).map_err(|problem| {
                let message = format!("[[vary]] \"{}\", case {case}: {problem}", own.name);
                self.campaign.source.error(&(0..0), message)
            })
        });
        values.collect()
    }

    /// Returns the changes that these values make to the system.
    pub fn changes(&self, values: &[SettingValue]) -> Vec<(Target, SettingValue)> {
        let each = self.varied.iter().zip(values);
        each.flat_map(|(own, value)| own.targets.iter().map(|target| (*target, value.clone())))
            .collect()
    }

    /// Writes a case as the text of an experiment that extends the one of the campaign.
    ///
    /// # Errors
    /// Returns an error if the text cannot be written as TOML.
    pub fn experiment_of(&self, title: &str, values: &[SettingValue]) -> Result<String, Error> {
        let mut table: toml::Table = toml::from_str(self.experiment.source.whole())
            .map_err(|error| Error::experiment(error.to_string()))?;
        table.remove("extends");
        table.remove("unset");
        table.insert("title".into(), title.into());
        let components = table.entry("components").or_insert_with(|| toml::Table::new().into());
        for (name, component) in &self.experiment.components {
            let own = components.as_table_mut().and_then(|all| all.get_mut(name));
            let Some(own) = own.and_then(toml::Value::as_table_mut) else { continue };
            own.insert("fmu".into(), component.fmu.get_ref().clone().into());
            let parameters = component.parameters.iter();
            let mut parameters: toml::Table =
                parameters.map(|(name, value)| (name.clone(), value.get_ref().clone())).collect();
            for (varied, value) in self.varied.iter().zip(values) {
                for path in &varied.paths {
                    if let Some((_, rest)) = names::split(path).filter(|(of, _)| of == name) {
                        parameters.insert(rest.into(), written(value));
                    }
                }
            }
            own.insert("parameters".into(), parameters.into());
        }
        toml::to_string(&table).map_err(|error| Error::experiment(error.to_string()))
    }

    /// Returns the limits with the position of their measure in [`Self::recorded`].
    pub fn limits(&self) -> impl Iterator<Item = (&Limit, usize)> {
        let place = |limit: &Limit| {
            self.recorded.iter().position(|own| own.name == *limit.measure.get_ref())
        };
        self.campaign.limits.iter().filter_map(move |limit| Some((limit, place(limit)?)))
    }

    /// Returns units by column, as JSON for the metadata of a table.
    pub fn units(&self) -> String {
        let varied = self.varied.iter().map(|own| (&own.name, &own.unit));
        let recorded = self.recorded.iter().map(|own| (&own.name, &own.unit));
        let units = varied.chain(recorded).filter(|(_, unit)| !unit.is_empty());
        let mut units: Map<String, Value> =
            units.map(|(name, unit)| (name.clone(), json!(unit))).collect();
        units.insert("time".into(), json!("s"));
        Value::Object(units).to_string()
    }

    fn check_limits(&self) -> Result<(), Error> {
        let names = || self.recorded.iter().map(|own| own.name.as_str());
        let source = &self.campaign.source;
        let referred = self
            .campaign
            .limits
            .iter()
            .map(|limit| &limit.measure)
            .chain(&self.campaign.keep.by)
            .chain(self.campaign.search.as_ref().map(|search| &search.largest));
        source.known(referred, "metric or measure", names())?;
        for limit in self.campaign.limits.iter().filter(|limit| limit.ends) {
            let measure = self.experiment.observe.metrics.get(limit.measure.get_ref());
            if measure.is_none_or(|measure| measure.kind != experiment::Kind::Largest) {
                let message = format!(
                    "[[limit]] {}: ends needs a measure of the kind largest, which only grows",
                    limit.id
                );
                return Err(source.error(&limit.measure.span(), message));
            }
        }
        Ok(())
    }
}

impl Correlated {
    /// Replaces the quantiles of the correlated dimensions. Corners and levels stay.
    fn apply(&self, places: &mut [Place]) {
        let Ok(normal) = Normal::new(0.0, 1.0) else { return };
        let scores = self.dimensions.iter().map(|dimension| match places[*dimension] {
            Place::Quantile(unit) => {
                Some(normal.inverse_cdf(unit.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0)))
            }
            _ => None,
        });
        let Some(scores) = scores.collect::<Option<Vec<f64>>>() else { return };
        for (dimension, row) in self.dimensions.iter().zip(&self.factor) {
            let score: f64 = row.iter().zip(&scores).map(|(factor, score)| factor * score).sum();
            places[*dimension] = Place::Quantile(normal.cdf(score).min(1.0 - f64::EPSILON / 2.0));
        }
    }
}

/// Reads the experiment of a campaign, with what the campaign sets in it.
fn experiment(campaign: &Campaign) -> Result<Experiment, Error> {
    let source = &campaign.source;
    let span = campaign.experiment.span();
    let beside = source.beside(campaign.experiment.get_ref());
    let path = if beside.is_file() {
        beside
    } else {
        search::experiment(campaign.experiment.get_ref())
            .map_err(|error| source.error(&span, error.to_string()))?
    };
    let mut experiment = Experiment::load(&path)?;
    let mut overrides = Overrides::default();
    for (component, fmu) in &campaign.fmu {
        let beside = source.beside(fmu);
        let file = if beside.is_file() { beside } else { fmu.clone() };
        overrides.fmu.push(format!("{component}={}", file.display()));
    }
    experiment.apply(&overrides)?;
    for name in &campaign.unset {
        let outcome = experiment.unset(name.get_ref());
        outcome.map_err(|problem| source.error(&name.span(), format!("unset: {problem}")))?;
    }
    for (name, value) in &campaign.set {
        let outcome = experiment.set(name, value.get_ref().clone());
        outcome.map_err(|problem| source.error(&value.span(), format!("[set] {problem}")))?;
    }
    Ok(experiment)
}

/// Returns what is observed of each case: the metrics that the campaign names and its measures.
fn observe(campaign: &Campaign, own: &Observe) -> Result<Observe, Error> {
    let source = &campaign.source;
    let mut signals = own.signals.clone();
    signals.extend(campaign.signals.clone());
    let known = Metrics::names(own);
    let known = || known.iter().map(String::as_str).filter(|name| !OF_THE_MACHINE.contains(name));
    source.known(&campaign.metrics, "metric of the experiment", known())?;
    let mut metrics = BTreeMap::new();
    for name in &campaign.metrics {
        let Some(measure) = own.metrics.get(name.get_ref()) else { continue };
        if measure.timing {
            let message = format!(
                "metrics: \"{}\" is a computing time, which differs from run to run",
                name.get_ref()
            );
            return Err(source.error(&name.span(), message));
        }
        metrics.insert(name.get_ref().clone(), measure.clone());
    }
    for measure in &campaign.measures {
        source.known([&measure.signals], "list of signals", signals.keys().map(String::as_str))?;
        let mut measure = measure.clone();
        let id = std::mem::take(&mut measure.id);
        if metrics.contains_key(&id) || known().any(|name| name == id) {
            let message = format!("[[measure]] {id}: the experiment has a metric of this name");
            return Err(source.error(&measure.signals.span(), message));
        }
        metrics.insert(id, measure);
    }
    for measure in metrics.values_mut() {
        measure.limit = None;
    }
    let asks_guarantee =
        campaign.metrics.iter().any(|name| !own.metrics.contains_key(name.get_ref()));
    Ok(Observe {
        signals,
        metrics,
        summary: Vec::new(),
        guarantee: own.guarantee.clone().filter(|_| asks_guarantee),
        loss: own.loss.clone(),
        panels: own.panels.clone(),
        readings: BTreeMap::new(),
    })
}

/// Makes the distributions of one entry of what varies.
fn laws(vary: &Vary, source: &Source, system: &System) -> Result<Vec<Varied>, Error> {
    let mut groups: Vec<(std::ops::Range<usize>, Vec<String>)> = Vec::new();
    if let Some(parameter) = &vary.parameter {
        groups.push((parameter.span(), parameter.get_ref().all().to_vec()));
    }
    groups.extend(vary.each.iter().map(|name| (name.span(), vec![name.get_ref().clone()])));
    let both = vary.parameter.is_some() && !vary.each.is_empty();
    if groups.is_empty() || both || groups.iter().any(|(_, names)| names.is_empty()) {
        let span = groups.first().map_or(0..0, |(span, _)| span.clone());
        return Err(source.error(&span, "[[vary]] wants either parameter or each"));
    }
    let mut all = Vec::new();
    for (span, paths) in groups {
        let name = paths[0].clone();
        let fault =
            |problem: String| source.error(&span, format!("[[vary]] \"{name}\": {problem}"));
        let targets = paths.iter().map(|path| {
            system
                .target(path)
                .map_err(|problem| source.error(&span, format!("[[vary]] \"{path}\": {problem}")))
        });
        let targets = targets.collect::<Result<Vec<_>, _>>()?;
        let variable = system.variable(targets[0]);
        for other in &targets[1..] {
            if system.variable(*other).kind.name() != variable.kind.name() {
                return Err(fault("parameters with the same value must be of one type".into()));
            }
        }
        let law = Law::new(vary, targets[0], system).map_err(&fault)?;
        let unit = match &variable.kind {
            Type::Real { unit, .. } => unit.clone().unwrap_or_default(),
            _ => String::new(),
        };
        all.push(Varied {
            name: name.clone(),
            unit,
            kind: variable.kind.clone(),
            law,
            targets,
            paths,
        });
    }
    Ok(all)
}

/// Reads the correlations of a campaign.
fn correlation(campaign: &Campaign, varied: &[Varied]) -> Result<Option<Correlated>, Error> {
    let source = &campaign.source;
    let mut dimensions: Vec<usize> = Vec::new();
    let mut entries = Vec::new();
    for correlation in &campaign.correlations {
        let span = correlation.between.span();
        let fault = |problem: String| source.error(&span, format!("[[correlation]] {problem}"));
        let mut pair = [0; 2];
        for (place, name) in pair.iter_mut().zip(correlation.between.get_ref()) {
            let known = varied.iter().map(|own| own.name.as_str());
            source.known(
                [&Spanned::new(span.clone(), name.clone())],
                "parameter that varies",
                known,
            )?;
            let dimension = varied.iter().position(|own| own.name == *name).unwrap_or(0);
            if !varied[dimension].law.is_ordered() {
                return Err(fault(format!("\"{name}\" has no order that could be correlated")));
            }
            if !dimensions.contains(&dimension) {
                dimensions.push(dimension);
            }
            *place = dimensions.iter().position(|known| *known == dimension).unwrap_or(0);
        }
        let coefficient = correlation.coefficient;
        if pair[0] == pair[1] || !(coefficient > -1.0 && coefficient < 1.0) {
            return Err(fault(format!(
                "coefficient = {coefficient}: of two parameters, above -1 and below 1"
            )));
        }
        entries.push((pair, coefficient));
    }
    if entries.is_empty() {
        return Ok(None);
    }
    let mut matrix = vec![vec![0.0; dimensions.len()]; dimensions.len()];
    matrix.iter_mut().enumerate().for_each(|(i, row)| row[i] = 1.0);
    for ([i, j], coefficient) in entries {
        (matrix[i][j], matrix[j][i]) = (coefficient, coefficient);
    }
    let factor = cholesky(&matrix).ok_or_else(|| {
        source.error(&(0..0), "[[correlation]] no parameters can be correlated like this: the matrix of the coefficients is not positive definite")
    })?;
    Ok(Some(Correlated { dimensions, factor }))
}

/// Returns the lower triangular factor of a symmetric matrix, row by row; `None` if the matrix is not
/// positive definite. (`nalgebra` is built without matrices of any size here, so that the units
/// compute the same everywhere.)
fn cholesky(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut factor: Vec<Vec<f64>> = Vec::new();
    for (i, row) in matrix.iter().enumerate() {
        let mut own: Vec<f64> = Vec::new();
        for j in 0..=i {
            let other = factor.get(j).unwrap_or(&own);
            let rest = row[j] - own.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            let entry = if i == j { rest.sqrt() } else { rest / other[j] };
            if !entry.is_finite() || i == j && entry <= 0.0 {
                return None;
            }
            own.push(entry);
        }
        factor.push(own);
    }
    Some(factor)
}

/// Lists the numbers that are recorded: the metrics in the order of the file, then the measures.
fn recorded(campaign: &Campaign, observe: &Observe, meters: &Meters) -> Vec<Recorded> {
    let units = meters.metrics().units;
    let names = campaign.metrics.iter().map(|name| name.get_ref().clone());
    let names = names.chain(campaign.measures.iter().map(|measure| measure.id.clone()));
    names
        .map(|name| Recorded {
            unit: units.get(&name).cloned().unwrap_or_default(),
            is_never: observe.metrics.get(&name).is_some_and(|measure| {
                matches!(measure.kind, experiment::Kind::Settling | experiment::Kind::Leaving)
            }),
            name,
        })
        .collect()
}

/// Hashes what the cases depend on.
fn keys(campaign: &Campaign, system: &System) -> Result<BTreeMap<String, String>, Error> {
    let digest = |bytes: &[u8]| hex(&Sha256::digest(bytes));
    let mut own: toml::Table = toml::from_str(campaign.source.whole())
        .map_err(|error| campaign.source.error(&(0..0), error.to_string()))?;
    // These change neither the cases nor what is recorded of them. Experiment and FMUs count by their
    // content, wherever they are.
    for key in ["title", "description", "extends", "experiment", "fmu", "until", "keep", "search"] {
        own.remove(key);
    }
    if campaign.design != Kind::LatinHypercube && campaign.design != Kind::Corners {
        own.remove("cases");
    }
    let own = toml::to_string(&own).map_err(|error| Error::experiment(error.to_string()))?;
    let mut keys = BTreeMap::from([
        ("campaign".to_string(), digest(own.as_bytes())),
        ("experiment".to_string(), digest(system.experiment.source.whole().as_bytes())),
        ("program".to_string(), format!("{} {FORMAT}", env!("CARGO_PKG_VERSION"))),
    ]);
    for (name, fmu) in system.order.iter().zip(&system.fmus) {
        let bytes = fs::read(&fmu.path).map_err(Error::file(&fmu.path))?;
        keys.insert(format!("FMU of {name}"), digest(&bytes));
    }
    Ok(keys)
}

/// Converts a value to TOML.
fn written(value: &SettingValue) -> toml::Value {
    match value {
        SettingValue::Real(value) => (*value).into(),
        SettingValue::Integer(value) => (*value).into(),
        SettingValue::Boolean(value) => (*value).into(),
        SettingValue::Item(text, _) | SettingValue::Text(text) => text.as_str().into(),
    }
}

/// Finds the campaign with this name: a file, or one below the campaigns of the experiments.
///
/// # Errors
/// Returns an error if there is no such campaign.
pub fn find(name: &Path) -> Result<PathBuf, Error> {
    if name.is_file() {
        return Ok(name.to_path_buf());
    }
    let folders = || search::experiments().into_iter().map(|root| root.join("campaigns"));
    let file = name.with_extension("toml");
    if let Some(path) = folders().map(|folder| folder.join(&file)).find(|path| path.is_file()) {
        return Ok(path);
    }
    let there: Vec<String> = folders()
        .flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten())
        .filter_map(|entry| Some(entry.path().file_stem()?.to_string_lossy().into_owned()))
        .collect();
    let hint = names::hint(&name.to_string_lossy(), there.iter().map(String::as_str));
    Err(Error::experiment(format!(
        "there is no campaign \"{}\", neither as a file nor among the experiments' campaigns{hint}",
        name.display()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_cholesky_by_hand() {
        let factor =
            cholesky(&[vec![4.0, 2.0, 2.0], vec![2.0, 10.0, 4.0], vec![2.0, 4.0, 6.0]]).unwrap();
        assert_eq!(factor[0], [2.0]);
        assert_eq!(factor[1], [1.0, 3.0]);
        assert_eq!(factor[2], [1.0, 1.0, 2.0]);
        assert!(cholesky(&[vec![1.0, 2.0], vec![2.0, 1.0]]).is_none());
    }
}
