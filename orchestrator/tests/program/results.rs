//! Tests of the results of a run: measured, written and printed.

use crate::prelude::*;

#[test]
fn oracle_a_run_writes_its_results() {
    let bench = Bench::new();
    let summary = bench.flown(&["--set", "gain.gain=500 mm", "--set", "gain.kind=rough"]);
    assert!(summary.contains("loop delay        none (gain -> plant -> gain)"), "{summary}");
    // The state follows x⁺ = x + x/2. At the stop time no step begins: the gain keeps its output.
    let rows = bench.results();
    let expected = "time,gain.output.direct,plant.output.integral,plant.steps\n\
                    0.0,0.5,1.0,0\n1.0,0.75,1.5,1\n2.0,1.125,2.25,2\n3.0,1.125,3.375,3\n";
    assert_eq!(rows, expected);

    let metadata = bench.json("out/loop/results.json");
    assert_eq!(metadata["status"], "completed");
    assert_eq!(metadata["experiment"]["text"], LOOP);
    assert_eq!(metadata["components"]["gain"]["guid"], "{u-1}");
    assert_eq!(metadata["components"]["gain"]["set"]["gain"], 0.5);
    assert_eq!(metadata["components"]["gain"]["parameters"]["kind"], "rough");
    assert_eq!(metadata["components"]["plant"]["parameters"]["kind"], "calm");
    assert_eq!(metadata["seeds"]["plant.noise.seed"], 0);
    let metrics = bench.json("out/loop/metrics.json");
    for key in ["real_time_factor", "wall_s", "loop_delay_s", "samples", "completed", "lost_at"] {
        assert!(metrics.as_object().unwrap().contains_key(key), "{key}");
    }
}

/// Creates a bench whose loop has a section that says what is measured, watched and drawn.
fn observed(section: &str) -> Bench {
    Bench::with(&format!("{LOOP}{section}"))
}

#[test]
fn oracle_what_an_experiment_asks_for_is_measured_and_drawn() {
    let section = r#"
[observe]
summary = ["mean_square", "largest"]
panels = [
    { name = "signals", curves = [{ name = "gain", of = "gain.output.direct", reference = "plant.output.integral" }] },
]
[observe.signals]
out = ["gain.output.direct"]
ratio = ["gain.output.direct / plant.output.integral"]
none = ["gain.output.none"]
[observe.metrics]
mean_square = { label = "RMS", kind = "rms", signals = "out", steps = true }
largest = { kind = "largest", signals = "out", label = "largest", limit = "bound" }
bound = { kind = "last", signals = "out" }
ratio = { kind = "mean", signals = "ratio" }
none = { kind = "mean", signals = "none", optional = true }
"#;
    let bench = observed(section);
    let summary = bench.flown(&["--set", "gain.gain=0.5"]);
    // The gain gives half of the integral 1, 1.5, 2.25, 3.375; the last point begins no step.
    let metrics = bench.json("out/loop/metrics.json");
    let number = |name: &str| metrics[name].as_f64().unwrap();
    let mean_square = (0.25 + 0.5625 + 1.265625) / 3.0;
    assert!((number("mean_square") - f64::sqrt(mean_square)).abs() < 1e-15);
    assert_eq!((number("largest"), number("ratio")), (1.125, 0.5));
    assert!(metrics.as_object().unwrap()["none"].is_null());
    assert!(summary.contains("  RMS               0.8323"), "{summary}");
    assert!(summary.contains("within its limit 1.125"), "{summary}");
    assert!(bench.text("out/loop/plot.svg").contains("signals"));

    let out = "out = [\"gain.output.direct\"]";
    for (from, to, said) in [
        (", optional = true", "", "[observe.metrics.none] there is no variable gain.output.none"),
        ("= \"ratio\"", "= \"ratoi\"", "[observe.signals] has no ratoi; did you mean ratio?"),
        (
            "[\"mean_sq",
            "[\"mean_s",
            "[observe] summary: there is no metric mean_suare; did you mean mean_sq",
        ),
        ("= \"bound\"", "= \"bond\"", "[observe.metrics.largest] limit: there is no metric bond"),
        (out, "out = []", "[observe.signals] out is empty"),
        (out, "out = [\"gain.output.direct\", \"plant.steps\"]", "mixes signals in"),
        (
            "steps = true",
            "every = 0",
            "[observe.metrics.mean_square] every = 0: it must be at least 1",
        ),
        (
            "ratio = { k",
            "samples = { k",
            "[observe.metrics.samples] metrics.json already has an entry of",
        ),
        (
            "ratio = {",
            "ratio = { id = \"share\",",
            "[observe.metrics.ratio] id = share: leave it out, the key is",
        ),
        (
            "reference = \"plant.",
            "reference = \"plan.",
            "signals: there is no variable plan.output.integral",
        ),
    ] {
        let message = plain(&observed(&section.replacen(from, to, 1)).refusal(&[]));
        assert!(message.contains(said), "{message}");
    }
    // An FMU of the command line may lack variables of its own, but not those of others.
    let wrong = section.replace("/ plant.output.integral", "/ plant.output.integal");
    let message = observed(&wrong).refusal(&["--fmu", "gain=Model.fmu"]);
    assert!(message.contains("there is no variable \"plant.output.integal\""), "{message}");
    let exchanged = section.replace("\"gain.output.direct /", "\"gain.output.dirct /");
    let bench = observed(&exchanged);
    bench.flown(&["--fmu", "gain=Model.fmu"]);
    assert!(bench.json("out/loop/metrics.json")["ratio"].is_null());
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let bench = Bench::new();
    for out in ["a", "b"] {
        assert_eq!(bench.run(&["--out", out, "--quiet"]), (0, String::new(), String::new()));
    }
    for file in ["results.csv", "results.json"] {
        assert_eq!(
            fs::read(bench.path("a").join(file)).unwrap(),
            fs::read(bench.path("b").join(file)).unwrap()
        );
    }
}

