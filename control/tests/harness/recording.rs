//! Recorded runs of a controller that optimises, and their behaviour if ticks are evaluated again,
//! with a solver that fails, or from a saved memory.

use super::{FEEDBACK, disturbance, simulate};
use control::controller::{Preview, ReferenceAt};
use control::schedule::Sampled;
use control::{Controller, Measurement};
use nalgebra::Vector3;
use std::fmt::Debug;
use std::ops::Range;
use vehicle::disturbance::DisturbanceKind;
use vehicle::reference::Reference;
use vehicle::scenario::Scenario;

/// Returns the reference of the scenario.
pub fn reference() -> impl Fn(f64) -> Reference {
    let scenario = Scenario::crmpc2022();
    move |time| scenario.reference.at(time)
}

/// Input of one tick of a recorded run.
pub struct Recorded<M> {
    /// Number of the tick.
    pub tick: u64,
    /// Memory before the tick.
    pub before: M,
    /// Measurement at the tick.
    pub measured: Measurement,
}

impl<M: Clone> Recorded<M> {
    /// Evaluates the tick; returns the memory after it and the moment, N m.
    pub fn update(&self, controller: &mut impl Controller<Memory = M>) -> (M, Vector3<f64>) {
        let mut memory = self.before.clone();
        let time = self.tick as f64 * FEEDBACK;
        let moment = controller.update(&mut memory, self.tick, time, &self.measured, &reference());
        (memory, moment)
    }
}

/// Returns every tick whose number is a multiple of `ratio`, of the scenario with white noise.
pub fn recorded<C: Controller>(
    controller: &mut C,
    inertia_scale: f64,
    ratio: u64,
) -> Vec<Recorded<C::Memory>> {
    let mut before = controller.memory();
    let mut samples = Vec::new();
    let noise = disturbance(DisturbanceKind::White);
    let mut memory = controller.memory();
    simulate(controller, &mut memory, inertia_scale, noise, |after, tick, &measured| {
        if tick % ratio == 0 {
            samples.push(Recorded { tick, before: before.clone(), measured });
        }
        before.clone_from(after);
    });
    samples
}

/// A controller whose solver fails during some ticks.
pub struct Interrupted<C> {
    /// The controller at all other ticks.
    pub working: C,
    /// The controller whose solver fails.
    pub failing: C,
    /// The ticks at which it fails.
    pub during: Range<u64>,
}

impl<C: Controller> Controller for Interrupted<C> {
    type Memory = C::Memory;

    fn command(
        &mut self,
        memory: &mut C::Memory,
        tick: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        let controller =
            if self.during.contains(&tick) { &mut self.failing } else { &mut self.working };
        controller.command(memory, tick, time, measured, reference)
    }

    fn limit(&self, memory: &C::Memory) -> f64 {
        self.working.limit(memory)
    }

    fn limited(&mut self, memory: &mut C::Memory, applied: &Vector3<f64>) {
        self.working.limited(memory, applied);
    }
}

/// Evaluates the first 300 ticks of a run twice, first with a measurement that is garbage, and
/// asserts that moments and memories are those of a controller that evaluates each tick once.
/// `timeless` takes the values of a clock out of a memory.
pub fn assert_another_evaluation_leaves_no_trace<C: Controller<Memory: Debug + PartialEq>>(
    new: impl Fn() -> C,
    timeless: fn(&C::Memory) -> C::Memory,
) {
    let scenario = Scenario::crmpc2022();
    let preview = Preview::Profile(&scenario.reference);
    let garbage = super::garbage();
    let (mut disturbed_controller, mut calm_controller) = (new(), new());
    let start = || Sampled::new(0.0, FEEDBACK, new().memory());
    let (mut disturbed, mut calm) = (start(), start());
    for Recorded { tick, measured, .. } in recorded(&mut new(), 1.05, 1).iter().take(300) {
        let wrong = &garbage[*tick as usize / 5 % garbage.len()];
        disturbed.evaluate(&mut disturbed_controller, wrong, &preview);
        disturbed.evaluate(&mut disturbed_controller, measured, &preview);
        calm.evaluate(&mut calm_controller, measured, &preview);
        let ((moment, memory), (calm_moment, calm_memory)) =
            (disturbed.in_force(), calm.in_force());
        assert_eq!(moment, calm_moment, "tick {tick}");
        assert_eq!(timeless(memory), timeless(calm_memory), "tick {tick}");
        disturbed.commit();
        calm.commit();
    }
}

/// Saves and restores the memory at many ticks of a run, and asserts that a new controller then
/// continues bit for bit. `timeless` takes the values of a clock out of a memory.
pub fn assert_a_saved_memory_continues<C: Controller<Memory: Debug + PartialEq>>(
    new: impl Fn() -> C,
    inertia_scale: f64,
    timeless: fn(&C::Memory) -> C::Memory,
) {
    let run = recorded(&mut new(), inertia_scale, 1);
    let scenario = Scenario::crmpc2022();
    let preview = Preview::Profile(&scenario.reference);
    let mut used = new();
    let mut sampled = Sampled::new(0.0, FEEDBACK, used.memory());
    for (tick, Recorded { measured, .. }) in run.iter().enumerate().take(750) {
        // The saved state is taken within and at the beginning of an optimisation period, with the
        // tick evaluated or not.
        if tick % 7 == 3 {
            if tick % 2 == 0 {
                sampled.evaluate(&mut used, measured, &preview);
            }
            let saved = postcard::to_stdvec(&sampled).unwrap();
            let mut restored: Sampled<C::Memory> = postcard::from_bytes(&saved).unwrap();
            let mut copy = sampled.clone();
            let mut fresh = new();
            for later in &run[tick..tick + 7] {
                for (sampled, controller) in [(&mut restored, &mut fresh), (&mut copy, &mut used)] {
                    sampled.evaluate(controller, &later.measured, &preview);
                }
                let ((moment, memory), (moment_used, memory_used)) =
                    (restored.in_force(), copy.in_force());
                assert_eq!(moment, moment_used, "saved at tick {tick}");
                assert_eq!(timeless(memory), timeless(memory_used), "saved at tick {tick}");
                restored.commit();
                copy.commit();
            }
        }
        sampled.evaluate(&mut used, measured, &preview);
        sampled.commit();
    }
}
