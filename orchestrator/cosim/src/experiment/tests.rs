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
fn defaults_are_filled_in() {
    let experiment = parse(TEXT).unwrap();
    assert_eq!(experiment.simulation.coupling, Coupling::Sequential);
    assert_eq!(
        (experiment.simulation.start, experiment.components["a"].every, experiment.record.every),
        (0.0, 1, 1)
    );
}

#[test]
fn unknown_keys_are_refused_with_their_line() {
    let message = parse(&TEXT.replace("step = 0.1", "stepp = 0.1")).unwrap_err().to_string();
    assert!(
        message.starts_with("x.toml:5: ")
            && message.contains("`stepp`")
            && message.contains("`step`"),
        "{message}"
    );
    let message = parse(&TEXT.replace("fmu =", "fum =")).unwrap_err().to_string();
    assert!(message.starts_with("x.toml:7: ") && message.contains("`fum`"), "{message}");
    let message = parse("title = ").unwrap_err().to_string();
    assert!(message.starts_with("x.toml:1: "), "{message}");
    assert_eq!(message.lines().count(), 1);
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
fn bad_assignments_are_refused() {
    let refusal = |text: &str| {
        let overrides = Overrides { set: vec![text.into()], ..Overrides::default() };
        parse(TEXT).unwrap().apply(&overrides).unwrap_err().to_string()
    };
    assert!(refusal("a.p").contains("expected component.parameter=value"));
    assert!(refusal("=1").contains("expected component.parameter=value"));
}