#[test]
fn couplings_and_orders_that_delay_the_loop_say_so() {
    let bench = Bench::new();
    let (_, summary, _) = bench.run(&["--coupling", "jacobi"]);
    assert_has(&summary, "1 s, 1 step (gain -> plant -> gain), from the Jacobi coupling");
    let bench = Bench::with(&LOOP.replace("[\"gain\", \"plant\"]", "[\"plant\", \"gain\"]"));
    let (_, summary, _) = bench.run(&[]);
    assert!(summary.contains("1 s, 1 step (plant -> gain -> plant), from the order"), "{summary}");
    assert_eq!(bench.json("out/loop/metrics.json")["loop_delay_s"], 1.0);
}

#[test]
fn a_law_that_counts_on_another_delay_is_warned_of_in_one_line() {
    let bench = Bench::new();
    let warnings = |arguments: &[&str]| {
        let (code, _, errors) = bench.run(&[&["--quiet"], arguments].concat());
        assert_eq!(code, 0, "{errors}");
        errors
    };
    let jacobi =
        ["--coupling", "jacobi", "--set", "gain.delay=1.25", "--set", "plant.actuation.delay=0.25"];
    let errors = warnings(&jacobi);
    // The plant also has a parameter of this name, which stays at 0.
    assert_eq!(errors.lines().count(), 1, "{errors}");
    let told = "plant.delay = 0 s, but the loop gain -> plant -> gain has a delay of 1 s: set plant.delay = 1";
    assert!(errors.contains(told), "{errors}");
    assert_eq!(warnings(&[&jacobi[..], &["--set", "plant.delay=1"]].concat()), "");
    assert_eq!(warnings(&[]), "");
    let errors = warnings(&["--set", "gain.delay=0.5"]);
    assert_has(
        &errors,
        "gain.delay = 0.5 s, but the loop gain -> plant -> gain has a delay of 0 s",
    );
}

