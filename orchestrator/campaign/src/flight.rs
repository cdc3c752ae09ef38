//! Flies cases one after the other with the same instances, which are reset between cases.

use crate::plan::Plan;
use crate::table::{CaseTable, Column, Values};
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::master::{Master, Observer, Sample};
use cosim::recorder::Format;
use cosim::system::{Opened, System};
use cosim::variation::SettingValue;
use cosim_report::metrics::Meters;
use cosim_report::panels::Panel;
use cosim_report::plot::Curves;
use fmu_import::description::VariableKind as Type;
use fmu_import::error::Error as Import;
use std::path::Path;

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CaseStatus {
    /// It reached its stop time.
    Completed,
    /// It broke a limit that ends cases, or an FMU ended it, which is no fault.
    Ended,
    /// It was lost, as the experiment defines it.
    Lost,
    /// An FMU failed.
    Failed,
}

impl CaseStatus {
    /// Every status, in the order of their severity.
    pub const ALL: [Self; 4] = [Self::Completed, Self::Ended, Self::Lost, Self::Failed];

    /// Returns the name of the status in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Ended => "ended",
            Self::Lost => "lost",
            Self::Failed => "failed",
        }
    }
}

/// Result of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Number of the case.
    pub case: u64,
    /// Values of the varied parameters.
    pub values: Vec<SettingValue>,
    /// Recorded numbers; `None` if a number has no value.
    pub numbers: Vec<Option<f64>>,
    /// Whether each limit was kept.
    pub limits_kept: Vec<bool>,
    /// How the case ended.
    pub status: CaseStatus,
    /// Simulated time that the case reached, s.
    pub time: f64,
    /// Reason why the case ended early, or an empty text.
    pub message: String,
}

/// Instances that fly one case after the other.
pub struct Flight<'a> {
    plan: &'a Plan,
    system: System,
    meters: Meters,
    master: Option<Master>,
    interrupt: &'a Interrupt,
    /// Whether instances are reset instead of created again.
    resets: bool,
    /// Limits that end a case: index among the limits, metric, and largest value.
    ends: Vec<(usize, String, f64)>,
}

impl<'a> Flight<'a> {
    /// Opens the FMUs of a plan.
    ///
    /// # Errors
    /// Returns an error if an archive cannot be opened.
    pub fn new(plan: &'a Plan, resets: bool, interrupt: &'a Interrupt) -> Result<Self, Error> {
        let mut system = plan.system(&mut Opened::default())?;
        let meters = Meters::new(&mut system)?.ending_when_lost();
        let ends = plan.campaign.limits.iter().enumerate().filter(|(_, limit)| limit.ends);
        let ends = ends.filter_map(|(index, limit)| {
            Some((index, limit.measure.get_ref().clone(), limit.at_most?))
        });
        Ok(Self { ends: ends.collect(), plan, system, meters, master: None, interrupt, resets })
    }

    /// Lets cases go on that break a limit.
    #[must_use]
    pub fn without_ends(mut self) -> Self {
        self.ends.clear();
        self
    }

    /// Returns the system whose cases are flown. Signals that are probed now are seen by observers.
    pub fn system(&mut self) -> &mut System {
        &mut self.system
    }

    /// Flies a case to its end and writes the files of a single run: the recorded variables and the
    /// plot.
    ///
    /// # Errors
    /// The errors are those of [`Self::fly`], and of files that cannot be written.
    pub fn keep(
        &mut self,
        case: u64,
        values: Vec<SettingValue>,
        folder: &Path,
        title: &str,
    ) -> Result<Row, Error> {
        let panels = Panel::resolve_all(&mut self.system)?;
        let mut recorder = self.system.recorder(folder, Format::Csv, false)?;
        let mut curves = Curves::new(panels, self.system.clock.ticks());
        let ends = std::mem::take(&mut self.ends);
        let row = self.fly_with(case, values, &mut [&mut recorder, &mut curves]);
        self.ends = ends;
        recorder.finish()?;
        curves.draw(&folder.join("plot.svg"), title)?;
        row
    }

