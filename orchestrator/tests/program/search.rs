//! Searches for the worst case of a loop that can be computed by hand.

use crate::campaign::bench;
use crate::prelude::*;

#[test]
fn a_search_finds_the_corner_and_writes_it_as_an_experiment() {
    let text = format!("{RANDOM}[search]\nlargest = \"last\"\ncases = 300\n");
    let text = text.replace("uniform = [0.0", "uniform = [-0.9");
    let bench = bench(&text);
    let said = bench.says(&["campaign", "c.toml", "--worst", "--out", "w"]);
    assert!(said.contains("breaks small"), "{said}");
    let outcome = bench.json("w/search.json");
    assert!((outcome["largest"].as_f64().unwrap() - 8.0).abs() < 1e-3, "{outcome}");
    bench.says(&["run", "w/worst.toml", "--fmu-dir", "."]);
    let rows = bench.text("out/worst/results.csv");
    let last: f64 = rows.lines().last().unwrap().split(',').nth(2).unwrap().parse().unwrap();
    assert!((last - outcome["largest"].as_f64().unwrap()).abs() < 1e-12);
    // The same search gives the same bytes, on any number of threads.
    bench.says(&["campaign", "c.toml", "--worst", "--out", "w1", "--jobs", "1"]);
    for file in ["search.parquet", "worst.toml", "search.json", "history.svg"] {
        let bytes = |out: &str| fs::read(bench.path(&format!("{out}/{file}"))).unwrap();
        assert!(bytes("w") == bytes("w1"), "{file}");
    }
    let page = bench.text("w/report.html").replace("w/worst.toml", "w1/worst.toml");
    assert_eq!(page, bench.text("w1/report.html"));
    bench.fails(2, &["campaign", "c.toml", "--worst", "--out", "w"], "--fresh replaces them");
    let without = crate::campaign::bench(RANDOM);
    without.fails(2, &["campaign", "c.toml", "--worst"], "[search] is missing");
}
