//! Lookup tables as components, which drive an FMU whose answer can be computed by hand.

use crate::prelude::*;

/// The FMU's first output is twice its input.
const DRIVEN: &str = r#"
title = "a table drives a gain"
[simulation]
stop = 4.0
step = 1.0
order = ["drive", "gain"]
[components.drive]
fmu = "drive.csv"
[components.gain]
fmu = "Model.fmu"
[[connections]]
from = "drive.input"
to = "gain.input"
[record]
variables = ["drive.input", "gain.output.direct"]
"#;
const TABLE: &str = "time,input [m]\n1,3\n2,5\n4,-1\n";

fn bench(table: &str) -> Bench {
    let bench = Bench::with(DRIVEN);
    fs::write(bench.path("drive.csv"), table).unwrap();
    bench
}

fn answers(bench: &Bench, arguments: &[&str]) -> Vec<f64> {
    bench.silent(&[&["--quiet"], arguments].concat());
    let results = bench.results();
    let last = |row: &str| row.rsplit(',').next().unwrap().parse().unwrap();
    results.lines().skip(1).map(last).collect()
}

#[test]
fn oracle_an_input_follows_the_rows_of_a_table() {
    let bench = bench(TABLE);
    // At the stop time no step begins: the gain keeps its output.
    assert_eq!(answers(&bench, &[]), [6.0, 6.0, 10.0, 10.0, 10.0]);
    let line = answers(&bench, &["--set", "drive.interpolation=linear"]);
    assert_eq!(line, [6.0, 6.0, 10.0, 4.0, 4.0]);
    let set = ["--set", "drive.time[2]=3 s", "--set", "drive.input[1]=4"];
    assert_eq!(answers(&bench, &set)[..4], [8.0, 8.0, 8.0, 10.0]);
    // Processes of their own are for third-party code.
    assert_eq!(answers(&bench, &["--isolate"]), [6.0, 6.0, 10.0, 10.0, 10.0]);
    fs::write(bench.path("other.csv"), "time,input\n0,1\n").unwrap();
    assert_eq!(answers(&bench, &["--fmu", "drive=other.csv"]), [2.0; 5]);
    let metadata = bench.json("out/loop/results.json");
    assert_eq!(metadata["components"]["drive"]["fmu"], "other.csv");
}

#[test]
fn a_table_that_the_run_does_not_meet_is_told() {
    let bench = bench(TABLE);
    let told = |table: &str, arguments: &[&str]| {
        fs::write(bench.path("drive.csv"), table).unwrap();
        let (code, _, errors) = bench.run(&[&["--quiet"], arguments].concat());
        assert_eq!(code, 0, "{errors}");
        errors
    };
    let late = told("time,input [m]\n10,3\n20,5\n", &[]);
    let said = "drive: its rows are from 10 s to 20 s, outside the run from 0 s to 4 s, in which it holds its first row";
    assert!(late.contains(said) && late.lines().count() == 1, "{late}");
    let early = told("time,input [m]\n-4,3\n-1,5\n", &[]);
    assert!(early.contains("from -4 s to -1 s") && early.contains("its last row"), "{early}");
    // A constant, tables that cover a part of the run, and those that begin or end with it.
    let rows = ["-3,1", "9,1", "-3,1\n2,1", "3,1\n9,1", "-3,1\n9,1", "4,1\n9,1", "-3,1\n0,1"];
    for rows in rows {
        assert_eq!(told(&format!("time,input [m]\n{rows}\n"), &[]), "", "{rows}");
    }
}

#[test]
fn a_recorded_run_drives_another() {
    let bench = bench(TABLE);
    let first = answers(&bench, &[]);
    fs::copy(bench.path("out/loop/results.csv"), bench.path("flown.csv")).unwrap();
    let replay = DRIVEN
        .replace("drive.csv", "flown.csv")
        .replace("from = \"drive.input\"", "from = \"drive.gain.output.direct\"")
        .replace("\"drive.input\", ", "");
    fs::write(bench.path("loop.toml"), replay).unwrap();
    let second = answers(&bench, &[]);
    assert_eq!(second, first.iter().map(|value| 2.0 * value).collect::<Vec<_>>());
}

#[test]
fn oracle_units_of_a_table_are_those_of_the_input() {
    let bench = bench("time,input [mm]\n0,500\n");
    assert_eq!(answers(&bench, &[]), [1.0; 5]);
    fs::write(bench.path("drive.csv"), "time,input [m/s]\n0,500\n").unwrap();
    let message = bench.refusal(&[]);
    assert!(message.contains("m/s against m") && message.contains("loop.toml:13"), "{message}");
}

#[test]
fn oracle_a_campaign_varies_the_rows_of_a_table() {
    let bench = bench(TABLE);
    let campaign = r#"
        title = "rows"
        experiment = "loop.toml"
        design = "levels"
        [signals]
        out = ["gain.output.direct"]
        [[vary]]
        parameter = "drive.input[2]"
        list = [7.0, -9.0]
        [[measure]]
        id = "largest"
        kind = "largest"
        signals = "out"
    "#;
    fs::write(bench.path("c.toml"), campaign).unwrap();
    bench.says(&["campaign", "c.toml"]);
    assert_eq!(bench.cases("out/c")[1..], ["0,7,14,completed,4,", "1,-9,18,completed,4,"]);
    // Other rows are other cases.
    fs::write(bench.path("drive.csv"), TABLE.replace("1,3", "1,30")).unwrap();
    bench.says(&["campaign", "c.toml"]);
    assert_eq!(bench.cases("out/c")[1], "0,7,60,completed,4,");
}

#[test]
fn a_table_can_be_looked_at_but_not_packed_for_other_tools() {
    let bench = bench(TABLE);
    let (code, text, errors) = bench.call(&["inspect", "drive.csv"]);
    assert_eq!((code, errors.as_str()), (0, ""));
    assert!(text.starts_with("drive\n") && text.contains("table of 3 rows"), "{text}");
    let (code, text, errors) = bench.call(&["inspect", "--check", "drive.csv"]);
    assert!(code == 0 && text.starts_with("drive: sound, ") && errors.is_empty(), "{text}{errors}");
    bench.fails(2, &["pack", "loop.toml"], "[components.drive] is a lookup table");
}
