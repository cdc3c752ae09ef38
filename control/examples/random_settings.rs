//! This example tries random settings of CRMPC with the robust set:
//!
//! ```text
//! cargo run --release -p reentry-control --example random_settings -- FIRST COUNT
//! ```
//!
//! It tries COUNT settings, with the seeds from FIRST on. Settings that the design accepts are
//! flown for 15 s and must keep the guarantee. If the design refuses to give the guarantee, it must
//! accept each bound that its message names, as printed.

#[path = "../tests/harness/mod.rs"]
mod harness;

use harness::flight::{Tried, random_settings, tried};
use harness::in_parallel;

fn main() {
    let arguments: Vec<u64> =
        std::env::args().skip(1).filter_map(|text| text.parse().ok()).collect();
    let &[first, count] = arguments.as_slice() else {
        eprintln!("usage: random_settings FIRST COUNT");
        std::process::exit(2);
    };
    let seeds: Vec<u64> = (first..first + count).collect();
    let outcomes = in_parallel(&seeds, |&seed| tried(&random_settings(seed), seed));
    let (mut flown, mut defects, mut fallbacks, mut refused, mut named, mut broken) =
        (0, 0, 0, 0, 0, 0);
    let (mut rate, mut moment) = (0.0f64, 0.0f64);
    for (seed, outcome) in seeds.iter().zip(outcomes) {
        match outcome {
            Tried::Flown(shown) => {
                flown += 1;
                fallbacks += shown.fallbacks;
                rate = rate.max(shown.rate);
                moment = moment.max(shown.moment);
                if shown.defective() {
                    defects += 1;
                    println!("seed {seed}: {shown:?} with {:?}", random_settings(*seed));
                }
            }
            Tried::Refused { bounds, not_accepted } => {
                refused += 1;
                named += bounds;
                broken += not_accepted.len();
                for text in not_accepted {
                    println!("seed {seed}: {text}");
                }
            }
            Tried::Invalid(text) => println!("seed {seed}: {text}"),
        }
    }
    println!(
        "{flown} accepted and flown: {defects} defects, {fallbacks} fallbacks, rate up to {rate:.4} and moment up to {moment:.4} of the limit; {refused} refused, naming {named} bounds, of which {broken} are not accepted"
    );
}
