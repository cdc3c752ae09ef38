//! Entry flights: co-simulation against model exchange, the end, partial derivatives, and the
//! outputs of a fixed flight condition.

use super::model_exchange::flown;
use super::prelude::*;
use super::{STATES, fly, outputs, started, step};
use crate::entry::Translation;
use vehicle::air::Row;
use vehicle::entry::Trim;

/// An entry flight without disturbance at 45 km, through wind, with surfaces and jets.
pub(super) fn entering(instance: &mut ReentryPlant) {
    super::actuate(instance);
    instance.parameters.kind = DisturbanceKind::None;
    instance.parameters.jet_duty = true;
    let entry = &mut instance.parameters.entry;
    entry.translation = Translation::Entry;
    entry.start.altitude = 45e3;
    entry.start.speed = 3000.0;
    entry.trim = Trim::Input;
    entry.air.rows = 2;
    entry.air.profile[0] = Row { altitude: 0.0, density: 0.9, wind: [20.0, -10.0] };
    entry.air.profile[1] = Row { altitude: 8e4, density: 1.1, wind: [-10.0, 40.0] };
    instance.input.trim = 0.13;
}

/// An entry flight that follows a prescribed attitude.
pub(super) fn prescribed(instance: &mut ReentryPlant) {
    let entry = &mut instance.parameters.entry;
    entry.translation = Translation::Entry;
    entry.prescribed.active = true;
    entry.start.altitude = 60e3;
    entry.start.speed = 5000.0;
    instance.parameters.initial.beta = 0.0;
    instance.input.prescribed.angles = Vector3::new(0.4, 0.0, 0.8);
}

/// Largest difference of the motion's components, relative to those above 1.
fn distance(one: &Output, other: &Output) -> f64 {
    (one.motion - other.motion).component_div(&other.motion.map(|x| x.abs().max(1.0))).amax()
}

#[test]
fn oracle_model_exchange_agrees_with_co_simulation_during_an_entry() {
    for set in [entering, prescribed] {
        let ([cs, me], _) = flown(set);
        assert!((cs.angles - me.angles).amax() < 1e-9, "{}", cs.angles - me.angles);
        assert!((cs.rates - me.rates).amax() < 1e-9);
        assert!(distance(&cs, &me) < 1e-11);
    }
}

#[test]
fn an_entry_ends_at_its_altitude_or_speed() {
    for by_speed in [false, true] {
        let mut instance = started(|instance| {
            prescribed(instance);
            instance.parameters.entry.end.altitude = if by_speed { 0.0 } else { 59_900.0 };
            instance.parameters.entry.end.speed = if by_speed { 4990.0 } else { 0.0 };
        });
        let ended = fly(&mut instance, 0.04, 2000);
        let Some(Failure::Ended { time, reason }) = ended else { panic!("{ended:?}") };
        assert!(reason.contains(if by_speed { "end.speed" } else { "end.altitude" }), "{reason}");
        let motion = outputs(&mut instance, time).motion;
        let margin = if by_speed { motion[3] - 4990.0 } else { motion[0] - 59_900.0 };
        assert!(margin <= 0.0 && margin > -1e-4, "{margin}");
        assert!(instance.new_discrete_states(time).unwrap().terminates);
    }
}

#[test]
fn oracle_an_ideal_loop_follows_the_prescribed_attitude() {
    let mut instance = started(prescribed);
    assert!(fly(&mut instance, 0.04, 1000).is_none());
    let output = outputs(&mut instance, 40.0);
    assert!((output.angles - instance.input.prescribed.angles).amax() < 1e-3, "{}", output.angles);
    assert!(output.angle_rates.amax() < 1e-3);
}

pub(super) fn in_general_motion(set: fn(&mut ReentryPlant)) -> ReentryPlant {
    let mut instance = started(set);
    instance.set_continuous_states(&STATES);
    instance.new_discrete_states(0.0).unwrap();
    instance
}

#[test]
fn a_fixed_flight_condition_shows_its_altitude_and_speed() {
    let mut instance = started(|_| {});
    step(&mut instance, 0.0, 0.04).unwrap();
    let output = outputs(&mut instance, 0.04);
    assert_eq!(output.motion[0], instance.parameters.flight.altitude);
    assert!((output.motion[3] - 3172.5).abs() < 0.1, "{}", output.motion[3]);
    assert_eq!((output.passage.mach, output.motion_rate.amax()), (9.8, 0.0));
}

/// The moment of the surfaces grows with the dynamic pressure of the flight.
#[test]
fn oracle_surfaces_act_in_proportion_to_the_dynamic_pressure() {
    let mut entry = in_general_motion(entering);
    let mut fixed = started(super::actuate);
    fixed.parameters.jet_duty = true;
    fixed.initialize(&super::CONTEXT).unwrap();
    fixed.set_continuous_states(&STATES);
    let jets = |instance: &mut ReentryPlant| {
        if let Some(plant) = &mut instance.plant {
            plant.deflections = Surfaces::zeros();
        }
        outputs(instance, 0.0).applied_moment
    };
    let with = [outputs(&mut entry, 0.0), outputs(&mut fixed, 0.0)];
    let without = [jets(&mut entry), jets(&mut fixed)];
    let pressure = with.map(|output| output.passage.dynamic_pressure);
    let surfaces = [0, 1].map(|i| (with[i].applied_moment - without[i]) / pressure[i]);
    assert!((surfaces[0] - surfaces[1]).amax() < 1e-9 * surfaces[1].amax(), "{surfaces:?}");
}

/// The result does not depend on the length of the communication steps.
#[test]
fn oracle_long_steps_of_an_entry_agree_with_short_ones() {
    let ends: Vec<Output> = [0.04, 0.5, 20.0]
        .into_iter()
        .map(|length: f64| {
            let mut instance = started(prescribed);
            assert!(fly(&mut instance, length, (20.0 / length).round() as u32).is_none());
            outputs(&mut instance, 20.0)
        })
        .collect();
    for end in &ends[1..] {
        assert!(distance(end, &ends[0]) < 1e-11);
        assert!((end.angles - ends[0].angles).amax() < 1e-9);
    }
}

/// A flight has no course where it is vertical. The message says so, and blames no input.
#[test]
fn a_flight_that_becomes_vertical_is_an_error_that_says_so() {
    let mut instance = started(|instance| {
        prescribed(instance);
        let entry = &mut instance.parameters.entry;
        entry.deviations.lift = 0.0;
        (entry.planet.rate, entry.planet.oblateness) = (0.0, 0.0);
        entry.end.altitude = 0.0;
        entry.start.altitude = 50e3;
        entry.start.speed = 100.0;
        entry.start.flight_path_angle = -89.99_f64.to_radians();
    });
    let failed = fly(&mut instance, 0.04, 200_000);
    let Some(Failure::Error(text)) = failed else { panic!("{failed:?}") };
    assert!(text.contains("the flight is vertical"), "{text}");
    // In model exchange a trial state like this is discarded.
    let mut trial = STATES;
    trial[18] = -std::f64::consts::FRAC_PI_2;
    let mut instance = in_general_motion(entering);
    instance.set_continuous_states(&trial);
    let refused = instance.calculate(0.0, LastEvent::InputSet).unwrap_err();
    assert!(matches!(&refused, Failure::Discard(text) if text.contains("vertical")), "{refused:?}");
}
