//! The answers of `margins --guarantee`: which bounds the instances accept in place of those that
//! the experiment sets. Nothing is flown for them.

use cosim::error::Error;
use cosim::experiment::Accepted;
use cosim::interrupt::Interrupt;
use cosim::run::Run;
use cosim::signal::{Resolved, Signal};
use cosim::system::System;
use cosim::variation::{SettingValue, Target};
use fmi_master::description::VariableKind;
use fmu_import::warnings;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{self, Write};
use toml::Value;

/// Width to which an accepted bound is found, relative to it or to the value that is set.
const EXACT: f64 = 1e-4;
/// Part of the way from the accepted to the refused value at which the next one is tried. To say why
/// it refuses, an instance may compute for long.
const PART: f64 = 0.06;
/// Multiple of the value that is set up to which an accepted bound is looked for.
const FAR: f64 = 1e6;

type Changes = Vec<(Target, SettingValue)>;
type Ask<'a> = dyn Fn(&Trial) -> Result<Option<f64>, Error> + 'a;

/// An answer with the parameters as they are set, and by the rule of the design. There is none if
/// nothing is accepted; the largest number says that every large one is.
#[derive(Serialize, Deserialize)]
pub(crate) struct Row {
    answer: String,
    unit: String,
    set: Option<f64>,
    as_set: Option<f64>,
    by_rule: Option<f64>,
}

/// A parameter whose accepted values are looked for.
struct Parameter {
    name: String,
    target: Target,
    set: f64,
    /// Value at which the search begins.
    start: f64,
    shown: Resolved,
}

/// Instances with some parameters changed.
#[derive(Clone)]
struct Trial<'a> {
    system: &'a System,
    interrupt: &'a Interrupt,
    changes: Changes,
    /// Output that must be as large as this after initialization.
    leaving: Option<(&'a Resolved, f64)>,
}

