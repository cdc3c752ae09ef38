use super::*;
use crate::recording::Track;

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

#[test]
fn oracle_the_panel_of_an_experiment_with_the_norm_and_its_limit() {
    let panels = of_experiments(&[run("a", &SIGNALS, PANELS)]).unwrap();
    assert_eq!(panels.len(), 1);
    assert_eq!(names(&panels[0]), [("p", 0), ("q", 0), ("norm", 0)]);
    assert_eq!(panels[0].curves[2].values, [5.0, 1.0]);
    assert_eq!((panels[0].limit, panels[0].unit.as_str()), (Some(5.0), "deg/s"));
}

#[test]
fn panels_of_several_runs_have_six_curves_at_most() {
    let runs: Vec<Recording> =
        ["a", "b", "c", "d"].iter().map(|name| run(name, &SIGNALS, PANELS)).collect();
    let panels = of_experiments(&runs).unwrap();
    // One for p, one for q, one for the norms with their limit.
    assert_eq!(panels.len(), 3);
    assert!(panels.iter().all(|panel| panel.curves.len() == 4));
    assert_eq!((panels[0].limit, panels[2].limit), (None, Some(5.0)));
    let panels = of_experiments(&runs[..2]).unwrap();
    assert_eq!(names(&panels[0]), [("p", 0), ("q", 0), ("p", 1), ("q", 1)]);
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
    assert_eq!(names(&panels[1]), [("α", 0)]);
    // Signals that are named one by one are compared, also with what a combination gives.
    let panels = asked(&["plant.rate.p", "law.limit", "norm(plant.rate.p, plant.rate.q)"]).unwrap();
    assert_eq!((panels.len(), panels[0].curves.len()), (1, 3));
    let fault = asked(&["plant.rat.p"]).unwrap_err();
    assert!(fault.ends_with("did you mean \"plant.rate.p\"?"), "{fault}");
    let fault = asked(&["plant.rates.*"]).unwrap_err();
    assert!(fault.contains("no recorded variable matches \"plant.rates.*\""), "{fault}");
}

#[test]
fn without_panels_all_recorded_variables_are_drawn_up_to_a_number() {
    let many: Vec<(String, &str, [f64; 2])> =
        (0..40).map(|i| (format!("a.x[{i}]"), "m", [0.0, f64::from(i)])).collect();
    let many: Vec<_> =
        many.iter().map(|(name, unit, values)| (name.as_str(), *unit, *values)).collect();
    let panels = of_experiments(&[run("a", &many, "")]).unwrap();
    assert_eq!(panels.iter().map(|panel| panel.curves.len()).collect::<Vec<_>>(), [6, 6, 6, 6]);
}

#[test]
fn angles_are_written_by_their_symbols() {
    assert_eq!(symbols("plant.attitude.alpha"), "plant.attitude.α");
    assert_eq!(symbols("beta - sigma"), "β - σ");
    assert_eq!(symbols("alphabet"), "alphabet");
}
