//! Flies cases one after the other with the same instances, which are reset between cases.

use crate::cases::Sweep;
use crate::table::{Column, Values};
use cosim::error::Error;
use cosim::experiment::Margins;
use cosim::interrupt::Interrupt;
use cosim::run::{Observer, Run, Sample};
use cosim::system::{Opened, Parameters, System};
use cosim::variation::{SettingValue, Target};
use cosim_metrics::metrics::{Meters, Metrics};
use fmi_master::description::VariableKind as Type;
use fmu_import::fmu::Fmu;
use fmu_import::law;
use linear::linearise::{Linearised, Lineariser};
use linear::measures::{self, Measured};

/// Result of a case.
#[derive(Debug)]
pub struct Flown {
    /// Number of the case.
    pub case: u64,
    /// Values of the varied parameters.
    pub values: Vec<SettingValue>,
    /// Metrics of the case.
    pub metrics: Metrics,
    /// How the case ended. An error is an answer of an instance, or the end of a case that was lost.
    pub outcome: Result<(), Error>,
    /// Why the loop has no margins although the experiment asks for them, if it has none.
    pub without_margins: Option<Error>,
    /// Simulated time that the case reached, s.
    pub time: f64,
}

/// Instances that fly one case after the other.
pub struct Flight<'a> {
    sweep: &'a Sweep,
    system: System,
    meters: Meters,
    run: Option<Run>,
    interrupt: &'a Interrupt,
    /// Whether instances are reset instead of created again.
    resets: bool,
    /// Whether computing times of components are measured.
    times: bool,
    /// Linearisation of each case with its instances, if the experiment asks for margins.
    lineariser: Option<Lineariser>,
    linearised: Option<Run>,
    /// The loop of the last case, linearised.
    found: Option<Linearised>,
}

impl<'a> Flight<'a> {
    /// Prepares instances of the FMUs. Archives that are already in `opened` are not opened again.
    /// If `resets` is false, each case gets new instances.
    ///
    /// # Errors
    /// Returns an error if an archive cannot be opened.
    pub fn new(
        sweep: &'a Sweep,
        opened: &mut Opened,
        resets: bool,
        interrupt: &'a Interrupt,
    ) -> Result<Self, Error> {
        let mut system = sweep.system(opened)?;
        let meters = Meters::new(&mut system)?;
        let lineariser = match &system.experiment.observe.margins {
            Some(Margins { at, open }) => Some(Lineariser::new(sweep.system(opened)?, *at, open)?),
            None => None,
        };
        Ok(Self {
            sweep,
            system,
            meters,
            run: None,
            interrupt,
            resets,
            times: false,
            lineariser,
            linearised: None,
            found: None,
        })
    }

    /// Lets a case end as soon as it is lost.
    #[must_use]
    pub fn ending_when_lost(self) -> Self {
        Self { meters: self.meters.ending_when_lost(), ..self }
    }

    /// Measures the computing times of components.
    pub fn measure_times(&mut self) {
        self.times = true;
    }

    /// Returns the system whose cases are flown. Signals that are probed now are seen by observers.
    pub fn system(&mut self) -> &mut System {
        &mut self.system
    }

    /// Returns the parameters of all components in the last case.
    ///
    /// # Errors
    /// Returns an error if an instance does not give a value.
    pub fn parameters(&mut self) -> Result<Parameters, Error> {
        match &mut self.run {
            Some(run) => self.system.parameters(run),
            None => Ok(Parameters::default()),
        }
    }

    /// Returns the loop of the last case, linearised as the experiment asks.
    pub fn linearised(&self) -> Option<&Linearised> {
        self.found.as_ref()
    }

    /// Flies the case with this number, seen by further observers.
    ///
    /// # Errors
    /// Returns an error if the work was asked to end, or if the case could not be flown: a library
    /// that cannot be loaded, a process that is killed, uses too much memory or does not answer, a
    /// file that cannot be read. That an instance refuses the values of the case, or answers a call
    /// by a failure, is a result.
    pub fn fly(&mut self, case: u64, others: &mut [&mut dyn Observer]) -> Result<Flown, Error> {
        self.fly_with(case, self.sweep.values(case), others)
    }

    /// Flies a case with these values, seen by further observers.
    ///
    /// # Errors
    /// The errors are those of [`Self::fly`].
    pub fn fly_with(
        &mut self,
        case: u64,
        values: Vec<SettingValue>,
        others: &mut [&mut dyn Observer],
    ) -> Result<Flown, Error> {
        let changes = self.sweep.changes(&values);
        self.meters.reset(&self.system, &changes);
        let mut watch = Watch { meters: &mut self.meters, time: None };
        let mut observers: Vec<&mut dyn Observer> = Vec::with_capacity(1 + others.len());
        observers.extend(others.iter_mut().map(|other| &mut **other as &mut dyn Observer));
        // The watch comes last, because it may end the case.
        observers.push(&mut watch);
        let mut step_us = Vec::new();
        law::in_case(Some(case));
        let started = match self.run.take().filter(|_| self.resets) {
            Some(mut run) => self.system.restart(&mut run, &changes).map(|()| run),
            None => self.system.start_varied(&changes, self.interrupt),
        };
        let outcome = started.and_then(|mut run| {
            if self.times {
                run.measure_time();
            }
            let outcome = run.run(&mut observers);
            let times = run.step_seconds();
            step_us = times.map(|(name, seconds)| (name.to_string(), seconds * 1e6)).collect();
            // An instance that failed is not used again.
            if !matches!(outcome, Err(Error::Call { .. })) {
                self.run = Some(run);
            }
            outcome
        });
        drop(observers);
        let Watch { time, .. } = watch;
        let outcome = match outcome {
            Err(error) if !is_of_case(&error) => return Err(error),
            outcome => outcome,
        };
        let mut metrics = Metrics {
            step_us: step_us.into_iter().collect(),
            loop_delay_s: self.system.loop_delay(),
            ..self.meters.metrics()
        };
        let (margins, without_margins) = self.margins(&changes)?;
        metrics.asked.extend(margins);
        let time = time.unwrap_or(self.sweep.span[0]);
        Ok(Flown { case, values, metrics, outcome, without_margins, time })
    }
}

