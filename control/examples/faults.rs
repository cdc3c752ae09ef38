//! The table of detected faults of docs/guarantee.md.
//! `cargo run --release --package reentry-control --example faults -- FLIGHTS`

#[path = "../tests/harness/mod.rs"]
mod harness;

use harness::faulted::{Flown, faults, fly, situations};

fn main() {
    let count: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(24);
    for case in faults() {
        let mut line = format!("| {} ", case.0);
        for situation in situations() {
            let Flown { noticed, mean, broken, ticks, largest, seed } =
                fly(&situation, &case, count);
            let number = if noticed == count as usize { "all".into() } else { noticed.to_string() };
            let time = if noticed > 0 { format!(", {mean:.2} s") } else { String::new() };
            let beyond = match broken {
                0 => String::new(),
                broken => {
                    format!("; {broken} exceeded at {ticks} ticks, {largest:.2} (seed {seed})")
                }
            };
            line = format!("{line}| {number}{time}{beyond} ");
        }
        println!("{line}|");
    }
}
