//! How often `health` of the navigation says an error beyond five of its predicted deviations within ten
//! seconds, in flights with 33 faults, and what its guards cost without a fault, as docs/entry.md says.
//! `cargo run --release --package reentry-control --example health -- SEED unguarded`

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::navigation::Guarded;
use harness::navigated::{Case, faulty, fly, judged};
use vehicle::fault::FaultKind::{
    Accelerometer, Attitude, Clock, Dropout, Frozen, Gyroscope, Late, Position, Restart, Velocity,
};
use vehicle::noise::uniform;

/// Steps of 10°/h and 5 mg, and a clock that is off by 0.2 s.
const GUARDED: Guarded = Guarded { gyroscope: 4.848e-5, accelerometer: 4.903e-2, clock: 0.2 };

fn main() {
    let mut arguments = std::env::args().skip(1);
    let first: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(7000);
    let guarded = if arguments.next().is_none() { GUARDED } else { Guarded::default() };
    said(first, guarded);
    price();
}

fn said(first: u64, guarded: Guarded) {
    let of_receiver = [
        (Frozen, &[1.0][..]),
        (Dropout, &[1.0]),
        (Late, &[1.0, 5.0]),
        (Clock, &[0.5, 1.0, -1.0]),
        (Restart, &[1.0]),
        (Position, &[0.2, 1.0, 2.0]),
        (Velocity, &[0.2, 1.0, 2.0]),
    ];
    let of_tracker = [
        (Frozen, &[1.0][..]),
        (Late, &[1.0]),
        (Clock, &[1.0]),
        (Restart, &[1.0]),
        (Attitude, &[0.1, 0.2, 1.0, 2.0]),
    ];
    let of_unit = [
        (Frozen, &[1.0][..]),
        (Late, &[1.0]),
        (Clock, &[1.0]),
        (Restart, &[1.0]),
        (Gyroscope, &[0.01, 0.03, 0.1]),
        (Accelerometer, &[0.01, 0.03, 0.1]),
        (Gyroscope, &[0.06]),
    ];
    let devices = [&of_receiver[..], &of_tracker, &of_unit];
    let faults = devices.iter().enumerate().flat_map(|(device, kinds)| {
        kinds
            .iter()
            .flat_map(move |(kind, sizes)| sizes.iter().map(move |size| (device, *kind, *size)))
    });
    let (mut all, mut missed) = (0, 0);
    for (number, (device, kind, size)) in faults.enumerate() {
        let seeds: Vec<u64> = (0..8).map(|i| first + 8 * number as u64 + i).collect();
        let flown = harness::in_parallel(&seeds, |&seed| {
            let [start, length] = uniform(seed, 77).map(|draw: f64| 0.5 + 0.5 * draw);
            // The star tracker sees stars above 90 km.
            let start = if device == 1 { 250.0 } else { 1700.0 } * start;
            let window = [start, start + 20.0 + 580.0 * length];
            let mut case = faulty(device, kind, size, window, seed);
            case.settings.guarded = guarded;
            judged(&case).1[1]
        });
        let unsaid = flown.iter().filter(|times| **times > 0).count();
        if unsaid > 0 {
            println!("device {device}, {kind:?} {size}: {unsaid} of 8 not said");
        }
        (all, missed) = (all + 8, missed + unsaid);
    }
    println!("{} of {all} said", all - missed);
}

fn price() {
    let seeds: Vec<u64> = (4000..4020).collect();
    let inertial = Guarded { gyroscope: 0.0, ..GUARDED };
    let gyroscope = Guarded { gyroscope: GUARDED.gyroscope, ..Guarded::default() };
    for guarded in [Guarded::default(), inertial, gyroscope, GUARDED] {
        let flown = harness::in_parallel(&seeds, |&seed| {
            let mut case = Case::new(4, false, seed);
            case.settings.guarded = guarded;
            let (mut count, mut squares, mut beyond, mut farthest) =
                (0.0, [0.0; 3], [0.0; 3], 0.0_f64);
            fly(&case, |seen| {
                count += 1.0;
                let [_, _, sigma, alpha, beta] = seen.errors;
                for (sum, error) in squares.iter_mut().zip([alpha, beta, sigma]) {
                    *sum += error * error;
                }
                for (sum, bound) in beyond.iter_mut().zip([0.95_f64, 1.5, 2.0]) {
                    *sum += f64::from(u8::from(seen.protection.attitude > bound.to_radians()));
                }
                if seen.altitude > 45.2e3 {
                    farthest = farthest.max(seen.position_error[0]);
                }
            });
            (count, squares, beyond, farthest)
        });
        let count: f64 = flown.iter().map(|one| one.0).sum();
        let angles = [0, 1, 2].map(|i| {
            let sum: f64 = flown.iter().map(|one| one.1[i]).sum();
            (sum / count).sqrt().to_degrees()
        });
        let beyond =
            [0, 1, 2].map(|i| 100.0 * flown.iter().map(|one| one.2[i]).sum::<f64>() / count);
        let farthest = flown.iter().fold(0.0_f64, |most, one| most.max(one.3)) / 1e3;
        println!("{guarded:?}: {angles:.2?}°, {farthest:.1} km, {beyond:.0?} %");
    }
}
