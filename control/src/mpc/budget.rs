//! What an optimisation may take: time, and iterations of all solvers together.

use super::optimiser::SolverSettings;
use std::time::{Duration, Instant};

/// The cone solver is begun only if this many times as long is left as has passed: it sets itself up for longer than one iteration takes.
const FOR_THE_CONE: u32 = 4;

/// Iterations for which there must be time: the one that is begun, and about as much for the plan and the report after it.
const TO_END: u32 = 2;

/// The budget of one optimisation of a controller, which may solve several problems.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    begin: Instant,
    deadline: Option<Instant>,
    /// When the last iteration was begun.
    last: Instant,
    iterations: u32,
    exhausted: bool,
}

impl Budget {
    /// The budget of the settings from now on.
    pub fn begin(settings: &SolverSettings) -> Self {
        let SolverSettings { time_budget, iteration_budget, .. } = *settings;
        let begin = Instant::now();
        // A budget that no clock can count to is no limit.
        let deadline = Some(time_budget)
            .filter(|&budget| budget > 0.0)
            .and_then(|budget| begin.checked_add(Duration::try_from_secs_f64(budget).ok()?));
        let iterations = if iteration_budget == 0 { u32::MAX } else { iteration_budget };
        Self { begin, deadline, last: begin, iterations, exhausted: false }
    }

    /// No limits.
    pub fn unlimited() -> Self {
        let begin = Instant::now();
        Self { begin, deadline: None, last: begin, iterations: u32::MAX, exhausted: false }
    }

    /// Takes one iteration, unless there is none left, or no time for another one like the last and for what follows it.
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

    /// Iterations and time for the cone solver, s; nothing if it is not to be begun.
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

    /// Takes these iterations; what had to end with the last of them was ended by the budget.
    pub fn spend(&mut self, iterations: u32) {
        self.iterations = self.iterations.saturating_sub(iterations);
        self.exhausted |= self.iterations == 0 || self.is_late();
    }

    /// Whether more was wanted than there was.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }

    fn is_late(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}
