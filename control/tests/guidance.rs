//! Entry guidance: where its flights end, and the limits of its reference.

use crate::harness::entry::{Flight, fly, fly_for, start};
use control::guidance::{Command, Guidance, Limits, Memory, Navigation, PERIOD, Settings, Shaped};
use proptest::prelude::*;
use vehicle::entry::Motion;
use vehicle::noise::uniform;

#[test]
fn regress_the_nominal_flights_end_in_the_terminal_area() {
    for flight in [Flight::nominal(), Flight::lower()] {
        let settings = Settings::default();
        let outcome = fly(&settings, &flight, |_, _, memory| {
            assert!(memory.command.in_reach);
        });
        assert!(outcome.arrived(), "{} m to go", outcome.range);
        assert!((outcome.end[0] - settings.target.altitude).abs() < 500.0, "{}", outcome.end[0]);
        assert!((outcome.end[3] - settings.target.speed).abs() < 1.0, "{}", outcome.end[3]);
        assert!(outcome.memory.reversals >= 3);
        assert!((1500.0..2000.0).contains(&outcome.seconds), "{} s", outcome.seconds);
        assert!(outcome.greatest_load < 1.3 && outcome.greatest_pressure < 14e3);
        assert!(outcome.greatest_turn.to_degrees() < 0.45, "{}", outcome.greatest_turn);
    }
}

/// At the last tick the verdict is the result of the flight. A target in reach at the first tick is
/// reached, if the vehicle is as the guidance expects. A near target may be reached although no
/// plan does so at first, because later plans hold the largest bank angle for longer.
#[test]
fn oracle_the_verdict_on_reach_is_the_end_of_the_flight() {
    let mut ends = [0, 0];
    for shift in [-1.2, -0.9, -0.8, -0.6, -0.45, 0.45, 0.9, 1.2, 1.4] {
        let mut settings = Settings::default();
        settings.target.longitude += shift;
        let mut first = None;
        let outcome = fly(&settings, &Flight::nominal(), |_, _, memory| {
            first.get_or_insert(memory.command.in_reach);
        });
        let miss = (outcome.range - settings.target.range).abs();
        let arrives = miss <= settings.target.tolerance;
        assert_eq!(outcome.memory.command.in_reach, arrives, "{shift}: {miss} m at the last tick");
        let expected = arrives && shift > -0.5;
        assert_eq!(first, Some(expected), "{shift}: {miss} m at the first tick");
        ends[usize::from(arrives)] += 1;
    }
    assert!(ends[0] >= 4 && ends[1] >= 4, "{ends:?}");
}

/// Returns the command after this many ticks of a motion that stands still.
fn commanded(settings: &Settings, motion: Motion, ticks: u64) -> Command {
    let guidance = Guidance::new(*settings).unwrap();
    let mut memory = Memory::default();
    let navigation = Navigation { motion, ..Navigation::default() };
    (0..ticks).map(|tick| guidance.update(&mut memory, tick, &navigation)).last().unwrap()
}

/// Whatever is measured, before or during a flight, the guidance answers with finite numbers; what
/// is no entry flight leaves the command, and is neither in reach nor within limits.
#[test]
fn the_last_command_is_held_while_the_measurements_are_those_of_no_flight() {
    let guidance = Guidance::new(Settings::default()).unwrap();
    let good = Navigation { motion: Flight::lower().start, ..Navigation::default() };
    let values = [0.0, -1.0, 1e-300, 1.6, -1e9, 1e9, 1e200, -f64::MAX, f64::MAX, f64::NAN];
    for begun in [false, true] {
        let mut memory = Memory::default();
        let before = begun.then(|| guidance.update(&mut memory, 0, &good));
        for (i, value) in (0..8).flat_map(|i| values.map(|value| (i, value))) {
            let mut memory = memory;
            let mut measured = good;
            match i {
                6 => measured.lift = value,
                7 => measured.drag = value,
                _ => measured.motion[i] = value,
            }
            for tick in 25..40 {
                let command = guidance.update(&mut memory, tick, &measured);
                assert!(guidance.fits(&memory), "{i} {value}: {command:?}");
                if !guidance.is_plausible(&measured) {
                    assert!(!command.in_reach && !command.keeps_limits, "{i} {value}");
                    let held = before.map_or(Settings::default().initial.sigma, |last| last.bank);
                    assert_eq!(command.bank, held, "{i} {value}");
                }
            }
            let again = guidance.update(&mut memory, 50, &good);
            let is_held = !guidance.is_plausible(&measured);
            assert!(again.in_reach && again.keeps_limits || !is_held, "{i} {value}: {again:?}");
        }
    }
}

/// The first turn is towards the target: a positive bank angle turns to the left.
#[test]
fn oracle_the_first_bank_turns_towards_the_target() {
    for (heading, is_positive) in [(70.0, true), (50.0, false)] {
        let motion = start([120e3, 0.0, -10.0, 7450.0, -1.2, heading]);
        let command = commanded(&Settings::default(), motion, 1);
        assert_eq!(command.bank > 0.0, is_positive, "{}", command.bank);
    }
}

