//! Loops while the trajectory turns, with and without the turn as an input of the laws.

use crate::prelude::*;
use vehicle::actuators::Command;

const PERIOD: f64 = 0.04;

/// A heading that turns to both sides by at most this rate (deg/s), and a flight path angle that
/// falls, as in a guided entry with its bank reversals.
fn trajectory(turn: f64, time: f64) -> Trajectory {
    Trajectory {
        heading_rate: turn.to_radians() * (0.25 * time).cos(),
        flight_path_angle_rate: -0.046_f64.to_radians(),
        ..Trajectory::default()
    }
}

/// Flies the scenario of Chai 2022. Calls `observe` with the memory and the plant at each tick.
fn fly<C: Controller>(
    law: &mut C,
    scenario: &Scenario,
    turn: f64,
    is_known: bool,
    mut observe: impl FnMut(&C::Memory, f64, &Plant),
) {
    let mut memory = law.memory();
    let mut config = scenario.config(0.01);
    config.earth_rate = 0.0;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    for tick in 0..(scenario.duration / PERIOD).round() as u64 {
        let time = tick as f64 * PERIOD;
        let told = if is_known { trajectory(turn, time) } else { Trajectory::default() };
        let (angles, rates) = (plant.angles(), plant.rates());
        let measured = Measurement { angles, rates, ..Measurement::default() };
        let measured = measured.relative_to(&told.turn_rate(0.0));
        let reference = |time: f64| scenario.reference.at(time);
        let moment = law.update(&mut memory, tick, time, &measured, &reference);
        let input = |time| Input { moment, trajectory: trajectory(turn, time), ..Input::default() };
        plant.advance_with(time, time + PERIOD, &Command::default(), input).unwrap();
        observe(&memory, time, &plant);
    }
}

/// Flies CRMPC with this bound on the change of the turn (deg/s). Returns the share of ticks in
/// force, the largest ‖ω‖ over its limit while it was, and the first contradiction.
fn guaranteed(scenario: &Scenario, turn: f64, is_known: bool, bound: f64) -> (f64, f64, String) {
    let turn_change = bound.to_radians();
    let settings = Settings { turn_change, ..Settings::new(Constraints::Robust) };
    let mut law = Crmpc::new(settings).unwrap();
    let (mut in_force, mut ticks, mut largest) = (0_u32, 0_u32, 0.0_f64);
    let mut contradiction = Contradiction::None;
    fly(&mut law, scenario, turn, is_known, |memory, _, plant| {
        ticks += 1;
        if contradiction == Contradiction::None {
            contradiction = memory.supervision.contradiction;
        }
        if memory.supervision.status == GuaranteeStatus::InForce {
            in_force += 1;
            largest = largest.max(plant.rates().norm() / scenario.limit_rate);
        }
    });
    (f64::from(in_force) / f64::from(ticks), largest, format!("{contradiction:?}"))
}

#[test]
fn oracle_a_turn_that_is_known_leaves_the_guarantee_in_force() {
    for kind in [DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Square] {
        // A guided flight turns by 0.35 deg/s, with dispersions by 0.5.
        for turn in [0.1, 0.35, 0.6] {
            let mut scenario = Scenario::crmpc2022();
            scenario.disturbance.kind = kind;
            // The remainder of the turn is a part of Δ.
            scenario.disturbance.bound -= 0.15_f64.to_radians() * turn / 0.6;
            let (share, rate, why) = guaranteed(&scenario, turn, true, 0.1);
            assert!(share == 1.0 && rate <= 1.0, "{kind:?} {turn}: {share} {rate} {why}");
            let (share, _, _) = guaranteed(&scenario, turn, false, 0.1);
            assert!(share < 0.7, "{kind:?} {turn}: {share}");
            let (share, _, why) = guaranteed(&scenario, turn, true, 0.01 * turn);
            assert!(share < 0.9 && why == "Turn", "{kind:?} {turn}: {share} {why}");
        }
    }
}

#[test]
fn oracle_the_rate_itself_keeps_its_limit_while_the_trajectory_turns() {
    // With the wings upright a turn of the heading adds to the rate of the angle of attack.
    let mut largest = 0.0_f64;
    for (sign, turn) in [(1.0, 0.6), (-1.0, 0.6), (1.0, -0.6), (-1.0, -0.6)] {
        let alpha = |alpha: f64| Vector3::new(alpha, 0.0, 80.0).map(f64::to_radians);
        let mut scenario = Scenario::crmpc2022();
        let (from, to) = (alpha(25.0 - 20.0 * sign), alpha(25.0 + 20.0 * sign));
        scenario.reference = Profile::step(from, to, 0.4);
        scenario.initial_angles = from;
        scenario.disturbance.kind = DisturbanceKind::AlongRate;
        scenario.disturbance.bound -= 0.15_f64.to_radians();
        let (share, rate, why) = guaranteed(&scenario, turn, true, 0.1);
        assert!(share == 1.0 && rate <= 1.0, "{turn}: {share} {rate} {why}");
        largest = largest.max(rate);
    }
    assert!(largest > 0.9, "{largest}");
}

#[test]
fn a_turn_that_jumps_at_an_optimisation_ends_the_guarantee() {
    let settings = Settings { delay: 0.04, ..Settings::new(Constraints::Robust) };
    let mut law = Crmpc::new(settings).unwrap();
    let mut memory = law.memory();
    let scenario = Scenario::crmpc2022();
    let reference = |_: f64| vehicle::reference::Reference {
        angles: scenario.initial_angles,
        ..Default::default()
    };
    // The vehicle rests, and receives turns from tick 20 on, which is an optimisation.
    for (tick, jump) in (0..=20).map(|tick| (tick, if tick < 20 { 0.2 } else { 0.35 })) {
        let turn = Vector3::z() * f64::to_radians(jump);
        let measured =
            Measurement { angles: scenario.initial_angles, turn, ..Measurement::default() };
        law.update(&mut memory, tick, tick as f64 * PERIOD, &measured, &reference);
        let expected = if tick < 20 { Contradiction::None } else { Contradiction::Turn };
        assert_eq!(memory.supervision.contradiction, expected, "{tick}");
    }
}
