//! Prediction over a known delay: it is exact with the right model, far better than no prediction,
//! and has no effect without a delay.

use crate::prelude::*;
use control::closed_loop::fly;
use control::controller::ReferenceAt;
use control::delay::Memory;
use vehicle::Error;
use vehicle::plant::{State, state};

const DELAYS: [f64; 5] = [0.04, 0.1, 0.117, 0.12, 0.003];

fn delayed<C: Controller>(inner: C, delay: f64) -> Delayed<C> {
    limited(inner, FEEDBACK, delay, f64::INFINITY).unwrap()
}

fn limited<C>(inner: C, period: f64, delay: f64, limit: f64) -> Result<Delayed<C>, DesignError>
where
    C: Controller,
{
    let body = settings(Constraints::Robust).body;
    Delayed::new(inner, body, period, Latency { measurement: 0.0, action: delay }, limit)
}

/// A plant on which commands act `delay` (s) after they are given.
struct Late {
    plant: Plant,
    /// Time of the plant, s.
    time: f64,
    delay: f64,
    moment_limit: f64,
    /// Commands with the time (s) from which they act.
    commands: Vec<(f64, Vector3<f64>)>,
    /// States at which each command began to act.
    reached: Vec<State>,
}

impl Late {
    fn new(delay: f64, inertia_scale: f64, disturbance: Disturbance) -> Self {
        let mut config = Scenario::crmpc2022().config(0.01);
        (config.inertia_scale, config.disturbance) = (inertia_scale, disturbance);
        let plant = Plant::new(&config, 0.0).unwrap();
        let (commands, reached) = (Vec::new(), Vec::new());
        Self { plant, time: 0.0, delay, moment_limit: f64::INFINITY, commands, reached }
    }

    fn undisturbed(delay: f64) -> Self {
        Self::new(delay, 1.0, Disturbance::default())
    }

    /// Returns the moment in force, N m.
    fn moment(&self) -> Vector3<f64> {
        self.reached.len().checked_sub(1).map_or_else(Vector3::zeros, |last| self.commands[last].1)
    }

    fn go(&mut self, to: f64) -> Result<(), Error> {
        self.plant.advance(self.time, to, self.moment())?;
        self.time = to;
        Ok(())
    }

    fn advance(&mut self, to: f64) -> Result<(), Error> {
        while let Some(&(acts, _)) =
            self.commands.get(self.reached.len()).filter(|(acts, _)| *acts <= to)
        {
            self.go(acts)?;
            self.reached.push(self.plant.state);
        }
        self.go(to)
    }

    /// Runs the closed loop over `duration` (s) and returns ‖Θ − Θ_r‖ (deg) at each tick. `observe`
    /// receives memory and measurement before each update.
    fn run<C: Controller>(
        &mut self,
        controller: &mut C,
        period: f64,
        duration: f64,
        mut observe: impl FnMut(&C, &C::Memory, &Measurement),
    ) -> Result<Vec<f64>, Error> {
        let reference = Scenario::crmpc2022().reference;
        let mut memory = controller.memory();
        let ticks = (duration / period).round() as u64;
        let mut errors = Vec::new();
        for tick in 0..ticks {
            let time = tick as f64 * period;
            self.advance(time)?;
            let (angles, rates) = (self.plant.angles(), self.plant.rates());
            let measured = Measurement { angles, rates, ..Measurement::default() };
            observe(controller, &memory, &measured);
            errors.push((angles - reference.at(time).angles).norm().to_degrees());
            let moment =
                controller.update(&mut memory, tick, time, &measured, &|time| reference.at(time));
            self.commands.push((time + self.delay, saturated(moment, self.moment_limit)));
        }
        self.advance(duration)?;
        Ok(errors)
    }
}

/// Returns the largest distance (rad, rad/s) of a predicted state from the actual one, over 10 s.
fn largest_error<C: Controller>(mut late: Late, mut controller: Delayed<C>, period: f64) -> f64 {
    let mut predicted = Vec::new();
    late.run(&mut controller, period, 10.0, |controller, memory, measured| {
        let Measurement { angles, rates, .. } =
            controller.predictor().predict(&memory.under_way, measured);
        predicted.push(state(&angles, &rates));
    })
    .unwrap();
    assert!(late.reached.len() > 240);
    let pairs = late.reached.iter().zip(&predicted);
    pairs.map(|(reached, predicted)| (reached - predicted).amax()).fold(0.0, f64::max)
}

#[test]
fn oracle_with_the_right_model_the_predicted_state_is_the_one_that_comes() {
    for delay in DELAYS {
        let error = largest_error(Late::undisturbed(delay), delayed(lqr(), delay), FEEDBACK);
        assert!(error < 1e-9, "{delay} s: {error:e}");
        // With feedback every 0.01 s, up to 12 commands are under way.
        let Settings { body, p, q, .. } = settings(Constraints::Robust);
        let fast = Lqr::new(LqrSettings { body, p, q, period: 0.01 }).unwrap();
        let fast = limited(fast, 0.01, delay, f64::INFINITY).unwrap();
        let error = largest_error(Late::undisturbed(delay), fast, 0.01);
        assert!(error < 1e-9, "{delay} s: {error:e}");
    }
}