impl Flight<'_> {
    /// Computes the margins of a case with these changes, if the experiment asks for them. They
    /// have no value if an instance answers by a failure or has no linear model; then the second
    /// result is the reason.
    fn margins(
        &mut self,
        changes: &[(Target, SettingValue)],
    ) -> Result<(Measured, Option<Error>), Error> {
        let Some(lineariser) = &self.lineariser else { return Ok((Measured::new(), None)) };
        self.found = None;
        let system = lineariser.system();
        let started = match self.linearised.take().filter(|_| self.resets) {
            Some(mut run) => system.restart(&mut run, changes).map(|()| run),
            None => system.start_varied(changes, self.interrupt),
        };
        let found = started.and_then(|mut run| {
            let found = lineariser.linearise(&mut run);
            if found.is_ok() {
                self.linearised = Some(run);
            }
            found
        });
        match found {
            Ok(found) => Ok((measures::measure(self.found.insert(found)), None)),
            Err(error) if is_of_case(&error) => Ok((measures::none(), Some(error))),
            Err(error) => Err(error),
        }
    }
}

/// Returns whether an error is the result of a case. All other errors are independent of the case.
fn is_of_case(error: &Error) -> bool {
    match error {
        Error::Lost { .. } | Error::EndedByInstance { .. } => true,
        Error::Call { failure, .. } => failure.is_answer,
        _ => false,
    }
}

/// Measures a case, and notes its time.
struct Watch<'a> {
    meters: &'a mut Meters,
    /// Time of the last communication point, if there was any.
    time: Option<f64>,
}

impl Observer for Watch<'_> {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        self.time = Some(sample.time);
        self.meters.observe(sample)
    }
}

/// Returns the first columns of a table of cases: their numbers and the values that vary.
pub fn columns(sweep: &Sweep, cases: &[(u64, &[SettingValue])]) -> Vec<Column> {
    let mut columns = vec![Column {
        name: "case".into(),
        values: Values::Integer(cases.iter().map(|(case, _)| case.cast_signed()).collect()),
    }];
    for (place, varied) in sweep.varied.iter().enumerate() {
        let values = cases.iter().map(|(_, values)| &values[place]);
        columns.push(Column { name: varied.name.clone(), values: typed(&varied.kind, values) });
    }
    columns
}

fn typed<'a>(kind: &Type, values: impl Iterator<Item = &'a SettingValue>) -> Values {
    let values = values.map(SettingValue::to_json);
    match kind {
        Type::Real { .. } => Values::Real(values.map(|value| value.as_f64()).collect()),
        Type::Integer { .. } => {
            Values::Integer(values.map(|value| value.as_i64().unwrap_or(0)).collect())
        }
        Type::Boolean => Values::Flag(values.map(|value| value == true).collect()),
        _ => Values::Text(values.map(|value| value.as_str().unwrap_or_default().into()).collect()),
    }
}

/// Returns whether instances can be reset: a case that is flown with instances that were reset
/// after another case gives the same result as with new ones. This is tried once.
///
/// # Errors
/// The errors are those of [`Flight::fly`] for the first case.
pub fn can_reset(sweep: &Sweep, opened: &mut Opened, interrupt: &Interrupt) -> Result<bool, Error> {
    let mut known = sweep.resets.lock();
    let resets = match *known {
        Some(resets) => return Ok(resets),
        None => try_to_reset(sweep, opened, interrupt)?,
    };
    if !resets {
        tracing::warn!(
            "a case gave another result after fmi2Reset than with a new instance: each case gets new instances"
        );
    }
    *known = Some(resets);
    Ok(resets)
}

fn try_to_reset(sweep: &Sweep, opened: &mut Opened, interrupt: &Interrupt) -> Result<bool, Error> {
    if sweep.experiment().law.is_some() {
        // A trial would ask the law for flights that nobody requested.
        let components = sweep.system(opened)?.components;
        let resets = |fmu: &Fmu| fmu.is_made_by_fmu_pack() || fmu.is_lookup_table();
        return Ok(components.iter().all(|component| resets(&component.fmu)));
    }
    let mut flight = Flight::new(sweep, opened, true, interrupt)?;
    let mut result = |case| {
        let flown = flight.fly(case, &mut [])?;
        let reason = flown.outcome.err().map(|error| error.to_string());
        let metrics = flown.metrics.without_times(&sweep.experiment().observe);
        Ok::<_, Error>((reason, metrics, flown.time))
    };
    let first = result(0)?;
    match result(1.min(sweep.cases() - 1)).and_then(|_| result(0)) {
        Ok(again) => Ok(again == first),
        // A library may have no function for it.
        Err(Error::Call { .. }) => Ok(false),
        Err(error) => Err(error),
    }
}
