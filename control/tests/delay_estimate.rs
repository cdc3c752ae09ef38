//! Tests of the estimate of the delay of a loop.

use crate::prelude::*;
use control::delay::Memory;

const PERIOD: f64 = 0.04;

/// Outcome of a flight.
struct Flight {
    /// Time at which a delay other than the declared one is found, s.
    found_at: Option<f64>,
    /// Estimated delay at the end, s.
    estimate: f64,
    contradiction: Contradiction,
    status: GuaranteeStatus,
}

fn fly(kind: DisturbanceKind, seed: u64, (told, truly): (f64, f64), scale: f64) -> Flight {
    let mut scenario = Scenario::crmpc2022();
    (scenario.disturbance.kind, scenario.disturbance.seed) = (kind, seed);
    scenario.disturbance.square_period = 1.5;
    scenario.inertia_scale = scale;
    let mut settings = Settings::new(Constraints::Robust);
    (settings.delay, settings.guarantee) = (told, Guarantee::BestEffort);
    let (law, latency) =
        (Crmpc::new(settings).unwrap(), Latency { measurement: 0.0, action: told });
    let mut law = Delayed::new(law, settings.body, PERIOD, latency, f64::INFINITY).unwrap();
    let mut memory = law.memory();
    let mut config = scenario.config(0.01);
    config.moment_delay = truly;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let mut found_at = None;
    for tick in 0..500 {
        let time = f64::from(tick) * PERIOD;
        let measured =
            Measurement { angles: plant.angles(), rates: plant.rates(), ..Measurement::default() };
        let reference = |time: f64| scenario.reference.at(time);
        let moment = law.update(&mut memory, tick as u64, time, &measured, &reference);
        found_at = found_at.or(memory.loop_delay.is_other.then_some(time));
        plant.advance(time, time + PERIOD, moment).unwrap();
    }
    let supervision = memory.inner.supervision;
    Flight {
        found_at,
        estimate: law.estimated_delay(&memory),
        contradiction: supervision.contradiction,
        status: supervision.status,
    }
}

#[test]
fn oracle_a_delay_that_was_not_told_is_found_and_ends_the_guarantee() {
    for kind in [DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Square] {
        for (told, truly) in [(0.0, 0.04), (0.04, 0.0), (0.0, 0.12)] {
            let flight = fly(kind, 3, (told, truly), 0.97);
            let is_found = flight.found_at.is_some_and(|time| time <= 15.0);
            assert!(is_found, "{kind:?} {told} {truly} {:?}", flight.found_at);
            assert!((flight.estimate - truly).abs() <= 0.25 * PERIOD + 1e-9, "{}", flight.estimate);
            assert_eq!(flight.contradiction, Contradiction::Delay);
            assert_eq!(flight.status, GuaranteeStatus::Exceeded);
        }
    }
}

#[test]
fn oracle_a_delay_that_was_told_is_not_doubted() {
    for kind in [DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Square] {
        for delay in [0.0, 0.04] {
            for scale in [0.95, 1.05] {
                let flight = fly(kind, 5, (delay, delay), scale);
                assert_eq!(flight.found_at, None, "{kind:?} {delay}");
                assert!((flight.estimate - delay).abs() <= 0.5 * PERIOD);
                assert_eq!(flight.contradiction, Contradiction::None);
            }
        }
    }
}

/// A controller that only serves for its reference has no measurements.
#[test]
fn oracle_commands_that_do_not_act_tell_no_delay() {
    let scenario = Scenario::crmpc2022();
    let settings = Settings::new(Constraints::Robust);
    let (body, limit) = (settings.body, f64::INFINITY);
    let law = Crmpc::new(settings).unwrap();
    let mut law =
        Delayed::new(law, body, PERIOD, Latency { measurement: 0.0, action: 0.0 }, limit).unwrap();
    let mut memory = law.memory();
    for tick in 0..1500 {
        let time = tick as f64 * PERIOD;
        let reference = |time: f64| scenario.reference.at(time);
        law.update(&mut memory, tick, time, &Measurement::default(), &reference);
        assert!(!memory.loop_delay.is_other, "{time} s");
    }
}

#[test]
fn a_memory_that_begins_as_the_default_one_gives_the_same_estimate() {
    let (scenario, settings) = (Scenario::crmpc2022(), Settings::new(Constraints::Robust));
    let (body, latency) = (settings.body, Latency { measurement: 0.0, action: PERIOD });
    let law = Crmpc::new(settings).unwrap();
    let mut law = Delayed::new(law, body, PERIOD, latency, f64::INFINITY).unwrap();
    let mut memories = [law.memory(), Memory::default()];
    for tick in 0..60 {
        let time = tick as f64 * PERIOD;
        let measured = Measurement {
            angles: scenario.initial_angles,
            rates: Vector3::new(0.01, -0.02, 0.015) * (3.0 * time).sin(),
            ..Measurement::default()
        };
        let reference = |time: f64| scenario.reference.at(time);
        let [made, default] =
            memories.each_mut().map(|memory| law.update(memory, tick, time, &measured, &reference));
        assert_eq!(made, default, "{time} s");
    }
    assert_eq!(memories[0].loop_delay, memories[1].loop_delay);
    assert_ne!(memories[0].loop_delay, law.memory().loop_delay);
}
