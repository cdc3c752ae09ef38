//! A flight of the loop: the master steps it, and its rows become signals and figures.

use crate::closed_loop::ClosedLoop;
use crate::error::Error;
use crate::fmu::Warnings;
use crate::scenario::Scenario;
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
    scenario: &'static Scenario,
    /// Values of all columns at a communication point.
    row: Vec<f64>,
    /// Time of the last recorded row, s.
    recorded: Option<f64>,
}

/// Flies the loop. `signals` gets a row of the scenario's columns for each communication point, or
/// for every so many, in SI units; the last one repeats the responses of the step before. `plans`
/// gets the variables that show a plan ([`crate::signals::plan`]) whenever there is a new one.
///
/// # Errors
/// Says which parameter the FMUs refuse. If a step fails or the attitude is lost, the flight ends
/// there, and the summary says why.
pub fn fly(
    closed_loop: ClosedLoop,
    signals: &mut Vec<f64>,
    plans: &mut Vec<f64>,
) -> Result<Summary, Error> {
    let ClosedLoop { mut master, warnings, limits, guarantee, lost_beyond, scenario } = closed_loop;
    master.initialize()?;
    let limits = master.read(&limits)?;
    let limits = Limits { rate: limits[0], moment: limits[1] };
    let summary = Summary::new(limits, master.clock().step(), guarantee);
    signals.clear();
    plans.clear();
    let row = vec![0.0; scenario.columns.len()];
    let mut flight =
        Flight { summary, signals, plans, warnings, lost_beyond, scenario, row, recorded: None };
    flight.summary.end = master.run(&mut flight).err();
    // The last communication point is recorded, too.
    if flight.summary.rows > 0 && flight.recorded != Some(flight.row[0]) {
        flight.signals.extend_from_slice(&flight.row);
    }
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
        let Self { row, .. } = self;
        row[0] = sample.time;
        row[1..].iter_mut().zip(sample.values).for_each(|(place, value)| *place = *value);
        for i in (0..3).filter(|i| REPEATS[*i]) {
            row[7 + i] = nearest(row[7 + i], row[1 + i]);
        }
        let time = sample.time;
        let told = self.warnings.take().into_iter().map(|text| Message { time, text });
        self.summary.warnings.extend(told);
        let error = self.summary.take(&self.row, sample.last).to_degrees();
        if sample.tick.is_multiple_of(u64::from(self.scenario.every)) {
            self.signals.extend_from_slice(&self.row);
            self.recorded = Some(sample.time);
        }
        self.take_plan(sample.values.get(self.row.len() - 1..).unwrap_or_default());
        // An error that is not a number counts as lost, too.
        if error.is_nan() || error > self.lost_beyond {
            let text = format!("attitude lost: its error exceeds {} deg", self.lost_beyond);
            self.summary.lost = true;
            return Err(Message { time, text });
        }
        Ok(())
    }
}
