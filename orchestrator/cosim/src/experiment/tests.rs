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
