//! Prints the outcome of a run to standard output.

use crate::experiment::Coupling;
use crate::metrics::Metrics;
use crate::run::{Plan, Report};
use crate::study::reproduce;
use fmu_import::quantity::rounded;
use std::io::{self, Write};
use std::path::Path;

/// Prints the summary of a run.
///
/// # Errors
/// If the text cannot be written.
pub fn summary(report: &Report, out: &mut impl Write) -> io::Result<()> {
    let Report { clock, metrics, .. } = report;
    let coupling = match report.coupling {
        Coupling::GaussSeidel => "Gauss-Seidel",
        Coupling::Jacobi => "Jacobi",
    };
    writeln!(out, "{}", report.title)?;
    writeln!(
        out,
        "  {} s to {} s in {} steps of {} s, {coupling}: {}",
        rounded(clock.start()),
        rounded(clock.stop()),
        clock.ticks(),
        clock.step(),
        report.order.join(", ")
    )?;
    let mut line = |label: &str, text: String| writeln!(out, "  {label:<17} {text}");
    if let Some(ems) = metrics.ems_deg {
        line("EMS", format!("{ems:.4} deg"))?;
    }
    if let Some(cms) = metrics.cms {
        line("CMS", format!("{cms:.4}"))?;
    }
    if let Some(rate) = metrics.max_rate_deg_s {
        let against = metrics
            .rate_limit_deg_s
            .map_or(String::new(), |limit| against(rate / limit, &format!("{limit:.4} deg/s")));
        line("largest rate", format!("{rate:.4} deg/s{against}"))?;
    }
    if let (Some(ratio), Some(limit)) = (metrics.max_moment_ratio, metrics.moment_limit) {
        line(
            "largest moment",
            format!("{:.4e} N m{}", ratio * limit, against(ratio, &format!("{limit:.4e} N m"))),
        )?;
    }
    if let (Some(mean), Some(p99), Some(max), Some(solves)) =
        (metrics.solver_ms_mean, metrics.solver_ms_p99, metrics.solver_ms_max, metrics.solves)
    {
        line(
            "solver time",
            format!("mean {mean:.3} ms, p99 {p99:.3} ms, max {max:.3} ms, {solves} solutions"),
        )?;
    }
    if let Some(fallbacks) = metrics.fallbacks {
        line("solver fallbacks", format!("{fallbacks}"))?;
    }
    if let Some(guarantee) = guarantee(metrics) {
        line("guarantee", guarantee)?;
    }
    if report.loops.is_empty() {
        line("loop delay", "no feedback loop".into())?;
    }
    for feedback in &report.loops {
        let names: Vec<&str> = feedback
            .components
            .iter()
            .chain(feedback.components.first())
            .map(|&index| report.order[index].as_str())
            .collect();
        let steps = match feedback.ticks {
            0 => "none".to_string(),
            1 => format!("{} s, 1 step", clock.step()),
            n => format!("{} s, {n} steps", rounded(n as f64 * clock.step())),
        };
        let reason = match (feedback.ticks, report.coupling) {
            (0, _) => "",
            (_, Coupling::Jacobi) => ", from the Jacobi coupling",
            (_, Coupling::GaussSeidel) => {
                ", from the order: an output is read before its unit's inputs are set"
            }
        };
        let undeclared: Vec<&str> =
            feedback.undeclared.iter().map(|&index| report.order[index].as_str()).collect();
        let assumed = if undeclared.is_empty() {
            String::new()
        } else {
            format!(" (the worst case; not declared what outputs depend on: {})", undeclared.join(", "))
        };
        line("loop delay", format!("{steps} ({}){reason}{assumed}", names.join(" -> ")))?;
    }
    if let Some(factor) = metrics.real_time_factor {
        line("real-time factor", format!("{factor:.1} ({:.3} s elapsed)", metrics.wall_s))?;
    }
    if let Some(ended) = &report.ended {
        line("ended early", ended.to_string())?;
    }
    if let Some(real_time) = &metrics.real_time {
        real_time.print(&report.order, out)?;
    }
    let mut line = |label: &str, text: String| writeln!(out, "  {label:<17} {text}");
    line("results", format!("{}: {}", report.out.display(), report.files.join(", ")))
}

/// Prints what a packed archive holds, and which settings the standard cannot store.
///
/// # Errors
/// If the text cannot be written.
pub fn packed(plan: &Plan, archive: &Path, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}: {}", archive.display(), plan.order.join(", "))?;
    let step = plan.experiment.simulation.step;
    writeln!(
        out,
        "  the standard has no place for the step, {step} s: it stands in annotations, which not every tool reads"
    )
}

