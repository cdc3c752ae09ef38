//! Prints the outcome of a run or of a study to standard output.

use cosim::error::Error;
use cosim::experiment::{Coupling, Observe};
use cosim::system::System;
use cosim_metrics::guarantee::margins_text;
use cosim_metrics::metrics::{Metrics, Value};
use cosim_report::recording::{SummaryLine, share_text};
use fmi_master::quantity::rounded;
use std::io::{self, Write};
use std::path::PathBuf;

/// Report on a run.
#[derive(Debug)]
pub(crate) struct RunReport {
    /// Metrics of the run.
    pub metrics: Metrics,
    /// Folder that holds the results.
    pub out: PathBuf,
    /// Names of the files that were written to the folder.
    pub files: Vec<&'static str>,
    /// Reason why the run ended before its stop time, for example a request or a missed deadline;
    /// `None` if it did not.
    pub ended: Option<Error>,
    /// How the instance that may do so ended the run.
    pub end: Option<String>,
    /// Failure of an instance when it was freed.
    pub late: Option<Error>,
}

/// Prints the summary of a run.
///
/// # Errors
/// Returns an error if the text cannot be written.
pub(crate) fn summary(system: &System, report: &RunReport, out: &mut impl Write) -> io::Result<()> {
    let (System { clock, experiment, loops, .. }, metrics) = (system, &report.metrics);
    let names = system.names();
    let coupling = match experiment.simulation.coupling {
        Coupling::Sequential => "sequential",
        Coupling::Jacobi => "Jacobi",
    };
    writeln!(out, "{}", experiment.title)?;
    writeln!(
        out,
        "  {} s to {} s in {} steps of {} s, {coupling}: {}",
        rounded(clock.start()),
        rounded(clock.stop()),
        clock.ticks(),
        clock.step(),
        names.join(", ")
    )?;
    let mut line = |label: &str, text: String| writeln!(out, "  {label:<17} {text}");
    for told in lines(&experiment.observe, metrics) {
        line(&told.heading, told.text)?;
    }
    if experiment.observe.metrics.is_empty() {
        line("metrics", "none: the experiment defines none ([observe.metrics])".into())?;
    }
    if loops.is_empty() {
        line("loop delay", "no feedback loop".into())?;
    }
    for feedback in loops {
        let around: Vec<&str> = feedback
            .components
            .iter()
            .chain(feedback.components.first())
            .map(|&index| names[index])
            .collect();
        let steps = match feedback.ticks {
            0 => "none".to_string(),
            1 => format!("{} s, 1 step", clock.step()),
            n => format!("{} s, {n} steps", rounded(n as f64 * clock.step())),
        };
        let reason = match (feedback.ticks, experiment.simulation.coupling) {
            (0, _) => "",
            (_, Coupling::Jacobi) => ", from the Jacobi coupling",
            (_, Coupling::Sequential) => {
                ", from the order: a component is stepped before one whose response it receives"
            }
        };
        let undeclared: Vec<&str> = feedback.undeclared.iter().map(|&index| names[index]).collect();
        let assumed = if undeclared.is_empty() {
            String::new()
        } else {
            format!(
                " (at most; the dependencies of the outputs are not declared: {})",
                undeclared.join(", ")
            )
        };
        line("loop delay", format!("{steps} ({}){reason}{assumed}", around.join(" -> ")))?;
    }
    if let Some(factor) = metrics.real_time_factor {
        line("real-time factor", format!("{factor:.1} ({:.3} s elapsed)", metrics.wall_s))?;
    }
    if let Some(end) = &report.end {
        line("ended", end.clone())?;
    }
    let Metrics { completed, .. } = *metrics;
    if let Some(goal) = &experiment.observe.goal
        && completed
        && experiment.given.stop.is_none()
    {
        line("goal", format!("{} reached", goal.what))?;
    }
    if let Some(ended) = &report.ended {
        let label = if matches!(ended, Error::Lost { .. }) { "failed" } else { "ended early" };
        line(label, ended.to_string())?;
    }
    if let Some(real_time) = &metrics.real_time {
        line("real time", real_time.to_string())?;
    }
    line("results", format!("{}: {}", report.out.display(), report.files.join(", ")))
}

/// Returns the lines for the metrics of a run and for its guarantee.
pub(crate) fn lines(observe: &Observe, metrics: &Metrics) -> Vec<SummaryLine> {
    metric_lines(observe, metrics).into_iter().chain(guarantee(metrics)).collect()
}

/// Formats the ratio of a value to its limit, and returns whether the limit is kept.
fn against(ratio: f64, limit: &str) -> (String, bool) {
    // A value that is not a number is not within a limit. A limit counts as met up to rounding.
    let is_within = ratio <= 1.0 + 1e-9;
    let verdict = if is_within { "within" } else { "EXCEEDS" };
    // A limit that is exceeded is told with as many digits as tell it from 100 %.
    let mut texts = (1..=9).map(|digits| format!("{:.digits$}", ratio * 100.0));
    let is_told = |text: &String| is_within || text.parse() != Ok(100.0);
    let text = texts.find(is_told).unwrap_or_default();
    (format!("   {verdict} its limit {limit}: {text} %"), is_within)
}

