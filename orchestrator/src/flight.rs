//! Flies the instances of a run, in this process or in a closed one.

use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::pacing::{Factor, Pacer, RealTime};
use cosim::run::{Observer, Sample};
use cosim::system::{Parameters, System};
use cosim::timer::Monotonic;
use fmu_import::isolation::{Closed, Closing, Link};
use fmu_import::warnings;
use linear::measures::{self, Measured};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::time::Instant;

/// Whoever hears of a run: its parameters, and then its values.
pub(crate) trait Heard: Observer {
    /// Receives the parameters of the initialized instances.
    ///
    /// # Errors
    /// An error ends the run.
    fn begin(&mut self, parameters: Parameters) -> Result<(), Error>;

    /// Returns whether the parameters have come.
    fn has_begun(&self) -> bool;

    /// Called when the last values have come.
    fn stop(&mut self);
}

/// What is known of a run when it is over.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Flown {
    /// Why it ended early, if it did.
    pub(crate) outcome: Result<(), Error>,
    /// Elapsed time, s.
    pub(crate) wall: f64,
    /// How the instance that may do so ended the run.
    pub(crate) end: Option<String>,
    pub(crate) real_time: Option<RealTime>,
    /// Margins that the experiment asks for.
    pub(crate) margins: Result<Measured, Error>,
    /// Failure of an instance when it was freed.
    pub(crate) late: Option<Error>,
}

/// Flies a run where its instances are to run.
///
/// # Errors
/// Returns an error if the run could not begin.
pub(crate) fn fly(
    system: &System,
    real_time: Option<Factor>,
    interrupt: &Interrupt,
    heard: &mut dyn Heard,
) -> Result<Flown, Error> {
    match system.closing() {
        Some(closing) => fly_closed(system, &closing, (real_time, interrupt), heard),
        None => fly_here(system, real_time, interrupt, heard, |_| ()),
    }
}

/// Flies a run in this process. `tell` is called before the instances are freed.
fn fly_here(
    system: &System,
    real_time: Option<Factor>,
    interrupt: &Interrupt,
    heard: &mut dyn Heard,
    tell: impl FnOnce(&Flown),
) -> Result<Flown, Error> {
    let warnings = warnings::collect();
    warnings::at(system.clock.start());
    let mut run = system.start(interrupt)?;
    heard.begin(system.parameters(&mut run)?)?;
    if let Some(factor) = real_time {
        run.pace(factor, Rc::new(Monotonic));
    }
    let begin = Instant::now();
    let outcome = run.run(&mut [heard]);
    let wall = begin.elapsed().as_secs_f64();
    heard.stop();
    drop(warnings);
    let margins = match outcome {
        Ok(()) => margins(system, interrupt),
        Err(_) => Ok(Measured::new()),
    };
    let end = run.master.end().map(String::from);
    let real_time = run.take_pacer().map(Pacer::report);
    let flown = Flown { outcome, wall, end, real_time, margins, late: None };
    tell(&flown);
    Ok(flown)
}

/// Computes the margins that an experiment asks for. A loop that cannot be linearised has none, and
/// the run is complete without them.
fn margins(system: &System, interrupt: &Interrupt) -> Result<Measured, Error> {
    match measures::asked(system, interrupt) {
        Err(error @ Error::Call { .. }) => {
            tracing::warn!("the margins are left out: {error}");
            Ok(measures::none())
        }
        outcome => outcome,
    }
}

/// What a closed process tells of a run.
#[derive(Serialize, Deserialize)]
enum Told<'a> {
    /// The parameters, as JSON.
    Begun(String),
    /// Tick, time, whether it is the last one, and values.
    Sample(u64, f64, bool, Cow<'a, [f64]>),
    /// There are no more values.
    Stopped,
    /// What is known of the run, as JSON.
    Flown(String),
    /// The run could not begin.
    Failed(Error),
}

/// Tells the supervisor of a run.
struct Teller<'a>(&'a Link);

impl Teller<'_> {
    fn tell(&self, told: &Told) -> Result<(), Error> {
        // The supervisor has its own reason not to listen any more.
        self.0.send(told).map_err(|error| Error::experiment(error.to_string()))
    }
}

impl Observer for Teller<'_> {
    fn observe(&mut self, &Sample { tick, time, last, values }: &Sample) -> Result<(), Error> {
        self.tell(&Told::Sample(tick, time, last, Cow::Borrowed(values)))
    }
}

impl Heard for Teller<'_> {
    fn begin(&mut self, parameters: Parameters) -> Result<(), Error> {
        self.tell(&Told::Begun(json!(parameters).to_string()))
    }

    fn has_begun(&self) -> bool {
        true
    }

    fn stop(&mut self) {
        let _ = self.tell(&Told::Stopped);
    }
}

/// Flies a run in a closed process.
fn fly_closed(
    system: &System,
    closing: &Closing,
    (real_time, interrupt): (Option<Factor>, &Interrupt),
    heard: &mut dyn Heard,
) -> Result<Flown, Error> {
    let begin = Instant::now();
    let work = |link: &mut Link| {
        let link = &*link;
        let tell = |flown: &Flown| {
            let _ = Teller(link).tell(&Told::Flown(json!(flown).to_string()));
        };
        if let Err(error) = fly_here(system, real_time, interrupt, &mut Teller(link), tell) {
            let _ = Teller(link).tell(&Told::Failed(error));
        }
    };
    let mut closed =
        Closed::begin(closing, work).map_err(|ended| system.ended(ended, interrupt))?;
    let wrong = || Error::experiment("the closed process told what no run has");
    let (width, mut left) = (system.probed().len(), system.clock.ticks() + 2);
    let (mut flown, mut fault): (Option<Flown>, Option<Error>) = (None, None);
    let mut hear = |told: Told| match told {
        Told::Flown(text) => {
            flown = Some(serde_json::from_str(&text).map_err(|_| wrong())?);
            Ok(())
        }
        Told::Begun(text) => heard.begin(serde_json::from_str(&text).map_err(|_| wrong())?),
        Told::Sample(tick, time, last, values) => {
            left = left.checked_sub(1).filter(|_| values.len() == width).ok_or_else(wrong)?;
            heard.observe(&Sample { tick, time, last, values: &values })
        }
        Told::Stopped => {
            heard.stop();
            Ok(())
        }
        Told::Failed(error) => Err(error),
    };
    let ended = closed.hear(
        || interrupt.signal(),
        |told| {
            // After a fault, only the end of the run is heard.
            if (fault.is_none() || matches!(told, Told::Flown(_)))
                && let Err(error) = hear(told)
            {
                fault.get_or_insert(error);
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        },
    );
    let mut late = ended.map_err(|ended| system.ended(ended, interrupt)).err();
    // Without a fault, the process has told its end, or ended before.
    let fault = if flown.is_none() { fault.or_else(|| late.take()) } else { fault };
    if !heard.has_begun() {
        return Err(fault.unwrap_or_else(wrong));
    }
    let mut flown = flown.unwrap_or_else(|| Flown {
        outcome: Err(wrong()),
        wall: begin.elapsed().as_secs_f64(),
        end: None,
        real_time: None,
        margins: Ok(Measured::new()),
        late: None,
    });
    if let Some(fault) = fault {
        (flown.outcome, flown.margins) = (Err(fault), Ok(Measured::new()));
    }
    Ok(Flown { late, ..flown })
}
