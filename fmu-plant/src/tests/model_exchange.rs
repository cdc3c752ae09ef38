//! Model exchange against co-simulation, with the disturbance's events.

use super::prelude::*;
use super::{CONTEXT, STATE_COUNT, actuate, all_kinds, outputs, started, step, tabulate};
use vehicle::disturbance::Row;

type States = nalgebra::SVector<f64, STATE_COUNT>;

pub(super) fn states(instance: &ReentryPlant) -> States {
    let mut states = States::zeros();
    instance.continuous_states(states.as_mut_slice());
    states
}

pub(super) fn indicators(instance: &mut ReentryPlant, time: f64) -> [f64; INDICATORS] {
    instance.calculate(time, LastEvent::InputSet).unwrap();
    let mut indicators = [f64::NAN; INDICATORS];
    instance.event_indicators(&mut indicators);
    indicators
}

/// Integrates accurately to `end`, or to the state event before it, which is located by bisection.
/// Returns the time reached.
pub(super) fn integrate(instance: &mut ReentryPlant, begin: f64, end: f64) -> f64 {
    let crossed =
        |instance: &mut ReentryPlant, time| indicators(instance, time).iter().any(|z| *z <= 0.0);
    assert!(!crossed(instance, begin), "an event is due at {begin} s");
    let steps = vehicle::integrator::equal_steps(end - begin, 0.001);
    let h = (end - begin) / steps as f64;
    for i in 0..steps {
        let (time, y) = (begin + i as f64 * h, states(instance));
        let advance = |instance: &mut ReentryPlant, h: f64| {
            let mut f = |t: f64, y: &States| {
                instance.set_continuous_states(y.as_slice());
                let o = outputs(instance, t);
                let motion = o.angle_rates.iter().chain(o.angular_acceleration.iter());
                let motion = motion.chain(o.deflection_rates.iter());
                States::from_iterator(motion.chain(o.motion_rate.iter()).copied())
            };
            let y = vehicle::integrator::rk4(&mut f, time, &y, h);
            instance.set_continuous_states(y.as_slice());
            crossed(instance, time + h)
        };
        if advance(instance, h) {
            let (mut before, mut after) = (0.0, h);
            while after - before > 1e-15 {
                let middle = 0.5 * (before + after);
                if advance(instance, middle) { after = middle } else { before = middle }
            }
            advance(instance, after);
            return time + after;
        }
    }
    end
}

/// Runs model exchange to `end` and returns the times of the events.
pub(super) fn exchange(instance: &mut ReentryPlant, begin: f64, end: f64) -> Vec<f64> {
    let mut times = vec![begin];
    loop {
        let time = times[times.len() - 1];
        let next =
            instance.new_discrete_states(time).unwrap().next_event_time.unwrap_or(end).min(end);
        let reached = integrate(instance, time, next);
        if reached >= end {
            return times;
        }
        times.push(reached);
    }
}

/// Flies 2 s in steps of 0.04 s, and in model exchange. Returns the outputs of both, and the times
/// of the events.
pub(super) fn flown(set: impl Fn(&mut ReentryPlant)) -> ([Output; 2], Vec<f64>) {
    let [mut cs, mut me] = [0, 1].map(|_| started(&set));
    assert!(super::fly(&mut cs, 0.04, 50).is_none());
    let events = exchange(&mut me, 0.0, 2.0);
    ([&mut cs, &mut me].map(|instance| outputs(instance, 2.0)), events)
}

pub(super) fn assert_same_motion(cs: &Output, me: &Output, case: &str) {
    assert!((cs.angles - me.angles).amax() < 1e-11, "{case}: {}", cs.angles - me.angles);
    assert!((cs.rates - me.rates).amax() < 1e-11, "{case}: {}", cs.rates - me.rates);
}

