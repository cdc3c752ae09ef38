//! Flies loops whose delay differs from the declared one, and loops with the declared delay. It
//! prints how soon a difference is found, and how often one is found where there is none.
//!
//! `cargo run --release -p reentry-control --example loop_delay -- 1000`

use control::controller::{Controller, Measurement};
use control::crmpc::{Constraints, Guarantee, Settings};
use control::delay::{Delayed, Latency};
use control::lqr::{Lqr, LqrSettings};
use control::{Crmpc, error::DesignError};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::disturbance::DisturbanceKind;
use vehicle::plant::Plant;

const PERIOD: f64 = 0.04;
const SECONDS: f64 = 50.0;
/// Periods of the square waves, s. Those up to some optimisation periods are the hardest.
const SQUARE_PERIODS: [f64; 12] = [0.08, 0.12, 0.16, 0.2, 0.24, 0.4, 0.6, 0.8, 1.2, 2.0, 5.0, 11.0];

/// Returns the time at which another delay is found, s, the time at which the assumptions no longer
/// explain the measurements, s, and the estimate at the end, s.
fn fly<C: Controller>(
    law: Result<C, DesignError>,
    scenario: &Scenario,
    told: f64,
    truly: f64,
    seconds: f64,
) -> [f64; 3] {
    let body = scenario.inertia.body(1.0).unwrap();
    let limit = f64::INFINITY;
    let mut law =
        Delayed::new(law.unwrap(), body, PERIOD, Latency::of_action(told), limit).unwrap();
    let mut memory = law.memory();
    let mut config = scenario.config(0.01);
    config.moment_delay = truly;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let [mut found_at, mut contradicted] = [f64::INFINITY; 2];
    for tick in 0..(seconds / PERIOD) as u64 {
        let time = tick as f64 * PERIOD;
        let measured =
            Measurement { angles: plant.angles(), rates: plant.rates(), ..Measurement::default() };
        let moment =
            law.update(&mut memory, tick, time, &measured, &|time| scenario.reference.at(time));
        if memory.loop_delay.is_other {
            found_at = found_at.min(time);
        }
        if memory.loop_delay.is_unexplained {
            contradicted = contradicted.min(time);
        }
        if plant.advance(time, time + PERIOD, moment).is_err() {
            break;
        }
    }
    [found_at, contradicted, law.estimated_delay(&memory)]
}

/// Returns the scenario of a flight, with a seed, a corner, a square wave and an inertia.
fn scenario(kind: DisturbanceKind, flight: u64) -> Scenario {
    let mut scenario = Scenario::crmpc2022();
    let corner = |bit: u64| if flight >> bit & 1 == 0 { 1.0 } else { -1.0 };
    let disturbance = &mut scenario.disturbance;
    (disturbance.kind, disturbance.seed) = (kind, 1000 + flight);
    disturbance.direction = Vector3::new(corner(0), corner(1), corner(2));
    disturbance.square_period = SQUARE_PERIODS[flight as usize / 8 % SQUARE_PERIODS.len()];
    scenario.inertia_scale = 0.95 + 0.001 * ((flight * 7919) % 101) as f64;
    scenario
}

fn outcome(is_lqr: bool, scenario: &Scenario, (told, truly): (f64, f64)) -> [f64; 3] {
    if is_lqr {
        let body = scenario.inertia.body(1.0).unwrap();
        let settings = LqrSettings { body, p: [50.0; 6], q: [10.0; 3], period: PERIOD };
        return fly(Lqr::new(settings), scenario, told, truly, SECONDS);
    }
    let mut settings = Settings::new(Constraints::Robust);
    (settings.delay, settings.guarantee) = (told, Guarantee::BestEffort);
    fly(Crmpc::new(settings), scenario, told, truly, SECONDS)
}

fn main() {
    let flights: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(100);
    println!(
        "law, disturbance, declared and true delay: share found within 10 s, found ever, 95 % found at; assumptions contradicted within 10 s, ever; estimates"
    );
    for is_lqr in [false, true] {
        for kind in [DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Square] {
            for delays in [(0.0, 0.04), (0.04, 0.0), (0.0, 0.12), (0.0, 0.0), (0.04, 0.04)] {
                let outcomes = (0..flights).map(|n| outcome(is_lqr, &scenario(kind, n), delays));
                let mut sorted = [Vec::new(), Vec::new(), Vec::new()];
                for outcome in outcomes {
                    sorted.iter_mut().zip(outcome).for_each(|(values, value)| values.push(value));
                }
                let [found_times, contradicted, estimates] = sorted.map(|mut values| {
                    values.sort_by(f64::total_cmp);
                    values
                });
                let share = |times: &[f64], within: f64| {
                    100.0 * times.partition_point(|time| *time <= within) as f64 / flights as f64
                };
                println!(
                    "{} {kind:?} {delays:?}: {:.1} %, {:.1} %, {:.2} s; {:.1} %, {:.1} %; {:.3} to {:.3} s",
                    if is_lqr { "LQR" } else { "CRMPC" },
                    share(&found_times, 10.0),
                    share(&found_times, SECONDS),
                    found_times[found_times.len() * 95 / 100],
                    share(&contradicted, 10.0),
                    share(&contradicted, SECONDS),
                    estimates[0],
                    estimates[estimates.len() - 1],
                );
            }
        }
    }
}