#[test]
fn oracle_the_bounds_that_a_guarantee_accepts_are_told_without_a_flight() {
    // The model refuses a gain of 100 and more; the input is 1 at first, and the margin
    // 1 - input/largest.
    let bench = observed(
        r#"
[observe.guarantee]
in_force = "gain.guarantee.inForce"
[observe.guarantee.accepted]
largest = ["gain.gain", "gain.delay"]
smallest = ["gain.largest"]
told = ["gain.guarantee.rateMargin"]
leaving = ["gain.guarantee.rateMargin", 0.5]
with = { "gain.largest" = 5.0 }
by_rule = { "gain.largest" = 1.0 }
"#,
    );
    let call = ["margins", "loop.toml", "--guarantee", "--set", "gain.gain=200"];
    let (code, table, errors) = bench.call(&call);
    // Why the settings as they are are refused is said once.
    assert_eq!((code, errors.as_str()), (0, "ERROR gain: gain too large: 200 (fmi2Error)\n"));
    let rows: Vec<Vec<&str>> =
        table.lines().skip(1).map(|line| line.split_whitespace().collect()).collect();
    let near_100 = |text: &str| (99.98..100.0).contains(&text.parse::<f64>().unwrap());
    assert_eq!(rows[0][..4], ["largest", "gain.gain", "m", "200.0000"]);
    assert!(near_100(rows[0][4]) && near_100(rows[0][5]), "{table}");
    // With this gain nothing else is accepted.
    assert_eq!(rows[1], ["largest", "gain.delay", "s", "0.0000", "none", "none"]);
    assert_eq!(rows[2], ["smallest", "gain.largest", "m", "1000.0000", "none", "none"]);
    let condition = ["with", "gain.guarantee.rateMargin", "≥", "0.5", "m"];
    assert_eq!(rows[3][2..7], condition);
    assert!(near_100(rows[3][7]) && rows[3][8] == "none", "{table}");
    assert_eq!(rows[4], ["gain.guarantee.rateMargin", "none", "none"]);
    let call = ["margins", "loop.toml", "--guarantee", "--json", "--set", "gain.delay=0.5"];
    let (code, text, _) = bench.call(&call);
    let answers: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(code, 0);
    // Every large delay is accepted, and without one the gain is as large as before.
    assert_eq!((&answers[1]["set"], &answers[1]["by_rule"]), (&0.5.into(), &f64::MAX.into()));
    assert_eq!(answers[4]["answer"], "largest gain.gain without gain.delay");
    assert!(answers[4]["as_set"].as_f64().unwrap() > 99.98, "{answers}");
    assert_eq!((&answers[5]["as_set"], &answers[5]["by_rule"]), (&0.8.into(), &0.0.into()));
    let (code, _, errors) = Bench::new().call(&["margins", "loop.toml", "--guarantee"]);
    assert_eq!(code, 2);
    assert!(errors.contains("the experiment has no [observe.guarantee.accepted]"), "{errors}");
}

#[test]
fn oracle_a_guarantee_is_summed_up_and_told() {
    let section = |prefix: &str| {
        format!(
            r#"
[observe.guarantee]
in_force = "{prefix}.inForce"
status = "{prefix}.status"
margins = {{ rate = "{prefix}.rateMargin", moment = "{prefix}.momentMargin" }}
"#
        )
    };
    let bench = observed(&section("gain.guarantee"));
    let guarantee = |largest: &str| {
        let summary =
            bench.flown(&["--set", "gain.gain=0.5", "--set", &format!("gain.largest={largest}")]);
        let line =
            summary.lines().find(|line| line.starts_with("  guarantee ")).unwrap().to_string();
        (line, bench.json("out/loop/metrics.json"))
    };
    // The input is 1, 1.5, 2.25, in three steps; the margins are 1 - input/largest, and half of
    // that.
    let (line, metrics) = guarantee("2");
    assert_eq!(
        line,
        "  guarantee         in force at 66.66 % of the ticks, lost at t = 2 s (exceeded)"
    );
    assert_eq!(
        (&metrics["guarantee_share"], &metrics["guarantee_lost_at"]),
        (&(2.0 / 3.0).into(), &2.0.into())
    );
    assert_eq!(metrics["guarantee_rate_margin_min"], 0.25);
    assert_eq!(metrics["guarantee_moment_margin_min"], 0.125);
    // The experiment names no limits.
    assert!(metrics["guarantee_broken"].is_null());
    let (_, summary, _) = Bench::new().run(&[]);
    assert!(!summary.contains("guarantee"), "{summary}");
    let message = observed(&section("gain.fail")).refusal(&[]);
    assert_has(&message, "[observe.guarantee] there is no variable \"gain.fail.inForce\"");
    let may_lack = observed(&format!("{}optional = true\n", section("gain.fail")));
    assert_eq!(may_lack.run(&[]).0, 0);
    assert!(
        may_lack.json("out/loop/metrics.json").as_object().unwrap()["guarantee_share"].is_null()
    );
}

