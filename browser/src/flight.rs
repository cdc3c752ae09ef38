//! A flight of the loop: the master steps it, and its rows become signals and figures.

use crate::closed_loop::ClosedLoop;
use crate::error::Error;
use crate::fmu::Warnings;
use crate::signals::{COLUMNS, Row};
use crate::summary::{Limits, Message, Summary};
use fmi_master::master::{Failed, Sample, Watcher};
use vehicle::axes::{REPEATS, nearest};

/// Data that are collected during a flight.
struct Flight<'a> {
    summary: Summary,
    signals: &'a mut Vec<f64>,
    plans: &'a mut Vec<f64>,
    warnings: Warnings,
    lost_beyond: f64,
}

/// Flies the loop. `signals` gets a row of [`COLUMNS`] for each communication point, in SI units;
/// the last one repeats the responses of the step before. `plans` gets the variables that show a
/// plan ([`crate::signals::plan`]) whenever there is a new one.
///
/// # Errors
/// Says which parameter the FMUs refuse. If a step fails or the attitude is lost, the flight ends
/// there, and the summary says why.
pub fn fly(
    closed_loop: ClosedLoop,
    signals: &mut Vec<f64>,
    plans: &mut Vec<f64>,
) -> Result<Summary, Error> {
    let ClosedLoop { mut master, warnings, limits, guarantee, lost_beyond } = closed_loop;
    master.initialize()?;
    let limits = master.read(&limits)?;
    let limits = Limits { rate: limits[0], moment: limits[1] };
    let summary = Summary::new(limits, master.clock().step(), guarantee);
    signals.clear();
    plans.clear();
    signals.reserve((master.clock().ticks() as usize + 1) * COLUMNS.len());
    let mut flight = Flight { summary, signals, plans, warnings, lost_beyond };
    flight.summary.end = master.run(&mut flight).err();
    Ok(flight.summary)
}

impl Flight<'_> {
    /// Takes the variables that show the plan, of which the first says when it began.
    fn take_plan(&mut self, plan: &[f64]) {
        let last = self.plans.len().checked_sub(plan.len()).and_then(|at| self.plans.get(at));
        if last != plan.first() {
            self.plans.extend_from_slice(plan);
        }
    }
}

impl Watcher for Flight<'_> {
    type Error = Message;

    fn after(&mut self, sample: &Sample, outcome: Result<(), Failed>) -> Result<(), Message> {
        outcome?;
        let mut row: Row = [0.0; COLUMNS.len()];
        row[0] = sample.time;
        row[1..].iter_mut().zip(sample.values).for_each(|(place, value)| *place = *value);
        for i in (0..3).filter(|i| REPEATS[*i]) {
            row[7 + i] = nearest(row[7 + i], row[1 + i]);
        }
        let time = sample.time;
        let told = self.warnings.take().into_iter().map(|text| Message { time, text });
        self.summary.warnings.extend(told);
        let error = self.summary.take(&row, sample.last).to_degrees();
        self.signals.extend_from_slice(&row);
        self.take_plan(sample.values.get(COLUMNS.len() - 1..).unwrap_or_default());
        // An error that is not a number counts as lost, too.
        if error.is_nan() || error > self.lost_beyond {
            let text = format!("attitude lost: its error exceeds {} deg", self.lost_beyond);
            self.summary.lost = true;
            return Err(Message { time, text });
        }
        Ok(())
    }
}