impl Trial<'_> {
    /// Initializes the instances; `None` if one of them refuses the parameters.
    fn start(&self) -> Result<Option<Run>, Error> {
        match self.system.start_varied(&self.changes, self.interrupt) {
            Ok(run) => Ok(Some(run)),
            Err(Error::Call { failure, .. }) if failure.is_answer => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Returns an output in its display unit.
    fn told(&self, output: &Resolved) -> Result<Option<f64>, Error> {
        let Some(mut run) = self.start()? else { return Ok(None) };
        Ok(Some(output.value(run.advance(0)?)))
    }

    fn with(&self, target: Target, value: f64) -> Self {
        let mut trial = self.clone();
        trial.changes.push((target, SettingValue::Real(value)));
        trial
    }

    fn accepts(&self, target: Target, value: f64) -> Result<bool, Error> {
        if let Some(request) = self.interrupt.asked() {
            return Err(Error::Ended(request));
        }
        let trial = self.with(target, value);
        match self.leaving {
            None => Ok(trial.start()?.is_some()),
            Some((output, least)) => Ok(trial.told(output)?.is_some_and(|value| value >= least)),
        }
    }

    /// Returns the largest or the smallest accepted value of a parameter, in its display unit.
    fn bound(&self, parameter: &Parameter, is_largest: bool) -> Result<Option<f64>, Error> {
        let Parameter { target, start, ref shown, .. } = *parameter;
        let is_accepted = self.accepts(target, start)?;
        let (mut good, mut bad) = if is_accepted == is_largest {
            let mut far = start;
            while self.accepts(target, far)? == is_accepted {
                far *= 2.0;
                if far > FAR * start {
                    return Ok(is_accepted.then_some(f64::MAX));
                }
            }
            if is_accepted { (0.5 * far, far) } else { (far, 0.5 * far) }
        } else if is_accepted {
            (start, 0.0)
        } else if self.accepts(target, 0.0)? {
            (0.0, start)
        } else {
            return Ok(None);
        };
        while (good - bad).abs() > EXACT * good.max(start) {
            let middle = good + PART * (bad - good);
            if self.accepts(target, middle)? { good = middle } else { bad = middle }
        }
        Ok(Some(good * shown.factor))
    }
}

impl Parameter {
    fn find(system: &mut System, signal: &Signal) -> Result<Self, String> {
        let (name, shown) = (signal.to_string(), system.resolve(signal)?);
        let target = system.target(&name)?;
        let set = system.nominal(target).unwrap_or_default();
        let start = match system.variable(target).kind {
            _ if set > 0.0 => set,
            VariableKind::Real { nominal: Some(nominal), .. } => nominal,
            _ => 1.0,
        };
        Ok(Self { name, target, set, start, shown })
    }
}

/// What an experiment asks for, with its names looked up.
struct Questions {
    largest: Vec<Parameter>,
    smallest: Vec<Parameter>,
    told: Vec<(String, Resolved)>,
    leaving: Option<(String, Resolved, f64)>,
    as_set: Changes,
    by_rule: Changes,
}

impl Questions {
    fn find(system: &mut System, asked: &Accepted) -> Result<Self, String> {
        let mut all = |signals: &[Signal]| {
            signals.iter().map(|signal| Parameter::find(system, signal)).collect::<Result<_, _>>()
        };
        let (largest, smallest) = (all(&asked.largest)?, all(&asked.smallest)?);
        let mut output = |signal: &Signal| Ok((signal.to_string(), system.resolve(signal)?));
        let told = asked.told.iter().map(&mut output).collect::<Result<_, String>>()?;
        let leaving = asked.leaving.as_ref().map(|(signal, least)| {
            let (name, shown) = output(signal)?;
            Ok::<_, String>((format!("with {name} ≥ {least}"), shown, *least))
        });
        let leaving = leaving.transpose()?;
        let as_set = changes(system, &asked.with)?;
        let by_rule = as_set.iter().cloned().chain(changes(system, &asked.by_rule)?).collect();
        Ok(Self { largest, smallest, told, leaving, as_set, by_rule })
    }

    fn answers(&self, system: &System, interrupt: &Interrupt) -> Result<Vec<Row>, Error> {
        let [as_set, by_rule] = [&self.as_set, &self.by_rule].map(|changes| Trial {
            system,
            interrupt,
            changes: changes.clone(),
            leaving: None,
        });
        // What refuses the settings as they are says so in its own words.
        match system.start_varied(&self.as_set, interrupt) {
            Err(Error::Call { component, failure, .. }) if failure.is_answer => {
                tracing::error!("{component}: {}", failure.message);
            }
            started => drop(started?),
        }
        let _silence = warnings::silence();
        let mut rows = Vec::new();
        let mut add = |answer: String, shown: &Resolved, set, ask: &Ask| {
            let (as_set, by_rule) = (ask(&as_set)?, ask(&by_rule)?);
            rows.push(Row { answer, unit: shown.unit.clone(), set, as_set, by_rule });
            Ok::<_, Error>(())
        };
        for (sought, parameters) in [("largest", &self.largest), ("smallest", &self.smallest)] {
            for parameter in parameters {
                let Parameter { name, set, shown, .. } = parameter;
                add(format!("{sought} {name}"), shown, Some(set * shown.factor), &|trial| {
                    trial.bound(parameter, sought == "largest")
                })?;
            }
        }
        let Some((first, others)) = self.largest.split_first() else { return Ok(rows) };
        let of_first = format!("largest {}", first.name);
        if let Some((condition, output, least)) = &self.leaving {
            add(format!("{of_first} {condition}"), &first.shown, None, &|trial| {
                let leaving = Some((output, *least));
                Trial { leaving, ..trial.clone() }.bound(first, true)
            })?;
        }
        for other in others.iter().filter(|other| other.set > 0.0) {
            add(format!("{of_first} without {}", other.name), &first.shown, None, &|trial| {
                trial.with(other.target, 0.0).bound(first, true)
            })?;
        }
        for (name, output) in &self.told {
            add(name.clone(), output, None, &|trial| trial.told(output))?;
        }
        Ok(rows)
    }
}

fn changes(system: &System, values: &BTreeMap<String, Value>) -> Result<Changes, String> {
    let change = |(name, value): (&String, &Value)| {
        let target = system.target(name)?;
        Ok((target, system.value(target, value)?))
    };
    values.iter().map(change).collect()
}

/// Answers the questions of an experiment.
///
/// # Errors
/// Returns an error if a variable does not exist, or if an instance fails.
pub(crate) fn answers(
    system: &mut System,
    asked: &Accepted,
    interrupt: &Interrupt,
) -> Result<Vec<Row>, Error> {
    let fault = |problem| Error::experiment(format!("[observe.guarantee.accepted] {problem}"));
    let questions = Questions::find(system, asked).map_err(fault)?;
    system.apart(interrupt, || questions.answers(system, interrupt))
}

/// Writes the answers as a table.
pub(crate) fn write(rows: &[Row], out: &mut impl Write) -> io::Result<()> {
    let width = rows.iter().map(|row| row.answer.len()).max().unwrap_or(0);
    writeln!(out, "{:<width$} {:>8} {:>12} {:>12} {:>12}", "", "unit", "set", "as set", "by rule")?;
    for Row { answer, unit, set, as_set, by_rule } in rows {
        let text = |value: &Option<f64>| match value {
            None => "none".into(),
            Some(f64::MAX) => "any".into(),
            Some(value) => format!("{value:.4}"),
        };
        let set = set.map_or(String::new(), |set| text(&Some(set)));
        let (as_set, by_rule) = (text(as_set), text(by_rule));
        writeln!(out, "{answer:<width$} {unit:>8} {set:>12} {as_set:>12} {by_rule:>12}")?;
    }
    Ok(())
}