    /// Flies the case with this number.
    ///
    /// # Errors
    /// Returns an error if the work was asked to end, or if the values of the case cannot be set.
    /// An FMU that fails is a result.
    pub fn fly(&mut self, case: u64) -> Result<Row, Error> {
        self.fly_with(case, self.plan.values(case)?, &mut [])
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
    ) -> Result<Row, Error> {
        let changes = self.plan.changes(&values);
        self.meters.reset();
        let started = match self.master.take().filter(|_| self.resets) {
            Some(mut master) => self.system.restart(&mut master, &changes).map(|()| master),
            None => self.system.start_varied(&changes, self.interrupt),
        };
        let (outcome, broken, time) = match started {
            Ok(mut master) => {
                let mut watch = Watch {
                    meters: &mut self.meters,
                    ends: &self.ends,
                    broken: None,
                    time: self.plan.span[0],
                };
                let mut observers: Vec<&mut dyn Observer> = Vec::with_capacity(1 + others.len());
                for other in others.iter_mut() {
                    observers.push(&mut **other);
                }
                // The watch comes last, because it may end the case.
                observers.push(&mut watch);
                let outcome = master.run(&mut observers);
                let Watch { broken, time, .. } = watch;
                // An instance that failed is not used again.
                if !matches!(outcome, Err(Error::Call { .. })) {
                    self.master = Some(master);
                }
                (outcome, broken, time)
            }
            Err(error) => (Err(error), None, self.plan.span[0]),
        };
        let (status, message) = match outcome {
            Ok(()) => (CaseStatus::Completed, String::new()),
            Err(Error::Lost { .. }) if broken.is_some() => {
                let limit = broken.map(|index| self.plan.campaign.limits[index].id.as_str());
                (CaseStatus::Ended, format!("limit {} broken", limit.unwrap_or_default()))
            }
            Err(error @ Error::Lost { .. }) => (CaseStatus::Lost, error.to_string()),
            Err(error @ Error::EndedByInstance { .. }) => (CaseStatus::Ended, error.to_string()),
            Err(error @ (Error::Call { .. } | Error::Import(Import::Fmu { .. }))) => {
                (CaseStatus::Failed, error.to_string())
            }
            Err(error) => return Err(error),
        };
        let metrics = self.meters.metrics();
        let numbers: Vec<Option<f64>> =
            self.plan.recorded.iter().map(|recorded| metrics.number(&recorded.name)).collect();
        let limits_kept = self.plan.limits().map(|(limit, place)| {
            let measure = &self.plan.recorded[place];
            let number = numbers[place].or(measure.is_never.then_some(f64::INFINITY));
            let within = number.is_some_and(|number| {
                limit.at_most.is_none_or(|most| number <= most)
                    && limit.at_least.is_none_or(|least| number >= least)
            });
            // Whether a case that ended early would have kept its other limits is not known: it
            // counts as breaking them.
            within && status == CaseStatus::Completed
        });
        Ok(Row { case, values, limits_kept: limits_kept.collect(), numbers, status, time, message })
    }
}

/// Measures a case, and ends it as soon as it breaks a limit that ends cases.
struct Watch<'a> {
    meters: &'a mut Meters,
    ends: &'a [(usize, String, f64)],
    broken: Option<usize>,
    time: f64,
}

impl Observer for Watch<'_> {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        self.time = sample.time;
        self.meters.observe(sample)?;
        for (index, name, most) in self.ends {
            // A value that is not a number is not within the limit.
            let is_within = self.meters.number(name).is_none_or(|number| number <= *most);
            if !is_within {
                self.broken = Some(*index);
                let (what, reason) = (name.clone(), String::new());
                return Err(Error::Lost { what, time: sample.time, reason });
            }
        }
        Ok(())
    }
}

/// Makes a table of rows.
pub fn table(plan: &Plan, rows: &[Row]) -> CaseTable {
    let mut columns = vec![Column {
        name: "case".into(),
        values: Values::Count(rows.iter().map(|row| row.case.cast_signed()).collect()),
    }];
    for (place, varied) in plan.varied.iter().enumerate() {
        let values = rows.iter().map(|row| &row.values[place]);
        columns.push(Column { name: varied.name.clone(), values: typed(&varied.kind, values) });
    }
    for (place, recorded) in plan.recorded.iter().enumerate() {
        let values = rows.iter().map(|row| row.numbers[place]).collect();
        columns.push(Column { name: recorded.name.clone(), values: Values::Optional(values) });
    }
    for (place, limit) in plan.campaign.limits.iter().enumerate() {
        let values = rows.iter().map(|row| row.limits_kept[place]).collect();
        columns.push(Column { name: kept_column(&limit.id), values: Values::Flag(values) });
    }
    let text = |text: fn(&Row) -> String| Values::Text(rows.iter().map(text).collect());
    columns.push(Column { name: "status".into(), values: text(|row| row.status.name().into()) });
    let times = rows.iter().map(|row| row.time).collect();
    columns.push(Column { name: "time".into(), values: Values::Real(times) });
    columns.push(Column { name: "message".into(), values: text(|row| row.message.clone()) });
    CaseTable { columns }
}

/// Returns the name of the column that says whether a limit was kept.
pub fn kept_column(limit: &str) -> String {
    format!("kept.{limit}")
}

fn typed<'a>(kind: &Type, values: impl Iterator<Item = &'a SettingValue>) -> Values {
    match kind {
        Type::Real { .. } => Values::Real(
            values
                .map(|value| if let SettingValue::Real(value) = value { *value } else { f64::NAN })
                .collect(),
        ),
        Type::Integer { .. } => Values::Integer(
            values
                .map(|value| if let SettingValue::Integer(value) = value { *value } else { 0 })
                .collect(),
        ),
        Type::Boolean => {
            Values::Flag(values.map(|value| matches!(value, SettingValue::Boolean(true))).collect())
        }
        Type::Enumeration { .. } | Type::String => Values::Text(
            values
                .map(|value| match value {
                    SettingValue::Item(text, _) | SettingValue::Text(text) => text.clone(),
                    _ => String::new(),
                })
                .collect(),
        ),
    }
}

/// Returns whether instances can be reset: a case that is flown with instances that were reset
/// after another case gives the same result as with new ones.
///
/// # Errors
/// The errors are those of [`Flight::fly`].
pub fn can_reset(plan: &Plan, interrupt: &Interrupt) -> Result<bool, Error> {
    let mut flight = Flight::new(plan, true, interrupt)?;
    let first = flight.fly(0)?;
    flight.fly(1.min(plan.cases() - 1))?;
    Ok(flight.fly(0)? == first)
}
