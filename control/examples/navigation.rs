//! Errors of the navigation in entry flights, by grade of the sensors, as docs/entry.md
//! shows them. `cargo run --release --package reentry-control --example navigation -- FLIGHTS`

#[path = "../tests/harness/mod.rs"]
mod harness;

use harness::navigated::{Case, Figures};

fn main() {
    let flights = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(50);
    let seeds: Vec<u64> = (1..=flights).collect();
    let print = |name: &str, case: &(dyn Fn(u64) -> Case + Sync)| {
        let flown = harness::in_parallel(&seeds, |&seed| Figures::of(&case(seed)));
        let all = flown.into_iter().fold(Figures::default(), |sum, one| sum.with(&one));
        println!(
            "| {name} | {:.3?} | {:.3?} | {:.2} | {:.2} | {:.3} | {:.3} | {:.0?} | {:.2} |",
            all.angles().map(f64::to_degrees),
            all.predicted().map(f64::to_degrees),
            all.normalised_error(),
            all.innovation(),
            all.slow_sideslip().to_degrees(),
            all.slow_prediction().to_degrees(),
            all.altitude(),
            all.normalised_altitude(),
        );
    };
    println!(
        "| sensors | rms of α, β, σ, air α, β, deg | predicted | NEES/9 | NIS | air β < Mach 5 | predicted | altitude at 45 km, m, predicted | its NEES |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    print("tactical, in wind", &|seed| Case::windy(seed).in_other_air());
    let grades = ["without errors", "", "navigation", "tactical", "calibrated MEMS"];
    for (set, stars) in [(3, false), (4, false), (4, true), (5, false), (5, true)] {
        let name = format!("{}{}", grades[set as usize - 1], if stars { " and stars" } else { "" });
        print(&name, &|seed| Case::new(set, stars, seed).in_other_air());
    }
}