/// Prints the outcome of a reproduction.
///
/// # Errors
/// If the text cannot be written.
pub fn reproduction(report: &reproduce::Report, out: &mut impl Write) -> io::Result<()> {
    let (run, kept) = report.parts;
    writeln!(out, "{}", report.title)?;
    writeln!(
        out,
        "  {} runs in {} parts: {run} run now, {kept} kept from before; {:.1} s elapsed",
        report.runs,
        run + kept,
        report.elapsed
    )?;
    for note in &report.notes {
        writeln!(out, "  note: {note}")?;
    }
    for (claim, verdict) in &report.verdicts {
        writeln!(out, "  {:<14} {claim}", verdict.text())?;
    }
    writeln!(out, "  report: {}", report.page.display())?;
    writeln!(out, "  beside it: {}", report.files[1..].join("; "))
}

/// Formats the ratio of a value to its limit.
fn against(ratio: f64, limit: &str) -> String {
    // A value that is not a number is not within a limit. A limit counts as met up to rounding.
    let verdict = if ratio <= 1.0 + 1e-9 { "within" } else { "EXCEEDS" };
    format!("   {verdict} its limit {limit}: {:.1} %", ratio * 100.0)
}

/// Describes how the controller's guarantee fared, if the controller gives one.
fn guarantee(metrics: &Metrics) -> Option<String> {
    let share = metrics.guarantee_share?;
    let status = metrics.guarantee_status.as_ref().map_or(String::new(), |status| format!(" ({status})"));
    let margins = margins([metrics.guarantee_rate_margin_min, metrics.guarantee_moment_margin_min]);
    let course = match metrics.guarantee_lost_at.map(rounded) {
        _ if share == 0.0 => format!("never in force{status}"),
        Some(time) => {
            format!("in force at {:.1} % of the ticks, lost at t = {time} s{status}", share * 100.0)
        }
        None if share < 1.0 => {
            format!("in force at {:.1} % of the ticks, never lost{margins}", share * 100.0)
        }
        None => format!("in force throughout{margins}"),
    };
    let broken = metrics.guarantee_broken == Some(true);
    Some(course + if broken { "; DEFECT: a limit was EXCEEDED while it was in force" } else { "" })
}

/// Formats the margins of rate and moment as part of a sentence.
pub(crate) fn margins(margins: [Option<f64>; 2]) -> String {
    let known =
        margins.into_iter().zip(["rate", "moment"]).filter_map(|(margin, name)| Some((margin?, name)));
    let texts: Vec<String> =
        known.map(|(margin, name)| format!("{:.1} % ({name})", margin * 100.0)).collect();
    if texts.is_empty() { String::new() } else { format!(", margins {}", texts.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_met_up_to_rounding() {
        assert_eq!(against(1.0000000000000004, "1 N m"), "   within its limit 1 N m: 100.0 %");
        assert_eq!(against(1.001, "1 N m"), "   EXCEEDS its limit 1 N m: 100.1 %");
        assert!(against(f64::NAN, "1 N m").contains("EXCEEDS"));
    }

    #[test]
    fn a_guarantee_is_told_in_one_line() {
        assert_eq!(guarantee(&Metrics::default()), None);
        let mut metrics = Metrics {
            guarantee_share: Some(1.0),
            guarantee_status: Some("inForce".into()),
            guarantee_rate_margin_min: Some(0.031),
            guarantee_moment_margin_min: Some(0.012),
            guarantee_broken: Some(false),
            ..Metrics::default()
        };
        let told = |metrics: &Metrics| guarantee(metrics).unwrap();
        assert_eq!(told(&metrics), "in force throughout, margins 3.1 % (rate), 1.2 % (moment)");
        metrics.guarantee_broken = Some(true);
        assert_eq!(
            told(&metrics),
            "in force throughout, margins 3.1 % (rate), 1.2 % (moment); \
             DEFECT: a limit was EXCEEDED while it was in force"
        );
        metrics.guarantee_broken = None;
        metrics.guarantee_share = Some(0.972);
        assert_eq!(
            told(&metrics),
            "in force at 97.2 % of the ticks, never lost, margins 3.1 % (rate), 1.2 % (moment)"
        );
        (metrics.guarantee_lost_at, metrics.guarantee_status) =
            (Some(310.0 * 0.04 + 1e-14), Some("exceeded".into()));
        assert_eq!(told(&metrics), "in force at 97.2 % of the ticks, lost at t = 12.4 s (exceeded)");
        let never = Metrics {
            guarantee_share: Some(0.0),
            guarantee_status: Some("refused".into()),
            ..Metrics::default()
        };
        assert_eq!(told(&never), "never in force (refused)");
        let bare = Metrics { guarantee_share: Some(1.0), ..Metrics::default() };
        assert_eq!(told(&bare), "in force throughout");
    }
}