/// Describes how the controller's guarantee fared, if the controller gives one.
fn guarantee(metrics: &Metrics) -> Option<SummaryLine> {
    let number = |name: &str| metrics.number(&format!("guarantee_{name}"));
    let share = number("share")?;
    let status =
        metrics.text("guarantee_status").map_or(String::new(), |status| format!(" ({status})"));
    let margins = metrics.asked.keys().filter_map(|name| {
        let margin = name.strip_prefix("guarantee_")?.strip_suffix("_margin_min")?;
        Some((metrics.number(name), margin))
    });
    let margins = margins_text(margins);
    let in_force = format!("in force at {} % of the ticks", share_text(share));
    let text = match number("lost_at").map(rounded) {
        _ if share == 0.0 => format!("never in force{status}"),
        Some(time) => format!("{in_force}, lost at t = {time} s{status}"),
        None if share < 1.0 => format!("{in_force}, never lost{margins}"),
        None => format!("in force throughout{margins}"),
    };
    let broken = number("broken") == Some(1.0);
    let defect = if broken {
        "; DEFECT, or an assumption that it cannot see does not hold: a limit was EXCEEDED while it was in force"
    } else {
        ""
    };
    let unfounded = number("unfounded_at").map_or(String::new(), |time| {
        let what = metrics.text("guarantee_unfounded").unwrap_or_default();
        let time = rounded(time);
        format!("; while it was in force, an ASSUMPTION did not hold at t = {time} s: {what}")
    });
    let late = number("late_at").map_or(String::new(), |time| {
        let time = rounded(time);
        format!(
            "; LATE at t = {time} s: the reference not reached for three times the designed time"
        )
    });
    let is_within = (broken || !unfounded.is_empty()).then_some(false);
    Some(SummaryLine {
        heading: "guarantee".into(),
        text: text + defect + &unfounded + &late,
        is_within,
        ..SummaryLine::default()
    })
}

/// Returns the lines for the metrics that the experiment lists in `summary`.
fn metric_lines(observe: &Observe, metrics: &Metrics) -> Vec<SummaryLine> {
    let mut lines: Vec<SummaryLine> = Vec::new();
    for name in &observe.summary {
        let (Some(measure), Some(value)) = (observe.metrics.get(name), metrics.asked.get(name))
        else {
            continue;
        };
        let unit = metrics.units.get(name).map_or("", String::as_str);
        let (unit, factor) =
            observe.units.get(unit).map_or((unit, 1.0), |shown| (&*shown.name, shown.factor));
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let text = match value {
            None => continue,
            Some(Value::Count(count)) => count.to_string(),
            Some(Value::Number(number)) => shown(factor * number),
            Some(Value::Flag(is)) => is.to_string(),
            Some(Value::Text(text)) => text.clone(),
        };
        let number = |name: &String| metrics.number(name);
        let (compared, is_within) = match (number(name), measure.limit.as_ref().and_then(number)) {
            // What stays 0 throughout was hardly computed, as the heating of a vehicle without one.
            (Some(value), Some(limit)) if value != 0.0 => {
                let (text, is) =
                    against(value / limit, &format!("{}{unit}", shown(factor * limit)));
                (text, Some(is))
            }
            _ => (String::new(), None),
        };
        let part =
            if measure.part.is_empty() { String::new() } else { format!("{} ", measure.part) };
        let text = format!("{part}{text}{unit}{compared}");
        match lines.last_mut().filter(|line| line.heading == measure.label) {
            Some(line) => {
                line.text.extend([", ", &text]);
                // One limit that is exceeded decides.
                line.is_within = [line.is_within, is_within].into_iter().flatten().min();
            }
            None => lines.push(SummaryLine {
                heading: measure.label.clone(),
                meaning: measure.meaning.clone(),
                text,
                is_within,
            }),
        }
    }
    lines
}

