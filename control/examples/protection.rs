//! Shares of the instants of entry flights at which an error of the navigation exceeds its stated bound,
//! the flights with such an instant, and how often errors beyond five deviations are not said, by fault,
//! as docs/entry.md shows them.
//! `cargo run --release --package reentry-control --example protection -- FLIGHTS`

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::navigation::Guarded;
use harness::navigated::{faulty, judged};
use vehicle::fault::FaultKind::{
    Accelerometer, Attitude, Clock, Dropout, Frozen, Gyroscope, Late, None, Position, Velocity,
};
use vehicle::noise::uniform;

/// Steps of 10°/h and 5 mg.
const GUARDED: Guarded = Guarded { gyroscope: 4.848e-5, accelerometer: 4.903e-2, clock: 0.2 };

fn main() {
    let flights = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(20);
    let seeds: Vec<u64> = (900..900 + flights).collect();
    for (device, kind, size, guarded) in [
        (0, None, 1.0, false),
        (0, None, 1.0, true),
        (0, Frozen, 1.0, false),
        (0, Dropout, 1.0, false),
        (0, Late, 1.0, false),
        (0, Clock, 1.0, false),
        (0, Position, 1.0, false),
        (0, Velocity, 1.0, false),
        (1, Attitude, 0.2, false),
        (1, Attitude, 1.0, false),
        (1, Frozen, 1.0, false),
        (2, Gyroscope, 0.01, false),
        (2, Gyroscope, 0.1, false),
        (2, Gyroscope, 0.1, true),
        (2, Accelerometer, 0.01, false),
        (2, Accelerometer, 0.1, false),
        (2, Accelerometer, 0.1, true),
    ] {
        let flown = harness::in_parallel(&seeds, |&seed| {
            let [start, length] = uniform(seed, 55).map(|draw: f64| 0.5 + 0.5 * draw);
            let window = [1500.0 * start, 1500.0 * start + 600.0 * length];
            let mut case = faulty(device, kind, size, window, seed);
            case.settings.guarded = if guarded { GUARDED } else { Guarded::default() };
            judged(&case)
        });
        let mean =
            [0, 1].map(|i| flown.iter().map(|one| one.0[i]).sum::<f64>() / flown.len() as f64);
        let hit = [0, 1].map(|i| flown.iter().filter(|one| one.0[i] > 0.0).count());
        let [large, unsaid] = [0, 1].map(|i| flown.iter().map(|one| one.1[i]).sum::<u32>());
        println!(
            "| {device} {kind:?} {size}, guarded {guarded} | {:.3} % {} | {:.3} % {} | {unsaid} of {large} |",
            100.0 * mean[0],
            hit[0],
            100.0 * mean[1],
            hit[1]
        );
    }
}
