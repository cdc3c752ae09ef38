//! Tests of refusals, in the command line and in files, and of the search for files.

use crate::prelude::*;

/// Returns whether a line of the list shows this name with this title. If the program was built in
/// the project, the list also shows the project's files.
fn lists(text: &str, name: &str, title: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with(name) && line.ends_with(title))
}

fn refusal_of(from: &str, to: &str) -> String {
    let changed = LOOP.replace(from, to);
    assert_ne!(changed, LOOP, "{from}");
    Bench::with(&changed).refusal(&[])
}

#[test]
fn usage_that_is_nearly_right_is_told_what_it_lacks() {
    let bench = Bench::new();
    let said = "error: --stop -1: stop = -1 s must be at least one step of 1 s";
    assert_has(&bench.refusal(&["--stop", "-1"]), said);
    bench.fails(2, &["reproduce", "loop", "--members", "0"], "--members");
    let paced = ["run", "--real-time", "loop.toml"];
    bench.fails(2, &paced, "write the experiment before --real-time");
    // The pattern leaves all inputs of this component unconnected, however many there are.
    let lonely = LOOP.replace(
        "[components.plant]",
        "[components.other]\nfmu = \"Model.fmu\"\nunconnected = [\"*\"]\n[components.plant]",
    );
    let bench = Bench::with(&lonely);
    let summary = bench.flown(&[]);
    // A component that the order leaves out comes last.
    assert!(summary.contains("gain, plant, other"), "{summary}");
}

#[test]
fn an_fmu_is_exchanged_from_the_command_line() {
    let experiment = LOOP.replace(
        "[components.plant]",
        "[components.gain.parameters]\ngain = 3.0\n[components.plant]",
    );
    let bench = Bench::with(&experiment);
    // The new FMU lacks a parameter that the experiment sets.
    let renamed = |text: String| text.replace("name=\"gain\"", "name=\"amplification\"");
    let other = Bench::made(LOOP, &Recipe { description: &renamed, ..Recipe::default() });
    fs::create_dir(bench.path("mine")).unwrap();
    fs::copy(other.path("Model.fmu"), bench.path("mine/My.fmu")).unwrap();
    let exchanged = ["--quiet", "--fmu", "gain=mine/My.fmu", "--set", "gain.amplification=0.5"];
    let told = "as \"gain\" does not have these parameters, which are left out: gain";
    bench.ends(0, &exchanged, told);
    let metadata = bench.json("out/loop/results.json");
    assert_has(metadata["title"].as_str().unwrap(), "My in place of Model: ");
    assert_eq!(metadata["components"]["gain"]["fmu"], "My.fmu");
    assert_eq!(metadata["components"]["gain"]["set"]["amplification"], 0.5);
    for (assignment, told) in [
        ("gian=mine/My.fmu", "did you mean \"gain\""),
        ("mine/My.fmu", "expected component=file"),
        ("gain=mine/Me.fmu", "there is no file \"mine/Me.fmu\""),
        ("gain=Modle.fmu", "did you mean \"Model.fmu\""),
    ] {
        let message = bench.refusal(&["--fmu", assignment]);
        assert!(message.contains(told), "{message}");
    }
}

