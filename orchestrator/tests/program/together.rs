//! The same command, started twenty times at once.

use crate::prelude::*;
use std::process::{Child, Output};

/// Starts a command twenty times and returns how often it succeeded. Those that did not must have
/// said that another one is at work, or that there are results.
fn successes(bench: &Bench, arguments: &[&str]) -> usize {
    let start = |_| -> Child {
        bench.command(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let children: Vec<_> = (0..20).map(start).collect();
    let mut count = 0;
    for child in children {
        let Output { status, stderr, .. } = child.wait_with_output().unwrap();
        let errors = String::from_utf8(stderr).unwrap();
        if status.success() {
            count += 1;
            continue;
        }
        assert_eq!(status.code(), Some(2), "{errors}");
        let reasons = ["another process is writing", "holds results of an earlier run"];
        assert!(reasons.iter().any(|reason| errors.contains(reason)), "{errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    count
}

#[test]
fn of_twenty_equal_runs_one_writes_the_results() {
    let bench = Bench::new();
    assert_eq!(successes(&bench, &["run", "loop.toml", "--quiet"]), 1);
    let rows = bench.results();
    assert_eq!(rows.lines().count(), 5);
    // Those that may replace results do so one after the other.
    assert!(successes(&bench, &["run", "loop.toml", "--quiet", "--force"]) >= 1);
    assert_eq!(bench.results(), rows);
}

#[test]
fn of_twenty_equal_campaigns_none_spoils_another() {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), CAMPAIGN).unwrap();
    assert!(successes(&bench, &["campaign", "c.toml", "--quiet"]) >= 1);
    let table = bench.cases("out/c");
    assert_eq!(bench.call(&["campaign", "c.toml", "--fresh"]).0, 0);
    assert_eq!(bench.cases("out/c"), table);
}
