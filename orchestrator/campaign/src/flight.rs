//! Flies cases one after the other with the same instances, which are reset between cases.

use crate::definition::kept_column;
use crate::plan::Plan;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::system::Opened;
use cosim::variation::SettingValue;
use serde::{Deserialize, Serialize};
use sweep::flight::{Flown, columns};
use sweep::table::{CaseTable, Column, Values};

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum CaseStatus {
    /// It reached its stop time.
    Completed,
    /// An FMU ended it, which is not a fault.
    Ended,
    /// It was lost, as the experiment defines it.
    Lost,
    /// An FMU failed.
    Failed,
}

impl CaseStatus {
    /// Every status, in the order of their severity.
    pub(crate) const ALL: [Self; 4] = [Self::Completed, Self::Ended, Self::Lost, Self::Failed];

    /// Returns the name of the status in tables.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Ended => "ended",
            Self::Lost => "lost",
            Self::Failed => "failed",
        }
    }
}

/// Result of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
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
pub(crate) struct Flight<'a> {
    plan: &'a Plan,
    instances: sweep::flight::Flight<'a>,
}

impl<'a> Flight<'a> {
    /// Opens the FMUs of a plan.
    ///
    /// # Errors
    /// Returns an error if an archive cannot be opened.
    pub(crate) fn new(
        plan: &'a Plan,
        resets: bool,
        interrupt: &'a Interrupt,
    ) -> Result<Self, Error> {
        let flight =
            sweep::flight::Flight::new(&plan.sweep, &mut Opened::default(), resets, interrupt)?;
        Ok(Self { plan, instances: flight.ending_when_lost() })
    }

    /// Flies the case with this number.
    ///
    /// # Errors
    /// The errors are those of [`sweep::flight::Flight::fly`].
    pub(crate) fn fly(&mut self, case: u64) -> Result<Row, Error> {
        self.fly_with(case, self.plan.sweep.values(case))
    }

    /// Flies a case with these values.
    ///
    /// # Errors
    /// The errors are those of [`Self::fly`].
    pub(crate) fn fly_with(&mut self, case: u64, values: Vec<SettingValue>) -> Result<Row, Error> {
        let Flown { case, values, metrics, outcome, without_margins, time } =
            self.instances.fly_with(case, values, &mut [])?;
        let outcome = outcome.and(without_margins.map_or(Ok(()), Err));
        let status = match &outcome {
            Ok(()) => CaseStatus::Completed,
            Err(Error::Lost { .. }) => CaseStatus::Lost,
            Err(Error::EndedByInstance { .. }) => CaseStatus::Ended,
            Err(_) => CaseStatus::Failed,
        };
        let message = outcome.err().map(|error| error.to_string()).unwrap_or_default();
        let numbers: Vec<Option<f64>> =
            self.plan.recorded.iter().map(|recorded| metrics.number(&recorded.name)).collect();
        let limits_kept = self.plan.limits().map(|(limit, place)| {
            let number = numbers[place].or(self.plan.recorded[place].missing);
            // Whether a case that ended early would have kept its other limits is not known: it
            // counts as breaking them.
            number.is_some_and(|number| limit.is_kept(number)) && status == CaseStatus::Completed
        });
        Ok(Row { case, values, limits_kept: limits_kept.collect(), numbers, status, time, message })
    }
}

/// Makes a table of rows.
pub(crate) fn table(plan: &Plan, rows: &[Row]) -> CaseTable {
    let cases: Vec<_> = rows.iter().map(|row| (row.case, row.values.as_slice())).collect();
    let mut columns = columns(&plan.sweep, &cases);
    for (place, recorded) in plan.recorded.iter().enumerate() {
        let values = rows.iter().map(|row| row.numbers[place]).collect();
        columns.push(Column { name: recorded.name.clone(), values: Values::Real(values) });
    }
    for (place, limit) in plan.campaign.limits.iter().enumerate() {
        let values = rows.iter().map(|row| row.limits_kept[place]).collect();
        columns.push(Column { name: kept_column(&limit.id), values: Values::Flag(values) });
    }
    let text = |text: fn(&Row) -> String| Values::Text(rows.iter().map(text).collect());
    columns.push(Column { name: "status".into(), values: text(|row| row.status.name().into()) });
    let times = rows.iter().map(|row| Some(row.time)).collect();
    columns.push(Column { name: "time".into(), values: Values::Real(times) });
    columns.push(Column { name: "message".into(), values: text(|row| row.message.clone()) });
    CaseTable { columns }
}
