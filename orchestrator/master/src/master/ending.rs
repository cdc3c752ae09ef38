//! The end of a run by an instance that may do so, before the stop time.

use super::{Culprit, Master, Sample, Watcher};

impl Master {
    /// Lets an instance end the run before the stop time, by its index.
    pub fn set_ender(&mut self, ender: Option<usize>) {
        self.ender = ender;
    }

    /// Returns how the instance that may do so ended the run, if it did.
    pub fn end(&self) -> Option<&str> {
        self.end.as_deref()
    }

    /// Shows the watcher the values at the moment at which an instance ended the run, within the
    /// step from `tick`.
    pub(super) fn show_end<W: Watcher>(
        &mut self,
        tick: u64,
        (index, failure): &Culprit,
        watcher: &mut W,
    ) -> Result<(), W::Error> {
        let reached = failure.ends.filter(|time| time.is_finite());
        let time = reached.unwrap_or_else(|| self.clock.time(tick));
        self.read_instance(*index, true).map_err(|culprit| self.failed(time, culprit))?;
        for index in 0..self.members.len() {
            self.values.arrive(index);
        }
        self.row.fill(&self.values);
        let sample = Sample { tick: tick + 1, time, last: true, values: &self.row.values };
        self.end = Some(format!("by {}: {}", self.members[*index].name, failure.message));
        watcher.after(&sample, Ok(()))
    }
}
