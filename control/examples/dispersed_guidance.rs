//! Entry flights with unknown density, lift, drag and wind: how many end in the terminal area. The
//! argument is the number of flights.

#[path = "../tests/harness/entry.rs"]
mod entry;

use control::guidance::Settings;
use entry::{Flight, Outcome, fly};
use std::time::Instant;
use vehicle::noise::uniform;

fn main() {
    let count: u32 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1000);
    for (name, flight) in [("120 km", Flight::nominal()), ("80 km", Flight::lower())] {
        println!("from {name}: {}", told(&fly(&Settings::default(), &flight, |_, _, _| {})));
    }
    for share in [0.1, 0.2] {
        let begin = Instant::now();
        let outcomes: Vec<Outcome> = (0..count)
            .map(|number| {
                let flight = Flight::dispersed(share, uniform(1, i64::from(number)));
                fly(&Settings::default(), &flight, |_, _, _| {})
            })
            .collect();
        let arrived = outcomes.iter().filter(|outcome| outcome.arrived()).count();
        let mut off: Vec<f64> =
            outcomes.iter().map(|outcome| (outcome.range / 1e3 - 60.0).abs()).collect();
        off.sort_by(f64::total_cmp);
        let extreme = |value: fn(&Outcome) -> f64, pick: fn(f64, f64) -> f64| {
            outcomes.iter().map(value).reduce(pick).unwrap_or(f64::NAN)
        };
        println!(
            "{:.0} %: {arrived} of {count} arrive; range off by {:.2} km (median), {:.2} km (worst); altitude {:.1} to {:.1} km; turn {:.3} deg/s; {:.0} ms each",
            100.0 * share,
            off[off.len() / 2],
            off[off.len() - 1],
            extreme(|outcome| outcome.end[0] / 1e3, f64::min),
            extreme(|outcome| outcome.end[0] / 1e3, f64::max),
            extreme(|outcome| outcome.greatest_turn.to_degrees(), f64::max),
            begin.elapsed().as_secs_f64() * 1e3 / f64::from(count),
        );
    }
}

fn told(outcome: &Outcome) -> String {
    format!(
        "{:.0} s, {} reversals, {:.2} km, {:.1} m/s, {:.2} km to go, {:.2} g, {:.1} kPa, turn {:.3} deg/s",
        outcome.seconds,
        outcome.memory.reversals,
        outcome.end[0] / 1e3,
        outcome.end[3],
        outcome.range / 1e3,
        outcome.greatest_load,
        outcome.greatest_pressure / 1e3,
        outcome.greatest_turn.to_degrees(),
    )
}
