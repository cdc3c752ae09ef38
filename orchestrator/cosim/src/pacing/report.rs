//! Timing report of a run that was paced by the wall clock.

use super::distribution::Summary;
use super::{Factor, OnMiss};
use fmi_master::quantity::rounded;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// The timing figures that `metrics.json` holds under `real_time`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RealTime {
    /// Simulated time divided by elapsed time, as requested.
    pub factor: Factor,
    /// Action requested for a missed deadline.
    pub on_miss: OnMiss,
    /// Time from the first communication point to the end of the last, s.
    pub elapsed_s: f64,
    /// Number of deadlines that were checked.
    pub deadlines: u64,
    /// Number of deadlines that were missed.
    pub misses: u64,
    /// The first deadline that was missed.
    pub first_miss: Option<Late>,
    /// The missed deadline with the longest delay.
    pub worst_miss: Option<Late>,
    /// Delay of the run against the wall clock.
    pub lag: Lag,
    /// Timing of each component, by its name.
    pub components: BTreeMap<String, ComponentTiming>,
    /// Wake-up jitter: delay of each wake-up, over all communication points with a wait.
    pub wake_up_ms: Summary,
    /// Time that the orchestrator itself took at a communication point to transfer and record
    /// values.
    pub orchestrator_ms: Summary,
}

/// A missed deadline, with the step that may have caused it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Late {
    /// Name of the component whose values were late.
    pub component: String,
    /// Simulated time of the communication point that the values belong to, s.
    pub time: f64,
    /// Time from the deadline until the values were ready, ms.
    pub late_ms: f64,
    /// Delay with which the communication point began, because of the wake-up or of earlier work,
    /// ms.
    pub lag_ms: f64,
    /// Name of the component with the longest step since the run last waited.
    pub longest: String,
    /// Simulated time of the communication point at the end of that step, s.
    pub longest_time: f64,
    /// Duration of that step, ms.
    pub longest_ms: f64,
}

/// Delay of a run against the wall clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lag {
    /// Number of communication points that began late because earlier work took too long.
    pub late_starts: u64,
    /// Largest delay with which a communication point began, ms, including wake-up jitter.
    pub largest_ms: f64,
    /// Delay with which the last communication point began, ms.
    pub at_end_ms: f64,
}

/// Timing figures of one component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComponentTiming {
    /// Time between two communication points of the component on the wall clock, ms.
    pub period_ms: f64,
    /// Number of deadlines that the component missed.
    pub misses: u64,
    /// Computing time of the instance per step, over all of its calls.
    pub step_ms: Summary,
    /// Time from the instant of the communication point until the component's values are ready. It
    /// must be shorter than the period.
    pub response_ms: Summary,
    /// Wake-up jitter at the component's own communication points.
    pub wake_up_ms: Summary,
}

impl RealTime {
    /// Prints the timing report, below the summary of the run.
    ///
    /// # Errors
    /// Returns an error if the text cannot be written.
    pub fn print(&self, names: &[&str], out: &mut impl Write) -> io::Result<()> {
        let mut line = |label: &str, text: String| writeln!(out, "  {label:<17} {text}");
        line(
            "real time",
            format!(
                "factor {}: {} of {} deadlines missed; {:.3} s elapsed",
                self.factor.get(),
                self.misses,
                self.deadlines,
                self.elapsed_s
            ),
        )?;
        let width =
            names.iter().map(|name| name.len()).max().unwrap_or(0).max("orchestrator".len());
        let groups = format!(
            "{:width$} {:>8} |{:>32} |{:>16} |{:>24} |",
            "", "", "step time", "response", "wake-up jitter"
        );
        line("", groups)?;
        let mut row = |label: &str, name: &str, cells: [String; 11]| {
            let [
                period,
                min,
                median,
                p99,
                max,
                response_p99,
                response_max,
                woken,
                woken_p99,
                woken_max,
                missed,
            ] = cells;
            line(
                label,
                format!(
                    "{name:width$} {period:>8} |{min:>8}{median:>8}{p99:>8}{max:>8} |{response_p99:>8}{response_max:>8} \
                     |{woken:>8}{woken_p99:>8}{woken_max:>8} |{missed:>7}"
                ),
            )
        };
        let texts = |cells: [&str; 11]| cells.map(String::from);
        row(
            "ms",
            "",
            texts([
                "period", "min", "median", "p99", "max", "p99", "max", "median", "p99", "max",
                "missed",
            ]),
        )?;
        for &name in names {
            let Some(component) = self.components.get(name) else { continue };
            let ComponentTiming { step_ms: step, response_ms: response, wake_up_ms: woken, .. } =
                component;
            let woken = [woken.median, woken.p99, woken.max]
                .map(|ms| if woken.count > 0 { plain(ms) } else { "-".into() });
            let [woken_median, woken_p99, woken_max] = woken;
            let cells = [
                plain(component.period_ms),
                plain(step.min),
                plain(step.median),
                plain(step.p99),
                plain(step.max),
                plain(response.p99),
                plain(response.max),
                woken_median,
                woken_p99,
                woken_max,
                component.misses.to_string(),
            ];
            row("", name, cells)?;
        }
        let overhead = &self.orchestrator_ms;
        let overhead = [overhead.min, overhead.median, overhead.p99, overhead.max].map(plain);
        row(
            "",
            "orchestrator",
            std::array::from_fn(|k| overhead.get(k.wrapping_sub(1)).cloned().unwrap_or_default()),
        )?;
        for (label, miss) in [("first miss", &self.first_miss), ("worst miss", &self.worst_miss)] {
            if let Some(miss) = miss {
                line(label, miss.to_string())?;
            }
        }
        if let Some(text) = self.done_about_it() {
            line("done about it", text)?;
        }
        Ok(())
    }

    /// Describes the action taken on missed deadlines; `None` if there were none.
    pub fn done_about_it(&self) -> Option<String> {
        let Lag { late_starts, largest_ms, at_end_ms } = self.lag;
        (self.misses > 0).then(|| match self.on_miss {
            OnMiss::CatchUp => format!(
                "went on at once, {late_starts} times without waiting; at most {} ms behind, {} ms at the last \
                 communication point",
                plain(largest_ms),
                plain(at_end_ms)
            ),
            OnMiss::Stop => "ended the run".into(),
        })
    }
}

impl std::fmt::Display for Late {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(
            f,
            "{} at t = {} s, {} ms late",
            self.component,
            rounded(self.time),
            plain(self.late_ms)
        )?;
        write!(f, "; that communication point began {} ms late", plain(self.lag_ms))?;
        write!(
            f,
            "; longest step since the last wait: {}, {} ms, to t = {} s",
            self.longest,
            plain(self.longest_ms),
            rounded(self.longest_time)
        )
    }
}

/// Formats milliseconds with three digits after the point, or with one from 100 ms on.
fn plain(milliseconds: f64) -> String {
    match milliseconds {
        ms if ms < 100.0 => format!("{ms:.3}"),
        ms => format!("{ms:.1}"),
    }
}
