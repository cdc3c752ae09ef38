//! CRMPC with the robust set reaches a reference that jumps and then stays, and its guarantee stays
//! in force on the way.

mod harness;

use control::controller::{Controller, Measurement, Preview};
use control::crmpc::{Constraints, Crmpc, GuaranteeStatus, Settings};
use harness::flight::Random;
use harness::settings;
use nalgebra::Vector3;
use std::f64::consts::PI;
use vehicle::Scenario;
use vehicle::disturbance::DisturbanceKind;
use vehicle::plant::Plant;
use vehicle::profile::Profile;
use vehicle::reference::Reference;

const PERIOD: f64 = 0.04;
/// Time of the jump, s.
const JUMP: f64 = 5.0;
/// Distance at which the vehicle has arrived, rad.
const NEAR: f64 = 2.0 * PI / 180.0;
/// Largest rate of the turn, which the tube leaves, rad/s, and an acceleration that the moment
/// allows about any axis, rad/s².
const RATE: f64 = 4.29 * PI / 180.0;
const ACCELERATION: f64 = 2.0 * PI / 180.0;

/// A jump of the reference, with the vehicle's start and what disturbs it.
#[derive(Clone, Copy, Debug)]
struct Jump {
    horizon: usize,
    before: Vector3<f64>,
    after: Vector3<f64>,
    rates: Vector3<f64>,
    disturbance: DisturbanceKind,
    seed: u64,
}

/// What came out: when the vehicle arrived for good, s; whether the guarantee was in force at the
/// jump and at every tick behind it; the most iterations of an optimisation.
struct Arrival {
    time: f64,
    was_in_force: bool,
    stayed_in_force: bool,
    iterations: u32,
}

fn attitude(random: &mut Random) -> Vector3<f64> {
    let degrees = Vector3::new(
        random.between(0.0, 45.0),
        random.between(-10.0, 10.0),
        random.between(-170.0, 170.0),
    );
    degrees.map(f64::to_radians)
}

impl Jump {
    fn random(random: &mut Random, seed: u64) -> Self {
        let kinds = [DisturbanceKind::None, DisturbanceKind::White, DisturbanceKind::Constant];
        let size = random.between(0.0, 1f64.to_radians());
        Self {
            horizon: random.between(5.0, 250.0) as usize,
            before: attitude(random),
            after: attitude(random),
            rates: random.direction(size),
            disturbance: kinds[seed as usize % kinds.len()],
            seed,
        }
    }

    /// Time of the turn: at the largest rate, with a start and an end, s.
    fn duration(&self) -> f64 {
        (self.after - self.before).norm() / RATE + RATE / ACCELERATION
    }

    fn fly(&self) -> Arrival {
        let settings = Settings { horizon: self.horizon, ..settings(Constraints::Robust) };
        let mut law = Crmpc::new(settings).unwrap();
        let mut scenario = Scenario::crmpc2022();
        (scenario.initial_angles, scenario.initial_rates) = (self.before, self.rates);
        scenario.disturbance.kind = self.disturbance;
        scenario.disturbance.seed = self.seed;
        scenario.reference = Profile::constant(self.before);
        let mut plant = Plant::new(&scenario.config(0.01), 0.0).unwrap();
        let mut memory = law.memory();
        let mut arrival =
            Arrival { time: 0.0, was_in_force: false, stayed_in_force: true, iterations: 0 };
        let stop = JUMP + self.duration() + 12.0;
        for tick in 0..(stop / PERIOD) as u64 {
            let time = tick as f64 * PERIOD;
            let angles = if time < JUMP { self.before } else { self.after };
            let preview = Preview::External(Reference { angles, ..Reference::default() }, time);
            let (angles, rates) = (plant.angles(), plant.rates());
            let measured = Measurement { angles, rates, ..Measurement::default() };
            let reference = |time| preview.at(time);
            let moment = law.update(&mut memory, tick, time, &measured, &reference);
            let in_force = memory.supervision.status == GuaranteeStatus::InForce;
            if time < JUMP {
                arrival.was_in_force = in_force;
            } else {
                arrival.stayed_in_force &= in_force;
                if (angles - self.after).norm() > NEAR {
                    arrival.time = time - JUMP;
                }
            }
            arrival.iterations = arrival.iterations.max(memory.report.iterations);
            plant.advance(time, time + PERIOD, moment).unwrap();
        }
        arrival
    }
}

/// Flies a number of random jumps and the bank reversal of an entry. Returns the most iterations.
fn check(count: u64) -> u32 {
    let mut random = Random::new(51);
    let reversal = Jump {
        horizon: 100,
        before: Vector3::new(35.0, 0.0, -60.0).map(f64::to_radians),
        after: Vector3::new(35.0, 0.0, 60.0).map(f64::to_radians),
        rates: Vector3::zeros(),
        disturbance: DisturbanceKind::None,
        seed: 0,
    };
    let jumps = (0..count).map(|seed| Jump::random(&mut random, seed));
    let mut most = 0;
    for jump in std::iter::once(reversal).chain(jumps) {
        let arrival = jump.fly();
        assert!(arrival.time <= jump.duration() + 8.0, "{jump:?} took {} s", arrival.time);
        assert!(arrival.stayed_in_force || !arrival.was_in_force, "{jump:?}");
        most = most.max(arrival.iterations);
    }
    most
}

#[test]
fn a_jump_of_the_reference_is_followed_under_guarantee() {
    let most = check(12);
    assert!(most <= 60, "{most} iterations");
}

#[test]
#[ignore = "a minute: for the figures of docs/guarantee.md"]
fn a_thousand_jumps_are_followed_under_guarantee() {
    println!("most iterations: {}", check(1000));
}