#[test]
fn oracle_saturated_commands_are_predicted_as_they_act() {
    let limit = 5e4;
    let late = || Late { moment_limit: limit, ..Late::undisturbed(0.1) };
    let knowing = largest_error(late(), limited(lqr(), FEEDBACK, 0.1, limit).unwrap(), FEEDBACK);
    let unknowing = largest_error(late(), delayed(lqr(), 0.1), FEEDBACK);
    assert!(knowing < 1e-9 && unknowing > 1e-3, "{knowing:e}, {unknowing:e}");
}

#[test]
fn oracle_the_loop_moves_as_one_without_delay_that_begins_later() {
    // At rest and without a moment the vehicle's state is constant until the first command acts.
    let mut law = lqr();
    for delay in DELAYS {
        let mut late = Late::undisturbed(delay);
        late.run(&mut delayed(lqr(), delay), FEEDBACK, 20.0, |_, _, _| {}).unwrap();
        let reference = Scenario::crmpc2022().reference;
        let mut plant = Late::undisturbed(0.0).plant;
        for (tick, reached) in late.reached.iter().enumerate() {
            let time = delay + tick as f64 * 0.04;
            assert!((plant.state - reached).amax() < 1e-11, "{delay} s, tick {tick}");
            let measured = Measurement {
                angles: plant.angles(),
                rates: plant.rates(),
                ..Measurement::default()
            };
            let moment = law.update(&mut (), 0, time, &measured, &|time| reference.at(time));
            plant.advance(time, time + 0.04, moment).unwrap();
        }
    }
}

/// Returns the moments of the disturbed loop over `duration`, s.
fn moments<C: Controller>(mut controller: C, duration: f64) -> Vec<Vector3<f64>> {
    let scenario = Scenario { duration, ..Scenario::crmpc2022() };
    let (mut memory, mut moments) = (controller.memory(), Vec::new());
    fly(&mut controller, &mut memory, FEEDBACK, &scenario, |sample| moments.push(sample.moment))
        .unwrap();
    moments
}

#[test]
fn without_delay_nothing_changes_by_a_bit() {
    assert_eq!(moments(delayed(lqr(), 0.0), 50.0), moments(lqr(), 50.0));
    let crmpc = || Crmpc::new(settings(Constraints::Robust)).unwrap();
    assert_eq!(moments(delayed(crmpc(), 0.0), 4.0), moments(crmpc(), 4.0));
    assert!(delayed(crmpc(), 0.0).memory().under_way.is_empty());
}

#[test]
fn another_evaluation_or_a_saved_memory_leaves_no_trace() {
    let new = || delayed(lqr(), 0.117);
    assert_another_evaluation_leaves_no_trace(new, Clone::clone);
    assert_a_saved_memory_continues(new, 1.05, Clone::clone);
}

/// A controller that records the last input it received.
#[derive(Default)]
struct Probe {
    told: Option<(f64, Measurement)>,
    asked: f64,
}

impl Controller for Probe {
    type Memory = ();

    fn command(
        &mut self,
        (): &mut (),
        _: u64,
        time: f64,
        measured: &Measurement,
        reference: ReferenceAt,
    ) -> Vector3<f64> {
        self.told = Some((time, *measured));
        self.asked = reference(time).angles.x;
        Vector3::zeros()
    }
}

#[test]
fn the_law_is_told_the_time_at_which_its_moment_acts() {
    let mut controller = delayed(Probe::default(), 0.1);
    let achieved_moment = Some(Vector3::new(1.0, 2.0, 3.0));
    let measured = Measurement {
        rates: Vector3::new(0.0, 0.1, 0.0),
        achieved_moment,
        ..Measurement::default()
    };
    let reference = |time: f64| Reference { angles: Vector3::repeat(time), ..Reference::default() };
    // A default memory works as well.
    let mut memory = Memory::default();
    controller.update(&mut memory, 50, 2.0, &measured, &reference);
    let (time, told) = controller.inner().told.unwrap();
    assert_eq!((time, controller.inner().asked), (2.1, 2.1));
    // The vehicle turns about the pitch axis at beta = 0: alpha = q t.
    assert!((told.angles - Vector3::new(0.01, 0.0, 0.0)).amax() < 1e-15, "{told:?}");
    assert_eq!((told.rates, told.achieved_moment), (measured.rates, achieved_moment));
    assert_eq!(memory.under_way.len(), 3);
}

#[test]
fn an_old_measurement_is_predicted_to_now_and_the_reference_is_that_of_now() {
    let latency = Latency { measurement: 0.08, action: 0.0 };
    let body = settings(Constraints::Robust).body;
    let probe = Probe::default();
    let mut controller = Delayed::new(probe, body, FEEDBACK, latency, f64::INFINITY).unwrap();
    let measured = Measurement { rates: Vector3::new(0.0, 0.1, 0.0), ..Measurement::default() };
    controller.update(&mut Memory::default(), 50, 2.0, &measured, &|_| Reference::default());
    let (time, told) = controller.inner().told.unwrap();
    assert_eq!((time, controller.acts_after()), (2.0, 0.0));
    assert!((told.angles - Vector3::new(0.008, 0.0, 0.0)).amax() < 1e-15, "{told:?}");
}

#[test]
fn a_prediction_over_more_commands_than_are_remembered_is_refused() {
    let body = settings(Constraints::Robust).body;
    assert!(Predictor::new(body, 0.05, 1e-4).is_ok() && Predictor::new(body, 0.051, 1e-4).is_err());
}
