//! Limits of one optimisation: computing time, and iterations of all solvers together.

use super::settings::SolverSettings;
use crate::clock::Instant;
use std::time::Duration;

/// The cone solver is started only if the remaining time is at least this many times the elapsed
/// time, because its setup takes longer than one iteration.
const FOR_THE_CONE: u32 = 4;

/// Number of iterations for which time must remain: the next one, and about the same time for the
/// plan and the report after it.
const TO_END: u32 = 2;

/// The budget of one optimisation of a controller, which may solve several problems.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    begin: Instant,
    deadline: Option<Instant>,
    /// Time at which the last iteration was started.
    last: Instant,
    iterations: u32,
    exhausted: bool,
}

impl Budget {
    /// Starts the budget given by the settings now.
    pub fn begin(settings: &SolverSettings) -> Self {
        let SolverSettings { time_budget, iteration_budget, .. } = *settings;
        let begin = Instant::now();
        // A budget too long for the clock to represent is no limit.
        let deadline = Some(time_budget)
            .filter(|&budget| budget > 0.0)
            .and_then(|budget| begin.checked_add(Duration::try_from_secs_f64(budget).ok()?));
        let iterations = if iteration_budget == 0 { u32::MAX } else { iteration_budget };
        Self { begin, deadline, last: begin, iterations, exhausted: false }
    }

    /// Returns a budget without limits.
    pub fn unlimited() -> Self {
        Self::begin(&SolverSettings::default())
    }

    /// Takes one iteration. Returns `false` if none is left, or if the time is too short for
    /// another one like the last and for the work that follows it.
    pub fn take(&mut self) -> bool {
        self.exhausted |= self.iterations == 0;
        if let Some(deadline) = self.deadline {
            let now = Instant::now();
            self.exhausted |= now + (now - self.last) * TO_END >= deadline;
            self.last = now;
        }
        if self.exhausted {
            return false;
        }
        self.iterations -= 1;
        true
    }

    /// Returns the iterations and the time (s) left for the cone solver, or `None` if it must not
    /// be started.
    pub fn of_the_cone(&mut self) -> Option<(u32, f64)> {
        let left = match self.deadline {
            None => f64::INFINITY,
            Some(deadline) => {
                let now = Instant::now();
                let left = deadline.saturating_duration_since(now);
                self.exhausted |= left < (now - self.begin) * FOR_THE_CONE;
                left.as_secs_f64()
            }
        };
        self.exhausted |= self.iterations == 0;
        (!self.exhausted).then_some((self.iterations, left))
    }

    /// Subtracts `iterations`. If none or no time is left, the budget counts as the reason that the
    /// solver ended.
    pub fn spend(&mut self, iterations: u32) {
        self.iterations = self.iterations.saturating_sub(iterations);
        let is_late = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
        self.exhausted |= self.iterations == 0 || is_late;
    }

    /// Returns whether the optimisation needed more than the budget allowed.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }
}
