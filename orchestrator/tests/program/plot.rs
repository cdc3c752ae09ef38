//! Pictures and pages of recorded runs, of a loop that can be computed by hand.

use crate::prelude::*;
use serde_json::Value;

/// Panels of the loop. Its integrator has the values 2^k at tick k.
const PANELS: &str = r#"
[observe]
panels = [{ name = "integral", limit = "gain.gain", curves = [
    { name = "alpha", of = "plant.output.integral", reference = "gain.output.direct" },
    { name = "again", of = "plant.output.integral" },
] }]
[observe.vehicle]
attitude = ["plant.output.integral", "gain.output.direct", "plant.output.integral"]
deflections = ["gain.output.direct"]
"#;

fn flown() -> Bench {
    let bench = Bench::with(&format!("{LOOP}{PANELS}"));
    for (out, gain) in [("a", "1.0"), ("b", "0.5")] {
        let set = format!("gain.gain={gain}");
        bench.flown(&["--out", out, "--set", &set, "--quiet"]);
    }
    bench
}

fn plotted(bench: &Bench, arguments: &[&str]) -> String {
    let said = bench.says(&[&["plot"], arguments].concat());
    fs::read_to_string(bench.path(said.trim())).unwrap()
}

/// Returns the numbers of a page.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"run-data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn a_run_is_drawn_as_its_experiment_says_or_as_it_is_asked_for() {
    let bench = flown();
    let picture = plotted(&bench, &["a"]);
    assert!(picture.starts_with("<svg") && picture.contains("limit of norm"), "{picture}");
    assert!(picture.contains("α") && picture.contains("gain and integrator"));
    let picture = plotted(&bench, &["a", "--signals", "plant.*", "--out", "p/other.svg"]);
    assert!(picture.contains("steps") && !picture.contains("limit of norm"));
    let named = ["--signals", "plant.steps", "--signals", "plant.output.integral", "a", "b"];
    let picture = plotted(&bench, &[&named[..], &["--out", "named.svg"]].concat());
    // The labels name the signals, and the legends the runs alone.
    for (text, count) in [("plant.steps", 1), ("plant.output.integral, m", 1), ("a", 2), ("b", 2)] {
        assert_eq!(picture.matches(&format!(">{text}</text>")).count(), count, "{text}: {picture}");
    }
    let picture = plotted(&bench, &["a", "b", "--out", "both.svg"]);
    for name in ["limit of norm, a", "limit of norm, b", "reference", "reference of α, b"] {
        assert_eq!(picture.matches(&format!(">{name}</text>")).count(), 1, "{name}: {picture}");
    }
    // A run below out is found by its name.
    fs::create_dir(bench.path("out")).unwrap();
    fs::rename(bench.path("b"), bench.path("out/b")).unwrap();
    plotted(&bench, &["b", "--out", "b.svg"]);
}

#[test]
fn oracle_the_numbers_of_a_page_are_those_of_the_runs() {
    let bench = flown();
    let page = plotted(&bench, &["a", "b", "--out", "both.html"]);
    assert!(!page.contains("http://") || !page.contains("src="), "it needs no network");
    let data = data(&page);
    let values = |panel: usize, curve: usize| {
        let values = data["panels"][panel]["curves"][curve]["values"].as_array().unwrap();
        values.iter().map(|value| value.as_f64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(data["runs"][0]["time"], serde_json::json!([0, 1, 2, 3]));
    // Doubled at each tick, and half as much again; the norms have a panel of their own.
    assert_eq!(values(0, 0), [1.0, 2.0, 4.0, 8.0]);
    assert_eq!(values(0, 3), [1.0, 1.5, 2.25, 3.375]);
    let norms = values(0, 3).into_iter().map(|value| value * 2.0_f64.sqrt());
    assert!(norms.zip(values(1, 1)).all(|(norm, drawn)| (norm - drawn).abs() < 1e-3));
    // Limits and references differ between the runs.
    let limits = serde_json::json!([
        { "name": "limit of norm, a", "value": 1 }, { "name": "limit of norm, b", "value": 0.5 },
    ]);
    assert_eq!(data["panels"][1]["limits"], limits);
    assert_eq!(data["panels"][0]["curves"][4]["name"], "reference of α, b");
    assert_eq!(values(0, 4), [0.5, 0.75, 1.125, 1.125]);
    assert_eq!(data["runs"][1]["vehicle"]["angles"][0][2], 2.25);
    // At the stop time, a response is that of the step before.
    assert_eq!(
        data["runs"][0]["vehicle"]["surfaces"][0]["values"],
        serde_json::json!([1, 2, 4, 4])
    );
    assert!(page.contains("<tr data-set data-differs><th scope=\"row\"><code>gain.gain"), "{page}");
    let window = plotted(&bench, &["a", "--from", "1", "--to", "2", "--out", "part.html"]);
    assert!(window.contains("\"time\":[1,2]"));
}

#[test]
fn a_run_writes_its_own_page_with_what_it_does_not_record() {
    let text =
        format!("{LOOP}{PANELS}").replace("variables = [\"gain.output.direct\", ", "variables = [");
    let bench = Bench::with(&text);
    let (code, said, errors) = bench.run(&["--page"]);
    assert_eq!(code, 0, "{errors}");
    assert!(said.contains("page.html"), "{said}");
    let page = bench.text("out/loop/page.html");
    assert_eq!(data(&page)["panels"][0]["curves"][1]["role"], "reference");
    // The page belongs to the results: it is replaced with them.
    let (code, ..) = bench.run(&[]);
    assert!(code == 0 && !bench.path("out/loop/page.html").exists());
    let bench = Bench::with(&text.replace("\"gain.output.direct\"]", "\"gain.output.direkt\"]"));
    let (code, _, errors) = bench.run(&["--page"]);
    assert_eq!(code, 2);
    assert!(errors.contains("[observe.vehicle]") && errors.contains("did you mean"), "{errors}");
}

#[test]
fn the_page_of_a_run_without_panels_draws_what_is_recorded() {
    let bench = Bench::new();
    bench.flown(&["--page", "--out", "a"]);
    let page = data(&bench.text("a/page.html"));
    assert_eq!(page["panels"].as_array().unwrap().len(), 3);
    // The same as `plot` draws from the files.
    assert_eq!(page["panels"], data(&plotted(&bench, &["a", "--out", "a.html"]))["panels"]);
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    let bench = flown();
    for (arguments, said) in [
        (
            &["a", "--signals", "plant.output.intgral"][..],
            "did you mean \"plant.output.integral\"?",
        ),
        (&["a", "--signals", "plent.*"], "no recorded variable matches \"plent.*\""),
        (&["c"], "there is no run c"),
        (&["."], "holds no results.csv"),
        (&["a", "--out", "a.pdf"], "must end with .svg or .html"),
        (&["a", "--from", "7"], "it goes from 0 s to 3 s"),
        (&["a", "--from", "2", "--to", "1"], "--from 2 must be below --to 1"),
        (&["a/metrics.json"], "a/metrics.json is no table of recorded variables"),
        (&["a"; 7], "7 runs: at most 6"),
    ] {
        let (code, _, errors) = bench.call(&[&["plot"], arguments].concat());
        assert_eq!((code, errors.lines().count()), (2, 1), "{errors}");
        assert!(errors.contains(said), "{errors}");
    }
    bench.fails(2, &["plot", "a", "--from", "-5", "--to", "nan"], "'nan' for '--to <SECONDS>'");
    let margins = ["margins", "loop.toml", "--plot", "a.pdf"];
    bench.fails(2, &margins, "--plot a.pdf: the name must end with .svg");
}
