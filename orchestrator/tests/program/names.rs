//! Tests of names: the list, the names that each command takes, and its message about a name of
//! another kind.

use crate::prelude::*;

/// A folder with an experiment `loop`, a campaign `gains`, a study `papers` and an FMU `Model`.
fn bench() -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("gains.toml"), CAMPAIGN).unwrap();
    fs::create_dir(bench.path("papers")).unwrap();
    let study = "title = \"a study\"\npaper = \"somebody\"\n";
    fs::write(bench.path("papers/study.toml"), study).unwrap();
    bench
}

#[test]
fn a_name_of_another_kind_is_told_what_to_call() {
    let bench = bench();
    let says = [
        ("run", "gains", "gains is a campaign: orchestrator campaign gains"),
        ("run", "gains.toml", "gains.toml is a campaign: orchestrator campaign gains.toml"),
        ("run", "papers", "papers is a study: orchestrator reproduce papers"),
        ("run", "Model", "Model is an FMU: orchestrator inspect Model"),
        ("run", "Model.fmu", "Model.fmu is an FMU: orchestrator inspect Model.fmu"),
        ("pack", "gains", "gains is a campaign: orchestrator campaign gains"),
        ("margins", "papers", "papers is a study: orchestrator reproduce papers"),
        ("reproduce", "loop", "loop is an experiment: orchestrator run loop"),
        ("reproduce", "gains", "gains is a campaign: orchestrator campaign gains"),
        ("reproduce", "Model", "Model is an FMU: orchestrator inspect Model"),
        ("campaign", "loop", "loop is an experiment: orchestrator run loop"),
        ("campaign", "papers", "papers is a study: orchestrator reproduce papers"),
        ("campaign", "loop.toml", "loop.toml is an experiment: orchestrator run loop.toml"),
        ("campaign", "Model", "Model is an FMU: orchestrator inspect Model"),
        ("inspect", "loop", "loop is an experiment: orchestrator run loop"),
        ("inspect", "gains", "gains is a campaign: orchestrator campaign gains"),
        ("show", "Model", "Model is an FMU: orchestrator inspect Model"),
    ];
    for (command, name, says) in says {
        let errors = bench.fails(2, &[command, name], says);
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    // The message about a name of several kinds lists all of them, and each command takes its own.
    fs::write(bench.path("papers.toml"), CAMPAIGN).unwrap();
    let (_, _, errors) = bench.call(&["run", "papers"]);
    let both = "papers is a study and a campaign: orchestrator reproduce papers, or orchestrator campaign papers";
    assert!(errors.contains(both), "{errors}");
    // A campaign that extends another one names no experiment and no varied parameters itself.
    fs::write(bench.path("more.toml"), "extends = \"gains.toml\"\ntitle = \"more\"\n").unwrap();
    bench.says(&["campaign", "more", "--quiet"]);
}

#[test]
fn every_command_takes_names_of_what_is_installed() {
    let bench = bench();
    let deep = bench.path("a/b");
    fs::create_dir_all(&deep).unwrap();
    for file in ["loop.toml", "gains.toml", "Model.fmu"] {
        fs::rename(bench.path(file), deep.join(file)).unwrap();
    }
    // What is below the current folder is named by its path.
    let missing = "there is no experiment \"loop\", neither as a file";
    bench.fails(2, &["run", "loop"], missing);
    bench.says(&["show", "a/b/loop"]);
    let bench = Bench { installed: Some(bench.path("a")), ..bench };
    for arguments in [
        &["run", "loop", "--quiet"][..],
        &["run", "b/loop", "--quiet", "--out", "out/other"],
        &["campaign", "gains", "--quiet"],
        &["pack", "loop"],
        &["list"],
        &["show", "loop"],
        &["show", "gains"],
        &["show", "papers"],
        &["inspect", "Model"],
        &["inspect", "Model", "seed"],
        &["inspect", "Model", "--check"],
    ] {
        bench.says(arguments);
    }
    for (arguments, says) in [
        (["run", "lop"], "there is no experiment \"lop\", neither as a file"),
        (["campaign", "gans"], "there is no campaign \"gans\", neither as a file"),
        (["reproduce", "papers2"], "there is no study \"papers2\", neither as a file"),
        (["inspect", "Modle"], "there is no FMU \"Modle\", neither as a file"),
        (
            ["show", "gans"],
            "there is no study or experiment or campaign \"gans\", neither as a file",
        ),
    ] {
        let errors = bench.fails(2, &arguments, says);
        assert!(errors.contains("; did you mean \""), "{errors}");
    }
    fs::create_dir_all(bench.path("a/c")).unwrap();
    fs::copy(deep.join("Model.fmu"), bench.path("a/c/Model.fmu")).unwrap();
    bench.fails(2, &["inspect", "Model"], "several FMUs are called Model: ");
    assert_eq!(bench.call(&["inspect", "c/Model"]).0, 0);
}

const LONG: &str =
    "a very long title of many words, which takes more than one line of a terminal of 80 columns";

#[test]
fn the_list_has_names_titles_and_nothing_of_a_fuzzer() {
    let bench = bench();
    fs::create_dir_all(bench.path("fuzz/corpus")).unwrap();
    fs::write(bench.path("fuzz/corpus/wrong.toml"), LOOP.replace("stop =", "stopp =")).unwrap();
    fs::write(bench.path("long.toml"), LOOP.replace("gain and integrator", LONG)).unwrap();
    let text = bench.says(&["list", "."]);
    for heading in [
        "experiments (2): orchestrator run NAME",
        "studies (1): orchestrator reproduce NAME",
        "campaigns (1): orchestrator campaign NAME",
        "FMUs (1): orchestrator inspect NAME",
    ] {
        assert!(text.contains(heading), "{heading}: {text}");
    }
    assert!(!text.contains("wrong") && !text.contains("fuzz"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains(&format!("long {LONG}")), "{text}");
    let (_, json, _) = bench.call(&["list", "--json", "."]);
    let rows: serde_json::Value = serde_json::from_str(&json).unwrap();
    let entry = rows.as_array().unwrap().iter().find(|row| row["name"] == "loop").unwrap();
    assert_eq!((&entry["kind"], &entry["path"]), (&"experiment".into(), &"./loop.toml".into()));
    assert_eq!(
        (&entry["title"], &entry["fault"]),
        (&"gain and integrator".into(), &serde_json::Value::Null)
    );
    // A faulty experiment is listed with its fault, whole.
    fs::write(bench.path("faulty.toml"), LOOP.replace("stop =", "stopp =")).unwrap();
    let (_, text, _) = bench.call(&["list", "."]);
    assert!(text.contains("FAULT ./faulty.toml:4: ") && text.contains("`stop`"), "{text}");
}

#[test]
fn a_bad_value_is_blamed_on_its_option() {
    let bench = bench();
    for (arguments, blamed) in [
        (&["run", "loop", "--stop", "-1"][..], "--stop -1: "),
        (&["run", "loop", "--stop", "nan"], "--stop NaN: "),
        (&["run", "loop", "--stop", "2.5"], "--stop 2.5: "),
        (&["run", "loop", "--step", "0"], "--step 0: "),
        (&["run", "loop", "--step", "-1", "--stop", "3"], "--step -1: "),
        (&["run", "loop", "--step", "2"], "--step 2: "),
        (&["run", "loop", "--step", "1e-10"], "--step 0.0000000001: "),
        (&["run", "loop", "--step", "1e-9"], "3000000000 steps"),
        (&["run", "loop", "--stop", "1e12"], "1000000000000 steps"),
        (&["run", "loop", "--real-time", "-1"], "'-1' for '--real-time"),
        (&["campaign", "gains", "--stop", "-1"], "--stop -1: "),
        (&["campaign", "gains", "--jobs", "-1"], "'-1' for '--jobs"),
        (&["campaign", "gains", "--case", "-1"], "'-1' for '--case"),
        (&["campaign", "gains", "--case", "6"], "--case 6: "),
        (&["list", "missing"], "missing"),
        (&["campaign", "gains", "--cases", "3..3"], "within 0..6"),
        (&["campaign", "gains", "--cases", "0..2000"], "within 0..6"),
        (&["campaign", "gains", "--cases", "0-3"], "expected two whole numbers"),
        (&["campaign", "gains", "--cases", "-5..3"], "'-5..3' for '--cases"),
        (&["reproduce", "papers", "--members", "-1"], "'-1' for '--members"),
        (&["margins", "loop", "--at", "-5", "--open", "plant.input"], "--at -5: "),
    ] {
        let errors = bench.fails(2, arguments, blamed);
        assert!(!errors.contains(".toml"), "{errors}");
    }
    // Values of the file are still its own fault.
    fs::write(bench.path("short.toml"), LOOP.replace("stop = 3.0", "stop = 0.5")).unwrap();
    let (_, _, errors) = bench.call(&["run", "short"]);
    assert!(errors.contains("short.toml: [simulation] stop = 0.5 s"), "{errors}");
}
