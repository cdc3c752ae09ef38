use super::*;
use crate::recording::Track;
use crate::recording::panels::Limit;

fn run(name: &str, signals: &[(&str, &str, [f64; 2])], observe: &str) -> Recording {
    let track = |unit: &str, values: [f64; 2]| Track {
        unit: unit.into(),
        factor: 1.0,
        items: Vec::new(),
        values: values.to_vec(),
    };
    let named = signals.iter().map(|(name, unit, values)| ((*name).into(), track(unit, *values)));
    Recording {
        name: name.into(),
        time: vec![0.0, 1.0],
        recorded: signals.iter().map(|(name, ..)| (*name).to_string()).collect(),
        tracks: named.collect(),
        observe: toml::from_str(observe).unwrap(),
        ..Recording::default()
    }
}

const SIGNALS: [(&str, &str, [f64; 2]); 4] = [
    ("plant.rate.p", "deg/s", [3.0, 0.0]),
    ("plant.rate.q", "deg/s", [4.0, 1.0]),
    ("plant.attitude.alpha", "deg", [1.0, 2.0]),
    ("law.limit", "deg/s", [5.0, 5.0]),
];
const PANELS: &str = r#"
panels = [{ name = "rate", limit = "law.limit", curves = [
    { name = "p", of = "plant.rate.p" }, { name = "q", of = "plant.rate.q" },
    { name = "r", of = "plant.rate.r" },
] }]
"#;

fn names(panel: &Panel) -> Vec<(&str, usize)> {
    panel.curves.iter().map(|curve| (curve.name.as_str(), curve.run)).collect()
}

/// Texts of the legend of a panel, for runs of these names.
fn legend(panel: &Panel, runs: &[&str]) -> Vec<String> {
    let runs: Vec<String> = runs.iter().map(ToString::to_string).collect();
    panel.curves.iter().map(|curve| panel.legend(curve, &runs)).collect()
}

#[test]
fn oracle_the_panel_of_an_experiment_with_the_norm_and_its_limit() {
    let panels = of_experiments(&[run("a", &SIGNALS, PANELS)]).unwrap();
    assert_eq!(panels.len(), 1);
    assert_eq!(names(&panels[0]), [("p", 0), ("q", 0), ("norm", 0)]);
    assert_eq!(panels[0].curves[2].values, [5.0, 1.0]);
    assert_eq!(panels[0].limits, [Limit { value: 5.0, runs: vec![0] }]);
    assert_eq!(panels[0].unit, "deg/s");
    // An optional one is there with all its curves, or not at all.
    let optional = PANELS.replace("limit =", "optional = true, limit =");
    let drawn = of_experiments(&[run("a", &SIGNALS, &optional)]).unwrap();
    assert!(drawn.iter().all(|panel| panel.label != "rate"));
}

#[test]
fn references_that_differ_from_the_first_runs_are_drawn_as_their_runs_own() {
    const FOLLOWING: &str = r#"panels = [{ name = "angle", curves = [
        { name = "alpha", of = "plant.attitude.alpha", reference = "law.reference" },
    ] }]"#;
    let following = |name: &str, reference: [f64; 2]| {
        let angle = ("plant.attitude.alpha", "deg", [1.0, 2.0]);
        run(name, &[angle, ("law.reference", "deg", reference)], FOLLOWING)
    };
    let mut runs =
        [following("a", [1.0, 3.0]), following("b", [1.0, 3.0]), following("c", [1.0, 4.0])];
    // Sampled at other times, the same line is the same reference.
    runs[1].time = vec![0.0, 0.5];
    runs[1].tracks.get_mut("law.reference").unwrap().values = vec![1.0, 2.0];
    let panels = of_experiments(&runs).unwrap();
    let names = ["a", "b", "c"];
    assert_eq!(legend(&panels[0], &names), ["α, a", "reference", "α, b", "α, c", "reference, c"]);
    // A reference that goes on after the first run's is not covered by it.
    runs[1].time = vec![0.0, 2.0];
    let panels = of_experiments(&runs[..2]).unwrap();
    assert_eq!(legend(&panels[0], &names[..2]), ["α, a", "reference", "α, b", "reference, b"]);
}

