//! The status of the guarantee where the assumptions are violated: a limit may only be exceeded
//! while the guarantee is not in force. It stays in force while they are true.

use crate::harness::faulted::{DEGREE, Flown, faults, flight, fly, situations};
use crate::harness::flight::Fault;
use crate::prelude::*;

#[test]
fn no_limit_is_exceeded_under_guarantee_after_a_fault() {
    for (i, case) in faults().iter().enumerate() {
        let situation = &situations()[i % situations().len()];
        let Flown { ticks, largest, seed, .. } = fly(situation, case, 1);
        assert_eq!(ticks, 0, "{}, {}, seed {seed}: {largest}", situation.0, case.0);
    }
}

#[test]
fn lasting_errors_and_disturbances_at_their_bounds_contradict_nothing() {
    for (name, settings, age) in situations() {
        let corner = Vector3::new(1.0, -1.0, 1.0);
        let base = flight(&settings, age, 5);
        let disturbance = Waveform::Constant(corner);
        let sight = Sight::Errors(Waveform::Constant(-corner));
        let slow = Some(Slow::new(&settings, Waveform::Constant(corner), -corner));
        let shown = Flight { disturbance, sight, slow, inertia_scale: 1.05, ..base }.fly();
        assert!(shown.withdrawn.is_none() && shown.in_force > 0.99, "{name}: {shown:?}");
    }
}

#[test]
fn a_fault_that_lasts_is_not_forgiven() {
    for situation in situations() {
        let (_, settings, age) = situation;
        // At 0.6°/s the estimator's errors explain the first two seconds.
        for (size, latest) in [(0.6, 14.0), (2.0, 10.5), (3.0, 10.5)] {
            let fault = Fault::Bias(size * DEGREE, 0.0);
            let shown = Flight { fault, ..flight(&settings, age, 3) }.fly();
            assert!(shown.in_force < latest / 40.0, "{}, {size}: {shown:?}", situation.0);
        }
    }
}

#[test]
#[ignore = "minutes: for the figures of docs/guarantee.md"]
fn no_alarm_is_false_in_a_thousand_flights() {
    for (i, (_name, settings, age)) in situations().iter().enumerate() {
        let flights: Vec<Flight> = (0..250)
            .map(|seed| {
                let random = &mut Random::new(seed);
                let inertia_scale = [0.95, 1.05, random.between(0.95, 1.05)][random.below(3)];
                let seed = 90_000 + 1000 * i as u64 + seed;
                Flight { inertia_scale, ..flight(settings, *age, seed) }
            })
            .collect();
        for (flight, shown) in flights.iter().zip(in_parallel(&flights, Flight::fly)) {
            assert!(shown.withdrawn.is_none() && !shown.broken, "{}: {shown:?}", flight.seed);
        }
    }
}
