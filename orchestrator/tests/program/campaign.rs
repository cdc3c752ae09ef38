//! Campaigns of cases of a loop that can be computed by hand.

use crate::prelude::*;
use serde_json::json;

/// The loop's integrator has the values (1 + gain)^k at tick k.
pub(crate) const CAMPAIGN: &str = r#"
title = "gains"
experiment = "loop.toml"
design = "levels"

[signals]
out = ["plant.output.integral"]

[[vary]]
parameter = "gain.gain"
list = [0.5, 1.0, 2.0]

[[vary]]
parameter = "plant.fail.time"
list = [1e9, 2.0]

[[measure]]
id = "last"
kind = "last"
signals = "out"

[[measure]]
id = "largest"
kind = "largest"
signals = "out"

[[limit]]
id = "small"
measure = "largest"
at_most = 8.0
"#;

pub(crate) fn bench(campaign: &str) -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("c.toml"), campaign).unwrap();
    bench
}

/// Flies a campaign, and returns its table.
fn flown(bench: &Bench, arguments: &[&str]) -> Vec<String> {
    bench.says(&[&["campaign", "c.toml"], arguments].concat());
    bench.cases("out/c")
}

/// Refuses a campaign in one line, before anything is flown.
pub(crate) fn refusal(campaign: &str) -> String {
    let bench = bench(campaign);
    let (code, _, errors) = bench.call(&["campaign", "c.toml"]);
    assert_eq!(code, 2, "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
    assert!(!bench.path("out").exists());
    errors
}

#[test]
fn oracle_a_case_is_a_row_also_if_its_instance_fails() {
    let bench = bench(CAMPAIGN);
    let rows = flown(&bench, &[]);
    assert_eq!(
        rows[0],
        "case,gain.gain,plant.fail.time,last,largest,kept.small,status,time,message"
    );
    let failed = "plant failed at t = 2 s in doStep: out of propellant at 2 (fmi2Error)";
    assert_eq!(rows[1], "0,0.5,1000000000,3.375,3.375,true,completed,3,");
    assert_eq!(rows[2], format!("1,0.5,2,2.25,2.25,false,failed,2,{failed}"));
    assert_eq!(rows[3], "2,1,1000000000,8,8,true,completed,3,");
    assert_eq!(rows[4], format!("3,1,2,4,4,false,failed,2,{failed}"));
    assert_eq!(rows[5], "4,2,1000000000,27,27,false,completed,3,");
    assert_eq!(rows[6], format!("5,2,2,9,9,false,failed,2,{failed}"));
    assert_eq!(rows.len(), 7);
    let summary = bench.json("out/c/summary.json");
    assert_eq!(summary["status"], json!({ "completed": 3, "ended": 0, "failed": 3, "lost": 0 }));
    assert_eq!(summary["limits"][0]["broken"]["events"], 4);
    assert_eq!(summary["measures"][0]["summary"]["worst"], 4);
    let page = bench.text("out/c/report.html");
    assert!(page.contains("4 of 6") && page.contains("orchestrator campaign c.toml --case 4"));
}

#[test]
fn the_page_of_a_single_case_has_no_deviation() {
    let campaign = CAMPAIGN.replace("[0.5, 1.0, 2.0]", "[1.0]").replace("[1e9, 2.0]", "[1e9]");
    let bench = bench(&campaign);
    flown(&bench, &[]);
    let page = bench.text("out/c/report.html");
    assert!(page.contains("1 case of the experiment") && page.contains("1 case completed."));
    assert!(!page.contains("NaN") && !page.contains("1 cases"), "{page}");
}

#[test]
fn a_case_that_an_instance_ended_early_keeps_no_limit() {
    let bench = Bench::made(LOOP, &Recipe { flags: &["-DENDS=1"], ..Recipe::default() });
    let discards = "set = { \"plant.fail.status\" = 2 }\n\n[signals]";
    fs::write(bench.path("c.toml"), CAMPAIGN.replace("[signals]", discards)).unwrap();
    let rows = flown(&bench, &[]);
    assert!(rows[1].contains("true,completed,3"), "{}", rows[1]);
    assert!(rows[2].starts_with("1,0.5,2,2.25,2.25,false,ended,2,"), "{}", rows[2]);
}

pub(crate) const RANDOM: &str = r#"
title = "random gains"
experiment = "loop.toml"
cases = 1100
[signals]
out = ["plant.output.integral"]
[[vary]]
parameter = "gain.gain"
uniform = [0.0, "1000 mm"]
[[vary]]
parameter = "gain.kind"
list = ["calm", "rough"]
weights = [3.0, 1.0]
[[vary]]
parameter = "plant.noise.seed"
case = 7
[[measure]]
id = "last"
kind = "last"
signals = "out"
[[limit]]
id = "small"
measure = "last"
at_most = 7.9
"#;

#[test]
fn the_same_bytes_however_the_cases_were_flown() {
    let bench = bench(RANDOM);
    let rows = flown(&bench, &["--jobs", "1"]);
    assert_eq!(rows.len(), 1101);
    for (case, row) in rows[1..].iter().enumerate() {
        let cells: Vec<&str> = row.split(',').collect();
        let gain: f64 = cells[1].parse().unwrap();
        let last: f64 = cells[4].parse().unwrap();
        assert!((0.0..1.0).contains(&gain) && (last - (1.0 + gain).powi(3)).abs() < 1e-12);
        assert_eq!(cells[3], (case + 7).to_string());
    }
    let calm = rows.iter().filter(|row| row.contains(",calm,")).count();
    assert!((770..880).contains(&calm), "{calm}");
    let bytes = |out: &str| fs::read(bench.path(&format!("{out}/cases.parquet"))).unwrap();
    let whole = bytes("out/c");
    let call = |arguments: &[&str]| bench.says(&[&["campaign", "c.toml"], arguments].concat());
    // By several processes in one folder, in any order and with a part flown twice.
    let work = |first: u64, last: u64| {
        let short = (0..100).step_by(5).map(|at| [at, at + 5]);
        let long = (100..1100).step_by(25).map(|at| [at, at + 25]);
        let all = short.chain(long);
        let parts: Vec<[u64; 2]> = all.filter(|part| (first..last).contains(&part[0])).collect();
        format!("{}\n", json!({"cases": 1100, "missing": parts}))
    };
    assert_eq!(call(&["--out", "b", "--work"]), work(0, 1100));
    call(&["--out", "b", "--cases", "550..1100", "--jobs", "2"]);
    call(&["--out", "b", "--cases", "0..500"]);
    call(&["--out", "b", "--cases", "0..50", "--fresh"]);
    assert_eq!(call(&["--out", "b", "--work"]), work(500, 550));
    let said = call(&["--out", "b"]);
    assert!(said.contains("1100 cases, 50 flown now"), "{said}");
    assert_eq!(bytes("b"), whole);
    // One case by itself: the same gain, and everything recorded.
    let cells: Vec<&str> = rows[901].split(',').collect();
    call(&["--case", "900"]);
    let case = bench.text("out/c/cases/900/case.toml");
    assert!(case.contains(&format!("gain = {}", cells[1])), "{case}");
    let results = bench.text("out/c/cases/900/results.csv");
    assert!(results.lines().last().unwrap().contains(cells[4]), "{results}");
}

#[test]
fn what_has_changed_is_named_and_flown_again() {
    let bench = bench(RANDOM);
    flown(&bench, &[]);
    let (_, said, _) = bench.call(&["campaign", "c.toml"]);
    assert!(said.contains("1100 cases, 0 flown now"), "{said}");
    fs::write(bench.path("c.toml"), RANDOM.replace("cases = 1100", "cases = 1500")).unwrap();
    let (_, said, _) = bench.call(&["campaign", "c.toml"]);
    assert!(said.contains("1500 cases, 400 flown now") && !said.contains("changed"), "{said}");
    fs::write(bench.path("c.toml"), RANDOM.replace("1000 mm", "900 mm")).unwrap();
    let (_, said, _) = bench.call(&["campaign", "c.toml"]);
    assert!(said.contains("flown again because this has changed: campaign (60 parts)"), "{said}");
    fs::write(bench.path("loop.toml"), LOOP.replace("stop = 3.0", "stop = 4.0")).unwrap();
    let (_, said, _) = bench.call(&["campaign", "c.toml"]);
    assert!(said.contains("because this has changed: experiment (60 parts)"), "{said}");
}

#[test]
fn an_instance_that_cannot_be_reset_is_made_anew() {
    let flags = ["-DRESETS=0"];
    let bench = Bench::made(LOOP, &Recipe { flags: &flags, ..Recipe::default() });
    fs::write(bench.path("c.toml"), RANDOM).unwrap();
    bench.fails(
        0,
        &["campaign", "c.toml"],
        "another result after fmi2Reset than with a new instance",
    );
    let other = self::bench(RANDOM);
    flown(&other, &[]);
    assert_eq!(bench.cases("out/c"), other.cases("out/c"));
}

#[test]
fn a_wrong_file_is_refused_with_the_key_the_line_and_the_nearest_name() {
    const LEVELS: &str = "design = \"levels\"";
    const LIST: &str = "[0.5, 1.0, 2.0]";
    for (from, to, said) in [
        ("title = ", "titel = ", "did you mean title?"),
        (LEVELS, "design = \"levles\"", "did you mean levels?"),
        ("list = [0.5", "lst = [0.5", "c.toml:11: unknown field `lst`, expected"),
        ("loop.toml", "lop.toml", "c.toml:3: "),
        (
            "gain.gain",
            "gain.gian",
            "c.toml:10: [[vary]] gain.gian: there is no such parameter; did you",
        ),
        ("gain.gain", "gian.gain", "there is no component gian; did you mean gain?"),
        ("gain.gain", "gain.input", "is an input with a connection"),
        (LIST, "[0.5, 2000.0]", "[[vary]] gain.gain: 2000 m is above its maximum 1000 m"),
        (LIST, "[0.5, \"1 s\"]", "cannot be converted to m"),
        (LIST, "[]", "the list is empty"),
        ("= \"out\"", "= \"oot\"", "there is no list of signals oot; did you mean out?"),
        ("output.integral", "output.intgral", "did you mean plant.output.integral?"),
        (
            "= \"largest\"\nat",
            "= \"larges\"\nat",
            "c.toml:29: there is no metric or measure larges; did",
        ),
        ("at_most = 8.0", "", "one of at_most and at_least is needed"),
        (LEVELS, "design = \"random\"", "cases is missing"),
        (LEVELS, "design = \"levels\"\nset = { \"gain.flig\" = true }", "did you mean"),
        (LEVELS, "design = \"levels\"\nmetrics = [\"sampels\"]", "did you mean samples?"),
    ] {
        assert!(CAMPAIGN.contains(from), "{from}");
        let errors = plain(&refusal(&CAMPAIGN.replacen(from, to, 1)));
        assert!(errors.contains(said), "{to}: {errors}");
    }
}

#[test]
fn a_case_by_itself_has_the_changes_of_the_command_line() {
    let bench = bench(RANDOM);
    let changes = ["--stop", "2", "--fmu", "gain=Model.fmu", "--set", "plant.delay=1e-3"];
    let rows = flown(&bench, &changes);
    bench.says(&[&["campaign", "c.toml", "--case", "7"], &changes[..]].concat());
    let results = bench.text("out/c/cases/7/results.csv");
    let last: Vec<&str> = results.lines().last().unwrap().split(',').collect();
    assert_eq!(last[0], "2.0");
    assert_eq!(last[2], rows[8].split(',').nth(4).unwrap());
    let case = bench.text("out/c/cases/7/case.toml");
    assert!(case.contains("exchanged = true") && case.contains("delay = 0.001"), "{case}");
}

#[test]
fn what_is_sorted_ascends() {
    let vary = "[[vary]]\neach = [\"gain.pause\", \"gain.delay\", \"plant.delay\"]\nuniform = [0.0, 1e-3]\nsorted = true\n";
    let text = RANDOM.replace("cases = 1100", "cases = 20") + vary;
    let rows = flown(&bench(&text), &[]);
    for row in &rows[1..] {
        let times: Vec<f64> = row.split(',').skip(4).take(3).map(|t| t.parse().unwrap()).collect();
        assert!(times[0] < times[1] && times[1] < times[2] && times[2] < 1e-3, "{row}");
    }
}