#[test]
fn oracle_model_exchange_agrees_with_co_simulation() {
    for kind in all_kinds() {
        let ([cs, me], events) = flown(|instance| {
            instance.parameters.kind = kind;
            instance.parameters.start = 0.3;
            instance.parameters.end = 1.7;
            instance.parameters.square_period = 0.9;
            tabulate(&mut instance.parameters, 0.9, &TABLE);
            instance.input.moment = Vector3::new(2e4, -1e4, 1e4);
        });
        assert_same_motion(&cs, &me, &format!("kind {kind:?}"));
        let expected = [1, 38, 3, 3, 6, 38, 38, 9][kind as usize];
        assert_eq!(events.len(), expected, "kind {kind:?}");
    }
}

/// Rows of a table: times (s) and directions.
const TABLE: [(f64, [f64; 3]); 3] =
    [(0.05, [1.0, 0.0, -1.0]), (0.33, [-0.5, 1.0, 0.0]), (0.61, [0.0, -1.0, 0.7])];

/// Selects a table that does not repeat and begins at 0.3 s.
pub(super) fn tabulated(instance: &mut ReentryPlant) {
    instance.parameters.kind = DisturbanceKind::Table;
    instance.parameters.start = 0.3;
    tabulate(&mut instance.parameters, 0.0, &TABLE);
}

#[test]
fn a_table_has_its_time_events_at_its_rows_and_shows_the_row_in_force() {
    let mut instance = started(tabulated);
    let expected = [0.0, 0.3, 0.3 + 0.05, 0.3 + 0.33, 0.3 + 0.61];
    assert_eq!(exchange(&mut instance, 0.0, 2.0), expected, "to the last bit");
    let bound = instance.parameters.bound;
    assert_eq!(outputs(&mut instance, 2.0).delta, Vector3::from(TABLE[2].1) * bound);
    // In co-simulation the last step holds two jumps.
    let mut instance = started(tabulated);
    for (from, to, direction) in
        [(0.0, 0.34, [0.0; 3]), (0.34, 0.4, TABLE[0].1), (0.4, 1.0, TABLE[2].1)]
    {
        step(&mut instance, from, to).unwrap();
        assert_eq!(outputs(&mut instance, to).delta, Vector3::from(direction) * bound, "{to}");
    }
}

#[test]
fn rows_of_the_table_that_are_not_used_are_ignored() {
    let [mut plain, mut other] = [0, 1].map(|_| started(tabulated));
    other.parameters.table.rows[3] = Row { time: -1.0, direction: Vector3::repeat(f64::NAN) };
    other.initialize(&CONTEXT).unwrap();
    for instance in [&mut plain, &mut other] {
        step(instance, 0.0, 2.0).unwrap();
    }
    assert_eq!(outputs(&mut plain, 2.0), outputs(&mut other, 2.0));
}

#[test]
fn oracle_model_exchange_agrees_with_co_simulation_under_surfaces_and_jets() {
    for (kind, duty) in [DisturbanceKind::None, DisturbanceKind::AgainstMoment]
        .into_iter()
        .flat_map(|kind| [(kind, false), (kind, true)])
    {
        let set = |instance: &mut ReentryPlant| {
            instance.parameters.kind = kind;
            instance.parameters.jet_duty = duty;
            actuate(instance);
        };
        let [mut cs, mut me] = [0, 1].map(|_| started(set));
        for k in 0..10 {
            let [begin, end] = [0.2 * f64::from(k), 0.2 * f64::from(k + 1)];
            for instance in [&mut cs, &mut me] {
                instance.command.jets[k as usize] = 0.9;
                instance.command.jets[9 - k as usize] = 0.2;
                instance.command.surfaces[4] = 0.1 * begin.sin();
            }
            step(&mut cs, begin, end).unwrap();
            exchange(&mut me, begin, end);
            let [cs, me] = [&mut cs, &mut me].map(|instance| outputs(instance, end));
            assert_same_motion(&cs, &me, &format!("kind {kind:?}, duty {duty}, tick {k}"));
            assert!((cs.deflections - me.deflections).amax() < 1e-13, "{}", cs.deflections);
            assert!((cs.applied_moment - me.applied_moment).amax() < 1e-7);
        }
    }
}