#[test]
fn a_failing_instance_ends_the_run_with_its_own_words_and_keeps_the_results() {
    let bench = Bench::new();
    // The statuses are fmi2Discard, fmi2Error, and fmi2Fatal, after which not even fmi2FreeInstance
    // may be called.
    for (status, name) in [("2", "fmi2Discard"), ("3", "fmi2Error"), ("4", "fmi2Fatal")] {
        let status = format!("plant.fail.status={status}");
        let (code, _, errors) = bench.run(&["--set", "plant.fail.time=2", "--set", &status]);
        assert_eq!(code, 1, "{errors}");
        let last = errors.lines().last().unwrap();
        assert_has(last, "error: plant failed at t = 2 s in doStep: out of propellant at 2");
        assert!(last.contains(name), "{last}");
        assert_eq!(bench.results().lines().count(), 4);
        assert_eq!(bench.json("out/loop/metrics.json")["completed"], false);
        let status = bench.json("out/loop/results.json")["status"].as_str().unwrap().to_string();
        assert!(status.contains("out of propellant"), "{status}");
    }
    bench.ends(
        1,
        &["--set", "gain.gain=500"],
        "gain failed at t = 0 s in enterInitializationMode: gain too large: 500",
    );
}

#[test]
fn a_plot_can_be_left_out_and_metadata_name_units_and_items() {
    let bench =
        Bench::with(&LOOP.replace("\"plant.steps\"", "\"plant.steps\", \"gain.guarantee.status\""));
    let summary = bench.flown(&["--no-plot", "--out", "few"]);
    assert!(summary.contains("few: results.csv, results.json, metrics.json\n"), "{summary}");
    assert!(!bench.path("few/plot.svg").exists());
    assert_eq!(bench.run(&[]).0, 0);
    let rows = bench.results();
    let rows: Vec<&str> = rows.lines().take(2).collect();
    let names = "time,gain.output.direct,plant.output.integral,plant.steps,gain.guarantee.status";
    assert_eq!(rows, [names, "0.0,2.0,1.0,0,1"]);
    let columns = &bench.json("out/loop/results.json")["columns"];
    assert!(columns[3]["items"]["1"].is_string(), "{columns}");
    assert!(columns[0]["items"].is_null() && columns[0]["unit"] == "m");
}

#[test]
#[cfg(target_os = "linux")]
fn a_dropped_connection_ends_a_run_in_order_unless_it_is_ignored() {
    let bench = Bench::new();
    // The paced run would take thirty hours.
    for (out, trap, how, expected) in [
        ("ended", ":", "--real-time=2.7e-5", 129),
        ("ignored", "trap '' HUP", "--set=gain.pause=0.3", 0),
    ] {
        let run = ["run", "loop.toml", "--quiet", "--out", out, how];
        let mut child = with_usual_signals("sh")
            .args([
                "-c",
                &format!("{trap}; exec \"$0\" \"$@\""),
                env!("CARGO_BIN_EXE_orchestrator"),
            ])
            .args(run)
            .current_dir(bench.folder.path())
            .spawn()
            .unwrap();
        let results = bench.path(out).join("results.csv");
        await_while_it_runs(&mut child, "results.csv", || results.exists());
        let hangup = Command::new("kill").args(["-HUP", &child.id().to_string()]).status();
        assert!(hangup.unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(expected));
        let metrics = bench.json(&format!("{out}/metrics.json"));
        assert_eq!(metrics["completed"], expected == 0);
    }
}