/// Formats a number with four digits after the point, or with an exponent if it is large or small.
fn shown(number: f64) -> String {
    match number.abs() {
        size if size >= 1e4 || size < 1e-3 && size > 0.0 => format!("{number:.4e}"),
        _ => format!("{number:.4}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_met_up_to_rounding() {
        let told = |ratio| against(ratio, "1 N m");
        let within = "   within its limit 1 N m: 100.0 %".to_string();
        assert_eq!(told(1.0000000000000004), (within, true));
        assert_eq!(told(1.001), ("   EXCEEDS its limit 1 N m: 100.1 %".into(), false));
        assert_eq!(told(1.000_02).0, "   EXCEEDS its limit 1 N m: 100.002 %");
        let (text, is_within) = told(f64::NAN);
        assert!(text.contains("EXCEEDS") && !is_within);
    }

    #[test]
    fn a_guarantee_is_told_in_one_line() {
        assert_eq!(guarantee(&Metrics::default()), None);
        let metrics = |asked: &[(&str, Value)]| {
            let asked = asked
                .iter()
                .map(|(name, value)| (format!("guarantee_{name}"), Some(value.clone())));
            Metrics { asked: asked.collect(), ..Metrics::default() }
        };
        let (number, text) = (Value::Number, |text: &str| Value::Text(text.into()));
        let margins = [("moment_margin_min", number(0.012)), ("rate_margin_min", number(0.031))];
        let told = |asked: &[(&str, Value)]| {
            guarantee(&metrics(&[asked, &margins].concat())).unwrap().text
        };
        let throughout = [("share", number(1.0)), ("status", text("inForce"))];
        assert_eq!(told(&throughout), "in force throughout, margins 1.2 % (moment), 3.1 % (rate)");
        let broken = [("share", number(1.0)), ("broken", Value::Flag(true))];
        assert_eq!(
            told(&broken),
            "in force throughout, margins 1.2 % (moment), 3.1 % (rate); \
             DEFECT, or an assumption that it cannot see does not hold: a limit was EXCEEDED while it was in force"
        );
        let intact = [("share", number(0.972)), ("broken", Value::Flag(false))];
        assert_eq!(
            told(&intact),
            "in force at 97.2 % of the ticks, never lost, margins 1.2 % (moment), 3.1 % (rate)"
        );
        let lost = [
            ("share", number(0.972)),
            ("lost_at", number(310.0 * 0.04 + 1e-14)),
            ("status", text("exceeded")),
        ];
        assert_eq!(told(&lost), "in force at 97.2 % of the ticks, lost at t = 12.4 s (exceeded)");
        let once = [("share", number(0.99999)), ("lost_at", number(3.0))];
        assert_eq!(told(&once), "in force at 99.99 % of the ticks, lost at t = 3 s");
        let never = metrics(&[("share", number(0.0)), ("status", text("refused"))]);
        assert_eq!(guarantee(&never).unwrap().text, "never in force (refused)");
        let without_margins = guarantee(&metrics(&[("share", number(1.0))])).unwrap();
        assert_eq!(without_margins.text, "in force throughout");
        let unfounded = [("unfounded", text("a.b / a.c > 1")), ("unfounded_at", number(12.5))];
        let unfounded = guarantee(&metrics(&[&throughout[..], &unfounded].concat())).unwrap();
        assert_eq!(
            unfounded.text,
            "in force throughout; while it was in force, an ASSUMPTION did not hold at t = 12.5 s: a.b / a.c > 1"
        );
        assert_eq!(unfounded.is_within, Some(false));
        let late = guarantee(&metrics(&[&throughout[..], &[("late_at", number(85.0))]].concat()));
        assert_eq!(
            late.unwrap().text,
            "in force throughout; LATE at t = 85 s: the reference not reached for three times the designed time"
        );
        // Only a defect is a verdict on the limits.
        assert_eq!(without_margins.is_within, None);
        assert_eq!(guarantee(&metrics(&broken)).unwrap().is_within, Some(false));
    }

    #[test]
    fn metrics_of_one_heading_share_a_line_and_limits_are_told() {
        let observe: Observe = toml::from_str(
            r#"
            summary = ["mean", "largest", "rate", "heat", "missing"]
            [metrics]
            mean = { label = "time", part = "mean", kind = "mean", signals = "x" }
            largest = { label = "time", part = "max", kind = "largest", signals = "x" }
            rate = { label = "largest rate", kind = "largest", signals = "y", limit = "limit" }
            heat = { label = "heat flux", kind = "largest", signals = "y", limit = "limit" }
            limit = { kind = "last", signals = "z" }
            missing = { label = "count", kind = "last", signals = "z" }
            "#,
        )
        .unwrap();
        let values = [
            ("mean", Some(0.0004)),
            ("largest", Some(2.0)),
            ("rate", Some(6.0)),
            ("heat", Some(0.0)),
            ("limit", Some(5.0)),
            ("missing", None),
        ];
        let asked = values.map(|(name, value)| (name.to_string(), value.map(Value::Number)));
        let units = ["mean", "largest"].map(|name| (name.to_string(), "ms".to_string()));
        let metrics = Metrics { asked: asked.into(), units: units.into(), ..Metrics::default() };
        let line = |heading: &str, text: &str, is_within| SummaryLine {
            heading: heading.into(),
            text: text.into(),
            is_within,
            ..SummaryLine::default()
        };
        assert_eq!(
            metric_lines(&observe, &metrics),
            [
                line("time", "mean 4.0000e-4 ms, max 2.0000 ms", None),
                line("largest rate", "6.0000   EXCEEDS its limit 5.0000: 120.0 %", Some(false)),
                line("heat flux", "0.0000", None),
            ]
        );
    }
}
