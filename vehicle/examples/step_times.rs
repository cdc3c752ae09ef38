//! Times a step of the plant of 0.04 s, at a fixed flight condition and during an entry flight.

use std::hint::black_box;
use std::time::Instant;
use vehicle::aerodynamics::Aerodynamics;
use vehicle::air::Air;
use vehicle::entry::{Config, Deviations, End, Following, Motion, Trim};
use vehicle::translation::Planet;
use vehicle::{Plant, Scenario};

const STEPS: u32 = 5_000;

fn main() {
    let mut scenario = Scenario::crmpc2022();
    scenario.disturbance.bound = 0.0;
    scenario.initial_rates.fill(0.0);
    let mut config = scenario.config(0.01);
    let seconds = |config: &vehicle::plant::Config| {
        let mut plant = Plant::new(config, 0.0).expect("the configuration is good");
        let begin = Instant::now();
        for k in 0..STEPS {
            let (from, to) = (f64::from(k) * 0.04, f64::from(k + 1) * 0.04);
            plant.advance(from, to, nalgebra::Vector3::zeros()).expect("it flies");
        }
        black_box(plant.state);
        begin.elapsed().as_secs_f64() / f64::from(STEPS)
    };
    let mut entry = config.clone();
    entry.motion = Motion::new(7e4, 0.0, -0.17, 7000.0, -0.001, 1.0);
    entry.entry = Some(Config {
        planet: Planet::EARTH,
        aerodynamics: Aerodynamics::papers(),
        deviations: Deviations::default(),
        air: Air::default(),
        trim: Trim::default(),
        following: Following { active: false, frequency: 1.0 },
        end: End { altitude: 2e4, speed: 0.0 },
    });
    config.motion = entry.motion;
    // Each is timed in turn, so that both meet the same load of the machine.
    let mut best = [f64::INFINITY; 2];
    for _ in 0..200 {
        for (best, config) in best.iter_mut().zip([&config, &entry]) {
            *best = best.min(seconds(config));
        }
    }
    let [fixed, entering] = best.map(|seconds| seconds * 1e6);
    println!("fixed {fixed:.2} us, entry {entering:.2} us: ratio {:.2}", entering / fixed);
}
