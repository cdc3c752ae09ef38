//! Runs that another program flies, such as those of a control law that is no FMU.
//!
//! The other program is asked for a run by a line of JSON on standard output (`Request`). It
//! answers on standard input by a line of JSON (`Answer`), which is followed by the values of the
//! requested variables at each communication point, as 64-bit floats in little-endian order.

use cosim::error::Error;
use cosim::experiment::Coupling;
use cosim::run::{Observer, Sample};
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use fmi_master::instance::CallFailure;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::path::Path;

/// A run that the other program is asked for.
#[derive(Serialize)]
struct Request<'a> {
    /// Number of the case, if it is one of several.
    case: Option<u64>,
    start: f64,
    step: f64,
    /// Number of communication steps.
    steps: u64,
    coupling: Coupling,
    /// Components, in the order in which they are stepped.
    order: Vec<&'a str>,
    components: BTreeMap<&'a str, Component<'a>>,
    /// Connected outputs and inputs.
    connections: Vec<(String, String)>,
    /// Variables whose values are the answer, and whether each is read after the step, because it
    /// responds to the inputs of the communication point.
    variables: Vec<(String, bool)>,
}

#[derive(Serialize)]
struct Component<'a> {
    fmu: &'a Path,
    every: u32,
    /// Values that are set before initialization.
    set: BTreeMap<String, Value>,
}

/// Result of a run.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    /// Number of communication points that follow.
    rows: u64,
    /// Failure that ended the run at the last of them.
    failure: Option<Failure>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Failure {
    component: String,
    call: String,
    message: String,
}

/// Asks the program at the other end of standard input and output for a run, and shows it to the
/// observers.
///
/// # Errors
/// Returns an error if an instance failed in the run, if an observer ends it, or if the other
/// program does not answer as it should.
pub fn fly(
    system: &System,
    case: Option<u64>,
    changes: &[(Target, SettingValue)],
    observers: &mut [&mut dyn Observer],
) -> Result<(), Error> {
    let request = serde_json::to_string(&request(system, case, changes))
        .map_err(|error| Error::experiment(error.to_string()))?;
    let mut output = std::io::stdout().lock();
    writeln!(output, "{request}").and_then(|()| output.flush()).map_err(|error| ended(&error))?;
    show(system, &mut std::io::stdin().lock(), observers)
}

fn request<'a>(
    system: &'a System,
    case: Option<u64>,
    changes: &[(Target, SettingValue)],
) -> Request<'a> {
    let mut set = system.set_values(changes);
    let component = |component: &'a cosim::system::CheckedComponent| {
        let set = set.remove(&component.name).unwrap_or_default();
        let name = component.name.as_str();
        (name, Component { fmu: &component.fmu.path, every: component.every, set })
    };
    Request {
        case,
        start: system.clock.start(),
        step: system.clock.step(),
        steps: system.clock.ticks(),
        coupling: system.experiment.simulation.coupling,
        order: system.names(),
        components: system.components.iter().map(component).collect(),
        connections: system.connections(),
        variables: system.probed(),
    }
}

/// Shows the communication points of an answer to the observers. The answer is read to its end,
/// also if an observer ends the run before.
fn show(
    system: &System,
    input: &mut impl BufRead,
    observers: &mut [&mut dyn Observer],
) -> Result<(), Error> {
    let mut line = String::new();
    input.read_line(&mut line).map_err(|error| ended(&error))?;
    let answer: Answer = serde_json::from_str(&line)
        .map_err(|error| wrong(&format!("answered \"{}\": {error}", line.trim_end())))?;
    let ticks = system.clock.ticks();
    let is_whole = answer.rows == ticks + 1;
    if !is_whole && (answer.failure.is_none() || answer.rows > ticks) {
        return Err(wrong(&format!("gave {} rows instead of {}", answer.rows, ticks + 1)));
    }
    let mut bytes = vec![0; 8 * system.probed().len()];
    let mut values = vec![0.0; system.probed().len()];
    let mut outcome = Ok(());
    for tick in 0..answer.rows {
        input.read_exact(&mut bytes).map_err(|error| ended(&error))?;
        if outcome.is_err() {
            continue;
        }
        for (value, bytes) in values.iter_mut().zip(bytes.as_chunks::<8>().0) {
            *value = f64::from_le_bytes(*bytes);
        }
        let (time, last) = (system.clock.time(tick), tick == ticks);
        let sample = Sample { tick, time, last, values: &values };
        outcome = observers.iter_mut().try_for_each(|observer| observer.observe(&sample));
    }
    outcome?;
    answer.failure.map_or(Ok(()), |Failure { component, call, message }| {
        // Without an instance there is no answer.
        let is_answer = call != "instantiate";
        let failure = CallFailure { ends: None, call: call.into(), message, is_answer };
        let time = system.clock.time(answer.rows.saturating_sub(1));
        Err(Error::Call { component, time, failure })
    })
}

fn ended(error: &std::io::Error) -> Error {
    wrong(&format!("ended: {error}"))
}

fn wrong(problem: &str) -> Error {
    Error::experiment(format!("the program that flies the law {problem}"))
}
