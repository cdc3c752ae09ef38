//! Declarations of nested structures, arrays and choices.

use nalgebra::{Matrix3, Vector3};
use settings::{Choice, Declared, Kind, change, check, names, read, settings, start};
use toml::{Table, Value};

const AXES: [(&str, &str); 3] = [(".x", "roll axis"), (".y", "pitch axis"), (".z", "yaw axis")];

/// Way to act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Choice)]
enum Mode {
    /// No action.
    #[default]
    Off,
    /// R is used as it is.
    #[setting(name = "full")]
    All,
}

#[derive(Clone, Debug, Default, PartialEq, Declared)]
struct Layer {
    /// Thickness of the layer.
    #[setting(part, above = 0.0, start = 0.5)]
    thickness: f64,
    /// Gain.
    #[setting(part, rate, each = AXES, below = 10.0)]
    gain: Vector3<f64>,
    /// Exponent.
    ///
    /// This paragraph is for readers of the code.
    #[setting(part, unit = "1", max = 1.0)]
    exponent: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Declared)]
struct Law {
    #[setting(skip)]
    _body: u8,
    mode: Mode,
    /// Number of steps.
    #[setting(name = "steps", min = 1, max = 100, start = 20)]
    count: usize,
    /// Outer loop.
    #[setting(unit = "rad")]
    outer: Layer,
    /// Inner loop.
    #[setting(unit = "rad/s")]
    inner: Layer,
    /// Matrix of the sensor.
    matrix: Matrix3<f64>,
    /// Weights.
    #[setting(name = "weight.P")]
    weights: [f64; 2],
    /// Name of a file.
    file: String,
    /// Whether it is on.
    is_on: bool,
}

fn table(text: &str) -> Table {
    toml::from_str(text).unwrap()
}

#[test]
fn names_texts_and_units_follow_from_the_fields() {
    let list = settings::<Law>();
    let shown: Vec<(&str, &str, &str)> = list
        .iter()
        .map(|setting| &setting.place)
        .map(|place| (place.name.as_str(), place.text.as_str(), place.unit.as_ref()))
        .collect();
    assert_eq!(
        shown[..8],
        [
            ("mode", "Way to act", ""),
            ("steps", "Number of steps", ""),
            ("outer.thickness", "Outer loop: thickness of the layer", "rad"),
            ("outer.gain.x", "Outer loop: gain (roll axis)", "rad/s"),
            ("outer.gain.y", "Outer loop: gain (pitch axis)", "rad/s"),
            ("outer.gain.z", "Outer loop: gain (yaw axis)", "rad/s"),
            ("outer.exponent", "Outer loop: exponent", ""),
            ("inner.thickness", "Inner loop: thickness of the layer", "rad/s"),
        ]
    );
    assert_eq!(shown[8].2, "rad/s2");
    assert_eq!(shown[12], ("matrix[1,1]", "Matrix of the sensor (row 1, column 1)", ""));
    let last = ["weight.P[1]", "weight.P[2]", "file", "isOn"];
    assert_eq!(names::<Law>()[21..], last);
    let Kind::Choice(items) = &list[0].kind else { panic!("a choice") };
    assert_eq!(items.items, [("off", "no action"), ("full", "R is used as it is")]);
}

#[test]
fn files_set_what_they_name_in_the_units_that_they_write() {
    let mut law = Law::default();
    let text = "mode = 'full'\nsteps = 7\nouter.thickness = '90 deg'\ninner.gain = { x = '180 deg/s2' }\n\
        weight.P = [1, 2.5]\n\"matrix[2,3]\" = -1.0\nfile = 'a.csv'\nisOn = true";
    read(&mut law, &table(text)).unwrap();
    assert_eq!((law.mode, law.count, law.weights), (Mode::All, 7, [1.0, 2.5]));
    assert_eq!(law.outer.thickness, 90_f64.to_radians());
    assert_eq!(law.inner.gain.x, 180_f64.to_radians());
    assert_eq!(law.matrix[(1, 2)], -1.0);
    assert!(law.is_on && law.file == "a.csv");
}

#[test]
fn what_no_setting_can_be_is_refused_by_name() {
    for (text, refusal) in [
        ("mode = 'some'", "mode: \"some\" is not one of off, full"),
        ("steps = -1", "steps: -1 is not a number that it can hold"),
        ("steps = 1.5", "steps: 1.5 is not an integer"),
        ("outer.width = 1", "outer.width: there is no such setting"),
        ("outer.thickness = '1 m'", "outer.thickness: \"1 m\" is not a number in rad"),
        ("outer.thickness = true", "outer.thickness: true is not a number"),
        ("isOn = 1", "isOn: 1 is not true or false"),
        ("file = 1", "file: 1 is not a text"),
        ("weight.P = [1, 2, 3]", "weight.P[3]: there is no such setting"),
    ] {
        let error = read(&mut Law::default(), &table(text)).unwrap_err().to_string();
        assert!(error.starts_with(refusal), "{error}");
    }
    let error = change(&mut Law::default(), "steps", &Value::from("x")).unwrap_err();
    assert_eq!(error.name, "steps");
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    let good: Law = start();
    assert_eq!((good.count, good.outer.thickness), (20, 0.5));
    check(&good).unwrap();
    let refusal = |change: fn(&mut Law)| {
        let mut law = good.clone();
        change(&mut law);
        check(&law).unwrap_err().to_string()
    };
    assert_eq!(refusal(|law| law.count = 0), "steps = 0 must be at least 1");
    assert_eq!(refusal(|law| law.count = 101), "steps = 101 must be at most 100");
    assert_eq!(refusal(|law| law.inner.thickness = 0.0), "inner.thickness = 0 must be above 0");
    assert_eq!(refusal(|law| law.outer.gain.y = 10.0), "outer.gain.y = 10 must be below 10");
    assert_eq!(refusal(|law| law.outer.exponent = 1.5), "outer.exponent = 1.5 must be at most 1");
    let text = refusal(|law| law.matrix[(0, 0)] = f64::NAN);
    assert_eq!(text, "matrix[1,1] = NaN must be a finite number");
}
