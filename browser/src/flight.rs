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
    warnings: Warnings,
    lost_beyond: f64,
}

/// Flies the loop. `signals` gets a row of [`COLUMNS`] for each communication point, in SI units;
/// the last one repeats the responses of the step before.
///
/// # Errors
/// Says which parameter the FMUs refuse. If a step fails or the attitude is lost, the flight ends
/// there, and the summary says why.
pub fn fly(closed_loop: ClosedLoop, signals: &mut Vec<f64>) -> Result<Summary, Error> {
    let ClosedLoop { mut master, warnings, limits, guarantee, lost_beyond } = closed_loop;
    master.initialize()?;
    let limits = master.read(&limits)?;
    let limits = Limits { rate: limits[0], moment: limits[1] };
    let summary = Summary::new(limits, master.clock().step(), guarantee);
    signals.clear();
    signals.reserve((master.clock().ticks() as usize + 1) * COLUMNS.len());
    let mut flight = Flight { summary, signals, warnings, lost_beyond };
    flight.summary.end = master.run(&mut flight).err();
    Ok(flight.summary)
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
        // An error that is not a number counts as lost, too.
        if error.is_nan() || error > self.lost_beyond {
            let text = format!("attitude lost: its error exceeds {} deg", self.lost_beyond);
            self.summary.lost = true;
            return Err(Message { time, text });
        }
        Ok(())
    }
}
