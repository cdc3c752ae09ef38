//! Shows how far a run has got: a bar on a terminal, nothing that moves otherwise.

use crate::error::Error;
use crate::master::{Observer, Sample};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, stderr};

/// A bar that is redrawn a few times a second.
pub struct Progress {
    bar: ProgressBar,
    stride: u64,
}

impl Progress {
    /// A bar for `ticks` steps, drawn to standard error if that is a terminal and `quiet` is not asked for; otherwise one
    /// plain line.
    pub fn new(title: &str, ticks: u64, quiet: bool) -> Self {
        let terminal = stderr().is_terminal();
        if !terminal && !quiet {
            eprintln!("running {title}: {ticks} steps");
        }
        let target = if terminal && !quiet {
            ProgressDrawTarget::stderr_with_hz(10)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(ticks), target);
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {percent} %, {eta} left") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(title.to_string());
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

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