/// A target can be too far away. From too steep a start no bank angle keeps the limits, from too
/// flat a start none reaches the target, and from 120 km with −1° and 7,500 m/s eastward over the
/// equator the vehicle skips at every bank angle.
#[test]
fn a_start_or_a_target_that_is_not_feasible_is_reported() {
    let mut far = Settings::default();
    far.target.longitude += 1.5;
    let command = commanded(&far, Flight::nominal().start, 250);
    assert!(!command.in_reach && command.miss > 1e5, "{command:?}");
    for path in [-4.0, -0.5] {
        let motion = start([120e3, 0.0, -10.0, 7450.0, path, 60.0]);
        let command = commanded(&Settings::default(), motion, 1);
        assert!(!command.keeps_limits || !command.in_reach, "{path}: {command:?}");
    }
    let skipping = start([120e3, 0.0, 0.0, 7500.0, -1.0, 90.0]);
    let command = commanded(&Settings::default(), skipping, 1);
    assert!(!command.in_reach, "{command:?}");
}

/// From too fast a start the vehicle skips, and the predicted range changes by hundreds of kilometres
/// from one correction to the next.
#[test]
fn the_verdict_on_reach_does_not_flicker_in_a_skip() {
    let fast =
        Flight { start: start([120e3, 0.0, -10.0, 7600.0, -1.0, 60.0]), ..Flight::nominal() };
    let mut settings = Settings::default();
    settings.target.longitude += 0.3;
    let mut verdicts = Vec::new();
    fly_for(&settings, &fast, 2750.0, |_, _, memory| verdicts.push(memory.command.in_reach));
    let changes = verdicts.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(verdicts.len() > 2700 && changes == 0, "{changes} of {}", verdicts.len());
}

/// Without damping the flight skips several times.
#[test]
fn the_damped_flight_descends_without_a_skip() {
    let climbs = |gain: f64| {
        let mut settings = Settings::default();
        settings.damping.gain = gain;
        let (mut climbs, mut before) = (0.0, f64::INFINITY);
        let outcome = fly(&settings, &Flight::nominal(), |_, motion, _| {
            climbs += (motion[0] - before).max(0.0);
            before = motion[0];
        });
        (climbs, outcome.greatest_heat_flux)
    };
    let (damped, flux) = climbs(Settings::default().damping.gain);
    let (free, largest) = climbs(0.0);
    assert!(damped < 500.0 && free > 5e3, "{damped} m, {free} m");
    assert!(flux < 0.87 * largest, "{flux} W/m², {largest} W/m²");
}

/// The verdict at the first tick is what the flight shows, and a limit that is called feasible is
/// kept also by dispersed flights within 2 %.
#[test]
fn oracle_a_limit_is_kept_or_called_infeasible() {
    let mut verdicts = [0, 0];
    for limit in [400e3, 425e3, 470e3, 500e3] {
        let mut settings = Settings::default();
        settings.limit.heat_flux = limit;
        let mut first = None;
        let outcome = fly(&settings, &Flight::nominal(), |_, _, memory| {
            first.get_or_insert(memory.command.keeps_limits);
        });
        let ratio = outcome.greatest_heat_flux / limit;
        assert!(if first == Some(true) { ratio < 1.01 } else { ratio > 0.99 }, "{limit}: {ratio}");
        verdicts[usize::from(first == Some(true))] += 1;
    }
    assert!(verdicts[0] > 0 && verdicts[1] > 0, "{verdicts:?}");
    let mut settings = Settings::default();
    settings.limit.heat_flux = 470e3;
    for number in 3000..3006 {
        let outcome = fly(&settings, &Flight::dispersed(0.1, uniform(2, number)), |_, _, _| {});
        assert!(outcome.greatest_heat_flux < 480e3, "{number}: {}", outcome.greatest_heat_flux);
        assert!(outcome.arrived(), "{number}: {} m to go", outcome.range);
    }
}

#[test]
fn settings_that_cannot_work_are_refused_by_name() {
    type Change = fn(&mut Settings);
    let cases: [(Change, &str); 3] = [
        (|settings| settings.shaping.bank_rate = 0.0, "shaping.bankRate"),
        (|settings| settings.limit.pressure = 12e3, "limit.pressure = 12000 is less than"),
        (|settings| settings.limit.load = 1.1, "limit.load = 1.1 is less than"),
    ];
    for (change, part) in cases {
        let mut settings = Settings::default();
        change(&mut settings);
        let text = Guidance::new(settings).unwrap_err().to_string();
        assert!(text.contains(part), "{text}");
    }
}

proptest! {
    #[test]
    fn oracle_the_reference_keeps_to_its_limits_and_does_not_overshoot(
        commands in prop::collection::vec(-1.5..1.5, 1..6), rate in 0.01..0.2, acceleration in 0.002..0.1,
    ) {
        let limits = Limits { rate, acceleration };
        let mut shaped = Shaped::default();
        for command in commands {
            for _ in 0..500 {
                shaped.follow(command, &limits, PERIOD);
                prop_assert!(shaped.rate.abs() <= rate * (1.0 + 1e-12));
                prop_assert!(shaped.acceleration.abs() <= acceleration * (1.0 + 1e-12));
            }
        }
        // From standstill it arrives without going beyond.
        let mut shaped = Shaped::default();
        let mut ticks = 0.0;
        while (shaped.value - 1.0).abs() > 1e-3 {
            shaped.follow(1.0, &limits, PERIOD);
            ticks += 1.0;
            prop_assert!(shaped.value <= 1.0 + 1e-12);
        }
        // The least time: a trapezoid or a triangle of the rate.
        let ramp = rate / acceleration;
        let least = if rate * ramp <= 1.0 {
            1.0 / rate + ramp
        } else {
            2.0 / acceleration.sqrt()
        };
        let taken = ticks * PERIOD;
        prop_assert!(taken < least + 12.0 * PERIOD + 0.1 * least, "{} s instead of {} s", taken, least);
    }
}
