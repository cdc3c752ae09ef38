//! Shows the progress of a run: a moving bar on a terminal, and a plain line otherwise.

use cosim::error::Error;
use cosim::run::{Observer, Sample};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle};
use std::fmt::Arguments;
use std::io::{IsTerminal, Write, stderr};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Writes a plain line to standard error. If this fails, there is nobody left to tell.
fn tell(line: Arguments) {
    let _ = writeln!(stderr(), "{line}");
}

/// Creates a bar, which is hidden if standard error is no terminal or if `quiet` is set.
fn bar(length: u64, quiet: bool, template: &str) -> ProgressBar {
    let shown = stderr().is_terminal() && !quiet;
    let target =
        if shown { ProgressDrawTarget::stderr_with_hz(10) } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    let bar = bar.with_finish(ProgressFinish::AndClear);
    if let Ok(style) = ProgressStyle::with_template(template) {
        // Writing to the line of the bar cannot fail.
        let speed = |state: &ProgressState, line: &mut dyn std::fmt::Write| {
            let _ = line.write_str(&rate(state.per_sec()));
        };
        bar.set_style(style.with_key("rate", speed).progress_chars("=> "));
    }
    bar
}

/// Formats the number of parts per second, or per minute if they are slow, with one digit after the
/// point if it is small.
pub fn rate(per_second: f64) -> String {
    let (rate, unit) =
        if per_second < 1.0 { (60.0 * per_second, "minute") } else { (per_second, "second") };
    let digits = usize::from(rate < 9.95);
    format!("{rate:.digits$} per {unit}")
}

/// A progress bar of a run, which is redrawn a few times a second.
pub struct Progress {
    bar: ProgressBar,
    stride: u64,
}

impl Progress {
    /// Creates a bar for `ticks` steps. It is drawn on standard error if that is a terminal;
    /// otherwise one plain line is written. With `quiet` nothing is shown. With `apart` a thread of
    /// its own draws the bar, so that the run never waits for the terminal.
    pub fn new(title: &str, ticks: u64, quiet: bool, apart: bool) -> Self {
        if !stderr().is_terminal() && !quiet {
            tell(format_args!("running {title}: {ticks} steps"));
        }
        let bar = bar(ticks, quiet, "[{bar:30}] {percent} %, {eta} left {wide_msg}");
        bar.set_message(title.to_string());
        if apart {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        Self { bar, stride: (ticks / 200).max(1) }
    }
}

impl Observer for Progress {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if sample.tick.is_multiple_of(self.stride) {
            self.bar.set_position(sample.tick);
        }
        if sample.last {
            self.bar.finish_and_clear();
        }
        Ok(())
    }
}

/// Progress of work in parts, shared by the threads that do it: a bar on a terminal, and a line
/// every few seconds otherwise.
pub struct Parts {
    bar: ProgressBar,
    what: &'static str,
    quiet: bool,
    total: u64,
    last_line: Mutex<Instant>,
}

/// Time between two lines if there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

impl Parts {
    /// Creates a display for `total` parts, of which `done` are complete already. `what` names the
    /// parts, in the plural.
    pub fn new(what: &'static str, title: &str, total: u64, done: u64, quiet: bool) -> Self {
        let quiet = quiet || done == total;
        if !stderr().is_terminal() && !quiet {
            tell(format_args!("{title}: {} of {total} {what} to run", total - done));
        }
        let template =
            format!("[{{bar:20}}] {{pos}} of {{len}} {what}, {{rate}}, {{eta}} left{{wide_msg}}");
        let bar = bar(total, quiet, &template);
        bar.set_position(done);
        bar.reset_eta();
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, what, quiet, total, last_line: Mutex::new(Instant::now()) }
    }

    /// Lets no thread of its own draw the display any more, so that this process can be forked.
    pub fn draw_here(&self) {
        self.bar.disable_steady_tick();
    }

    /// Counts more parts as finished.
    pub fn advance(&self, count: u64) {
        self.bar.inc(count);
        let mut last = self.last_line.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.quiet && !stderr().is_terminal() && last.elapsed() >= BETWEEN_LINES {
            tell(format_args!(
                "{} of {} {} done, {}",
                self.bar.position(),
                self.total,
                self.what,
                rate(self.bar.per_sec())
            ));
            *last = Instant::now();
        }
    }

    /// Ends the display when all work is done.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_have_units_and_no_more_digits_than_matter() {
        let rates = [64.3074, 9.9499, 9.951, 0.25, 0.0].map(rate);
        let expected =
            ["64 per second", "9.9 per second", "10 per second", "15 per minute", "0.0 per minute"];
        assert_eq!(rates, expected);
    }
}
