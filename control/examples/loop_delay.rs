//! Flies loops whose delay is another one than the controller was told, and loops with the delay
//! that it was told, and prints how soon the difference is found, and how often it is found where
//! there is none.
//!
//! `cargo run --release -p reentry-control --example loop_delay -- 1000`

use control::controller::{Controller, Measurement};
use control::crmpc::{Constraints, Guarantee, Settings};
use control::delay::{Delayed, Latency};
use control::lqr::{Lqr, LqrSettings};
use control::{Crmpc, error::DesignError};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::disturbance::Kind;
use vehicle::plant::Plant;

const PERIOD: f64 = 0.04;

/// Returns the time at which another delay is found, s, and the estimate at the end, s.
fn fly<C: Controller>(
    law: Result<C, DesignError>,
    scenario: &Scenario,
    told: f64,
    truly: f64,
    seconds: f64,
) -> (Option<f64>, f64) {
    let body = scenario.inertia.body(1.0).unwrap();
    let limit = f64::INFINITY;
    let mut law =
        Delayed::new(law.unwrap(), body, PERIOD, Latency::of_action(told), limit).unwrap();
    let mut memory = law.memory();
    let mut config = scenario.config(0.01);
    config.moment_delay = truly;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let mut found = None;
    for tick in 0..(seconds / PERIOD) as u64 {
        let time = tick as f64 * PERIOD;
        let measured =
            Measurement { angles: plant.angles(), rates: plant.rates(), ..Measurement::default() };
        let moment =
            law.update(&mut memory, tick, time, &measured, &|time| scenario.reference.at(time));
        if memory.loop_delay.is_other && found.is_none() {
            found = Some(time);
        }
        if plant.advance(time, time + PERIOD, moment).is_err() {
            break;
        }
    }
    (found, law.estimated_delay(&memory))
}

fn main() {
    let flights: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(100);
    for kind in [Kind::White, Kind::Constant, Kind::Square] {
        for is_lqr in [false, true] {
            for (told, truly) in
                [(0.0, 0.04), (0.04, 0.04), (0.0, 0.0), (0.04, 0.0), (0.0, 0.02), (0.0, 0.12)]
            {
                let mut times = Vec::new();
                let mut estimates = Vec::new();
                for seed in 0..flights {
                    let mut scenario = Scenario::crmpc2022();
                    scenario.disturbance.kind = kind;
                    scenario.disturbance.seed = 1000 + seed;
                    let corner = |bit: u64| if seed >> bit & 1 == 0 { 1.0 } else { -1.0 };
                    scenario.disturbance.direction = Vector3::new(corner(0), corner(1), corner(2));
                    scenario.disturbance.square_period = 1.0 + 0.37 * (seed % 29) as f64;
                    scenario.inertia_scale = 0.95 + 0.1 * ((seed * 7919) % 101) as f64 / 100.0;
                    let body = scenario.inertia.body(1.0).unwrap();
                    let outcome = if is_lqr {
                        let settings =
                            LqrSettings { body, p: [50.0; 6], q: [10.0; 3], period: PERIOD };
                        fly(Lqr::new(settings), &scenario, told, truly, 50.0)
                    } else {
                        let mut settings = Settings::new(Constraints::Robust);
                        settings.delay = told;
                        settings.guarantee = Guarantee::BestEffort;
                        fly(Crmpc::new(settings), &scenario, told, truly, 50.0)
                    };
                    times.push(outcome.0.unwrap_or(f64::INFINITY));
                    estimates.push(outcome.1);
                }
                times.sort_by(f64::total_cmp);
                estimates.sort_by(f64::total_cmp);
                let within = times.iter().filter(|time| **time <= 10.0).count();
                let ever = times.iter().filter(|time| time.is_finite()).count();
                println!(
                    "{kind:?} {} told {told} truly {truly}: within 10 s {within}, ever {ever} of {flights}; median {:.2} s, p95 {:.2}; estimates {:.4} {:.4} {:.4}",
                    if is_lqr { "LQR" } else { "CRMPC" },
                    times[times.len() / 2],
                    times[times.len() * 95 / 100],
                    estimates[0],
                    estimates[estimates.len() / 2],
                    estimates[estimates.len() - 1],
                );
            }
        }
    }
}