#[test]
fn inspect_filters_and_speaks_json() {
    let bench = Bench::new();
    let (code, text, _) = bench.call(&["inspect", "Model.fmu", "guarantee.*", "--json"]);
    assert_eq!(code, 0);
    let printed: serde_json::Value = serde_json::from_str(&text).unwrap();
    let names: Vec<&str> = printed["variables"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["name"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["guarantee.inForce", "guarantee.status", "guarantee.rateMargin", "guarantee.momentMargin"]
    );
    assert_eq!(printed["guid"], "{u-1}");
    let text = bench.says(&["inspect", "Model.fmu"]);
    for part in ["linux64", "canHandleVariableCommunicationStepSize", "{calm, rough}"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let (_, text, _) = bench.call(&["inspect", "Model.fmu", "seed"]);
    assert!(text.contains("noise.seed") && !text.contains("output.direct"), "{text}");
    bench.fails(2, &["inspect", "Model.fmu", "sed"], "has no variable that fits \"sed\"");
}

#[test]
fn wrong_names_and_wiring_are_refused_with_place_and_remedy() {
    const FROM: &str = "plant.output.integral\"\nto";
    const TO: &str = "to = \"plant.input\"";
    const BOTH: &str = "gain.output.direct\"\nto = \"plant.input";
    const ORDER: &str = "[\"gain\", \"plant\"]";
    for (from, to, said) in [
        (FROM, "plant.output.integrall\"\nto", &["toml:12: ", "did you mean output.integral"][..]),
        ("to = \"gain.input\"", "to = \"gian.input\"", &["toml:13: ", "did you mean gain"]),
        ("\"plant.steps\"", "\"plant.step\"", &["toml:18: ", "did you mean steps"]),
        ("l.fmu\"\n[c", "e.fmu\"\n[c", &["toml:8: ", "did you mean Model.fmu"]),
        (ORDER, "[\"gain\", \"palnt\"]", &["did you mean plant"]),
        (ORDER, "[]", &["there is no order", "order = [gain, plant]"]),
        ("stop = 3.0", "stopp = 3.0", &["toml:4: ", "`stop`"]),
        (FROM, "plant.speed\"\nto", &["units", "m/s against m"]),
        (FROM, "plant.steps\"\nto", &["Integer against Real"]),
        (FROM, "plant.gain\"\nto", &["is of causality parameter, not an output"]),
        (FROM, "plant.output.direct\"\nto", &["algebraic loop", "gain.input"]),
        (TO, "to = \"plant.output.direct\"", &["is of causality output, not an input"]),
        (TO, "to = \"gain.input\"", &["toml:16: ", "connected twice"]),
        (BOTH, "plant.*\"\nto = \"gain.none.*", &["there are: input"]),
    ] {
        let message = plain(&refusal_of(from, to));
        assert!(said.iter().all(|text| message.contains(text)), "{to}: {message}");
    }
    // A line that was right for the experiment's own FMU is not at fault alone.
    let changed = LOOP.replace(TO, "to = \"plant.output.direct\"");
    let message = Bench::with(&changed).refusal(&["--fmu", "plant=Model"]);
    assert!(message.contains("; --fmu plant=Model replaces the experiment's FMU"), "{message}");
}

#[test]
fn wrong_settings_are_refused() {
    let bench = Bench::new();
    for (setting, remedy) in [
        ("gain.gain", "expected component.parameter=value"),
        ("=1", "expected component.parameter=value"),
        ("gain.gian=1", "did you mean \"gain.gain\""),
        ("noise.seed=1", "the component is missing: write gain.noise.seed or plant.noise.seed"),
        ("palnt.gain=1", "did you mean \"plant.gain\""),
        ("gain.seed=1", "did you mean \"gain.noise.seed\""),
        ("gain.kind=ruogh", "did you mean \"rough\""),
        ("gain.kind=2", "the name of an item (calm, rough)"),
        ("gain.gain=1 m/s", "measure different quantities"),
        ("gain.gain=1 mmm", "did you mean \"mm\""),
        ("gain.gain=2000", "above its maximum 1000"),
        ("gain.fail.status=7", "not between 2 and 4"),
        ("gain.flag=1", "must be true or false"),
        ("gain.steps=1", "is of causality output"),
        ("gain.input=1", "is an input with a connection"),
    ] {
        let message = bench.refusal(&["--set", setting]);
        assert!(message.contains(remedy), "{setting}: {message}");
        assert!(
            message.starts_with("error: --set ") && !message.contains("loop.toml"),
            "{message}"
        );
    }
    assert!(bench.refusal(&["--stop", "2.5"]).contains("2 s or 3 s"));
    bench.flown(&["--set", "gain.text=hello", "--set", "gain.flag=true"]);
    assert_eq!(
        bench.json("out/loop/results.json")["components"]["gain"]["parameters"]["flag"],
        true
    );
}

/// A description in which the parameter is an input.
fn as_input(description: &str, parameter: &str) -> String {
    let (before, after) = description.split_once(&format!("name=\"{parameter}\"")).unwrap();
    let after = after.replacen("parameter", "input", 1).replacen("fixed", "discrete", 1);
    format!("{before}name=\"{parameter}\"{after}")
}

#[test]
fn whole_numbers_are_passed_on() {
    let connected = "[[connections]]\nfrom = \"plant.steps\"\nto = \"gain.noise.seed\"\n[record]";
    let experiment = LOOP
        .replace("[record]", connected)
        .replace("[components.plant]", "[components.plant]\nunconnected = [\"noise.seed\"]")
        .replace("\"plant.steps\"]", "\"gain.noise.seed\"]");
    let description = |text: String| as_input(&text, "noise.seed");
    let recipe = Recipe { description: &description, ..Recipe::default() };
    let bench = Bench::made(&experiment, &recipe);
    bench.flown(&[]);
    let results = bench.results();
    let seeds: Vec<&str> = results.lines().skip(1).map(|l| l.rsplit(',').next().unwrap()).collect();
    assert_eq!(seeds, ["0", "1", "2", "2"]);
}

#[test]
fn enumerations_of_different_items_are_not_connected() {
    let connected =
        "[[connections]]\nfrom = \"plant.guarantee.status\"\nto = \"gain.kind\"\n[record]";
    let description = |text: String| as_input(&text, "kind");
    let recipe = Recipe { description: &description, ..Recipe::default() };
    let message = Bench::made(&LOOP.replace("[record]", connected), &recipe).refusal(&[]);
    assert!(message.contains("are enumerations of different items"), "{message}");
}

#[test]
fn inputs_without_connection_must_be_meant() {
    let message = refusal_of("[components.plant]", "[components.plant]\nunconnected = [\"inptu\"]");
    assert!(message.contains("\"plant\" has no input \"inptu\""), "{message}");
    let open =
        LOOP.replace("[[connections]]\nfrom = \"gain.output.direct\"\nto = \"plant.input\"\n", "");
    let message = Bench::with(&open).refusal(&[]);
    assert!(message.contains("inputs of \"plant\" are not connected: input"), "{message}");
    // The line that the message proposes solves the problem.
    let (_, line) = message.split_once("[components.plant]: ").unwrap();
    let meant = open.replace("[components.plant]\n", &format!("[components.plant]\n{line}"));
    assert_eq!(Bench::with(&meant).run(&[]).0, 0);
    // A value for the input solves it as well.
    let bench = Bench::with(&open);
    assert_eq!(bench.run(&["--set", "plant.input=3"]).0, 0);
    assert!(bench.results().contains("\n3.0,14.0,10.0,3\n"));
    let message = Bench::with(
        &LOOP.replace("[components.plant]\n", "[components.plant]\nunconnected = [\"input\"]\n"),
    )
    .refusal(&[]);
    assert!(message.contains("is listed as unconnected, but is connected"), "{message}");
}

#[test]
fn an_experiment_that_extends_another_is_all_of_them() {
    let bench = Bench::new();
    bench.says(&["run", "loop.toml", "--quiet"]);
    let results =
        |name: &str| fs::read_to_string(bench.path(&format!("out/{name}/results.csv"))).unwrap();
    let longer = "extends = \"../loop.toml\"\ntitle = \"longer\"\n[simulation]\nstop = 4.0\n";
    fs::create_dir(bench.path("more")).unwrap();
    fs::write(bench.path("more/longer.toml"), longer).unwrap();
    // The FMU stands beside the file that is extended.
    bench.says(&["run", "more/longer", "--quiet"]);
    // The last row of the shorter run, where no step begins, keeps the outputs of the step before.
    let (longer, shorter) = (results("longer"), results("loop"));
    let common = shorter.lines().count() - 1;
    assert!(longer.lines().take(common).eq(shorter.lines().take(common)));
    assert_eq!(longer.lines().count(), common + 2);
    // The kept, the shown and the packed experiment are the merged whole.
    let metadata = bench.json("out/longer/results.json");
    let (code, shown, _) = bench.call(&["show", "more/longer"]);
    // What is shown can be flown from any folder.
    let fmu = bench.path("more/../Model.fmu").display().to_string();
    let kept = metadata["experiment"]["text"].as_str().unwrap();
    assert!(
        code == 0 && kept.replace("Model.fmu", &fmu) == shown && !shown.contains("extends"),
        "{shown}"
    );
    fs::write(bench.path("whole.toml"), shown).unwrap();
    let (code, _, errors) = bench.call(&["run", "whole.toml", "--quiet"]);
    assert!(code == 0 && results("whole") == results("longer"), "{errors}");
    bench.says(&["pack", "more/longer.toml", "--out", "longer.ssp"]);
    let mut archive = zip::ZipArchive::new(fs::File::open(bench.path("longer.ssp")).unwrap());
    let mut structure = String::new();
    let entry = archive.as_mut().unwrap().by_name("SystemStructure.ssd");
    entry.unwrap().read_to_string(&mut structure).unwrap();
    assert!(structure.contains("stopTime=\"4.0\""), "{structure}");
    // A file without a title is no experiment of its own.
    fs::write(bench.path("loop.toml"), LOOP.replace("title = \"gain and integrator\"\n", ""))
        .unwrap();
    let (_, text, _) = bench.call(&["list", "."]);
    assert!(lists(&text, "more/longer", "longer") && !lists(&text, "loop", "integrator"), "{text}");
}
