use super::*;

const TEXT: &str = r#"
title = "x"
[simulation]
stop = 1.0
step = 0.1
[components.a]
fmu = "A.fmu"
[components.a.parameters]
"p.q" = 1
[record]
variables = ["a.*"]
"#;

fn parse(text: &str) -> Result<Experiment, Error> {
    Experiment::parse(Path::new("x.toml"), text.to_string())
}

#[test]
fn the_command_line_wins() {
    let mut experiment = parse(TEXT).unwrap();
    let set = ["a.p.q=2.5", "a.kind=white", "a.bound=2 deg/s2", "a.text=\"1\"", "a.flag=true"];
    let set = set.map(String::from).to_vec();
    experiment.apply(&Overrides { set, stop: Some(3.0), ..Overrides::default() }).unwrap();
    let value = |name: &str| experiment.components["a"].parameters[name].get_ref().clone();
    assert_eq!(experiment.simulation.stop, 3.0);
    assert_eq!(value("p.q"), Value::Float(2.5));
    assert_eq!(value("kind"), Value::String("white".into()));
    assert_eq!(value("bound"), Value::String("2 deg/s2".into()));
    assert_eq!(value("text"), Value::String("1".into()));
    assert_eq!(value("flag"), Value::Boolean(true));
}

#[test]
fn pages_show_the_surfaces_and_jets_of_the_vehicle_that_flies() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../experiments/entry");
    let shown = |name: &str| {
        let vehicle = Experiment::load(&folder.join(name)).unwrap().observe.vehicle.unwrap();
        let names: Vec<String> =
            (0..vehicle.deflections.len()).map(|at| vehicle.surface(at).into()).collect();
        (names, vehicle.jets.len(), vehicle.flaps.is_some())
    };
    let (papers, jets, has_flaps) = shown("surfaces-and-jets.toml");
    assert_eq!((papers.len(), jets, has_flaps), (8, 10, true));
    let own = ["left elevon", "right elevon", "body flap"].map(String::from).to_vec();
    assert_eq!(shown("own-vehicle.toml"), (own, 8, false));
    assert_eq!(shown("capsule.toml"), (Vec::new(), 6, false));
}
