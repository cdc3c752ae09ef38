//! What is known of the events of a model.

/// What is known of events.
#[derive(Clone, Default)]
pub(super) struct Events {
    /// Time of the next time event, s.
    pub(super) next_time: Option<f64>,
    /// Whether each event indicator is positive, since the last event.
    pub(super) is_positive: Vec<bool>,
    /// Time of the last event, s, and the number of events that came shortly before it.
    last: Option<f64>,
    count: u32,
    /// Length of the communication step, s.
    step: f64,
}

impl Events {
    /// Begins a communication step of this length, s.
    pub(super) fn begin(&mut self, step: f64) {
        self.step = step;
    }

    /// Returns the first indicator that is on another side of zero than after the last event.
    pub(super) fn crossed(&self, indicators: &[f64]) -> Option<usize> {
        indicators.iter().zip(&self.is_positive).position(|(z, was)| (*z > 0.0) != *was)
    }

    /// Returns the time of the next time event of the communication step that ends at `end` (s). One
    /// that rounding separates from the end belongs to it.
    pub(super) fn next_within(&self, end: f64) -> Option<f64> {
        let rounding = 4.0 * f64::EPSILON * end.abs().max(self.step);
        self.next_time.filter(|next| *next <= end + rounding)
    }

    /// Counts an event. Returns whether too many have come without progress.
    pub(super) fn is_stuck(&mut self, time: f64) -> bool {
        let is_near = |last: f64| time - last <= ADVANCE * self.step;
        self.count = if self.last.is_some_and(is_near) { self.count + 1 } else { 0 };
        self.last = Some(time);
        self.count >= MOST_EVENTS
    }
}

/// Part of a communication step that the time must advance between events of a model that makes
/// progress.
const ADVANCE: f64 = 1e-9;
/// Number of events without that advance at which the simulation fails.
pub(super) const MOST_EVENTS: u32 = 1000;