#[test]
fn signals_that_are_asked_for_are_grouped_by_unit_and_stem() {
    let runs = [run("a", &SIGNALS, "")];
    let asked = |patterns: &[&str]| {
        let patterns: Vec<String> = patterns.iter().map(ToString::to_string).collect();
        of_signals(&runs, &patterns)
    };
    let panels = asked(&["plant.*"]).unwrap();
    assert_eq!(panels.len(), 2);
    assert_eq!(
        (panels[0].label.as_str(), names(&panels[0])),
        ("plant.rate", vec![("p", 0), ("q", 0)])
    );
    // The label has room for the name of a signal alone.
    assert_eq!(panels[1].label, "plant.attitude.α");
    assert_eq!(legend(&panels[1], &["a"]), [""]);
    // Signals that are named one by one are compared, also with a combination.
    let panels = asked(&["plant.rate.p", "law.limit", "norm(plant.rate.p, plant.rate.q)"]).unwrap();
    assert_eq!((panels.len(), panels[0].curves.len()), (1, 3));
    let fault = asked(&["plant.rat.p"]).unwrap_err();
    assert!(fault.ends_with("did you mean \"plant.rate.p\"?"), "{fault}");
    let fault = asked(&["plant.rates.*"]).unwrap_err();
    assert!(fault.contains("no recorded variable matches \"plant.rates.*\""), "{fault}");
}

#[test]
fn a_limit_that_is_exceeded_many_times_is_seen_on_an_axis_of_magnitudes() {
    let panels = |most: f64| {
        let mut signals = SIGNALS;
        signals[0].2 = [-most, 0.0];
        of_experiments(&[run("a", &signals, PANELS)]).unwrap()
    };
    assert_eq!((panels(20.0).len(), panels(20.0)[0].magnitudes), (1, None));
    let [signals, norm] = &panels(300.0)[..] else { panic!("one panel") };
    assert_eq!((names(signals), names(norm)), (vec![("p", 0), ("q", 0)], vec![("norm", 0)]));
    let [low, high] = norm.magnitudes.unwrap();
    assert!(low == 0.5 && high > 300.0 && norm.label == "norm of rate");
    assert!(signals.limits.is_empty() && norm.limits[0].value == 5.0);
}

#[test]
fn a_limit_of_one_signal_needs_no_norm() {
    let one = r#"panels = [{ name = "rate", limit = "law.limit", curves = [{ name = "p", of = "plant.rate.p" }] }]"#;
    let panels = of_experiments(&[run("a", &SIGNALS, one), run("b", &SIGNALS, one)]).unwrap();
    assert_eq!(names(&panels[0]), [("p", 0), ("p", 1)]);
    assert_eq!(panels[0].limit_name(&panels[0].limits[0], &[]), "limit");
    assert_eq!((panels.len(), panels[0].limits[0].value), (1, 5.0));
}

#[test]
fn surfaces_have_their_names_and_the_commands_of_jets_are_added() {
    let signals = [
        ("plant.rate.p", "deg/s", [3.0, 0.0]),
        ("plant.deflection[1]", "deg", [-3.0, 2.0]),
        ("plant.jet[1]", "", [0.5, 0.0]),
        ("plant.jet[2]", "", [0.25, 1.0]),
    ];
    let observe = r#"
        panels = [{ name = "rate", curves = [{ name = "p", of = "plant.rate.p" }] }]
        [vehicle]
        attitude = ["a.a", "a.b", "a.c"]
        deflections = ["plant.deflection[1]", "plant.deflection[2]"]
        surfaces = ["left flap", "right flap"]
        jets = ["plant.jet[1]", "plant.jet[2]"]
    "#;
    let panels = of_experiments(&[run("a", &signals, observe)]).unwrap();
    let labels: Vec<&str> = panels.iter().map(|panel| panel.label.as_str()).collect();
    assert_eq!(labels, ["rate", "surfaces", "jets, sum of commands"]);
    assert_eq!((names(&panels[1]), panels[1].unit.as_str()), (vec![("left flap", 0)], "deg"));
    assert_eq!(panels[2].curves[0].values, [0.75, 1.0]);
}
