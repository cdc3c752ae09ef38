//! The sampled side of a controller on integer ticks: t_k = t₀ + k·period, never accumulated. At
//! run time the schedule alone knows start and period.

use crate::controller::{Controller, Measurement, Preview};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::reference::Reference;
use vehicle::time::{check_resolution, tick_time, tick_tolerance};

/// Largest number of a tick; beyond it the time of a tick is not exact.
const LAST_TICK: u64 = 1 << 53;

/// Memory of a sampled controller or estimator, its period and its position in time. At a tick the
/// output is a function of the committed memory and of the present input. It may be evaluated any
/// number of times, and is committed when time leaves the tick. Attitude controllers have the
/// default input and output.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sampled<Memory, Input = ControllerInput, Output = Vector3<f64>> {
    start: f64,
    period: f64,
    /// Number of the first tick that is not committed.
    next: u64,
    committed: Memory,
    held: Output,
    /// Outcome of `next`, if it was evaluated, and the input of that evaluation.
    pending: Memory,
    pending_output: Output,
    evaluated: Option<Input>,
}

/// Input on which a controller's evaluation depends, besides the committed memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ControllerInput {
    measured: Measurement,
    /// The external reference, if the controller follows one.
    external: Option<Reference>,
}

impl<Memory, Input, Output> Sampled<Memory, Input, Output>
where
    Memory: Clone + Default,
    Input: PartialEq + Default,
    Output: Copy + Default,
{
    /// Returns the state before tick 0, which is due at `start` (s), with the initial memory of a
    /// controller. Further ticks follow every `period` (s).
    pub fn new(start: f64, period: f64, memory: Memory) -> Self {
        Self { start, period, committed: memory.clone(), pending: memory, ..Self::default() }
    }

    /// Returns the time of the first uncommitted tick, s.
    pub fn next_time(&self) -> f64 {
        tick_time(self.next.cast_signed(), self.start, self.period)
    }

    /// Returns whether a tick is due at `time` (s).
    pub fn is_due(&self, time: f64) -> bool {
        self.next_time() <= time + tick_tolerance(time, self.period)
    }

    /// Returns the time of the first uncommitted tick (s), if it comes before `time` (s).
    pub fn next_before(&self, time: f64) -> Option<f64> {
        Some(self.next_time()).filter(|tick| *tick < time - tick_tolerance(time, self.period))
    }

    /// Returns the time of the first uncommitted tick that comes after `time` (s).
    pub fn next_after(&self, time: f64) -> f64 {
        let after = self.next + u64::from(self.is_due(time));
        tick_time(after.cast_signed(), self.start, self.period)
    }

    /// Returns whether a tick has been committed.
    pub fn has_committed(&self) -> bool {
        self.next > 0
    }

    /// Returns whether an instance with this `period` (s) can be in this state at `time` (s) in an
    /// experiment that began at `start` (s). All earlier ticks must be committed and, unless a step
    /// has `failed` in the middle, no later ones. `fits` checks each memory.
    pub fn fits(
        &self,
        (start, time): (f64, f64),
        period: f64,
        failed: bool,
        fits: impl Fn(&Memory) -> bool,
    ) -> bool {
        let next = self.next_time();
        check_resolution(start, period).is_ok()
            && self.start.to_bits() == start.to_bits()
            && self.period.to_bits() == period.to_bits()
            && self.next <= LAST_TICK
            && self.next_before(time).is_none()
            && (failed || next <= time + period + tick_tolerance(time, period))
            && fits(&self.committed)
            && fits(&self.pending)
    }

    /// Evaluates the first uncommitted tick. `update` receives the memory and the number of the
    /// tick; it must be a function of these and of `input`. Nothing is computed again for an equal
    /// `input`.
    pub fn evaluate_with(&mut self, input: Input, update: impl FnOnce(&mut Memory, u64) -> Output) {
        if self.evaluated.as_ref() == Some(&input) {
            return;
        }
        self.pending.clone_from(&self.committed);
        self.pending_output = update(&mut self.pending, self.next);
        self.evaluated = Some(input);
    }

    /// Commits the evaluated tick; its outcome is held from now on.
    pub fn commit(&mut self) {
        if self.evaluated.take().is_some() {
            std::mem::swap(&mut self.committed, &mut self.pending);
            self.held = self.pending_output;
            self.next += 1;
        }
    }

    /// Calls `look` with the memories before and after the tick that was just committed.
    pub fn last_change<T>(&self, look: impl FnOnce(&Memory, &Memory) -> T) -> T {
        // `commit` has swapped the older memory into `pending`.
        look(&self.pending, &self.committed)
    }

    /// Returns the output in force (a controller's moment, N m) and its memory. They are those of
    /// the evaluated tick, or else of the last committed one.
    pub fn in_force(&self) -> (Output, &Memory) {
        if self.evaluated.is_some() {
            (self.pending_output, &self.pending)
        } else {
            (self.held, &self.committed)
        }
    }
}

impl<Memory: Clone + Default> Sampled<Memory> {
    /// Evaluates the first uncommitted tick of a controller. Nothing is computed again for an equal
    /// measurement and external reference.
    pub fn evaluate<C: Controller<Memory = Memory>>(
        &mut self,
        controller: &mut C,
        measured: &Measurement,
        preview: &Preview,
    ) {
        let time = self.next_time();
        let input = ControllerInput { measured: *measured, external: preview.external() };
        self.evaluate_with(input, |memory, tick| {
            controller.update(memory, tick, time, measured, &|time| preview.at(time))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::{Forecast, ReferenceAt};

    /// Sums its measurements, so that any evaluation that is lost or counted twice shows in the
    /// sum.
    struct Sum;

    impl Controller for Sum {
        type Memory = f64;
        fn command(
            &mut self,
            memory: &mut f64,
            tick: u64,
            _: f64,
            measured: &Measurement,
            _: ReferenceAt,
        ) -> Vector3<f64> {
            *memory += measured.angles.x;
            Vector3::new(*memory, tick as f64, 0.0)
        }
    }

    fn measured(x: f64) -> Measurement {
        Measurement { angles: Vector3::new(x, 0.0, 0.0), ..Measurement::default() }
    }

    fn evaluate(sampled: &mut Sampled<f64>, x: f64) {
        let given = Reference::default();
        let forecast = Forecast { given, from: 0.0, until: 0.0, braking: None };
        sampled.evaluate(&mut Sum, &measured(x), &Preview::External(forecast));
    }

    #[test]
    fn a_tick_is_a_function_of_committed_memory_and_present_inputs() {
        let mut sampled = Sampled::new(0.0, 0.04, 0.0);
        evaluate(&mut sampled, 1.0);
        evaluate(&mut sampled, 5.0);
        assert_eq!(sampled.in_force().0.x, 5.0, "the first evaluation leaves no trace");
        sampled.commit();
        sampled.commit();
        evaluate(&mut sampled, 2.0);
        assert_eq!(sampled.in_force().0, Vector3::new(7.0, 1.0, 0.0));
    }

    #[test]
    fn ticks_are_due_at_integer_multiples_from_either_side_of_rounding() {
        let mut sampled = Sampled::<f64>::new(0.1, 0.04, 0.0);
        for k in 0..10_000_u32 {
            let time = 0.1 + f64::from(k) * 0.04;
            assert!(sampled.is_due(time.next_down()) && sampled.is_due(time));
            assert!(!sampled.is_due(time - 0.01) && sampled.next_before(time.next_up()).is_none());
            evaluate(&mut sampled, 0.0);
            sampled.commit();
        }
    }
}
